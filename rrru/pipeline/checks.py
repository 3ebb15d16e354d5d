"""Checks of the configuration, with a cache of the answer until the configuration or the code changes."""

import hashlib
import importlib
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from copy import deepcopy
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from rrru.errors import ConfigError
from rrru.store.digest import code_digest

if TYPE_CHECKING:
    from jsonschema.exceptions import ValidationError

# a larger number is a typing error, and results from it may overflow
_MAX_NUMBER = 1e15
# sections that are whole in every configuration, and keywords of a schema that ask for something to be there
_WHOLE = ("gap", "calibration", "loads")
_COUNTED = ("required", "minProperties")
_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def check_schema(config: Mapping[str, Any], file: str | Path, parts: bool = False) -> None:
    """Raise ConfigError with place and value where a configuration does not fit the JSON schema of a file.

    parts: sections and the keys of each may be missing, as in what the package's defaults hold. Types are stricter than
    those of JSON, since YAML allows more: numbers are finite, 3.0 is not a count, 1 and `no` are not names.
    """
    # installed with Snakemake
    from jsonschema import Draft202012Validator as Usual
    from jsonschema import exceptions, validators

    kinds = {name: lambda _, value, fits=fits: fits(value) for name, (fits, _) in _STRICT.items()}
    strict = validators.extend(Usual, type_checker=Usual.TYPE_CHECKER.redefine_many(kinds))
    rules = _rules(file)
    if parts:
        # robots and campaigns are whole, the sections of studies are not
        whole = {name: rules["properties"][name] for name in _WHOLE}
        partly = {name: _without(one, _COUNTED) for name, one in rules["properties"].items()}
        rules = _without(rules, _COUNTED) | {"properties": partly | whole}
    error = exceptions.best_match(strict(rules).iter_errors(config))
    if error:
        error = _of_its_type(error)
        kind = error.validator_value if error.validator == "type" else None
        allowed = f"; allowed: {_STRICT[kind][1]}" if isinstance(kind, str) and kind in _STRICT else ""
        place = ".".join(map(str, error.absolute_path)) or "configuration"
        said = _choices(error) or f"{_said(error)}{allowed}{_as_number(error)}{_meant(error)}"
        raise ConfigError(f"{place}: {said}")


def set_defaults(config: dict[str, Any], file: str | Path) -> None:
    """Set what a configuration lacks, in place, to the defaults of the JSON schema of a file, which it fits.

    It does what `snakemake.utils.validate` does, without a quarter of a second for reading the schema.
    """
    from jsonschema import Draft202012Validator as Usual
    from jsonschema import validators

    check = Usual.VALIDATORS["properties"]

    def completed(validator: Any, properties: Any, instance: Any, schema: Any) -> Iterator["ValidationError"]:
        for name, rules in properties.items():
            if "default" in rules:
                instance.setdefault(name, deepcopy(rules["default"]))
        yield from check(validator, properties, instance, schema)

    validators.extend(Usual, {"properties": completed})(_rules(file)).validate(config)


@cache
def _rules(file: str | Path) -> dict[str, Any]:
    """The JSON schema of a file."""
    rules: dict[str, Any] = yaml.load(Path(file).read_text(), Loader=_LOADER)
    return rules


def _without(rules: Mapping[str, Any], keys: Iterable[str]) -> dict[str, Any]:
    """A mapping without some keys."""
    return {key: value for key, value in rules.items() if key not in keys}


def check_keys(files: Iterable[str | Path]) -> None:
    """Raise ConfigError with file and line where a YAML file has a key twice: YAML silently uses the last one."""
    for file in map(Path, files):
        try:
            root = yaml.compose(file.read_text(encoding="utf-8"), Loader=_LOADER)
        except (OSError, UnicodeDecodeError, yaml.YAMLError):
            # the code that reads it reports this
            continue
        for place, key in _repeated(root, ""):
            line = key.start_mark.line + 1
            raise ConfigError(f"{file}, line {line}: {place}{key.value} occurs twice; allowed: each name once")


def _repeated(node: yaml.Node | None, place: str) -> Iterator[tuple[str, yaml.ScalarNode]]:
    """Nodes of keys that occur twice in a mapping, below a YAML node, with the place of their mapping as text."""
    if isinstance(node, yaml.SequenceNode):
        for item in node.value:
            yield from _repeated(item, place)
    if not isinstance(node, yaml.MappingNode):
        return
    seen = set()
    for key, value in node.value:
        if key.value in seen and key.tag != "tag:yaml.org,2002:merge":
            yield place, key
        if isinstance(key.value, str):
            seen.add(key.value)
            yield from _repeated(value, f"{place}{key.value}.")


def _as_number(error: "ValidationError") -> str:
    """The correct form of a number that YAML takes for text, such as 8.0e7; "" where the value is not a number."""
    if error.validator != "type" or not isinstance(error.instance, str):
        return ""
    try:
        number = float(error.instance)
    except ValueError:
        return ""
    # in YAML's form: with a point and a sign in the exponent
    return f"; it is text to YAML: write {yaml.safe_dump(number).split()[0]}, without quotes"


def _of_its_type(error: "ValidationError") -> "ValidationError":
    """The error of the only alternative that is of the value's type, or the error itself."""
    others = [one for one in error.context or () if one.validator != "type"]
    return _of_its_type(others[0]) if len(others) == 1 else error


def _said(error: "ValidationError") -> str:
    """What is wrong: of a mapping that has keys that are no text only these, since it may be long."""
    if error.validator_value == "object" and isinstance(error.instance, dict):
        return f"has the key {', '.join(repr(key) for key in error.instance if not isinstance(key, str))}"
    return str(error.message)


def _choices(error: "ValidationError") -> str:
    """What a mapping has that needs one of several sets of keys, and these; "" for any other error."""
    if error.validator != "oneOf" or not isinstance(error.instance, dict):
        return ""
    if not all(one.keys() == {"required"} for one in error.validator_value):
        return ""
    choices = ", or ".join(" and ".join(one["required"]) for one in error.validator_value)
    has = f"has the keys {', '.join(error.instance)}" if error.instance else "has no key"
    return f"{has}; allowed: the keys {choices}"


def _meant(error: "ValidationError") -> str:
    """Known keys or words similar to the unknown ones, or all known keys where none is similar.

    For missing keys the description of the schema.
    """
    known, unknown = [], []
    if error.validator == "required" and "description" in error.schema:
        return f"; {error.schema['description']}"
    if error.validator == "additionalProperties":
        known = list(error.schema.get("properties", ()))
        unknown = [key for key in error.instance if key not in known]
    elif error.validator == "enum":
        known, unknown = list(map(str, error.validator_value)), [error.instance]
    near = {key: get_close_matches(str(key), known, n=1) for key in unknown}
    meant = [f"{found[0]} for {key}" for key, found in near.items() if found]
    if meant or error.validator != "additionalProperties":
        return f"; did you mean {', '.join(meant)}?" if meant else ""
    return f"; allowed: {', '.join(known)}"


def _is_number(value: Any) -> bool:
    """Whether a value is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= _MAX_NUMBER


def _is_whole(value: Any) -> bool:
    """Whether a value is a whole number, written as one."""
    return _is_number(value) and isinstance(value, int)


def _is_mapping(value: Any) -> bool:
    """Whether a value is a mapping whose keys are text."""
    return isinstance(value, dict) and all(isinstance(key, str) for key in value)


# JSON's type names with their test and its description
_STRICT = {
    "number": (_is_number, f"a finite number of at most {_MAX_NUMBER:g}"),
    "integer": (_is_whole, "a whole number, without a point"),
    "object": (_is_mapping, "a mapping whose keys are text"),
}


def check_once(
    config: Mapping[str, Any], checks: Sequence[str], files: Sequence[str | Path], memory: str | Path
) -> None:
    """Call every check ("module:function") with the configuration, unless the same has passed them before.

    files: those that the checks read; memory: the file with the digest of the last passed configuration. A check raises
    a ConfigError.
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
