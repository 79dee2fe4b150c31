# SPDX-License-Identifier: MIT
"""A Slurm of one node in a folder of its own: database, accounting, controller and node daemon without munge, for tests alone."""
import os
import pathlib
import pwd
import subprocess
import time

CONFIG = """ClusterName=farlight
SlurmctldHost={host}(127.0.0.1)
AuthType=auth/none
AuthInfo=cred_expire=10
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
SchedulerParameters=sched_interval=1
ReturnToService=2
AccountingStorageType=accounting_storage/slurmdbd
AccountingStorageHost=127.0.0.1
AccountingStoragePort={accounting_port}
AccountingStoreFlags=job_comment
NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} State=UNKNOWN
PartitionName=all Nodes={host} Default=YES State=UP
"""
ACCOUNTING_CONFIG = """AuthType=auth/none
DbdHost=localhost
DbdPort={accounting_port}
SlurmUser={user}
StorageType=accounting_storage/mysql
StorageUser={user}
StorageLoc=accounting
PidFile={folder}/slurmdbd.pid
"""
START_S = 60


class Slurm:
    def __init__(self, folder, port=16817):
        self.folder = pathlib.Path(folder)
        for name in ("state", "spool"):
            (self.folder / name).mkdir()
        # MariaDB lets in who has the name of an account, through its socket alone.
        self.user = pwd.getpwuid(os.geteuid()).pw_name
        values = {"host": os.uname().nodename, "user": self.user, "port": port, "node_port": port + 1, "accounting_port": port + 2,
                  "folder": self.folder, "cpus": os.cpu_count()}
        (self.folder / "slurm.conf").write_text(CONFIG.format(**values))
        accounting = self.folder / "slurmdbd.conf"
        accounting.touch(mode=0o600)
        accounting.write_text(ACCOUNTING_CONFIG.format(**values))
        self.environment = {**os.environ, "SLURM_CONF": str(self.folder / "slurm.conf"), "MYSQL_UNIX_PORT": str(self.folder / "database.sock"),
                            "PATH": f"{os.environ['PATH']}:/usr/sbin"}
        self.daemons = []

    def __enter__(self):
        try:
            self.start_database()
            self.start("slurmdbd", "-D")
            self.wait_for("root", "sacctmgr", "--noheader", "show", "account")
            self.start("slurmctld", "-D", "-c")
            self.start("slurmd", "-D")
            self.wait_for("idle", "sinfo", "--noheader", "--format=%t")
        except BaseException:
            self.stop()
            raise
        return self

    def __exit__(self, *_):
        self.ask("scancel", "--state=PENDING,RUNNING", f"--user={self.user}", check=False)
        self.stop()

    def start_database(self):
        data = ["--no-defaults", f"--datadir={self.folder}/database", f"--user={self.user}"]
        self.ask("mariadb-install-db", *data, f"--auth-root-socket-user={self.user}", "--skip-test-db")
        # Nothing of it has to survive a power cut.
        self.start("mariadbd", *data, f"--socket={self.folder}/database.sock", "--skip-networking", f"--pid-file={self.folder}/mariadbd.pid",
                   "--innodb-flush-log-at-trx-commit=0")
        self.wait_for("ready for connections", "cat", self.folder / "mariadbd.log")

    def start(self, program, *arguments):
        with open(self.folder / f"{program}.log", "wb") as log:
            self.daemons.append((program, subprocess.Popen([program, *arguments], env=self.environment, stdout=log, stderr=log)))

    def wait_for(self, words, *command):
        deadline = time.monotonic() + START_S
        while words not in self.ask(*command, check=False):
            ended = [program for program, daemon in self.daemons if daemon.poll() is not None]
            if ended or time.monotonic() > deadline:
                program = (ended or [self.daemons[-1][0]])[0]
                raise RuntimeError(f"{program} does not start: " + (self.folder / f"{program}.log").read_text()[-2000:])
            time.sleep(0.2)

    def stop(self):
        for _, daemon in reversed(self.daemons):
            daemon.terminate()
            daemon.wait()

    def ask(self, program, *arguments, check=True, **variables):
        return subprocess.run([program, *map(str, arguments)], env={**self.environment, **variables}, check=check,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True).stdout

    def submit(self, script, array, *arguments, **variables):
        """The number of the job; `variables` are of its environment."""
        answer = self.ask("sbatch", "--parsable", f"--chdir={self.folder}", f"--array={array}", "--gres=none", script, *arguments, **variables)
        return int(answer.split(";")[0])

    def queue(self):
        """The comments of the tasks that have not ended."""
        return self.ask("squeue", "--noheader", "--format=%k").splitlines()

    def accounts(self, job):
        """Each attempt of the job's tasks, the last one of each last: (task, state, comment)."""
        text = self.ask("sacct", "--allocations", "--duplicates", "--noheader", "--parsable2", f"--jobs={job}", "--format=JobID,State,Comment")
        lines = (line.split("|", 2) for line in text.splitlines())
        return [(int(number.split("_")[1]), state, comment) for number, state, comment in lines]
