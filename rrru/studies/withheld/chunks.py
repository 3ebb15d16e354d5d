"""The robots of the check on withheld effects in chunks: jobs of little memory, however many they are."""

from typing import NamedTuple

from rrru.errors import ConfigError
from rrru.studies.withheld.noise import NOISES


class Member(NamedTuple):
    """One robot: check (label, effect, noise, many or background), what it is about, number.

    about: the effect that the diagnosis has to do without, the noise, or nothing.
    """

    check: str
    about: str
    number: int

    @property
    def name(self):
        """The robot's name in every table."""
        return "_".join(filter(None, (self.check, self.about, f"{self.number:04d}")))

    @property
    def taken_out(self):
        """The effect that the diagnosis has to do without, empty for none."""
        return self.about if self.check == "effect" else ""


def noise_of(name):
    """The noise that a robot of that check has by its name, empty for other robots."""
    check, _, about = name.partition("_")
    return about.rpartition("_")[0] if check == "noise" else ""


def chunks(section):
    """Members of every chunk by the chunk's name, from the configuration's `withheld` section."""
    members = [Member("label", "", k) for k in range(section["robots"])]
    members += [Member("effect", e, k) for e in section["effects"] for k in range(section["per_effect"])]
    members += [Member("noise", noise, k) for noise in NOISES for k in range(section["per_noise"])]
    members += [Member(check, "", k) for check in ("many", "background") for k in range(section[check])]
    size = section["chunk"]
    return {f"robots_{k:04d}": members[k : k + size] for k in range(0, len(members), size)}


def rivalled(section):
    """Names of the robots on which other ways are tried by the name of their chunk: the first of the check label."""
    found = {}
    for chunk, members in chunks(section).items():
        names = [one.name for one in members if one.check == "label" and one.number < section["methods"]]
        if names:
            found[chunk] = names
    return found


def check(config):
    """Raise ConfigError where the `withheld` section names a campaign or an effect that does not exist."""
    from rrru.studies.withheld.outside import EFFECTS

    section = config["withheld"]
    for key, known in (("field", config["campaigns"]), ("effects", EFFECTS)):
        for name in section[key]:
            if name not in known:
                raise ConfigError(f"withheld.{key} has {name!r}; known: {', '.join(known)}")
