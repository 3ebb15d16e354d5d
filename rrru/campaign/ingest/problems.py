"""Errors of a measurement file, collected until every check is done."""

from collections import defaultdict

from rrru.errors import IngestError

LISTED = 20
_LENGTH = 500


class Problems:
    """Problems of one file by kind; each kind lists the first 20 and counts all."""

    def __init__(self, file):
        self._file = str(file)
        self._by_kind = defaultdict(list)
        self._elsewhere = {}

    def __bool__(self):
        return bool(self._by_kind)

    def add(self, kind, *, value, allowed, row=None, column=None):
        """Note a problem: the row's number as an editor shows it or None, the file's column or None, its value there,
        what is allowed.
        """
        texts = {
            "column": None if column is None else _short(column),
            "value": _short(value),
            "allowed": _short(allowed),
        }
        file, row = self._file, None if row is None else int(row)
        if column is not None and column.partition(", ")[0] in self._elsewhere:
            file, rows = self._elsewhere[column.partition(", ")[0]]
            row = rows.get(row)
        self._by_kind[kind].append({"file": file, "row": row, **texts})

    def elsewhere(self, file, columns, rows):
        """Columns stand in another file, whose rows are given by those of this one."""
        self._elsewhere |= dict.fromkeys(columns, (str(file), rows))

    def refuse(self):
        """Raise IngestError if there is any problem."""
        listed = []
        for problems in self._by_kind.values():
            listed += problems[:LISTED]
            if len(problems) > LISTED:
                more = f"{len(problems)} problems of this kind, of which the first {LISTED} are listed"
                listed.append(problems[0] | {"row": None, "column": None, "value": more})
        if listed:
            raise IngestError(listed)

    def refuse_now(self, **problem):
        """Raise IngestError for a problem that leaves nothing more to look at."""
        self.add("file", **problem)
        self.refuse()


def _short(text):
    """Text that fits into a message; a broken file can make one cell of everything below it."""
    return text if len(text) <= _LENGTH else f"{text[:_LENGTH]}... ({len(text)} characters)"
