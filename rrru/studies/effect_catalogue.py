"""`docs/effects.md`, the catalogue of all effects; `python -m rrru.studies.effect_catalogue` writes it.

Equation, assumptions and source of an effect are its module's docstring, its sizes those of its `for_robot`. Signatures
and confounding are computed on fixed campaigns of nominal robots without noise.
"""

import importlib
import inspect
import re
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np

import rrru
from rrru.campaign.plan import make_plan
from rrru.campaign.stated_motion import DRIVES, STOP_AND_GO, StatedMotion
from rrru.campaign.trajectories import Line, Spiral
from rrru.diagnosis.diagnose import with_wide_bounds
from rrru.diagnosis.make_problem import make_diagnosis_problem
from rrru.diagnosis.options import OPTIONS
from rrru.diagnosis.state import ModelState
from rrru.effects.causes import cause_texts
from rrru.effects.library import NAMES, library
from rrru.effects.protocol import PATH
from rrru.formats.robot_file import from_urdf
from rrru.kinematics.dynamics import Masses
from rrru.pipeline.read_config import read_config
from rrru.pipeline.setup import as_measured
from rrru.robots.catalogue import make_mechanism, tracked_set
from rrru.robots.from_dh import from_dh
from rrru.simulation.driven import SETTLE_S
from rrru.simulation.virtual_robot import VirtualRobot

_ROOT = Path(rrru.__file__).parents[1]
_MODELS = _ROOT / "data/models"
_PASSES = (
    {"reverse": False, "payload_kg": 0.0},
    {"reverse": True, "payload_kg": 0.0},
    {"reverse": False, "payload_kg": 0.0, "speed_mm_s": 300.0, "acceleration_mm_s2": 400.0},
    {"reverse": False, "payload_kg": 5.0},
)
_SPEED_MM_S, _ACCELERATION_MM_S2, _DWELL_S = 80.0, 40.0, 60.0
# as in the blind validation; it scales no share and no picture
_NOISE_MM = 0.02
# a rival is listed from this share of the visible mean square on, so many at most
_MIN_CONFOUNDED_SHARE, _MAX_RIVALS = 0.5, 4
_WARMING_K = 2.0
_RANK_TOLERANCE = 1e-9
_WIDTH, _TITLE_HEIGHT, _HALF_HEIGHT = 680, 18, 40
_PANEL_HEIGHT = _TITLE_HEIGHT + 2 * _HALF_HEIGHT + 8
_COLOURS = ("#1f77b4", "#ff7f0e", "#2ca02c")
_SEARCHED_ORDERS_TEXT = "Its coefficients are those of the orders that stand out in a campaign's data."

# what a file must hold for an effect to be tested, by the field of Motion that its model needs
NEEDS = {
    PATH: "the order in which the points were driven, so that the side from which each drive comes is known",
    "time_s": "times, or rows in the order measured",
    "drive_rate": "times and readings during the motion",
    "drive_acceleration": "times and readings during the motion",
    "force_n": "masses of platform and links, or payloads",
    "held_force_n": "masses of platform and links, or payloads",
    "drive_load": "masses of the moved parts, or payloads",
    "follower_load": "masses of the moved parts, or payloads",
    "across": "masses of the links, or payloads",
    "base_moment": "masses of the moved parts, or payloads",
    "last_move": "a robot that stops at every point (`motion: stop_and_go`)",
    "temperature_c": "a column `temperature_c` with more than one value",
}


@dataclass(frozen=True)
class Scene:
    """A robot and its fixed campaign.

    title: the robot in words; robot: function that makes it; trajectories: in its frame; stops: whether it is read at
    rest, its drives going straight from stop to stop.
    """

    title: str
    robot: object
    trajectories: tuple
    stops: bool = False

    @cache  # noqa: B019  there are few scenes, and none ends before the program does
    def problem(self):
        """The DiagnosisProblem of the campaign, with all effects of the library that it can test."""
        plan = make_plan(self.trajectories, _PASSES, _SPEED_MM_S, _ACCELERATION_MM_S2, _DWELL_S)
        plan = plan.resting(SETTLE_S) if self.stops else plan
        robot = self.robot()
        frame, _ = VirtualRobot(mechanism=robot).run(plan, 0.0, np.random.default_rng(0))
        frame = frame.assign(temperature_c=20.0 + _WARMING_K * np.linspace(0.0, 1.0, len(frame)) ** 2)
        frame = frame.assign(**StatedMotion(STOP_AND_GO, DRIVES).columns()) if self.stops else frame
        mechanism = with_wide_bounds(as_measured(robot, frame))
        return make_diagnosis_problem(frame, mechanism, Masses(), _NOISE_MM, library(mechanism))

    @cache  # noqa: B019
    def visible(self):
        """Columns (3n, k) of every testable effect, per prior s.d., without what the calibration absorbs, and before.

        Columns of all shapes follow one another; those of the first shape come first.
        """
        problem = self.problem()
        linear = problem.linearise(ModelState(np.zeros(len(problem.mechanism.parameters)), {}))
        base, _ = np.linalg.qr(linear.base.reshape(3 * len(problem), -1))
        result = {}
        for name, effect in problem.effects.items():
            shapes = range(len(effect.coordinates.shapes))
            raw = [linear.columns[name, k].reshape(3 * len(problem), -1) * effect.coordinates.typical for k in shapes]
            raw = np.concatenate(raw, axis=1)
            result[name] = raw - base @ (base.T @ raw), raw
        return result


def _lines(start, end, offsets, points):
    """Lines next to one another along y, from (x, z) to (x, z)."""
    (x, z), (to_x, to_z) = start, end
    return tuple(Line(f"line_{k}", (x, y, z), (to_x, y, to_z), points) for k, y in enumerate(offsets, 1))


def _built_in(name):
    """A function that makes a robot of the package's configuration."""

    def made():
        return make_mechanism(name, read_config()["robots"][name], parameter_set=tracked_set(name))

    return made


def _arm6():
    """The arm of the repository's models."""
    return from_urdf(_MODELS / "arm6.urdf", parameter_set="full", name="arm6")


_ARM_TRAJECTORIES = (
    *_lines((450.0, 800.0), (700.0, 900.0), (0.0, 150.0, -150.0), 10),
    Spiral("spiral", (580.0, 0.0), (50.0, 200.0), (700.0, 920.0), 2.0, 20),
)
SCENES = (
    Scene(
        "3-RRRU",
        _built_in("rrru3"),
        (
            *_lines((-600.0, 650.0), (0.0, 650.0), (0.0, 110.0, -110.0), 10),
            Spiral("spiral", (0.0, 0.0), (50.0, 280.0), (560.0, 760.0), 4.5, 20),
        ),
    ),
    Scene("6-axis arm", _arm6, _ARM_TRAJECTORIES),
    Scene("6-axis arm at rest", _arm6, _ARM_TRAJECTORIES, stops=True),
    Scene(
        "3-PTT",
        _built_in("ptt3"),
        (
            *_lines((-80.0, -270.0), (80.0, -230.0), (0.0, 60.0, -60.0), 10),
            Spiral("spiral", (0.0, 0.0), (20.0, 90.0), (-280.0, -220.0), 2.0, 20),
        ),
    ),
)
# pictures and confounding are of the first robots; of the others only where none of the first can have the effect
_SHOWN_SCENES = 2

_HEAD = """# Catalogue of effects

What the diagnosis can name: {count} effects. `rrru effects --robot ROBOT` lists those of one robot. This page is made
by `python -m rrru.studies.effect_catalogue` from the modules of `rrru/effects/`. A test compares it with them.

- **Equation, assumptions, source** are those of the effect's module. `rrru/effects/<name>.py` has the code.
- **Prior s.d.** is the typical size of a coefficient. It sets the ratios of an effect's coefficients; the evidence is
  averaged over a grid of scales of all of them ([concepts](concepts.md#priors)).
- **The file must hold** says without what the effect is not tested.
- **The picture** shows what the calibration cannot absorb of the effect. It has one coefficient at its prior s.d.: the
  one that stays largest. x is blue, y orange, z green; readings are in the order driven.
- **Confounded with** lists effects that reproduce at least {share:.0%} of that. A share is the part of the mean square
  of all coefficients at their prior s.d. that the other effect reproduces, after calibration. At other poses the shares
  are other ones: `gap_identifiability` has those of your campaign.

Pictures and shares are of fixed campaigns without noise. The exact model is linearised about the nominal robot.
Each campaign has three lines and a spiral in four passes: forward, reverse, at 300 mm/s, with 5 kg. The robots are read
in motion, the arm (`data/models/arm6.urdf`) once more at rest for the effects that only stops show. All warm by
{warming:g} K. Papers A to C are those of the [reproduction](reproduction.md#sources).

| effect | what it is | {titles} |
| --- | --- | {rules} |
"""


def markdown():
    """The page."""
    shown = SCENES[:_SHOWN_SCENES]
    head = _HEAD.format(
        count=len(NAMES),
        share=_MIN_CONFOUNDED_SHARE,
        warming=_WARMING_K,
        titles=" | ".join(f"on the {scene.title}, confounded with" for scene in shown),
        rules=" | ".join("---" for _ in shown),
    )
    rows = []
    for name in NAMES:
        confounded_on = " | ".join(_rivals(scene, name) for scene in shown)
        rows.append(f"| [{name}](#{name}) | {_meaning(name)} | {confounded_on} |\n")
    return "\n".join([head.rstrip("\n") + "\n" + "".join(rows), *map(_section, NAMES)])


def pictures():
    """Text of every effect's SVG by its name, of those that a robot here can show."""
    return {name: _picture(name, scenes) for name in NAMES if (scenes := _scenes(name))}


def confounded(scene, name):
    """Effects that reproduce most of an effect after calibration, with their shares of its mean square, largest first.

    None where the scene's campaign does not test the effect or the calibration absorbs it.
    """
    visible = scene.visible()
    if name not in visible or not _is_visible(scene, name):
        return None
    columns = visible[name][0]
    shares = {
        other: float(((_basis(scene, other).T @ columns) ** 2).sum() / (columns**2).sum())
        for other in visible
        if other != name
    }
    return dict(sorted(shares.items(), key=lambda item: -item[1]))


@cache
def _basis(scene, name):
    """Orthonormal basis of the part of an effect that the calibration does not absorb."""
    basis, size, _ = np.linalg.svd(scene.visible()[name][0], full_matrices=False)
    return basis[:, size > _RANK_TOLERANCE * size.max(initial=1e-300)]


def _is_visible(scene, name):
    """Whether the calibration leaves more of an effect than rounding."""
    left, raw = scene.visible()[name]
    return raw.size > 0 and float(np.linalg.norm(left)) > OPTIONS.min_visible_rms_share * float(np.linalg.norm(raw))


def _scenes(name):
    """Scenes on which an effect is shown."""
    able = [scene for scene in SCENES if name in scene.visible() and _is_visible(scene, name)]
    return [scene for scene in able if scene in SCENES[:_SHOWN_SCENES]] or able[:1]


def _module(name):
    """The module of an effect."""
    return importlib.import_module(f"rrru.effects.{name}")


def _meaning(name):
    """What an effect is, in one sentence."""
    return inspect.getdoc(_module(name)).splitlines()[0].partition(": ")[2].rstrip(".")


def _rivals(scene, name):
    """What an effect is confounded with on a scene, in words."""
    problem = scene.problem()
    if name not in library(problem.mechanism):
        return "not an effect of this robot"
    if name in problem.untestable:
        return f"not tested: {problem.untestable[name]}"
    if not len(problem.library[name].coordinates):
        return "open: its orders are those that a campaign's data show"
    rivals = confounded(scene, name)
    if rivals is None:
        return "not separable from the geometric parameters"
    listed = [f"{other} {share:.2f}" for other, share in rivals.items() if share >= _MIN_CONFOUNDED_SHARE]
    return ", ".join(listed[:_MAX_RIVALS]) or "none of the others"


def _section(name):
    """The part of the page on one effect."""
    text = inspect.getdoc(_module(name))
    _, _, body = text.partition("\n")
    body = re.sub(r"^(Assumptions|Source):", r"**\1:**", body.strip(), flags=re.MULTILINE)
    scenes, meaning = _scenes(name), _meaning(name)
    parts = [f"## {name}\n", f"*{meaning[:1].upper()}{meaning[1:]}.*\n", body + "\n", _sizes(name)]
    needs = "; ".join(dict.fromkeys(NEEDS[need] for need in _example(name).needs)) or "poses, nothing more"
    parts.append(f"**The file must hold:** {needs}.\n")
    texts = cause_texts(name)
    parts.append(f"**On the machine:** {texts.inspect} {texts.remedy}\n")
    parts += [f"**Confounded on the {scene.title} with:** {_rivals(scene, name)}.\n" for scene in scenes]
    titles = " and ".join(f"the {scene.title}" for scene in scenes)
    if scenes:
        parts.append(f"![signature of {name} on {titles}](effects/{name}.svg)\n")
    else:
        parts += [f"**On the {scene.title}:** {_rivals(scene, name)}.\n" for scene in SCENES[:_SHOWN_SCENES]]
    return "\n".join(parts)


def _example(name):
    """The effect on the first robot here that can have it."""
    robots = (*(scene.problem().mechanism for scene in SCENES), _two_arms())
    return next(effect for robot in robots if (effect := library(robot).get(name)))


@cache
def _two_arms():
    """A robot of two arms on a trunk of two joints, for the sizes of what only a trunk has."""
    link = {"a_mm": 300.0, "range_deg": [-90.0, 90.0]}
    trunk, hands = [{**link, "alpha_deg": 90.0}, link], {arm: [{**link, "name": arm}] for arm in ("left", "right")}
    return from_dh(trunk, hands=hands, name="two_arms")


def _sizes(name):
    """Table of an effect's parameters, those of all legs or drives in one row."""
    effect = _example(name)
    if not len(effect.coordinates):
        return f"{_SEARCHED_ORDERS_TEXT}\n"
    coordinates = effect.coordinates
    free = [p.name for p in effect.parameters if p.name not in coordinates.shapes[0]]
    values = effect.parameters.mapping(coordinates.to_values(coordinates.typical, coordinates.shapes[0]))
    # of waves the coefficients are sines and cosines, the parameters amplitudes and phases
    plain = not coordinates.broad and np.array_equal([values[name] for name in free], coordinates.typical)
    typical = dict(zip(free, coordinates.typical, strict=True)) if plain else {}
    rows = {}
    for parameter in effect.parameters:
        kind = re.sub(r"_?\d+(?=$|_)", "", parameter.name)
        rows.setdefault((kind, parameter.unit), []).append(parameter)
    lines = ["| parameter | unit | prior s.d. | bounds | origin of the size |", "| --- | --- | --- | --- | --- |"]
    for (kind, unit), members in rows.items():
        first, deviations = members[0], [typical[p.name] for p in members if p.name in typical]
        low, high = min(p.low for p in members), max(p.high for p in members)
        count = f", {len(members)} of them" if len(members) > 1 else ""
        bounds = f"{low:.3g} to {high:.3g}" if np.isfinite([low, high]).all() else "none"
        lines.append(f"| {kind}{count} | {unit} | {_range(deviations)} | {bounds} | {first.source or 'assumed'} |")
    if not plain:
        lines += ["", f"Prior s.d. of its {len(coordinates)} coefficients: {_range(coordinates.typical)}."]
    return "\n".join(lines) + "\n"


def _range(values):
    """Numbers as one, or as the smallest and the largest; "-" where there is none."""
    if not len(values):
        return "-"
    low, high = min(values), max(values)
    return f"{low:.2g}" if np.isclose(low, high) else f"{low:.2g} to {high:.2g}"


def _picture(name, scenes):
    """The SVG of an effect: on each scene its three components over the readings."""
    height = _PANEL_HEIGHT * len(scenes)
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{_WIDTH}" height="{height}" font-family="sans-serif">']
    for number, scene in enumerate(scenes):
        left = scene.visible()[name][0][:, : len(scene.problem().library[name].coordinates)]
        largest = left[:, np.argmax(np.linalg.norm(left, axis=0).round(12))]
        parts += _panel(scene, largest.reshape(-1, 3), number * _PANEL_HEIGHT)
    return "\n".join([*parts, "</svg>", ""])


def _panel(scene, moved_mm, top):
    """Lines of an SVG: x, y and z of displacements (n, 3) over the number of the reading."""
    most = float(np.abs(moved_mm).max())
    middle, half = top + _TITLE_HEIGHT + _HALF_HEIGHT, _HALF_HEIGHT / most
    across = (_WIDTH - 1.0) / (len(moved_mm) - 1)
    title = f"{scene.title}, {len(moved_mm)} readings in the order driven; full height &#177;{1e3 * most:.2g} &#181;m"
    yield f'<text x="0" y="{top + 12}" font-size="12">{title}</text>'
    yield f'<path d="M0 {middle:g}H{_WIDTH}" stroke="#999" stroke-width="0.5"/>'
    run = scene.problem().measurements["run"].to_numpy()[scene.problem().at]
    for number in [k for k, (a, b) in enumerate(pairwise(run), 1) if a != b]:
        place = (number - 0.5) * across
        yield f'<path d="M{place:.1f} {top + _TITLE_HEIGHT}v{2 * _HALF_HEIGHT}" stroke="#ddd" stroke-width="0.5"/>'
    for values, colour in zip(moved_mm.T, _COLOURS, strict=True):
        # no minus zero
        points = " ".join(f"{k * across:.1f},{middle - half * value + 0.0:.1f}" for k, value in enumerate(values))
        yield f'<polyline points="{points}" fill="none" stroke="{colour}"/>'


def write(folder):
    """Write page and pictures into the folder of the documents; pictures of effects that are gone are deleted."""
    folder = Path(folder)
    made = pictures()
    (folder / "effects").mkdir(exist_ok=True)
    for path in (folder / "effects").glob("*.svg"):
        if path.stem not in made:
            path.unlink()
    for name, text in made.items():
        (folder / f"effects/{name}.svg").write_text(text, encoding="utf-8")
    (folder / "effects.md").write_text(markdown(), encoding="utf-8")


if __name__ == "__main__":
    write(_ROOT / "docs")
