"""The answer in words and as facts: it says what the tables say, whatever they say, and its numbers keep their size."""

import json
import re

import jsonschema
import numpy as np
import pandas as pd
import pytest
import yaml

from rrru.diagnosis import verdict_facts, verdict_text
from rrru.diagnosis.number_text import rounded
from rrru.diagnosis.result_notes import (
    REPEATABILITY_UNKNOWN,
    REPEATABILITY_UNSURE,
    ROBOT_REPEATS,
    SUCCESSIVE_ALIKE,
)
from rrru.effects.causes import cause_texts
from rrru.report.cards import card
from rrru.report.worth import Worth
from rrru.robots.catalogue import make_mechanism
from rrru.robots.drive_words import DriveWords, drive_words
from rrru.store import json_files
from rrru.studies.blind_validation.sentences import claims
from tests.figures import synthetic_gap
from tests.figures import synthetic_tables as synthetic
from tests.places import ROOT

CAMPAIGN = synthetic.CAMPAIGN
SCHEMA = yaml.safe_load((ROOT / "rrru/pipeline/verdict.schema.yaml").read_text())

_LEGS = DriveWords()


def answered(budget=None, runs=(), drives=_LEGS, places=(), follows=(), causes=None, **verdict):
    """Facts of a made-up diagnosis as a file holds them; drives: the robot's DriveWords."""
    tables = {
        "gap_budget": synthetic_gap.gap_budget(CAMPAIGN) if budget is None else budget,
        "gap_attribute": synthetic_gap.gap_attribute(CAMPAIGN) if causes is None else causes,
        "gap_parameters": pd.DataFrame(
            [
                ("link_flexure", "flexure2", "in leg 2", "mm/N", 0.00123, 0.00011, 0.00101, 0.00145, False),
                ("backlash", "width1", "in leg 1", "rad", 4.04e-4, 0.2e-4, 3.65e-4, 4.43e-4, False),
                ("backlash", "width2", "in leg 2", "rad", 4.04e-4, 0.2e-4, 3.65e-4, 4.43e-4, False),
                ("backlash", "width3", "in leg 3", "rad", 0.0, np.nan, np.nan, np.nan, False),
            ],
            columns=("effect", *verdict_facts._NUMBER),
        ),
        "gap_next_runs": pd.DataFrame(list(runs), columns=verdict_facts._RUN),
        "gap_drive_functions": pd.DataFrame(list(places), columns=("effect", "drive", "worst", *verdict_facts._WORST)),
        "gap_remainder": pd.DataFrame(list(follows), columns=verdict_facts._FOLLOWS),
        "gap_left_out": pd.DataFrame({"reason": ["outlier in the file"], "points": [2]}),
    }
    row = synthetic_gap.gap_verdicts(CAMPAIGN, **verdict).iloc[0].to_dict()
    return verdict_facts.answer(CAMPAIGN, row, tables, drives)


RUN = ("line_1 in reverse", "run", "line_1", True, 80.0, np.nan, 26, "backlash / backlash+servo_lag", 14.0)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"effects": "none", "leg": 0, "where": "", "next_runs": "", "confounded_with": ""},
        {"probability": 1.0 + 5e-14},
        {"effects": "unexplained", "leg": 0, "confounded_with": "backlash, none"},
        {"effects": "link_flexure+unexplained", "noise_stated_mm": np.nan, "notes": "a; b"},
    ],
)
@pytest.mark.parametrize("runs", [(), (RUN,)])
def test_the_facts_fit_their_schema_and_are_the_same_bytes_every_time(changes, runs, tmp_path):
    for name in ("first", "again"):
        json_files.write(answered(runs=runs, **changes), tmp_path / name)
    jsonschema.validate(json_files.read(tmp_path / "first"), SCHEMA)
    assert (tmp_path / "first").read_bytes() == (tmp_path / "again").read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["again", "first"]


def test_effects_that_were_not_tested_are_in_the_facts_with_the_reason():
    reason = "needs time, which the columns do not give"
    assert answered()["not_tested"] == [{"name": "thermal_growth", "reason": reason}]


def test_a_share_whose_interval_covers_nearly_everything_is_not_determined():
    """It has no number in sentences and bars; table and facts keep it."""
    budget = synthetic_gap.gap_budget(CAMPAIGN)
    wide = budget["part"].isin(["backlash", "unexplained", "scatter"])
    budget.loc[wide, ["share_low", "share_high"]] = -0.4, 1.7
    facts = answered(budget=budget, effects="link_flexure+backlash+unexplained")
    said = " ".join(facts["sentences"])
    assert "Causes by their share of the gap: link flexure 60 %, backlash (share not determined)." in said
    assert "60 % of the gap (95 %: 48 % to 78 %) is link flexure" in said
    assert "An undetermined share is backlash, width1 = width2" in said
    assert "Another undetermined share is systematic and like no effect of the library." in said
    assert "An undetermined share does not repeat from pass to pass" in said
    assert "20 %" not in said and "to 100 %" not in said
    assert facts["effects"][1]["share"] == pytest.approx(0.2) and facts["effects"][1]["share_high"] == 1.7
    kinds = {
        claim.kind for claim in (one for said in facts["sentences"] for one in claims._of_text(said, claims._SENTENCES))
    }
    assert "a cause without a share" in kinds and claims.UNKNOWN not in kinds
    bars = {part.words: part.share for part in card(facts).parts}
    assert bars["backlash"] == "share not determined" and bars["link flexure"].startswith("60 % (95 %")


def test_every_number_of_a_cause_of_several_legs_has_its_place_and_the_cause_those_where_it_is_not_zero():
    flexure, backlash = answered()["effects"]
    assert [number["place"] for number in backlash["parameters"]] == ["in leg 1", "in leg 2", "in leg 3"]
    assert (flexure["place"], backlash["place"]) == ("in leg 2", "in leg 1, leg 2")


def test_the_error_to_expect_of_a_corrected_file_holds_what_the_diagnosis_leaves():
    """It is next to the distance of the file from the diagnosis and that of the diagnosis from the robot."""
    file = {"file_error_mm": 0.03, "file_error_fresh_mm": 0.04, "gap_after_rms_mm": 0.03, "file_expected_mm": 0.05}
    facts = answered(**file)
    assert facts["corrected_file"]["expected_mm"] == pytest.approx(0.05)
    assert "0.030 mm at held-out points. With it 0.050 mm are to be expected" in " ".join(card(facts).worth)
    # the file does not know where the instrument stood
    registered = card(facts, found=Worth(100, 0.3, 0.1, True)).worth
    assert any("by the table registration" in said for said in registered)
    assert not any("registration" in said for said in card(facts, found=Worth(100, 0.3, 0.1, False)).worth)


def test_the_sentences_say_what_acts_how_much_how_sure_and_what_next():
    said = " ".join(answered(runs=(RUN,))["sentences"])
    for words in (
        "the residual error is 0.37 mm at points left out of it (noise subtracted)",
        "60 % of the gap (95 %: 48 % to 78 %) is link flexure in leg 2, ",
        "flexure2 = 1.23 µm/N (95 %: 1.01 to 1.45): ",
        "20 % (95 %: 16 % to 26 %) is backlash, width1 = width2 = 0.000404 rad (95 %: 0.000365 to 0.000443): backlash ",
        "backlash between motor and drive arm.",
        "Causes by their share of the gap: link flexure 60 %, backlash 20 %.",
        "Probability that it acts: link flexure 0.98, backlash 0.97. Probability of exactly this answer: 0.97.",
        "10 % (95 %: 8 % to 13 %) does not repeat",
        "With them in the simulator the residual error at left-out points is 0.020 mm",
        "the noise is 0.035 mm",
        "cannot rule out: drive compliance, servo lag.",
        "Next: drive line_1 in reverse. That decides whether servo lag acts.",
    ):
        assert words in said


@pytest.mark.parametrize(("nats", "verb"), [(14.0, "decides"), (1.8, "would help to decide")])
def test_a_run_decides_only_where_enough_is_expected_of_it(nats, verb):
    said = answered(runs=((*RUN[:-1], nats),))["sentences"][-1]
    assert said == f"Next: drive line_1 in reverse. That {verb} whether servo lag acts."


@pytest.mark.parametrize(
    ("shares", "unexplained", "overlap"),
    [
        ((1.2, 0.1), None, True),
        ((0.6, 0.2), None, False),
        ((1.2, None), None, False),
        ((0.92, None), 0.87, True),
        ((0.6, None), 0.3, False),
    ],
)
def test_shares_overlap_only_where_there_are_several(shares, unexplained, overlap):
    budget = synthetic_gap.gap_budget(CAMPAIGN)
    for name, share in zip(("link_flexure", "backlash", "unexplained"), (*shares, unexplained), strict=True):
        budget.loc[budget["part"] == name, "share"] = share or 0.0
    effects = "link_flexure+backlash" if shares[1] else "link_flexure"
    effects += "+unexplained" if unexplained else ""
    said = " ".join(answered(budget=budget, effects=effects)["sentences"])
    assert ("These shares add up to more than the gap" in said) == overlap
    assert ("and of what is unexplained cancel" in said) == (overlap and unexplained is not None)


def test_shares_that_are_not_stated_do_not_add_up():
    """Of "an undetermined share" and "another undetermined share" it was said that they add up to more than the gap."""
    budget = synthetic_gap.gap_budget(CAMPAIGN)
    for name, share in (("link_flexure", 0.2), ("backlash", 0.0), ("unexplained", 9600.0)):
        budget.loc[budget["part"] == name, ["share", "share_low", "share_high"]] = share, 0.0, 10.0 * share + 1.0
    said = " ".join(answered(budget=budget, effects="link_flexure+unexplained")["sentences"])
    assert said.lower().count("undetermined share") == 2 and "These shares" not in said


@pytest.mark.parametrize(
    ("share", "effects", "said"),
    [(0.3, "link_flexure+backlash", True), (0.04, "link_flexure+backlash", False), (0.3, "link_flexure", False)],
)
def test_what_two_causes_make_together_is_said_where_it_is_a_part_of_the_gap(share, effects, said):
    budget = synthetic_gap.gap_budget(CAMPAIGN)
    budget.loc[budget["kind"] == "covariance", "share"] = share
    sentences = answered(budget=budget, effects=effects)["sentences"]
    common = [one for one in sentences if "together, since" in one]
    wanted = (
        "Another 30 % of the gap is made by link flexure and backlash together, since their parts resemble each other."
    )
    assert common == [wanted] * said


@pytest.mark.parametrize(
    ("effects", "who"),
    [
        ("link_flexure+unexplained", "With it and possible further causes (drive compliance) in the simulator"),
        (
            "link_flexure+backlash+unexplained",
            "With them and possible further causes (drive compliance) in the simulator",
        ),
        ("unexplained", "With possible further causes (drive compliance) in the simulator"),
    ],
)
def test_the_model_says_what_it_has_besides_the_named_causes(effects, who):
    facts = answered(effects=effects, unnamed="drive_compliance")
    (said,) = (one for one in facts["sentences"] if one.startswith(who))
    assert [claim.kind for claim in claims._of_text(said, claims._SENTENCES)] == [
        "what is left with it",
        "the measuring noise",
    ]
    assert facts["unnamed"] == ["drive_compliance"] and any(
        "with the effects" in step.words for step in card(facts).steps
    )


def test_a_gap_that_is_no_smaller_with_its_cause_is_said_to_be_too_small_to_see():
    """100 poses with a noise of 0.1 mm: "the residual error is 0.015 mm", and 0.027 mm with the cause."""
    said = "That it shrinks cannot be seen at these points: it is too small relative to the noise."
    sizes = {"gap_rms_mm": 0.015, "gap_after_rms_mm": 0.027, "noise_rms_mm": 0.1}
    assert said in answered(effects="link_flexure", **sizes)["sentences"]
    assert said not in answered(effects="link_flexure", **sizes | {"gap_rms_mm": 0.03})["sentences"]
    assert said not in answered(effects="link_flexure", **sizes | {"noise_rms_mm": 0.01})["sentences"]


def test_a_gap_above_the_noise_that_is_no_smaller_with_its_cause_is_said_to_be_no_smaller():
    """A table that rises as it turns, which the library lacks: 0.023 mm, and 0.060 mm with three causes, no word."""
    said = "At these points it is no smaller than without it: another cause may act."
    sizes = {"gap_rms_mm": 0.023, "gap_after_rms_mm": 0.060, "noise_rms_mm": 0.0069}
    sentences = answered(effects="link_flexure", **sizes)["sentences"]
    assert said in sentences
    assert [claim.kind for claim in claims._of_text(said, claims._SENTENCES)] == ["it does not shrink"]
    assert said not in answered(effects="link_flexure", **sizes | {"gap_after_rms_mm": 0.02})["sentences"]


def test_what_is_left_next_to_a_ruled_out_effect_is_no_share_of_what_is_unexplained():
    """An arm whose fourth joint moves the fifth: "no effect of the library explains it: 12 % of it is like none"."""
    budget = synthetic_gap.gap_budget(CAMPAIGN)
    effect = budget["kind"] == "effect"
    budget.loc[effect, ["share", "probability"]] = 1.0, 1.0
    said = "It is systematic, and no effect of the library explains it at left-out points."
    assert said in answered(budget, effects="unexplained", leg=0)["sentences"]
    assert [claim.kind for claim in claims._of_text(said, claims._SENTENCES)] == ["something is unexplained"]
    budget.loc[effect, "probability"] = 0.05
    assert said not in answered(budget, effects="unexplained", leg=0)["sentences"]


def test_a_cause_of_the_corrected_model_without_a_name_has_a_sentence_with_its_share():
    budget = synthetic_gap.gap_budget(CAMPAIGN)
    own = budget["part"] == "backlash"
    budget.loc[own, ["part", "share", "share_low", "share_high", "probability"]] = (
        "drive_compliance",
        0.27,
        0.08,
        0.46,
        1.0,
    )
    said = answered(budget, effects="link_flexure+unexplained", unnamed="drive_compliance")["sentences"]
    (sentence,) = (one for one in said if "possibly" in one)
    assert sentence == (
        "27 % (95 %: 8 % to 46 %) is possibly drive compliance (probability that it acts: more than 0.99). It is not "
        "named, since it may make up for a part of what is unexplained."
    )
    assert [claim.kind for claim in claims._of_text(sentence, claims._SENTENCES)] == ["a possible cause"]
    budget.loc[own, "share"] = 0.01
    said = answered(budget, effects="link_flexure+unexplained", unnamed="drive_compliance")["sentences"]
    assert not any("possibly" in one for one in said)


def test_confounded_causes_are_one_sentence_with_their_probabilities():
    causes = synthetic_gap.gap_attribute(CAMPAIGN)
    grouped = causes["effect"].isin(["link_flexure", "servo_lag"])
    causes.loc[grouped, ["decision", "group_probability"]] = "group", 0.97
    facts_of = answered(effects="backlash+link_flexure", groups="link_flexure | servo_lag", causes=causes)
    said = facts_of["sentences"]
    assert "Causes by their share of the gap: link flexure or servo lag 60 %, backlash 20 %." in said
    (group,) = [one for one in said if one.startswith("One of these acts")]
    assert "link flexure 0.98, servo lag 0.02 (probability that one does: 0.97)" in group
    assert "together they make 60 % of the gap" in group
    # a drive or leg to inspect, and how much is expected there
    assert group.endswith("The corrected model has link flexure in leg 2, flexure2 = 1.23 µm/N (95 %: 1.01 to 1.45).")
    assert not any(" is link flexure" in one for one in said)
    assert any(one.startswith("Probability that it acts: backlash 0.97.") for one in said)
    jsonschema.validate(json.loads(json.dumps(facts_of)), SCHEMA)


def test_a_group_whose_first_cause_was_not_fitted_says_nothing_of_the_corrected_model():
    causes = synthetic_gap.gap_attribute(CAMPAIGN)
    grouped = causes["effect"].isin(["link_flexure", "servo_lag"])
    causes.loc[grouped, ["decision", "group_probability"]] = "group", 0.97
    said = answered(effects="backlash", groups="link_flexure | servo_lag", causes=causes)["sentences"]
    (group,) = [one for one in said if one.startswith("One of these acts")]
    assert "link flexure 0.98, servo lag 0.02" in group and "corrected model" not in group


def test_a_small_group_is_counted_and_has_no_sentence():
    causes = synthetic_gap.gap_attribute(CAMPAIGN)
    grouped = causes["effect"].isin(["backlash", "servo_lag"])
    causes.loc[grouped, ["decision", "group_probability"]] = "group", 0.97
    budget = synthetic_gap.gap_budget(CAMPAIGN)
    budget.loc[budget["part"] == "backlash", "share"] = 0.009
    answer = answered(budget, effects="link_flexure+backlash", groups="backlash | servo_lag", causes=causes)
    assert "Causes by their share of the gap: link flexure 60 %, 1 small one." in answer["sentences"]
    assert not any("One of these acts" in one for one in answer["sentences"])
    jsonschema.validate(json.loads(json.dumps(answer)), SCHEMA)


@pytest.mark.parametrize(("share", "rms"), [(0.009, 0.3), (0.5, 0.009)])
def test_a_small_cause_is_counted_and_has_no_sentence(share, rms):
    budget = synthetic_gap.gap_budget(CAMPAIGN)
    small = budget["part"] == "backlash"
    budget = budget.assign(share=budget["share"].mask(small, share), rms_mm=budget["rms_mm"].mask(small, rms))
    said = answered(budget)["sentences"]
    assert "Causes by their share of the gap: link flexure 60 %, 1 small one." in said
    assert not any(" is backlash" in one for one in said)


def test_a_cause_that_is_small_and_alone_has_its_sentence():
    budget = synthetic_gap.gap_budget(CAMPAIGN)
    budget = budget.assign(rms_mm=budget["rms_mm"].mask(budget["part"] == "backlash", 0.009))
    said = answered(budget, effects="backlash", leg=0)["sentences"]
    assert any(" is backlash" in one for one in said)


def test_where_no_cause_is_named_the_most_probable_answer_says_so():
    causes = synthetic_gap.gap_attribute(CAMPAIGN).replace({"decision": {"named": "possible"}})
    said = answered(causes=causes)["sentences"]
    assert said[1] == "No cause is probable enough to be named; the most probable answer follows."
    assert said[1] not in answered()["sentences"]


def test_where_more_acts_than_what_is_named_the_further_causes_are_called_possible():
    causes = synthetic_gap.gap_attribute(CAMPAIGN)
    causes = causes.assign(decision=causes["decision"].mask(causes["effect"] == "backlash", "possible"))
    facts = answered(causes=causes)
    said = facts["sentences"]
    assert said[1].startswith("More acts than the named causes, and no further one is probable enough; ")
    assert sum(" is possibly backlash" in one for one in said) == 1
    assert any(" is link flexure" in one for one in said)
    assert "possibly backlash" in next(one for one in said if one.startswith("Causes by their share"))
    assert [words for words, _ in verdict_text.causes_in_words(facts)] == ["link flexure", "possibly backlash"]
    of_backlash = next(one for one in card(facts).advice if "acklash" in one.cause)
    assert of_backlash.cause == "Backlash, if it acts"


@pytest.mark.parametrize(("sure", "said"), [(0.49, False), (0.51, True)])
def test_what_does_not_repeat_is_said_where_it_more_likely_acts_than_not(sure, said):
    budget = synthetic_gap.gap_budget(CAMPAIGN)
    unsure = budget.assign(probability=budget["probability"].mask(budget["kind"].isin(["scatter", "runs"]), sure))
    assert ("does not repeat" in " ".join(answered(unsure)["sentences"])) == said


def test_without_a_pose_measured_twice_repeatability_is_unknown():
    said = " ".join(answered(notes=REPEATABILITY_UNKNOWN)["sentences"])
    assert "does not repeat" not in said
    assert (
        "10 % (95 %: 8 % to 13 %) is random error above the stated noise. "
        "Repeatability is unknown: no pose was measured twice." in said
    )
    for note, words in (
        (REPEATABILITY_UNSURE, "is random error above the stated noise. Repeatability is unknown: too few poses were "),
        (
            ROBOT_REPEATS,
            "looks like random error. Poses that were measured again agree better: it is an error that the model lacks",
        ),
        (
            f"{REPEATABILITY_UNKNOWN}; {SUCCESSIVE_ALIKE}",
            "looks like random error, but residuals of successive stops are correlated: it is an error that the model",
        ),
    ):
        said = " ".join(answered(notes=note)["sentences"])
        assert f"10 % (95 %: 8 % to 13 %) {words}" in said and "does not repeat" not in said


@pytest.mark.parametrize(
    ("stated", "said"),
    [
        (0.02, "the noise is 0.035 mm."),
        (np.nan, "the noise is 0.035 mm."),
        (0.005, "the noise that was found is 0.035 mm (stated: 0.0087 mm in space)."),
    ],
)
def test_a_noise_that_contradicts_the_stated_one_is_said_to_be_found(stated, said):
    assert said in " ".join(answered(noise_stated_mm=stated)["sentences"])


@pytest.mark.parametrize("note", [REPEATABILITY_UNKNOWN, REPEATABILITY_UNSURE])
@pytest.mark.parametrize("unexplained", [True, False])
def test_random_error_may_be_a_part_of_what_is_unexplained(unexplained, note):
    """Of a reflector that slipped once 30 to 46 % was "random error", which did not act at all."""
    effects = "link_flexure+unexplained" if unexplained else "link_flexure"
    (said,) = (one for one in answered(effects=effects, notes=note)["sentences"] if "random error" in one)
    words = "is random error above the stated noise, or a part of what is unexplained. Repeatability is unknown: "
    assert (words in said) == unexplained
    assert ("is random error above the stated noise. Repeatability is unknown: " in said) != unexplained
    (kind, *_) = (claim.kind for claim in claims._of_text(said, claims._SENTENCES))
    assert kind == ("it is random error or unexplained" if unexplained else "it is random error")


@pytest.mark.parametrize(
    ("notes", "said"),
    [
        (REPEATABILITY_UNKNOWN, "After calibration these data show no systematic error (probability 0.98): "),
        (ROBOT_REPEATS, "After calibration no cause is found (probability 0.98), but the model lacks an error: "),
        (SUCCESSIVE_ALIKE, "After calibration no cause is found (probability 0.98), but the model lacks an error: "),
    ],
)
def test_a_headline_without_causes_does_not_hide_an_error_that_passes_for_noise(notes, said):
    """Of a mount that swayed by 0.08 mm "no systematic error" was said, and its sway was called the measuring noise."""
    first, *_ = answered(effects="none", leg=0, notes=notes, noise_stated_mm=0.005, probability=0.98)["sentences"]
    assert first.startswith(said)
    assert first.endswith(" mm, the noise that was found is 0.035 mm (stated: 0.0087 mm in space).")
    assert claims._of_text(first, claims._SENTENCES)


@pytest.mark.parametrize(("factor", "gap", "why"), [(12.0, 0.02, "small"), (1.0, 0.0, "small"), (12.0, 0.2, "alike")])
def test_where_shares_are_not_determined_sizes_are_said_and_why(factor, gap, why):
    budget = synthetic_gap.gap_budget(CAMPAIGN)
    shares = budget[["share", "share_low", "share_high"]] * (factor if gap else 0.0)
    said = " ".join(answered(budget.assign(**shares), gap_rms_mm=gap)["sentences"])
    size = budget.set_index("part").loc["link_flexure", "rms_mm"]
    assert "%" not in re.sub(r"\(95 %: [^)]*\)", "", said)
    assert ("too small relative to the noise" in said) == (why == "small")
    assert ("are confounded with each other" in said) == (why == "alike")
    assert f"{rounded(size)} mm is link flexure" in said


@pytest.mark.parametrize(
    ("separates", "left_open", "decided"),
    [
        ("link_flexure+backlash / backlash", "that link flexure does not act", "whether link flexure acts"),
        ("none / servo_lag", "servo lag", "whether servo lag acts"),
        ("backlash+tool_offset / backlash+servo_lag", "servo lag, tool offset", "between tool offset and servo lag"),
    ],
)
def test_what_the_advised_run_decides_is_said_to_be_open(separates, left_open, decided):
    """Also where no rival alone is probable enough to be named."""
    said = answered(runs=[(*RUN[:-2], separates, 3.0)], confounded_with="")["sentences"]
    assert f"These data cannot rule out: {left_open}." in said and said[-1].endswith(f"That decides {decided}.")


def test_where_no_run_decides_the_inspection_that_would_is_said():
    facts_of = answered(undecided="backlash+link_flexure / backlash+servo_lag", probability=0.5)
    last = facts_of["sentences"][-1]
    flexure, lag = (cause_texts(name).inspect for name in ("link_flexure", "servo_lag"))
    assert last == (
        "Next: nothing that can be simulated would decide between link flexure and servo lag; inspection would. "
        f"Link flexure: {flexure} Servo lag: {lag}"
    )
    assert claims._of_text(last, claims._SENTENCES)[0].kind == "next, nothing would decide"
    jsonschema.validate(json.loads(json.dumps(facts_of)), SCHEMA)


def test_a_run_that_decides_something_else_follows_what_nothing_decides():
    note = "no run with a payload is proposed, the robot moves 2 kg itself: state limits.payload_kg"
    facts_of = answered(runs=(RUN,), undecided="my_own / none", probability=0.5, notes=note)
    first, last = facts_of["sentences"][-2:]
    assert first == (
        "Next: nothing that can be simulated within the limits would decide whether my own acts; inspection would. "
        "My own: add a sensor at the part itself."
    )
    assert last.startswith("Next: drive line_1 in reverse.")
    assert claims._of_text(note, claims._NOTES)[0].kind == "runs are limited"


def test_an_effect_of_one_drive_of_an_arm_is_named_after_the_drive():
    arm = make_mechanism("arm", {"urdf": str(ROOT / "data/models/arm6.urdf")}, parameter_set="zero")
    said = " ".join(answered(drives=drive_words(arm))["sentences"])
    assert "link flexure at axis2, " in said and " leg " not in said and "backlash between motor and link." in said


def test_every_cause_says_what_to_inspect_and_what_to_do_by_the_kind_of_the_drives():
    texts = [
        effect
        for effect in answered(drives=DriveWords(kinds=("length",) * 6))["effects"]
        if effect["name"] == "backlash"
    ]
    assert texts[0]["inspect"].startswith("Block the motor and pull and push the leg") and texts[0]["remedy"]
    assert texts[0]["source"] == cause_texts("backlash").source and "drive arm" not in str(texts)


def test_where_a_drive_error_is_largest_is_said_with_its_interval():
    places = [
        ("backlash", 1, True, "axis1", "rad", 0.5, 2e-4, 1e-4, 3e-4),
        ("backlash", 2, True, "axis2", "rad", np.radians(-37.0), -5e-4, -5.5e-4, -4.5e-4),
        ("backlash", 2, False, "axis2", "rad", 0.1, 9e-4, 8e-4, 1e-3),
    ]
    facts_of = answered(places=places)
    said = " ".join(facts_of["sentences"])
    text = "largest for axis2 at -37.0 degrees: -0.000500 rad (95 %: -0.000550 to -0.000450) off its mean over "
    assert text in said
    jsonschema.validate(json.loads(json.dumps(facts_of)), SCHEMA)
    # link flexure acts in leg 2; of the other legs nothing is said
    of_leg = answered(
        places=[("link_flexure", k, True, f"leg {k}", "rad", 0.5, k * 1e-4, 0.0, 1e-3) for k in (1, 2, 3)]
    )
    assert "largest for leg 2 at 28.6 degrees" in " ".join(of_leg["sentences"])


def test_what_the_unexplained_follows_is_said_where_one_variable_predicts_most_of_it():
    follows = [("the value of axis2", 0.71, np.radians(12.0), "rad", 0.21), ("the time", 0.2, 60.0, "s", 0.1)]
    facts_of = answered(effects="unexplained", leg=0, follows=follows)
    assert (
        "The unexplained part follows the value of axis2: a smooth function of it, which changes over about 12 "
        "degrees, predicts 71 % of it at left-out points (0.21 mm rms)." in facts_of["sentences"]
    )
    jsonschema.validate(json.loads(json.dumps(facts_of)), SCHEMA)
    unclear = answered(effects="unexplained", leg=0, follows=[("the time", 0.3, 60.0, "s", 0.1)])
    assert any("follows no single variable that was tried: the time comes next" in one for one in unclear["sentences"])
    steps = answered(
        effects="unexplained", leg=0, follows=[("the sense of motion of the drives", 0.9, np.nan, "1", 0.1)]
    )
    assert any("steps with it predict 90 % of it" in one for one in steps["sentences"])
    jump, poor = (
        " ".join(
            answered(
                effects="unexplained",
                leg=0,
                next_runs="",
                follows=[("a jump at 178 s, as shifts of the targets", share, np.nan, "1", 0.1)],
            )["sentences"]
        )
        for share in (0.9, 0.3)
    )
    assert "follows a jump at 178 s, as shifts of the targets: it predicts 90 % of it" in jump
    assert "since something changed at 178 s: calibrate the readings before and after it separately" in jump
    assert "as shifts of the targets comes next: it predicts 30 %" in poor and "changed at" not in poor


def test_where_nothing_acts_or_the_library_lacks_it_no_effect_is_blamed():
    nothing = " ".join(answered(effects="none", leg=0, confounded_with="")["sentences"])
    assert "these data show no systematic error" in nothing and " is backlash" not in nothing
    budget = synthetic_gap.gap_budget(CAMPAIGN)
    budget.loc[budget["kind"] == "effect", "probability"] = 0.05
    unknown = " ".join(answered(budget, effects="unexplained", leg=0)["sentences"])
    assert (
        "no effect of the library explains it: 5 % (95 %: 4 % to 6 %) of it" in unknown
        and " is backlash" not in unknown
    )
    assert "Parts of the unexplained share could be: drive compliance." in unknown


def test_compliances_of_joints_are_in_microradians_per_newton_metre():
    """6.67e-9 rad/(N mm) = 6.67e-6 rad/(N m)."""
    row = {"parameter": "compliance2", "unit": "rad/(N mm)", "value": 6.67e-9, "standard_error": 6e-11}
    (size,) = verdict_text._sizes([row | {"low_95": 6.55e-9, "high_95": 6.79e-9}])
    assert size == "compliance2 = 6.67 µrad/(N m) (95 %: 6.55 to 6.79)"


def test_numbers_of_numpy_and_what_is_not_finite_are_plain_in_a_file(tmp_path):
    json_files.write(
        {"a": np.float64(2.5), "b": np.nan, "c": (np.int64(3), np.bool_(True)), "d": {"e": -np.inf}}, tmp_path / "f"
    )
    assert json.loads((tmp_path / "f").read_text()) == {"a": 2.5, "b": None, "c": [3, True], "d": {"e": None}}


@pytest.mark.parametrize("effects", ["link_flexure", "link_flexure+backlash"])
def test_no_line_of_the_page_names_one_of_a_group_for_all_of_it(effects):
    """The line of the overview had the most probable cause, with the probability that it acts alone."""
    causes = synthetic_gap.gap_attribute(
        CAMPAIGN, likely=(("link_flexure", 0.6, "2"), ("drive_compliance", 0.35, "each"), ("backlash", 0.97, "each"))
    )
    grouped = causes["effect"].isin(["link_flexure", "drive_compliance"])
    causes.loc[grouped, ["decision", "group_probability"]] = "group", 0.94
    facts = answered(causes=causes, effects=effects, groups="link_flexure | drive_compliance", probability=0.55, leg=0)
    jsonschema.validate(json.loads(json.dumps(facts)), SCHEMA)
    own = card(facts)
    alone = effects == "link_flexure"
    assert own.short.startswith("Link flexure or drive compliance 60 %")
    sure = "probability 0.94" if alone else "probability, of exactly this answer with link flexure, 0.55"
    assert f"({sure})" in own.short
    advised = {one.cause: one.inspect for one in own.advice}
    for name, legs in (("link_flexure", (2,)), ("drive_compliance", ())):
        words = name.replace("_", " ").capitalize()
        assert advised[f"{words}, if it acts"] == cause_texts(name, _LEGS, legs).inspect
    assert len(advised) == (2 if alone else 3)
    said = facts["sentences"]
    assert any(text.endswith("Probability of exactly the causes of the corrected model: 0.55.") for text in said)
    assert not any("this answer:" in text for text in said)
    kinds = {claim.kind for text in said for claim in claims._of_text(text, claims._SENTENCES)}
    assert {"a group of causes", "probability of this answer"} <= kinds and claims.UNKNOWN not in kinds
    # a group is no name
    judged = {claim.kind: claim for claim in claims._of_facts(facts)}
    assert judged["names in the verdict"].stated["names"] == ([] if alone else ["backlash"])
    assert judged["verdict"].text.startswith("link_flexure_or_drive_compliance")
