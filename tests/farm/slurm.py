# SPDX-License-Identifier: MIT
"""A Slurm of one node in a folder of its own: controller and node daemon without munge, for tests alone."""
import os
import pathlib
import subprocess
import time

CONFIG = """ClusterName=farlight
SlurmctldHost={host}(127.0.0.1)
AuthType=auth/none
CredType=cred/none
SlurmUser={user}
SlurmdUser={user}
SlurmctldPort={port}
SlurmdPort={node_port}
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
SchedulerType=sched/builtin
SchedulerParameters=requeue_delay=1
ReturnToService=2
NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} State=UNKNOWN
PartitionName=all Nodes={host} Default=YES State=UP
"""
START_S = 60


class Slurm:
    def __init__(self, folder, port=16817):
        self.folder = pathlib.Path(folder)
        for name in ("state", "spool"):
            (self.folder / name).mkdir()
        config = self.folder / "slurm.conf"
        config.write_text(CONFIG.format(host=os.uname().nodename, user=os.environ.get("USER", "root"), port=port, node_port=port + 1,
                                        folder=self.folder, cpus=os.cpu_count()))
        self.environment = {**os.environ, "SLURM_CONF": str(config), "PATH": f"{os.environ['PATH']}:/usr/sbin"}
        self.daemons = []

    def __enter__(self):
        for program, *arguments in (["slurmctld", "-D", "-c"], ["slurmd", "-D"]):
            with open(self.folder / f"{program}.log", "wb") as log:
                self.daemons.append(subprocess.Popen([program, *arguments], env=self.environment, stdout=log, stderr=log))
        deadline = time.monotonic() + START_S
        while "idle" not in self.ask("sinfo", "--noheader", "--format=%t", check=False):
            if time.monotonic() > deadline or any(daemon.poll() is not None for daemon in self.daemons):
                raise RuntimeError("Slurm does not start: " + (self.folder / "slurmctld.log").read_text()[-2000:])
            time.sleep(0.2)
        return self

    def __exit__(self, *_):
        self.ask("scancel", "--state=PENDING,RUNNING", f"--user={os.environ.get('USER', 'root')}", check=False)
        for daemon in reversed(self.daemons):
            daemon.terminate()
            daemon.wait()

    def ask(self, program, *arguments, check=True, **variables):
        return subprocess.run([program, *map(str, arguments)], env={**self.environment, **variables}, check=check,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True).stdout

    def submit(self, script, array, *arguments, **variables):
        """The number of the job; `variables` are of its environment."""
        answer = self.ask("sbatch", "--parsable", f"--chdir={self.folder}", f"--array={array}", script, *arguments, **variables)
        return int(answer.split(";")[0])

    def is_busy(self):
        return bool(self.ask("squeue", "--noheader").strip())

    def comments(self, job):
        """Of its tasks: what was told last."""
        text = self.ask("scontrol", "show", "job", job, check=False)
        return [line.split("=", 1)[1] for line in text.splitlines() if line.strip().startswith("Comment=")]
