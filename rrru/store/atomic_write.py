"""Atomic writing: a file of results exists completely or not at all, whatever stops the writing."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from rrru.errors import WriteError


@contextmanager
def whole(*paths: str | Path) -> Iterator[list[Path]]:
    """Temporary paths in the folders of the files at `paths`, to be written; at the end they replace these files.

    None is replaced before all are written, and a reader of the old ones continues to read them. Raises WriteError
    where the system refuses: the disk is full, the folder may not be written to.
    """
    files = [Path(path) for path in paths]
    # a reader may go by the ending
    partial = [file.parent / f".{file.stem}.partial{file.suffix}" for file in files]
    try:
        for file in files:
            file.parent.mkdir(parents=True, exist_ok=True)
        yield partial
        for new, file in zip(partial, files, strict=True):
            new.replace(file)
    except OSError as error:
        allowed = "allowed: a folder that may be written to, on a disk with room. What was there before is as it was"
        raise WriteError(f"{', '.join(map(str, paths))}: cannot be written ({error}); {allowed}") from error
    finally:
        for new in partial:
            # on a file system that has become read-only
            with suppress(OSError):
                new.unlink(missing_ok=True)


def write_text(text: str, path: str | Path) -> None:
    """Write a text file, see `whole`."""
    with whole(path) as (partial,):
        partial.write_text(text, encoding="utf-8")
