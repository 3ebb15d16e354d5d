"""Tables with rows of every study of a paper."""

from rrru.store.schema import read_tables

TABLES = read_tables("""
paper                  str    A: 3-RRRU; B: 3-PTT; C: Delta {A, B, C}

## published | tables/published.parquet | paper item source
Every number that the papers print, compared with this study.
--
paper
item                   str    what the number is
source                 str    table, figure, section or sentence of the paper
unit                   str    unit as printed
published              float  printed number
here                   float? this study's number; null where it has none. Of paper A's sweeps it is that of the seed
    nearest to the printed curve
ratio                  float? here / published; null where either is null or zero
here_median            float? median over other draws of non-repeatability and noise, of sweeps over seeds; null
    without draws
here_low               float? lower end of the middle 90 % over the same draws or seeds
here_high              float? upper end
inside                 str    where the printed number is against these 90 % {inside, below, above, no draws}
note                   str    what differs, and why

## audit | tables/audit.parquet | paper where check
Misprints, contradictions and claims of the papers, each recomputed, and what the scans of papers B and C have lost.
--
paper
where                  str    place in the paper
printed                str    printed text
right                  str    correct text
kind                   str    computed here, compared as printed, or lost in the scan {computed, as printed, lost}
check                  str    computation that shows it
unit                   str    unit of the two values
value_printed          float? value of the printed form; null where it has none
value_right            float? value of the correct form or of the independent check; null where it has none
shown                  bool   true where the misprint or contradiction is confirmed; false where a claim holds, and
    for lost parts
""")
