"""Whether the configuration makes sense, asked once: the answer is kept until the configuration or the code changes."""

import hashlib
import importlib
import json
from pathlib import Path

from rrru.store.digest import code_digest


def check_once(config, checks, files, memory):
    """Call every check ("module:function") with the configuration, unless just this has passed them before.

    files: those that the checks read; memory: the file that keeps what has passed. A check raises a ConfigError.
    """
    read = [hashlib.sha256(Path(file).read_bytes()).hexdigest() for file in files if Path(file).is_file()]
    code = [code_digest(check.partition(":")[0]) for check in checks]
    asked = json.dumps([config, checks, code, list(map(str, files)), read], sort_keys=True)
    digest = hashlib.sha256(asked.encode()).hexdigest()
    memory = Path(memory)
    if memory.is_file() and memory.read_text() == digest:
        return
    for check in checks:
        module, _, function = check.partition(":")
        getattr(importlib.import_module(module), function)(config)
    memory.parent.mkdir(exist_ok=True)
    memory.write_text(digest)
