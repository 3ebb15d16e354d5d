"""A Slurm of one node in a folder, of Debian's packages slurm-wlm and munge: nothing of the machine's own is touched.

Each daemon is started by hand in the foreground and ended by its own process.
"""

import contextlib
import getpass
import os
import shutil
import socket
import subprocess
import time

_DAEMONS = ("munged", "slurmctld", "slurmd")
_COMMANDS = ("sbatch", "srun", "squeue", "scancel", "scontrol", "sinfo")
# nothing is charged to accounts, a job ends with all its process group, and stays in the list
_CONF = """\
ClusterName=one
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller_port}
SlurmdPort={node_port}
CommunicationParameters=NoInAddrAny,NoCtldInAddrAny
AuthInfo=socket={folder}/munge.socket
SlurmUser={user}
SlurmdUser={user}
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
ProctrackType=proctrack/pgid
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
MinJobAge=600
NodeName={host} NodeAddr=127.0.0.1 CPUs={cores} RealMemory={memory_mb}
PartitionName=main Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""
_PATIENCE_S = 60.0


def missing():
    """Programs that have to be installed and are not."""
    return [name for name in (*_DAEMONS, *_COMMANDS) if not _place(name)]


@contextlib.contextmanager
def cluster(folder):
    """Environment in which Slurm's commands reach a cluster of this machine's cores, which ends with the block."""
    conf = _files(folder)
    environment = os.environ | {"PATH": f"{folder / 'bin'}{os.pathsep}{os.environ['PATH']}"}
    with contextlib.ExitStack() as running:
        running.enter_context(_daemon(folder, *_munged(folder)))
        _until((folder / "munge.socket").exists, folder)
        for name in ("slurmctld", "slurmd"):
            running.enter_context(_daemon(folder, name, "-D", "-f", str(conf)))
        _until(lambda: "idle" in said(environment, "sinfo", "--noheader", "--format", "%T"), folder)
        # without it they would outlive the node
        running.callback(_end_jobs, environment, folder)
        yield environment


def said(environment, *command):
    """What one of Slurm's commands prints."""
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False).stdout


def left_over(folder):
    """Commands of running processes that name the folder: of a cluster that has ended there are none."""
    commands = subprocess.run(["ps", "-eo", "args"], capture_output=True, text=True, check=True).stdout.splitlines()
    return [command for command in commands if str(folder) in command]


def _place(name):
    """Path of an installed program, None where there is none; daemons are not on everybody's path."""
    return shutil.which(name, path=os.pathsep.join((os.environ["PATH"], "/usr/sbin", "/sbin")))


def _files(folder):
    """Path of the configuration, written with the key and commands that know where it is."""
    for name in ("state", "spool", "bin"):
        (folder / name).mkdir(parents=True)
    key, conf = folder / "munge.key", folder / "slurm.conf"
    key.write_bytes(os.urandom(128))
    key.chmod(0o600)
    controller_port, node_port = _free_ports(2)
    text = _CONF.format(
        folder=folder,
        host=socket.gethostname().partition(".")[0],
        user=getpass.getuser(),
        controller_port=controller_port,
        node_port=node_port,
        cores=os.cpu_count(),
        memory_mb=os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2**20,
    )
    conf.write_text(text)
    # a variable would not do: the executor hides those of Slurm from the jobs
    for name in _COMMANDS:
        file = folder / "bin" / name
        file.write_text(f'#!/bin/sh\nSLURM_CONF={conf} exec {_place(name)} "$@"\n')
        file.chmod(0o755)
    return conf


def _munged(folder):
    """Command of the daemon that signs messages, all its files in the folder."""
    kinds = ("key-file", "socket", "pid-file", "log-file", "seed-file")
    # as root it wants to be forced
    return ("munged", "--foreground", "--force", *(f"--{k}={folder}/munge.{k.removesuffix('-file')}" for k in kinds))


def _free_ports(count):
    """Numbers of unused ports."""
    with contextlib.ExitStack() as held:
        sockets = [held.enter_context(socket.socket()) for _ in range(count)]
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return [one.getsockname()[1] for one in sockets]


@contextlib.contextmanager
def _daemon(folder, name, *options):
    """A daemon that is asked to end at the end, and killed where it does not."""
    with (folder / f"{name}.out").open("w") as log:
        process = subprocess.Popen([_place(name), *options], stdout=log, stderr=subprocess.STDOUT)
        try:
            yield
        finally:
            process.terminate()
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def _end_jobs(environment, folder):
    """Cancel all jobs and wait until they are gone."""
    waiting = ("squeue", "--noheader", "--format", "%i")
    said(environment, "scancel", *said(environment, *waiting).split())
    _until(lambda: not said(environment, *waiting).split(), folder)


def _until(true, folder):
    """Wait for something; raises RuntimeError with the daemons' output where it does not come."""
    end = time.monotonic() + _PATIENCE_S
    while not true():
        if time.monotonic() > end:
            logs = "\n".join(f"{file.name}:\n{file.read_text()[-2000:]}" for file in folder.glob("*.out"))
            raise RuntimeError(f"nothing came of Slurm within {_PATIENCE_S:g} s\n{logs}")
        time.sleep(0.2)
