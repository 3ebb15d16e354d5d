"""The table of `benchmarks.sysid`, and its rows in the table of all benchmarks."""

from benchmarks import harness
from rrru.store.schema import read_tables

TABLE = read_tables("""
## sysid | tables/sysid.parquet | robot by given
`mujoco.sysid` and the diagnosis on the same campaigns of arms simulated by MuJoCo, from benchmarks/sysid.py.
--
robot                  int    seed that it was drawn with
cause                  str    acting cause, in addition to zero offsets {soft_servo, play}
by                     str    method {mujoco.sysid, rrru}
given                  str    structure fitted by mujoco.sysid; the diagnosis has none
    {soft_servo, play, nothing}
answer                 str    verdict of the diagnosis with its probability; warnings of mujoco.sysid
numbers                int    numbers of the cause with a finite interval
held                   int    of these, true numbers inside their 95 % interval
off_sigmas             float? deviation of the cause's number over its standard error; null without such a number
zeros                  int    zeros of drives with a finite interval
zeros_held             int    of these, true ones within it
left_mm                float  residual rms on the campaign
fresh_mm               float  residual rms on a new campaign
noise_mm               float  rms of the noise
points                 int    of the campaign
seconds                float  of this process and its threads
""")[0]


def timing_rows(frame):
    """Rows of `benchmarks`: seconds of both for the same robots, `mujoco.sysid` with the correct structure."""
    fitted = frame[(frame["by"] == "rrru") | (frame["given"] == frame["cause"])]
    rows = []
    for cause, runs in fitted.groupby("cause"):
        ours, theirs = (runs[runs["by"] == by].set_index("robot")["seconds"] for by in (harness.OURS, "mujoco.sysid"))
        task = harness.Task("sysid", f"numbers of a MuJoCo arm, {cause}", int(runs["points"].max()))
        note = "cause given, fits parameters; rrru finds both"
        rows.append(task.row(harness.OURS, ours.median(), [1.0]))
        rows.append(task.row("mujoco.sysid", theirs.median(), (theirs / ours).to_numpy(), note=note))
    return rows
