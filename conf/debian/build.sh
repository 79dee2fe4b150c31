#!/bin/sh
# SPDX-License-Identifier: MIT
# Builds Debian packages of what is committed into FOLDER. Usage: build.sh FOLDER VERSION EPOCH BUILD-PACKAGE...
# EPOCH is the time that all files in the packages have; the same commit gives the same bytes, wherever FOLDER is.
set -eu
folder=$1 version=$2 epoch=$3
shift 3
tree=$folder/farlight-$version
rm -rf "$folder" && mkdir -p "$tree"
git archive HEAD | tar -x -C "$tree"
conf/debian/prepare.sh "$tree" "$version" "$(date -uRd "@$epoch")" "$@"
cd "$tree" && SOURCE_DATE_EPOCH=$epoch dpkg-buildpackage -b -us -uc
