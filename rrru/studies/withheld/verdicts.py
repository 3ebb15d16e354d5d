"""Verdicts beside the truth: whether they are right."""

PREFIX = "outside"
UNEXPLAINED = "unexplained"
_SCORES = ["check", "robot", "kind", "truth", "truth_leg", "strength", "verdict", "right", "leg_right", "probability"]


def is_right(truth, verdict, check):
    """Whether a verdict names the truth; where the library does not hold it, whether it says so."""
    said = set(verdict.split("+"))
    if check == "effect" or is_outside(truth):
        return UNEXPLAINED in said
    return said == set(truth.split("+"))


def is_outside(truth):
    """Whether no library holds the truth."""
    return truth.startswith((PREFIX, UNEXPLAINED))


def scores(told):
    """Frame `withheld_scores` from rows of `withheld_verdicts` beside the columns of the truth."""
    triples = zip(told["truth"], told["effects"], told["check"], strict=True)
    # a library without the effect cannot name its leg
    has_leg = (told["truth_leg"] > 0) & (told["check"] != "effect")
    told = told.assign(
        verdict=told["effects"],
        right=[is_right(*triple) for triple in triples],
        leg_right=(told["leg"] == told["truth_leg"]).astype(float).where(has_leg),
        share_closed=told["share_closed"].where(~told["effects"].isin(["none", UNEXPLAINED])),
    )
    return told[[*_SCORES, "oracle_detects", "share_closed_true", "share_closed"]]


def in_order(effects):
    """Names joined by + in alphabetical order."""
    return "+".join(sorted(effects.split("+")))
