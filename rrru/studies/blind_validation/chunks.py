"""The robots of the check on withheld effects in chunks, so that a job's memory does not grow with their number."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from rrru.errors import ConfigError
from rrru.pipeline import config as parts
from rrru.studies.blind_validation.models import MODELS
from rrru.studies.blind_validation.noise import NOISES
from rrru.studies.blind_validation.verdicts import AS_ROBOTS_ARE, PLANTS

# checks on own robots whose pages and files are judged
PAGES, MISTAKES, RIGHT = "pages", "mistakes", "right_files"
# each file starts this many kinds of causes after the one before
_APART = 4


class Member(NamedTuple):
    """One robot: check (label, effect, noise, many, background, as_robots_are, or a plant), subject, number.

    about: the effect removed from the library of the diagnosis, the noise, the robot's entry in `robots:`, or nothing.
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
        """The effect removed from the library of the diagnosis, empty for none."""
        return self.about if self.check == "effect" else ""

    @property
    def file(self):
        """The entry in `robots:` of a robot that is read from a file, empty for the 3-RRRU of our own."""
        return self.about if self.check in (*PLANTS, AS_ROBOTS_ARE) else ""


def noise_of(name):
    """The noise of a robot of the check noise, from the robot's name; empty for other robots."""
    check, _, about = name.partition("_")
    return about.rpartition("_")[0] if check == "noise" else ""


def chunks(section):
    """Members of every chunk by the chunk's name, from the configuration's `withheld` section."""
    members = [Member("label", "", k) for k in range(section["robots"])]
    members += [Member("effect", e, k) for e in section["effects"] for k in range(section["per_effect"])]
    members += [Member("noise", noise, k) for noise in NOISES for k in range(section["per_noise"])]
    members += [Member(check, "", k) for check in ("many", "background") for k in range(section[check])]
    members += [Member(AS_ROBOTS_ARE, file, k) for file, k in _in_turns(section)]
    for plant in PLANTS:
        for k in range(section[plant]):
            # the files take turns
            turn, which = divmod(k, len(section["files"]))
            members.append(Member(plant, section["files"][which], turn + _APART * which))
    # a chunk's robots have the same drives
    files = dict.fromkeys(["", *section["files"], *section["as_robots_are_files"]])
    groups = [[one for one in members if one.file == file] for file in files]
    result, size = {}, section["chunk"]
    for k, group in zip(np.cumsum([0, *map(len, groups)]).tolist(), groups, strict=False):
        result |= {f"robots_{k + first:04d}": group[first : first + size] for first in range(0, len(group), size)}
    return result


def statement_chunks(section):
    """(check, first number, first of the next) of every chunk by its name, from `withheld.sentences`."""
    found, size = {}, section["chunk"]
    for check in (PAGES, MISTAKES, RIGHT):
        for first in range(0, section[check], size):
            found[f"{check}_{first:04d}"] = (check, first, min(first + size, section[check]))
    return found


def _in_turns(section):
    """File and number of every robot as robots are: the 3-RRRU of our own, with an empty name, and the files."""
    files = ["", *section["as_robots_are_files"]]
    for k in range(section[AS_ROBOTS_ARE]):
        number, turn = divmod(k, len(files))
        yield files[turn], number


def described(config, members, as_measured=False):
    """Known robot and masses of the robots of files among Members, by the file's entry.

    as_measured: also the reflectors whose places are known.
    """
    result = {}
    for name in dict.fromkeys(member.file for member in members if member.file):
        targets = MODELS[Path(config["robots"][name]["mjcf"]).stem].targets if as_measured else {}
        section = {"robot": name, "errors": "full"} | ({"targets": targets} if targets else {})
        result[name] = {"robot": parts.robot(config, section), "masses": parts.masses(config, {"robot": name})}
    return result


def rivalled(section):
    """Names of the robots for the comparison of methods by the name of their chunk: the first of the check label."""
    found = {}
    for chunk, members in chunks(section).items():
        names = [one.name for one in members if one.check == "label" and one.number < section["methods"]]
        if names:
            found[chunk] = names
    return found


def check(config):
    """Raise ConfigError where the `withheld` section names a campaign or an effect that does not exist."""
    from rrru.studies.blind_validation.causes import EFFECTS

    section = config["withheld"]
    for key, known in (("field", config["campaigns"]), ("effects", EFFECTS)):
        for name in section[key]:
            if name not in known:
                raise ConfigError(f"withheld.{key} has {name!r}; known: {', '.join(known)}")
    for key, name in [(k, name) for k in ("files", "as_robots_are_files") for name in section[k]]:
        file = parts.entry(config, "robots", name, f"withheld.{key}").get("mjcf", "")
        if Path(file).stem not in MODELS:
            known = ", ".join(f"{model}.xml" for model in MODELS)
            raise ConfigError(f"withheld.{key}: {name} has the mjcf {file!r}; allowed: one of {known}")
