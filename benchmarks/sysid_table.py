"""The table of `benchmarks.sysid`, and what of it stands beside the other benchmarks."""

from benchmarks import harness
from rrru.store.schema import read_tables

TABLE = read_tables("""
## sysid | tables/sysid.parquet | robot by given
`mujoco.sysid` and the diagnosis on the same campaigns of arms that MuJoCo drives, from benchmarks/sysid.py.
--
robot                  int    seed that it was drawn with
cause                  str    what acts, beside zeros that are off {soft_servo, play}
by                     str    who {mujoco.sysid, rrru}
given                  str    structure that mujoco.sysid was told to fit; the diagnosis is told none
    {soft_servo, play, nothing}
answer                 str    verdict of the diagnosis with its probability; warnings of mujoco.sysid
numbers                int    numbers of the cause with a finite interval
held                   int    of these, true numbers within their 95 % interval
off_sigmas             float? deviation of the cause's number over its standard error; null without such a number
zeros                  int    zeros of drives with a finite interval
zeros_held             int    of these, true ones within it
left_mm                float  rms of what is left of the campaign
fresh_mm               float  rms of what is left of a fresh one
noise_mm               float  rms of the noise
points                 int    of the campaign
seconds                float  of this process and its threads
""")[0]


def beside(frame):
    """Rows of `benchmarks`: seconds of each for the same robots, where `mujoco.sysid` is told the right structure."""
    fitted = frame[(frame["by"] == "rrru") | (frame["given"] == frame["cause"])]
    rows = []
    for cause, own in fitted.groupby("cause"):
        ours, theirs = (own[own["by"] == by].set_index("robot")["seconds"] for by in (harness.OURS, "mujoco.sysid"))
        task = harness.Task("sysid", f"numbers of a MuJoCo arm, {cause}", int(own["points"].max()))
        told = "told the cause, fits numbers; rrru finds both"
        rows.append(task.row(harness.OURS, ours.median(), [1.0]))
        rows.append(task.row("mujoco.sysid", theirs.median(), (theirs / ours).to_numpy(), note=told))
    return rows
