"""What every workflow script runs in: a log file, and errors that a user can read."""

import logging
import sys
from contextlib import contextmanager
from pathlib import Path

from rrru.errors import RrruError


@contextmanager
def job(log_path):
    """Log to a file; an RrruError ends the process with its message instead of a traceback."""
    Path(log_path).parent.mkdir(parents=True, exist_ok=True)
    logging.basicConfig(filename=log_path, filemode="w", level=logging.INFO, format="%(message)s", force=True)
    logging.captureWarnings(True)
    try:
        yield
    except RrruError as error:
        logging.error("%s: %s", type(error).__name__, error)
        sys.exit(f"{type(error).__name__}: {error}")
    except Exception:
        logging.exception("unexpected error")
        raise
