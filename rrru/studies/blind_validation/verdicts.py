"""Verdicts beside the truth: whether they are right."""

PREFIX = "outside"
UNEXPLAINED, NONE = "unexplained", "none"
# checks on robots of files, each the name of the plant that drives them
PLANTS = ("mujoco", "own")
AS_ROBOTS_ARE = "as_robots_are"
# checks on robots of several causes, whose verdict has to name those that matter
SEVERAL_CAUSES = ("many", AS_ROBOTS_ARE)
# kinds of parts of a gap that a verdict names and that may not be there
CAUSES = ("effect", "background")
# what acts in every robot of the check on a background, asked for or not
_BACKGROUND = "joint_axis_error"
_SCORES = [
    "check",
    "robot",
    "kind",
    "file",
    "cause",
    "truth",
    "truth_leg",
    "strength",
    "verdict",
    "right",
    "leg_right",
    "probability",
]


def is_right(truth, verdict, check):
    """Whether a verdict names the truth; where the library does not hold it, whether it says so.

    On a background of axis errors these may be named or not. For many causes see `rrru.studies.blind_validation.parts`.
    """
    said = set(verdict.split("+"))
    if check == "effect" or is_outside(truth):
        return UNEXPLAINED in said
    if check == "background":
        said = said - {_BACKGROUND} or {NONE}
    return said == set(truth.split("+"))


def is_outside(truth):
    """Whether no library holds the truth."""
    return truth.startswith((PREFIX, UNEXPLAINED))


def scores(told):
    """Frame `withheld_scores` from rows of `withheld_verdicts` beside the columns of the truth and `right`."""
    # a library without the effect cannot name its leg
    has_leg = (told["truth_leg"] > 0) & (told["check"] != "effect")
    told = told.assign(
        verdict=told["effects"],
        leg_right=(told["leg"] == told["truth_leg"]).astype(float).where(has_leg),
        share_closed=told["share_closed"].where(~told["effects"].isin([NONE, UNEXPLAINED])),
    )
    return told[[*_SCORES, "oracle_detects", "share_closed_true", "share_closed", "numbers", "held"]]


def in_order(effects):
    """Names joined by + in alphabetical order."""
    return "+".join(sorted(effects.split("+")))
