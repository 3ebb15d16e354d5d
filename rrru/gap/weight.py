"""Weight that nobody knows exactly: a load that was not told, a base that is not level.

What gives way does so under loads that are linear in the mass m at the platform and in the lean w of the base
(`rrru.robots.dynamics.load_slopes`). What both may be off by is fitted together with everything else, wherever an
effect that bears loads acts:

    dm ~ N(0, (share m)^2),    w_x, w_y ~ N(0, lean^2)

It is one weight for all effects, and no effect itself: where nothing gives way it changes nothing. Evidence is averaged
over two cases: the weight is as it was told, or it is not.

ASSUME even odds: masses come from a scale or a drawing, good to 3 %, and the robot stands level within a tenth of a
degree; or masses are guessed within 30 %, and it leans by a degree.
"""

from dataclasses import replace

import numpy as np

from rrru.gap.projected import gained, posterior_mean
from rrru.robots.dynamics import carried_kg, level_axes
from rrru.robots.lumps import PLATFORM

# its name beside effects
WEIGHT = "weight"
# probabilities that the weight is as told and that it is not, each with its share of the standard deviations below
_CASES = ((0.5, 0.1), (0.5, 1.0))
_SHARE, _LEAN_RAD = 0.3, float(np.radians(1.0))
# standard deviations that it may be off by: to nearly nothing, and to four times what was told
LEAST, MOST = -3.0, 10.0
# such a share of these is nothing
_STAYS = 1e-4
# strengths lie so far apart that the next one to a size may be this share of it
_NEXT = 0.5


def weight_names(robot):
    """Names of what the weight may be off by: mass at the platform, turns of the base about the level axes."""
    return ("extra_kg", *(f"lean_{'xyz'[axis]}" for axis in level_axes(robot)))


def doubts_of(motion, masses):
    """Standard deviations by name of what the weight along a Motion may be off by, zero where nothing has weight."""
    robot = motion.robot
    own = sum(lump.mass_kg for lump in getattr(robot, "lumps", ()) if lump.joint == PLATFORM)
    told = own + float(carried_kg(robot, masses, np.nan_to_num(motion.payload_kg)).max(initial=0.0))
    doubts = _SHARE * told, *(2 * [_LEAN_RAD if told else 0.0])
    return dict(zip(weight_names(robot), doubts, strict=True))


def borne(problem, count, blocks, steps, strength, grams):
    """The Projected problem of so many terms with what the weight may be as further coefficients.

    blocks: by number of a term that bears loads the matrix (c, k) of its own k coefficients' coordinates, and the
    numbers (q, c) of the columns that a step of each of q numbers of the weight makes of its columns; steps: of the
    weight, see `rrru.gap.state.Linear`; strength: of the priors under which the coefficients are found that such a step
    changes; grams: as in `Projected.of`.
    """
    means = np.array([step[-1] for step in steps])
    scale = problem.scale(np.full((1, count), strength))[0]
    found = np.linalg.solve(problem.gram[0] + np.diag(scale**-2.0), problem.moment[0])
    found = np.where(problem.positive, np.maximum(found, 0.0), found)
    acting = {k: matrix @ found[problem.owner == k] for k, (matrix, _) in blocks.items()}
    index = np.concatenate([numbers.ravel() for _, numbers in blocks.values()])
    mix = np.zeros((len(found) + len(index), len(found) + len(means)))
    np.fill_diagonal(mix[: len(found)], 1.0)
    row = len(found)
    for coordinates in acting.values():
        for number in range(len(means)):
            mix[row : row + len(coordinates), len(found) + number] = coordinates
            row += len(coordinates)
    more = {
        "size": np.ones(len(means)),
        "largest": np.full(len(means), np.inf),
        "positive": np.zeros(len(means), dtype=bool),
        "about": means,
        "owner": np.full(len(means), count),
        "index": index,
    }
    joined = {name: np.concatenate([getattr(problem, name), values]) for name, values in more.items()}
    at_least, squares = np.zeros(count), (found / problem.size) ** 2
    for k in blocks:
        at_least[k] = np.sqrt(squares[problem.owner == k].mean())
    whole = replace(problem, mix=mix, weights=len(means), at_least=at_least, **joined)
    return whole.on(*grams(joined["index"]))


def gained_over_cases(problem, strengths):
    """`gained` of a Projected problem at strengths (m, terms), averaged over both cases of the weight."""
    if not problem.weights:
        return gained(problem, strengths)
    free, result = _free(problem, strengths), np.empty((len(problem.gram), len(strengths)))
    for freely, some in ((True, free), (False, ~free)):
        if some.any():
            found = [log + gained(one, strengths[some]) for log, one in _cases(problem, freely)]
            result[:, some] = np.logaddexp.reduce(found)
    return result


def over_cases(problem, strengths):
    """Mean (k,) and covariance (k, k) of the coefficients of a Projected problem of one level at strengths (1, terms).

    Of a mixture of both cases of the weight, which is always free: the strengths are raised to where it is. The
    covariance does not know of positive coefficients.
    """
    cases = ((0.0, problem),)
    if problem.weights:
        strengths, cases = np.maximum(strengths, problem.at_least), _cases(problem, True)
    log = np.array([chance + gained(one, strengths)[0, 0] for chance, one in cases]) if cases[1:] else np.zeros(1)
    share, means, spreads = np.exp(log - np.logaddexp.reduce(log)), [], []
    for _, one in cases:
        scale = one.scale(strengths)[0]
        means.append(posterior_mean(one.gram[0], one.moment[0], scale, one.positive, one.about))
        spreads.append(np.linalg.inv(one.gram[0] + np.diag(scale**-2.0)))
    mean = share @ means
    apart = np.array(means) - mean
    return mean, np.einsum("c,cij->ij", share, spreads) + np.einsum("c,ci,cj->ij", share, apart, apart)


def _free(problem, strengths):
    """Which strengths (m, terms) leave a problem's weight free.

    Under a prior too narrow for the coefficients the weight, whose columns are as large as these, would stand for them.
    """
    return (strengths >= _NEXT * problem.at_least).all(axis=1)


def _cases(problem, free):
    """Logarithms of the probabilities of the cases, and the problem in each; one, in which the weight stays, where it
    is not free.
    """
    weight = np.arange(len(problem.size)) >= len(problem.size) - problem.weights
    if not free:
        stays = {"size": np.where(weight, _STAYS, problem.size), "about": np.zeros(len(weight))}
        return ((0.0, replace(problem, **stays)),)
    return tuple(
        (float(np.log(chance)), replace(problem, size=np.where(weight, share * problem.size, problem.size)))
        for chance, share in _CASES
    )
