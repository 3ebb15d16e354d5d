"""Tables of the end-to-end example: residuals of a robot's given, calibrated and corrected file on a new campaign."""

from rrru.store.schema import read_tables

TABLES = read_tables("""
model                  str    given: the robot's file as given; calibrated: its parameters calibrated on the
    diagnosed campaign; corrected: the file from this diagnosis {given, calibrated, corrected}

## circle | tables/circle.parquet | model
Residuals on a held-out campaign. MuJoCo simulates given and corrected; the calibrated model is evaluated at the
actuator positions.
--
model
diagnosed              str    campaign that was calibrated and diagnosed
fresh                  str    campaign on which the models are evaluated
effects                str    effects of the model in addition to the calibrated parameters, joined by +
points                 int    points of the fresh campaign
rms_mm                 float  measured minus modelled position, rms in space
max_mm                 float  the largest
noise_rms_mm           float  of the fresh campaign, rms in space
gap_rms_mm             float  rms with the noise subtracted

## circle_points | tables/circle_points.parquet | model run point
The same, point by point.
--
model
run                    int    number of the pass
trajectory             str    name of the path
point                  int    number of the point in its pass
error_{xyz}_mm         float  measured minus modelled position
error_mm               float  its length
""")
