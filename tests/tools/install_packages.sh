#!/bin/sh
# SPDX-License-Identifier: MIT
# Installs the named Debian packages that are missing, or says how to. Usage: install_packages.sh PACKAGE..
set -u
missing=
for package in "$@"; do
    dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null | grep -qx installed || missing="$missing $package"
done
[ -z "$missing" ] && exit 0
echo "packages to install:$missing" >&2
if [ "$(id -u)" -eq 0 ]; then
    run=
elif command -v sudo >/dev/null 2>&1 && sudo -n true 2>/dev/null; then
    run="sudo -n"
else
    echo "this needs root; run: apt-get install --no-install-recommends$missing" >&2
    exit 1
fi
export DEBIAN_FRONTEND=noninteractive
# shellcheck disable=SC2086
$run apt-get update -q >&2 &&
    $run apt-get install -q -y --no-install-recommends $missing >&2 || {
    echo "apt-get could not install:$missing" >&2
    exit 1
}
