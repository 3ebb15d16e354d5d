"""Result tables of a made-up gap diagnosis and of made-up withheld robots, for drawing figures without computing
anything.
"""

import numpy as np
import pandas as pd

from rrru.studies.blind_validation.verdicts import PLANTS
from tests.schemas import TABLES, check, filled

EFFECTS = (
    *(
        "backlash",
        "drive_compliance",
        "link_flexure",
        "joint_clearance",
        "leg_asymmetry",
        "axis_tilt",
        "base_placement",
    ),
    *("frame_misregistration", "encoder_eccentricity", "transmission_error", "thermal_growth", "servo_lag"),
)
OTHERS = ("backlash+axis_tilt+servo_lag", "backlash+cable_drag+link_flexure+thermal_growth")
NOISE_MM = 0.035
NEXT = (
    "line_1 in reverse, 300 mm/s, payload 5 kg (separates link_flexure / drive_compliance, 14 nats); "
    "spiral in reverse, 80 mm/s"
)
_SHARES = {"share_closed": 0.96, "share_closed_low": 0.94, "share_closed_high": 0.98}


def gap_verdicts(campaign, effects="link_flexure+backlash", **changes):
    """`gap_verdicts` of one campaign."""
    texts = {"confounded_with": "drive_compliance", "next_runs": NEXT, "noise_from": "repeats"}
    texts["where"] = "leg 2 wrist, leg 1 drive to leg 3 drive"
    numbers = {"probability": 0.97, "leg": 2, "noise_rms_mm": NOISE_MM, "gap_rms_mm": 0.37, "gap_after_rms_mm": 0.02}
    numbers |= {"file_error_mm": np.nan, "file_error_fresh_mm": np.nan, "file_expected_mm": np.nan}
    numbers |= {"noise_stated_mm": 0.02, "noise_correlation": 0.1, "noise_runs_mm": 0.005}
    numbers |= {
        "searches_apart": 0.01,
        "worst_x_mm": -512.3,
        "worst_y_mm": 37.5,
        "worst_z_mm": 600.0,
        "points": 144,
        "dropped_points": 2,
    }
    return filled("gap_verdicts", [{"campaign": campaign, "effects": effects} | texts | numbers | _SHARES | changes])


def gap_budget(campaign):
    """`gap_budget` of two partly confounded effects, scatter and something unexplained."""
    shares = {"link_flexure": 0.6, "backlash": 0.2, "scatter": 0.1, "runs": 0.0, "unexplained": 0.05}
    kinds = {name: name if name in ("scatter", "runs", "unexplained") else "effect" for name in shares}
    shares["link_flexure and backlash"], kinds["link_flexure and backlash"] = 0.04, "covariance"
    shares |= {"sampling": 0.02, "calibration": 0.01}
    rows = [
        {"part": name, "kind": kinds.get(name, name), "rms_mm": np.sqrt(share) * 0.37, "share": share}
        for name, share in shares.items()
    ]
    frame = pd.DataFrame(rows).assign(campaign=campaign, probability=0.97)
    return check("gap_budget", frame.assign(share_low=0.8 * frame["share"], share_high=1.3 * frame["share"]))


def gap_attribute(
    campaign, likely=(("link_flexure", 0.985, "2"), ("backlash", 0.97, "each"), ("unexplained", 0.04, ""))
):
    """`gap_attribute`: the likely effects as given, the others improbable; thermal_growth was not tested."""
    rows = {
        name: {"probability": 0.002 * k, "legs": "each", "log_evidence": 1.0}
        for k, name in enumerate((*EFFECTS, "none", "unexplained"))
    }
    for row in rows.values():
        row |= {"decision": "excluded", "group_probability": np.nan, "note": ""}
    rows["thermal_growth"] |= {"probability": np.nan, "log_evidence": np.nan, "decision": "not tested"}
    rows["thermal_growth"]["note"] = "not tested: needs time, which the columns do not give"
    for name, probability, legs in likely:
        decision = "named" if probability >= 0.7 else "possible"
        rows[name] |= {"probability": probability, "legs": legs, "decision": decision}
    frame = pd.DataFrame.from_dict(rows, orient="index").rename_axis("effect").reset_index()
    return filled("gap_attribute", frame.assign(campaign=campaign))


def gap_shrink(campaign, trajectories, steps=2, kinds=("held_out", "resimulated")):
    """`gap_shrink`: every step closes most of what is left."""
    rows = []
    for kind in kinds:
        for step in range(steps + 1):
            for k, name in enumerate(("*", *trajectories)):
                size = (0.3 + 0.05 * k) * 0.25**step
                shares = (
                    {key: value - 0.01 * k for key, value in _SHARES.items()}
                    if step
                    else dict.fromkeys(_SHARES, np.nan)
                )
                label = {
                    "step": step,
                    "added": EFFECTS[step] if step else "",
                    "effects": "+".join(EFFECTS[:step]) or "none",
                }
                numbers = {
                    "rms_mm": np.hypot(size, NOISE_MM),
                    "max_mm": 3.0 * size,
                    "noise_rms_mm": NOISE_MM,
                    "gap_rms_mm": size,
                }
                rows.append(label | {"trajectory": name, "kind": kind, "points": 20} | numbers | shares)
    return check("gap_shrink", pd.DataFrame(rows).assign(campaign=campaign))


def gap_points(ground):
    """`gap_points` of commanded points: a smooth gap and noise before, noise alone after; two points were left out."""
    generator = np.random.default_rng(7)
    command = ground[[f"command_{axis}_mm" for axis in "xyz"]].to_numpy()
    noise = generator.normal(0.0, NOISE_MM / np.sqrt(3.0), command.shape)
    x, y, _ = (command / 300.0).T
    forward = np.where(ground["run"] % 2, 1.0, -1.0)
    before = 0.25 * np.column_stack([x, 0.6 * y + 0.4 * forward, 0.7 * np.cos(2.0 * x)]) + noise
    used = np.ones(len(ground), dtype=bool)
    used[[4, len(ground) // 2]] = False
    before[~used] += 3.0
    after = np.where(used[:, None], noise * 1.1, np.nan)
    vectors = {
        f"{name}_{axis}_mm": part[:, k]
        for name, part in (("before", before), ("after", after))
        for k, axis in enumerate("xyz")
    }
    return filled("gap_points", ground.assign(used=used, **vectors))


def gap_tables(campaign, ground):
    """Every table that the figure of a gap reads."""
    return {
        "gap_verdicts": gap_verdicts(campaign),
        "gap_budget": gap_budget(campaign),
        "gap_attribute": gap_attribute(campaign),
        "gap_shrink": gap_shrink(campaign, ground["trajectory"].unique()),
        "gap_points": gap_points(ground),
        "gap_drive_functions": gap_drive_functions(campaign),
    }


def gap_drive_functions(campaign):
    """`gap_drive_functions` of waves of three drives, one of which slides."""
    frames = []
    for drive, (name, unit, reach, size) in enumerate(
        (("axis1", "rad", 1.5, 4e-4), ("axis2", "rad", 0.6, 2e-4), ("slide", "mm", 200.0, 0.02)), 1
    ):
        share = np.linspace(-1.0, 1.0, 201)
        error = size * np.sin(7.0 * share)
        ends = {"low_95": error - 0.2 * size, "high_95": error + 0.2 * size}
        label = {"drive": drive, "name": name, "unit": unit, "worst": np.arange(201) == np.abs(error).argmax()}
        frames.append(pd.DataFrame({"drive_value": reach * share, "error": error} | ends | label))
    return check("gap_drive_functions", pd.concat(frames).assign(campaign=campaign, effect="transmission_error"))


def withheld_scores(each=8):
    """`withheld_scores`: single effects, doubles, none and outside; weak ones are often missed; the field check has
    four campaigns.
    """
    generator = np.random.default_rng(11)
    rows = []
    for label in ("label", "effect"):
        outside = [f"outside:{name}" for name in (EFFECTS if label == "effect" else ("gear_wear", "cable_drag"))]
        for truth in [*EFFECTS, "link_flexure+backlash", "none", *outside] if label == "label" else outside:
            rows += [_score(generator, label, truth) for _ in range(each)]
    for label in PLANTS:
        rows += [
            _score(generator, label, truth) for truth in (*EFFECTS[:4], "none", "outside:spring") for _ in range(each)
        ]
    for label, others in (
        ("noise", ("backlash", "none")),
        ("background", ("axis_tilt", "none")),
        ("many", OTHERS),
        ("as_robots_are", OTHERS),
    ):
        rows += [_score(generator, label, truth) for truth in others for _ in range(each)]
    rows += [_score(generator, "field", truth) for truth in ("backlash", "none", "outside:sag", "axis_tilt+servo_lag")]
    names = [f"robot_{k:03d}" for k in range(len(rows))]
    return check("withheld_scores", pd.DataFrame(rows).assign(robot=names))


def _score(generator, label, truth):
    """One robot's score."""
    answer = "unexplained" if truth.startswith("outside:") else truth
    strength = 0.0 if truth == "none" else 0.3 * 80.0 ** generator.random()
    right = generator.random() < 1.0 - 0.5 * np.exp(-strength)
    verdict = answer if right else generator.choice(("none", "link_flexure", "unexplained", "axis_tilt+backlash"))
    none = "none" in (truth, verdict)
    closed = np.nan if none else 1.0 - 0.5 * generator.random() ** 2
    return {
        "check": label,
        "kind": generator.choice(("paper", "full")),
        "truth": truth,
        "truth_leg": 0,
        "strength": strength,
        "verdict": verdict,
        "right": verdict == answer,
        "leg_right": np.nan if none else 1.0,
        "probability": 0.99 if strength > 3.0 else 0.45 + 0.5 * generator.random(),
        "oracle_detects": bool(strength > 0.4),
        "share_closed_true": closed,
        "share_closed": closed + 0.05 * generator.normal(),
        "file": "delta_file" if label in PLANTS else "",
        "cause": truth,
        "numbers": 3,
        "held": 2,
    }


def withheld_confusion(scores):
    """`withheld_confusion` of the scores."""
    counted = scores.groupby(["check", "truth", "verdict"]).size().rename("robots").reset_index()
    return check(
        "withheld_confusion", counted if len(counted) else pd.DataFrame(columns=TABLES["withheld_confusion"].names)
    )


def withheld_parts(scores):
    """`withheld_parts` of the robots of many causes and of noises that are not as stated; small ones are missed."""
    generator, rows = np.random.default_rng(12), []
    for row in scores[scores["check"].isin(["many", "noise", "as_robots_are", *PLANTS])].itertuples():
        kinds = dict.fromkeys(row.truth.replace("none", "backlash").split("+"), "effect")
        kinds |= {kind: kind for kind in ("scatter", "runs", "unexplained")}
        kinds |= {"joint_axis_error": "background", "cable_drag": "outside"} if row.check == "many" else {}
        for part, kind in kinds.items():
            strength = 0.0 if generator.random() < 0.2 else 0.3 * 100.0 ** generator.random()
            found = strength * np.exp(0.1 * generator.normal()) if strength > 0.5 else 0.3 * generator.random()
            unknown = ("found_rms_mm", "found_low_mm", "found_high_mm", "probability")
            outside = dict.fromkeys(unknown, np.nan) if kind == "outside" else {}
            rows.append(
                {"check": row.check, "robot": row.robot, "part": part, "kind": kind, "strength": strength}
                | {"true_rms_mm": NOISE_MM * strength, "found_rms_mm": NOISE_MM * found, "probability": 0.9}
                | {"found_low_mm": 0.8 * NOISE_MM * found, "found_high_mm": 1.2 * NOISE_MM * found}
                | {"named": bool(found > 0.5)}
                | outside
            )
    return check("withheld_parts", pd.DataFrame(rows, columns=TABLES["withheld_parts"].names))


def withheld_causes(scores):
    """`withheld_causes` of all but the field campaigns: probabilities that are right, most of them near 0 or 1."""
    generator, rows = np.random.default_rng(13), []
    for row in scores[scores["check"] != "field"].itertuples():
        for effect in EFFECTS:
            probability = generator.beta(0.2, 0.4)
            acts = bool(generator.random() < probability)
            decision = "named" if probability > 0.7 else "possible" if probability > 0.05 else "excluded"
            own = {"probability": probability, "decision": decision, "group": "", "acts": acts}
            rows.append({"check": row.check, "robot": row.robot, "effect": effect} | own | {"strength": 3.0 * acts})
    return check("withheld_causes", pd.DataFrame(rows, columns=TABLES["withheld_causes"].names))


def withheld_tables(scores=None):
    """Every table that the figure of the checks reads."""
    scores = withheld_scores() if scores is None else scores
    made = {"withheld_scores": scores, "withheld_confusion": withheld_confusion(scores)}
    return made | {"withheld_parts": withheld_parts(scores), "withheld_causes": withheld_causes(scores)}
