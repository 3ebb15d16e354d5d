"""Tables of the whole circle: what a robot's file, its calibration and its corrected file leave of a fresh campaign."""

from rrru.store.schema import read_tables

TABLES = read_tables("""
model                  str    given: the robot's file as it came; calibrated: its numbers calibrated on the campaign
    that was diagnosed; corrected: the file that this diagnosis gave {given, calibrated, corrected}

## circle | tables/circle.parquet | model
What is left of a fresh campaign, which no model has seen. MuJoCo drives given and corrected; the calibrated model is
closed at the drives' values.
--
model
diagnosed              str    campaign that was calibrated and diagnosed
fresh                  str    campaign on which the models are tried
effects                str    what the model holds beside numbers of the calibration, joined by +
points                 int    points of the fresh campaign
rms_mm                 float  measured less modelled position, rms in space
max_mm                 float  the largest
noise_rms_mm           float  of the fresh campaign, rms in space
gap_rms_mm             float  rms without the noise

## circle_points | tables/circle_points.parquet | model run point
The same, point by point.
--
model
run                    int    number of the pass
trajectory             str    name of the path
point                  int    number of the point in its pass
error_{xyz}_mm         float  measured less modelled position
error_mm               float  its length
""")
