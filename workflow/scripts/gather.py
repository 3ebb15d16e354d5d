"""Tables of the whole study from the same tables of its parts."""

from rrru.store import tables
from rrru.store.job import run


def main(settings, inputs, outputs):
    """Write every table as the concatenation of its parts."""
    for name, output in outputs.items():
        parts = inputs[name]
        tables.gather([parts] if isinstance(parts, str) else parts, output)


if __name__ == "__main__":
    run(main, snakemake)
