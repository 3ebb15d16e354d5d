"""Frame of every workflow script: a log file, and errors as messages for the user."""

import logging
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rrru.errors import RrruError


def run(main: Callable[[dict[str, Any], dict[str, Any], dict[str, Any]], None], snakemake: Any) -> None:
    """Call main(settings, inputs, outputs) with a job's part of the configuration and its files by name.

    It logs to the job's file; an RrruError ends the process with its message instead of a traceback.
    """
    log = Path(snakemake.log[0])
    try:
        log.parent.mkdir(parents=True, exist_ok=True)
        logging.basicConfig(filename=log, filemode="w", level=logging.INFO, format="%(message)s", force=True)
    except OSError as error:
        sys.exit(f"{log}: cannot be written ({error}); allowed: results_dir in a folder that may be written to")
    logging.captureWarnings(True)
    # details of fonts do not concern the user
    logging.getLogger("fontTools").setLevel(logging.WARNING)
    try:
        main(snakemake.params.settings, dict(snakemake.input.items()), dict(snakemake.output.items()))
    except RrruError as error:
        logging.error("%s: %s", type(error).__name__, error)
        sys.exit(f"{type(error).__name__}: {error}")
    except Exception:
        logging.exception("unexpected error")
        raise


def tell(message: str) -> None:
    """A remark for the user: into the log and onto the screen."""
    logging.warning(message)
    print(message, file=sys.stderr)
