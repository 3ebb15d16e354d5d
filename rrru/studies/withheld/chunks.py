"""The robots of the check on withheld effects in chunks: jobs that need little memory, however many robots there
are.
"""

from dataclasses import dataclass

from rrru.errors import ConfigError


@dataclass(frozen=True)
class Chunk:
    """Robots `first` to before `end` of a check; effect: the one taken out of the library, empty for none."""

    check: str
    effect: str
    first: int
    end: int

    @property
    def numbers(self):
        """Numbers of the robots."""
        return range(self.first, self.end)


def chunks(section):
    """Chunks by name of the configuration's `withheld` section."""
    result = _split("label", "", section["robots"], section["chunk"])
    for effect in section["effects"]:
        result |= _split("effect", effect, section["per_effect"], section["chunk"])
    return result


def check(config):
    """Raise ConfigError where the `withheld` section names a campaign or an effect that does not exist."""
    from rrru.effects.library import EFFECTS

    section = config["withheld"]
    for key, known in (("field", config["campaigns"]), ("effects", EFFECTS)):
        for name in section[key]:
            if name not in known:
                raise ConfigError(f"withheld.{key} has {name!r}; known: {', '.join(known)}")


def _split(check, effect, count, size):
    """Chunks of a check by name."""
    label = f"{check}_{effect}" if effect else check
    return {
        f"{label}_{k:03d}": Chunk(check, effect, start, min(start + size, count))
        for k, start in enumerate(range(0, count, size))
    }
