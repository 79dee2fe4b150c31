# shellcheck shell=sh
# SPDX-License-Identifier: MIT
# Sourced by the tests of the packages: a clean Debian 12 in a folder.
suite=bookworm
# The archive that this host uses.
mirror=$(sed -n 's/^deb \(\[[^]]*\] \)\?\([^ ]*\) .*/\2/p; s/^URIs: \([^ ]*\).*/\1/p' /etc/apt/sources.list /etc/apt/sources.list.d/* 2>/dev/null | head -1)
mirror=${mirror:-http://deb.debian.org/debian}
fail()
{
    echo "${0##*/}: $*" >&2
    exit 1
}
# Prints why none can be made here, and fails then.
can_make_root()
{
    if [ "$(id -u)" -ne 0 ]; then
        echo "it needs root"
    elif ! chroot / true 2>/dev/null; then
        echo "chroot is not allowed here"
    else
        probe=$(mktemp -d)
        reached=1
        timeout 60 /usr/lib/apt/apt-helper download-file "$mirror/dists/$suite/Release" "$probe/Release" >/dev/null 2>&1 || reached=
        rm -r "$probe"
        [ -z "$reached" ] || return 0
        echo "$mirror cannot be reached"
    fi
    return 1
}
# Makes one in folder $1, if it is not there yet. It asks for packages as this host does.
make_root()
{
    [ -x "$1/usr/bin/apt-get" ] || debootstrap --variant=minbase "$suite" "$1" "$mirror"
    # Nothing of it has to survive a power cut.
    echo force-unsafe-io >"$1/etc/dpkg/dpkg.cfg.d/unsafe-io"
    cp -rf /etc/apt/apt.conf.d/. "$1/etc/apt/apt.conf.d/"
}
