"""Whether verdicts are correct, given the truth."""

PREFIX = "outside"
UNEXPLAINED, NONE = "unexplained", "none"
# checks on robots of files, each the name of the plant that drives them
PLANTS = ("mujoco", "own")
AS_ROBOTS_ARE = "as_robots_are"
# checks on robots with several causes; the verdict has to name the important ones
SEVERAL_CAUSES = ("many", AS_ROBOTS_ARE)
# kinds of parts of a gap that a verdict may name wrongly
CAUSES = ("effect", "background")
# effect that acts in every robot of the check on a background
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
    """Whether a verdict names the truth, or says unexplained where the library does not hold the truth.

    On a background of axis errors, joint_axis_error may be named or not. For many causes see
    `rrru.studies.blind_validation.parts`.
    """
    said = set(verdict.split("+"))
    if check == "effect" or is_outside(truth):
        return UNEXPLAINED in said
    if check == "background":
        said = said - {_BACKGROUND} or {NONE}
    return said == set(truth.split("+"))


def is_outside(truth):
    """Whether the truth is outside the library."""
    return truth.startswith((PREFIX, UNEXPLAINED))


def scores(verdicts):
    """Frame `withheld_scores` from rows of `withheld_verdicts` joined with the columns of the truth and `right`."""
    # a library without the effect cannot name its leg
    has_leg = (verdicts["truth_leg"] > 0) & (verdicts["check"] != "effect")
    verdicts = verdicts.assign(
        verdict=verdicts["effects"],
        leg_right=(verdicts["leg"] == verdicts["truth_leg"]).astype(float).where(has_leg),
        share_closed=verdicts["share_closed"].where(~verdicts["effects"].isin([NONE, UNEXPLAINED])),
    )
    return verdicts[[*_SCORES, "oracle_detects", "share_closed_true", "share_closed", "numbers", "held"]]


def in_order(effects):
    """Names joined by + in alphabetical order."""
    return "+".join(sorted(effects.split("+")))
