"""Run a notebook's cells in this process and save their outputs: `python -m docs.notebook docs/tutorial.ipynb`.

A notebook needs a Jupyter kernel only to be edited. Its code is Python, its file JSON; so the tests run it with what
the package itself needs. A cell's output is what it prints, then its last expression as a notebook shows it.
"""

import ast
import base64
import contextlib
import io
import json
import re
import sys
from pathlib import Path

_NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def run(cells):
    """Outputs of every code cell, run one after the other in one new namespace."""
    namespace = {"__name__": "__main__"}
    return [_outputs("".join(cell["source"]), namespace) for cell in cells if cell["cell_type"] == "code"]


def texts(outputs):
    """What a cell says in text: its prints and its last expression; pictures are left out."""
    return "".join("".join(output.get("text", output.get("data", {}).get("text/plain", ""))) for output in outputs)


def differences(saved, found, relative=0.02):
    """Lines of two texts that differ: in words, or in a number by more than a share or its last digit."""
    left, right = saved.strip().splitlines(), found.strip().splitlines()
    if len(left) != len(right):
        return [f"{len(left)} lines are saved, {len(right)} found"]
    return [f"saved: {a}\nfound: {b}" for a, b in zip(left, right, strict=True) if not _alike(a, b, relative)]


def as_markdown(path):
    """A notebook with its saved outputs as a page."""
    parts = []
    for cell in json.loads(Path(path).read_text(encoding="utf-8"))["cells"]:
        source = "".join(cell["source"])
        parts.append(source if cell["cell_type"] == "markdown" else f"```python\n{source}\n```")
        parts += [_shown(output) for output in cell.get("outputs", ())]
    return "\n\n".join(parts) + "\n"


def write(path):
    """Run a notebook and save its outputs in it."""
    path = Path(path)
    notebook = json.loads(path.read_text(encoding="utf-8"))
    found = iter(run(notebook["cells"]))
    for number, cell in enumerate(notebook["cells"]):
        cell["id"] = f"cell{number}"
        if cell["cell_type"] == "code":
            cell |= {"outputs": next(found), "execution_count": None}
    path.write_text(json.dumps(notebook, indent=1, ensure_ascii=False, sort_keys=True) + "\n", encoding="utf-8")


def _outputs(source, namespace):
    """Outputs of one cell in the form of a notebook's file."""
    *body, last = ast.parse(source).body
    shown = isinstance(last, ast.Expr)
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(ast.Module(body if shown else [*body, last], []), "<cell>", "exec"), namespace)
        value = eval(compile(ast.Expression(last.value), "<cell>", "eval"), namespace) if shown else None
    result = []
    if printed.getvalue():
        result.append({"output_type": "stream", "name": "stdout", "text": printed.getvalue()})
    if value is not None:
        data = _data(value)
        result.append({"output_type": "display_data", "data": data, "metadata": {}})
    return result


def _data(value):
    """A value by the types that a notebook shows it in."""
    if hasattr(value, "savefig"):
        picture = io.BytesIO()
        value.savefig(picture, format="png", dpi=80, metadata={"Software": None})
        return {"image/png": base64.b64encode(picture.getvalue()).decode()}
    return {"text/plain": str(value) if hasattr(value, "to_string") else repr(value)}


def _shown(output):
    """One output as Markdown."""
    if "text" in output:
        return f"```text\n{''.join(output['text']).rstrip()}\n```"
    data = output["data"]
    if "image/png" in data:
        return f"![figure of this cell](data:image/png;base64,{data['image/png']})"
    return f"```text\n{''.join(data['text/plain']).rstrip()}\n```"


def _alike(left, right, relative):
    """Whether two lines have the same words, and numbers that differ by little."""
    if _words(left) != _words(right):
        return False
    pairs = zip(_NUMBER.findall(left), _NUMBER.findall(right), strict=True)
    return all(abs(float(a) - float(b)) <= max(relative * abs(float(a)), _last_digit(a)) for a, b in pairs)


def _words(line):
    """A line without its numbers and the spaces of its columns."""
    return _NUMBER.sub("#", line).split()


def _last_digit(number):
    """Size of the last digit that is written of a number, plus rounding."""
    mantissa, _, exponent = number.partition("e")
    return 1.001 * 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))


if __name__ == "__main__":
    write(sys.argv[1])
