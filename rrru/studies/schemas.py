"""Tables that every study of a paper has a part of."""

from rrru.store.schema import read_tables

TABLES = read_tables("""
paper                  str    A: 3-RRRU; B: 3-PTT; C: Delta {A, B, C}

## published | tables/published.parquet | paper item source
Every number that the papers print, beside what this study gives.
--
paper
item                   str    what the number is
source                 str    table, figure, section or sentence of the paper
unit                   str    unit as printed
published              float  printed number
here                   float? this study's number; null where it has none
ratio                  float? here / published; null where either is null or zero
here_low               float? lower end of the middle 90 % over other draws of wobble and noise; null where nothing is
    drawn
here_high              float? upper end
note                   str    what differs, and why

## audit | tables/audit.parquet | paper where check
Misprints, contradictions and claims of the papers, each recomputed, and what the scans of papers B and C have lost.
--
paper
where                  str    place in the paper
printed                str    what stands there
right                  str    what should
kind                   str    computed here, compared as printed, or lost in the scan {computed, as printed, lost}
check                  str    what is computed to show it
unit                   str    unit of the two values
value_printed          float? what the printed form gives; null where it gives nothing
value_right            float? what the right form or the independent check gives; null where it gives nothing
shown                  bool   true where the misprint or contradiction shows; false where a claim holds, and for what
    is lost
""")
