# SPDX-License-Identifier: MIT
"""A systemd of the tests' own: process 1 of new namespaces, over a copy-on-write view of this machine's files, with no
units but those of a bare system. Nothing outside is written to but a control group, which goes with it."""
import contextlib
import os
import pathlib
import shutil
import signal
import subprocess
import tempfile
import time

SYSTEMD = pathlib.Path("/lib/systemd/systemd")
BOOT_TIMEOUT_S = 120
PATH = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"

# Joins the control group and goes into namespaces of its own; ends with whoever started it, and all that is inside with it.
ENTER = """
set -e
echo $$ >"$2/cgroup.procs"
exec setpriv --pdeathsig KILL unshare --mount --pid --cgroup --uts --ipc --net --fork --kill-child sh -c "$0" sh "$1"
"""

# The root: "$1" is an empty folder. A console that is no terminal and no device but those of memory.
BOOT = """
set -e
mount -t tmpfs -o mode=755 tmpfs "$1"
mkdir "$1/upper" "$1/work" "$1/root"
mount -t overlay -o "lowerdir=/,upperdir=$1/upper,workdir=$1/work" overlay "$1/root"
cd "$1/root"
mount -t proc proc proc
mount --bind proc/sys proc/sys
mount -o remount,bind,ro proc/sys
mount -t sysfs -o ro sysfs sys
mount -t cgroup2 cgroup2 sys/fs/cgroup
mount -t tmpfs -o mode=755 tmpfs dev
set -- null 3 zero 5 full 7 random 8 urandom 9
while [ $# -gt 0 ]; do mknod -m 666 "dev/$1" c 1 "$2"; shift 2; done
mkdir dev/shm
for folder in dev/shm tmp; do mount -t tmpfs -o mode=1777 tmpfs "$folder"; done
for folder in run var/log home etc/systemd/system; do mkdir -p "$folder"; mount -t tmpfs -o mode=755 tmpfs "$folder"; done
mkdir -p run/units
for unit in basic multi-user network shutdown sockets sysinit umount; do
    printf '[Unit]\\nDescription=%s\\nDefaultDependencies=no\\n' "$unit" >"run/units/$unit.target"
done
for unit in .service .socket -dev-log.socket; do ln -s "/lib/systemd/system/systemd-journald$unit" run/units; done
printf '[Unit]\\nWants=systemd-journald.service\\nAllowIsolate=yes\\n' >run/units/bare.target
mkdir run/outside
pivot_root . run/outside
umount -l /run/outside
exec env -i container=other PATH="$PATH" SYSTEMD_UNIT_PATH=/etc/systemd/system:/run/units:/usr/local/lib/systemd/system \\
    /lib/systemd/systemd --system --unit=bare.target --log-target=journal --show-status=0 </dev/null >/dev/null
"""


class CannotBoot(Exception):
    """Why there is no systemd."""


def new_control_group():
    """A folder below our own group of the unified hierarchy."""
    mounts = [line.split() for line in pathlib.Path("/proc/self/mounts").read_text().splitlines()]
    roots = [fields[1] for fields in mounts if fields[2] == "cgroup2"]
    groups = [line.split("::")[1] for line in pathlib.Path("/proc/self/cgroup").read_text().splitlines()
              if line.startswith("0::")]
    if not roots or not groups:
        raise CannotBoot("no unified control groups")
    try:
        return pathlib.Path(tempfile.mkdtemp(prefix="farlight-", dir=roots[0] + groups[0]))
    except OSError as error:
        raise CannotBoot(f"no control group of its own: {error.strerror}") from error


class SystemdRoot:
    """A context manager. CannotBoot: this machine does not let us."""

    def __init__(self):
        if os.geteuid() != 0:
            raise CannotBoot("not root")
        if not SYSTEMD.is_file() or not all(map(shutil.which, ("unshare", "nsenter", "setpriv"))):
            raise CannotBoot("systemd or util-linux is not installed")
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="farlight-systemd-"))
        self.process = self.group = None
        self.pid = 0

    def __enter__(self):
        try:
            self.group = new_control_group()
            with open(self.folder / "log", "w") as log:
                root = self.folder / "root"
                root.mkdir()
                self.process = subprocess.Popen(["sh", "-c", ENTER, BOOT, root, self.group], stdin=subprocess.DEVNULL,
                                                stdout=log, stderr=log, env={"PATH": PATH})
            self.wait_until_up()
        except BaseException:
            self.__exit__()
            raise
        return self

    def wait_until_up(self):
        end = time.monotonic() + BOOT_TIMEOUT_S
        while time.monotonic() < end and self.process.poll() is None:
            if self.is_systemd() and self.run("systemctl", "is-active", "bare.target").stdout == "active\n":
                return
            time.sleep(0.1)
        raise CannotBoot("systemd does not start: " + (self.folder / "log").read_text().strip())

    def is_systemd(self):
        """Whether process 1 is there and has become what it is to be."""
        try:
            children = pathlib.Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split()
            self.pid = int(children[0]) if children else 0
            return self.pid != 0 and pathlib.Path(f"/proc/{self.pid}/comm").read_text() == "systemd\n"
        except OSError:
            return False

    def run(self, *command, user="root", timeout=60, **options):
        """Runs a command inside, to its end."""
        return subprocess.run(self.inside(*command, user=user), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                              check=False, timeout=timeout, **options)

    def inside(self, *command, user="root"):
        """The command line that runs another one inside."""
        who = ["setpriv", f"--reuid={user}", f"--regid={user}", "--init-groups"] if user != "root" else []
        return ["nsenter", f"--target={self.pid}", "--mount", "--pid", "--cgroup", "--uts", "--ipc", "--net", "--", "env",
                "-i", f"PATH={PATH}", "LANG=C", "HOME=/tmp", *who, *map(str, command)]

    def path(self, inside):
        """Where a file of the root is for us."""
        return pathlib.Path(f"/proc/{self.pid}/root{inside}")

    def __exit__(self, *_):
        if self.process:
            if self.pid and self.process.poll() is None:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(self.pid, signal.SIGKILL)  # process 1: the kernel ends all others, and then this is reaped
            else:
                self.process.kill()
            self.process.wait()
        if self.group:
            self.remove_control_groups()
        shutil.rmtree(self.folder, ignore_errors=True)

    def remove_control_groups(self):
        """From the leaves; a group is busy for a moment after its last process."""
        for folder in sorted(self.group.rglob("*/"), reverse=True) + [self.group]:
            for _ in range(50):
                try:
                    folder.rmdir()
                    break
                except OSError:
                    time.sleep(0.1)
