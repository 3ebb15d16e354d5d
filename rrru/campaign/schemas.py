"""Tables of the campaigns."""

from collections.abc import Container
from dataclasses import replace

from rrru.campaign.measurements import ON_PLATFORM, ON_WORLD
from rrru.campaign.stated_motion import BETWEEN, KINDS
from rrru.kinematics.robot import Robot
from rrru.store.schema import Column, Table, read_tables

TABLES = read_tables("""
run                    int    number of the pass, from 1 in the order driven
trajectory             str    name of the trajectory
point                  int    number of the point in its run, from 1
time_s                 float? time since the campaign's start; null where the file has none
command_{xyz}_mm       float  commanded position, robot frame
measured_{xyz}_mm      float? measured position, robot frame; null where the point was not measured
speed_mm_s             float? speed of the run; null where the file has none
payload_kg             float? payload on the platform; null where the file has none
status                 str    the table has every point; outlier, stale (equal to an earlier reading in every digit),
    unsolved and held_out (of a held-out test) are left out of fits, near_singularity only with use_near_singularity:
    false {ok, outlier, stale, near_singularity, unsolved, held_out}
campaign               str    name of the campaign in the configuration

## measurements | campaigns/{campaign}/measurements.parquet | run point
One row per commanded point: the command and the reading of the instrument. After the commanded position follow the
robot's own columns of commanded actuator values, here those of the 3-RRRU. Where orientations were measured, there are
command_rx_rad and measured_rx_rad (rotation vectors, null where none was measured). Where reflectors were measured,
there are target, the reflector's name, and target_x_mm, its nominal place on the platform, or in the robot's frame
where target_on says that it is fixed to the world. Where the file has them, there are noise_x_mm, the reading's
standard deviation, and temperature_c. Where the configuration states how the robot moved, there are motion and
motion_between.
--
run trajectory point time_s command_{xyz}_mm
theta1_rad             float  commanded drive angle of leg 1; 3-PTT: slider1_mm
theta2_rad             float  commanded drive angle of leg 2; 3-PTT: slider2_mm
theta3_rad             float  commanded drive angle of leg 3; 3-PTT: slider3_mm
measured_{xyz}_mm speed_mm_s payload_kg status

## truth | campaigns/{campaign}/truth.parquet | run point
Ground truth of the virtual robot, one row per commanded point.
--
run                    int    as in measurements
trajectory             str    as in measurements
point                  int    as in measurements
true_{xyz}_mm          float? true position, non-repeatability included; null where the chains do not close
platform_rotation_rad  float? angle in space by which the platform is turned from its nominal orientation; null where
    the chains do not close

## singularity | tables/singularity.parquet | campaign run point
Distance of every commanded point from both kinds of singularity (smallest singular value of three unit rows: 0 at it,
1 at best).
--
campaign
run                    int    as in measurements
trajectory             str    as in measurements
point                  int    as in measurements
translational_measure  float  0 where the platform can move with locked drives; of own robots the smallest over the
    largest singular value of the position Jacobian, angles times the characteristic length: 0 where the drives cannot
    move the point in some direction
constraint_measure     float  0 at a constraint singularity, where the platform can move with locked drives: a 3-RRRU
    can turn there. The translational measure does not show it
constraint_determinant float  changes its sign across a constraint singularity; positive for own robots of chains
status                 str    as in measurements {ok, outlier, stale, near_singularity, unsolved, held_out}

## workspace | campaigns/{campaign}/workspace.parquet | slice x_mm y_mm z_mm
Regular grid over two slices of the workspace: xz at y = 0, xy through the middle of the commanded points;
where the robot reaches nothing at y = 0, also xz through that middle. No rows for robots that orient their tool: what
they reach depends on its orientation.
--
campaign
slice                  str    plane {xz, xy}
x_mm                   float  grid point, x, robot frame
y_mm                   float  grid point, y, robot frame
z_mm                   float  grid point, z, robot frame
reachable              bool   true where the robot reaches the point
translational_measure  float? as in singularity; null out of reach
constraint_measure     float? as in singularity; null out of reach
constraint_determinant float? as in singularity; null out of reach

## registration | tables/registration.parquet | campaign number
The rigid motion from the instrument's frame to the robot's that `frame: register` found, robot = R instrument + t: its
translation t and the rotation vector of R. The calibration fits the remaining motion, as world_ numbers of
`parameters` or those that replace them in `gauge`. No rows where the frame was the robot's.
--
campaign
number                 str    translation_x, .. rotation_x, ..
unit                   str    {mm, rad}
value                  float  of the number
random_95              float? half width of the 95 % interval that random errors of the size left at the points would
    give; null for three points. The robot's own errors, which the calibration fits, move the numbers further
points                 int    points that the motion was found from

## campaigns | tables/campaigns.parquet | campaign
One row per campaign: where it came from and what state it is in.
--
campaign
robot                  str    mechanism
z_down                 bool   true where z of the robot's frame points to the ground
source                 str    virtual robot or file
points                 int    commanded points
runs                   int    passes
ok                     int    points with status ok
outlier                int    points with status outlier
stale                  int    points with status stale
near_singularity       int    points with status near_singularity
unsolved               int    points with status unsolved
noise_mm               float  measuring noise per axis, 1 sigma
noise_rad              float? noise of measured orientations per axis, 1 sigma; null where none was measured
noise_from             str    of noise_mm, given: by the configuration; readings: median of what the file states of each
    reading; repeats: pooled over repeated points; high_frequency: from the residuals along the path of a fit of all
    points, which has the robot's systematic errors in it where the poses follow no path {given, readings, repeats,
    high_frequency}
noise_rad_from         str    of noise_rad, given: by the configuration; high_frequency: as that of positions; empty
    where no orientation was measured
platform_mass_kg       float? the real robot's platform, as given; null where it was not
registration_rms_mm    float? rms of the distance in space from the commanded points after the frame registration,
    before any calibration: errors of the robot's geometry are in it; null where the frame was the robot's
registration_max_mm    float? largest distance of a point after the frame registration
min_translational_measure float  nearest approach to a translational singularity
min_constraint_measure float  nearest approach to a constraint singularity
notes                  str    what was computed or missing on ingest; empty where nothing was
""")


# columns of `measurements`, by axis, that a campaign has where more than the tool's position was read: the column that
# they follow, their name and their description
_BY_AXIS = (
    ("command_z_mm", "command_r{}_rad", "commanded orientation, rotation vector, robot frame"),
    ("measured_z_mm", "measured_r{}_rad", "measured orientation, rotation vector, robot frame"),
    ("measured_z_mm", "noise_{}_mm", "standard deviation of the reading along the instrument's axis"),
    ("measured_z_mm", "target_{}_mm", "nominal place of the reflector on the platform"),
)
# further such columns, which follow measured_z_mm
_BY_ROW = (
    Column("temperature_c", "float64", "temperature of the robot, degrees Celsius", True),
    Column("target", "str", "name of the reflector that was measured"),
    Column("target_on", "str", "what the reflector is fixed to", False, (ON_PLATFORM, ON_WORLD)),
    Column("motion", "str", "how the robot moved between the rows", False, KINDS),
    Column("motion_between", "str", "what is straight from stop to stop", False, BETWEEN),
)


def measurement_table(robot: Robot, names: Container[str] = ()) -> Table:
    """The table `measurements` of a robot: with its own columns of actuator values in place of those of the 3-RRRU.

    names: of the optional columns that it has in addition.
    """
    table = next(table for table in TABLES if table.name == "measurements")
    first, last = table.names.index("theta1_rad"), table.names.index("theta3_rad") + 1
    drives = robot.parts.drives
    values = [Column(drive.column, "float64", f"commanded actuator value {drive.column}") for drive in drives]
    columns = [*table.columns[:first], *values, *table.columns[last:]]
    optional: dict[str, list[Column]] = {after: [] for after, *_ in _BY_AXIS}
    for after, name, text in _BY_AXIS:
        nullable = not name.startswith("target")
        optional[after] += [Column(name.format(axis), "float64", f"{text}, {axis}", nullable) for axis in "xyz"]
    optional["measured_z_mm"] += _BY_ROW
    for after, added in optional.items():
        at = [column.name for column in columns].index(after) + 1
        columns[at:at] = [column for column in added if column.name in names]
    return replace(table, columns=tuple(columns))
