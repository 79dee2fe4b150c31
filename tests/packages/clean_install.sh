#!/bin/sh
# SPDX-License-Identifier: MIT
# Installs the packages of out/deb on a clean Debian 12, renders there, and removes them: nothing may stay but what the
# packages that they need have left. Needs root, Debian's archive, and 2 GB below build/.
# Usage: clean_install.sh SCENES | --check     --check prints why it cannot be done here, and ends with 1 then
set -eu
# shellcheck source=tests/packages/clean_root.sh
. "$(dirname "$0")/clean_root.sh"
if [ "$1" = --check ]; then
    can_make_root
    exit
fi
root=$(pwd)/build/deb-root
scenes=$1
in_root()
{
    chroot "$root" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root DEBIAN_FRONTEND=noninteractive "$@"
}
remove_all()
{
    in_root sh -c "dpkg-query -W -f '\${Package}\n' 'farlight*' 'libfarlight*' 'python3-farlight*' 2>/dev/null | xargs -r apt-get purge -y -q" >/dev/null
}
end_daemon()
{
    [ ! -e "$root/run/farlightd.pid" ] || kill "$(cat "$root/run/farlightd.pid")" 2>/dev/null || true
    rm -f "$root/run/farlightd.pid"
}
ended()
{
    end_daemon
    umount "$root/proc" 2>/dev/null || true
}
trap ended EXIT

make_root "$root"
mountpoint -q "$root/proc" || mount -t proc proc "$root/proc"
cp -f /etc/resolv.conf "$root/etc/resolv.conf"
in_root apt-get update -q
remove_all

# What they need first, so that all that is new afterwards is theirs.
rm -rf "$root/packages" && mkdir "$root/packages"
cp out/deb/*.deb "$root/packages"
rm -f "$root"/packages/*dbgsym*
needed=$(in_root sh -c 'apt-get install -s --no-install-recommends /packages/*.deb' | sed -n '/^Inst [^ ]*farlight/d; s/^Inst \([^ ]*\).*/\1/p')
# shellcheck disable=SC2086
[ -z "$needed" ] || in_root apt-get install -y -q --no-install-recommends $needed >/dev/null
listed()
{
    (cd "$root" && find . -xdev \( -path ./proc -o -path ./packages -o -path ./var/cache -o -path ./var/lib/apt -o -path ./var/log \
        -o -path ./var/lib/dpkg -o -path ./run -o -path ./tmp \) -prune -o -print | sort)
}
listed >build/deb-before.txt
in_root sh -c 'apt-get install -y -q --no-install-recommends /packages/*.deb' >/dev/null
for path in /usr/bin/farlightd /usr/bin/farlight /usr/bin/farlight-view /lib/systemd/system/farlightd.service /etc/farlight/farlightd.conf; do
    [ -e "$root$path" ] || fail "$path is not installed"
done
in_root getent passwd farlight >/dev/null || fail "the service has no user"

# As the service does it: its command, its user, its folders.
cp "$scenes/teapot.glb" "$root/tmp/"
command=$(sed -n 's/^ExecStart=//p' "$root/lib/systemd/system/farlightd.service")
in_root install -d -o farlight -g farlight /run/farlight /var/lib/farlight /var/cache/farlight
in_root sh -c "XDG_CACHE_HOME=/var/cache/farlight setsid setpriv --reuid=farlight --regid=farlight --init-groups $command >/run/farlightd.log 2>&1 & echo \$! >/run/farlightd.pid"
for _ in $(seq 600); do
    kill -0 "$(cat "$root/run/farlightd.pid")" 2>/dev/null || fail "the daemon does not start: $(cat "$root/run/farlightd.log")"
    ! in_root farlight ping --count 1 --server unix:/run/farlight/farlight.sock >/dev/null 2>&1 || break
    sleep 0.1
done
in_root farlight render /tmp/teapot.glb --server unix:/run/farlight/farlight.sock --size 64x48 --samples 1 -q -o /tmp/picture.png ||
    fail "no picture: $(cat "$root/run/farlightd.log")"
[ "$(head -c 4 "$root/tmp/picture.png" | tail -c 3)" = PNG ] || fail "the picture is none"
end_daemon

remove_all
listed >build/deb-after.txt
diff build/deb-before.txt build/deb-after.txt || fail "the packages leave files behind"
echo "installed, rendered and removed: $(find out/deb -name '*.deb' ! -name '*dbgsym*' | wc -l) packages"
