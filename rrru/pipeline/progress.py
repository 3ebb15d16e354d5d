"""Progress of what takes longer than a second, step by step."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

# called with the name of a step, its number from 0 on and the number of steps, as the step begins
Progress = Callable[[str, int, int], None]


@contextmanager
def shown(progress: bool | Progress, steps: Sequence[str]) -> Iterator[Callable[[str], None] | None]:
    """What a computation calls with the name of each of its steps as it begins; None where nothing is to be shown.

    progress: True for a bar of tqdm on the standard error, or a function that gets every step.
    """
    if callable(progress):
        yield lambda step: progress(step, steps.index(step), len(steps))
    elif not progress:
        yield None
    else:
        from tqdm import tqdm

        with tqdm(total=len(steps), leave=False) as bar:

            def begin(step: str) -> None:
                bar.update(steps.index(step) - bar.n)
                bar.set_description(step)

            yield begin
