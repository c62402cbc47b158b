# SPDX-License-Identifier: GPL-3.0-or-later
"""A real Slurm of two nodes on this machine: munged, slurmctld and two slurmd on loopback, in a folder of its own."""
import os
import shutil
import signal
import socket
import subprocess
import time
from pathlib import Path

CONFIGURATION = """ClusterName=patina
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={port}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket,cred_expire=5
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool.%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ReturnToService=2
SchedulerParameters=batch_sched_delay=0,sched_min_interval=0,bf_interval=1
KillWait=1
MinJobAge=300
JobRequeue=1
NodeName=one NodeHostname={host} NodeAddr=127.0.0.1 Port={one} CPUs=1 State=UNKNOWN
NodeName=two NodeHostname={host} NodeAddr=127.0.0.1 Port={two} CPUs=1 State=UNKNOWN
PartitionName=farm Nodes=one,two Default=YES MaxTime=INFINITE State=UP
"""


def missing() -> str:
    """Why there can be none; empty: there can."""
    lacking = [name for name in ("munged", "slurmctld", "slurmd", "sbatch") if not shutil.which(name, path=os.environ.get("PATH", "") + ":/usr/sbin")]
    if lacking:
        return f"Slurm is not installed: {', '.join(lacking)}"
    return "" if os.geteuid() == 0 else "Slurm's daemons are started as root"


def _ports(count: int) -> list:
    sockets = [socket.socket() for _ in range(count)]
    for each in sockets:
        each.bind(("127.0.0.1", 0))
    ports = [each.getsockname()[1] for each in sockets]
    for each in sockets:
        each.close()
    return ports


class Cluster:
    def __init__(self, folder: Path) -> None:
        self.folder, self.started = folder, []
        folder.chmod(0o755)
        (folder / "state").mkdir()
        (folder / "munge.key").write_bytes(os.urandom(1024))
        (folder / "munge.key").chmod(0o400)
        port, one, two = _ports(3)
        text = CONFIGURATION.format(host=socket.gethostname().split(".")[0], folder=folder, port=port, one=one, two=two, user="root")
        (folder / "slurm.conf").write_text(text, encoding="ascii")
        self.env = dict(os.environ, SLURM_CONF=str(folder / "slurm.conf"), PATH=os.environ.get("PATH", "") + ":/usr/sbin")
        self.daemon("munged", "--foreground", "--force", f"--key-file={folder}/munge.key", f"--socket={folder}/munge.socket",
                    f"--pid-file={folder}/munged.pid", f"--log-file={folder}/munged.log", f"--seed-file={folder}/munged.seed")
        self.wait(lambda: (folder / "munge.socket").exists(), "munged does not answer")
        self.daemon("slurmctld", "-D", "-c")
        self.nodes = {name: self.daemon("slurmd", "-D", "-N", name) for name in ("one", "two")}
        self.wait(lambda: self.ask("sinfo", "-h", "-t", "idle", "-o", "%D") == "2", "the nodes do not come up")

    def daemon(self, *command: str) -> subprocess.Popen:
        log = (self.folder / f"{command[0]}.out").open("ab")
        self.started.append(subprocess.Popen(command, stdout=log, stderr=log, env=self.env, start_new_session=True))
        return self.started[-1]

    def wait(self, done, what: str, seconds: float = 180) -> None:
        end = time.monotonic() + seconds
        while not done():
            logs = "\n".join(path.read_text(errors="replace")[-1500:] for path in self.folder.glob("*.log"))
            assert time.monotonic() < end, f"{what}: {self.ask('squeue') if (self.folder / 'slurmctld.log').exists() else ''}\n{logs}"
            time.sleep(0.2)

    def ask(self, *command: str) -> str:
        return subprocess.run(command, env=self.env, capture_output=True, text=True, check=False).stdout.strip()

    def tell(self, *command: str) -> None:
        subprocess.run(command, env=self.env, check=True, capture_output=True)

    def idle(self) -> None:
        self.wait(lambda: not self.ask("squeue", "-h"), "jobs do not end", 240)

    def close(self) -> None:
        self.ask("scancel", "--full", "-u", "root")
        for process in reversed(self.started):
            process.send_signal(signal.SIGTERM)
        for process in reversed(self.started):
            try:
                process.wait(5)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait(5)
