"""Examples of docstrings as blocks of code, for `make docs`."""

import re

from griffe import Extension

_EXAMPLE = re.compile(r"(?:^>>>.*\n?(?:^(?!\s*$).*\n?)*)+", re.MULTILINE)


class Examples(Extension):
    """Doctests of a docstring as blocks of Python."""

    def on_object(self, *, obj, **_more):
        """Fence the doctests of an object's docstring."""
        if obj.docstring:
            obj.docstring.value = _EXAMPLE.sub(
                lambda found: f"```python\n{found[0].rstrip()}\n```\n", obj.docstring.value
            )
