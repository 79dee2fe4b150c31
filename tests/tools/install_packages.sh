#!/bin/sh
# SPDX-License-Identifier: MIT
# Installs the named Debian packages that are missing and says which, or says how to. With --check it installs nothing.
# Usage: install_packages.sh [--check] PACKAGE..
set -u
check=
if [ "${1:-}" = --check ]; then
    check=1
    shift
fi
if ! command -v dpkg-query >/dev/null 2>&1; then
    echo "not a Debian system: going on with what is there; it should have what these packages have: $*" >&2
    exit 0
fi
# Asked once for all of them: each question takes 40 ms.
installed=$(dpkg-query -W -f='${Package} ${db:Status-Status}\n' "$@" 2>/dev/null | sed -n 's/ installed$//p')
missing=
for package in "$@"; do
    case "
$installed
" in *"
$package
"*) ;; *) missing="$missing $package" ;; esac
done
[ -z "$missing" ] && exit 0
how="apt-get install --no-install-recommends$missing"
if [ -n "$check" ]; then
    echo "packages that are missing:$missing; to install them: $how" >&2
    exit 1
fi
if [ "$(id -u)" -eq 0 ]; then
    run=
elif command -v sudo >/dev/null 2>&1 && sudo -n true 2>/dev/null; then
    run="sudo -n"
else
    echo "packages that are missing:$missing; installing them needs root: $how" >&2
    exit 1
fi
echo "installing packages that are missing:$missing" >&2
export DEBIAN_FRONTEND=noninteractive
# shellcheck disable=SC2086
$run apt-get update -q >&2 &&
    $run apt-get install -q -y --no-install-recommends $missing >&2 || {
    echo "apt-get could not install:$missing" >&2
    exit 1
}
