#!/bin/sh
# SPDX-License-Identifier: MIT
# Makes the folder debian/ of a source tree from conf/debian. Usage: prepare.sh TREE VERSION DATE BUILD-PACKAGE...
set -eu
tree=$1 version=$2 date=$3
shift 3
debian=$tree/debian
cp -r "$tree/conf/debian" "$debian"
rm "$debian/prepare.sh" "$debian/build.sh"
cp "$tree/conf/sysusers.conf" "$debian/farlightd.sysusers"
sed -i "s/@BUILD_PACKAGES@/$(echo "$*" | sed 's/ /, /g')/" "$debian/control"
# The licence's text without its title and names, as Debian's format wants it.
sed -n '5,$p' "$tree/LICENSE" | sed 's/^$/./; s/^/ /' >"$debian/licence"
sed -i -e "/@LICENSE@/{r $debian/licence" -e 'd;}' "$debian/copyright"
rm "$debian/licence"
printf 'farlight (%s) unstable; urgency=medium\n\n  * See changes.md in the package farlight-doc.\n\n -- The farlight authors <maintainers@farlight.example>  %s\n' \
    "$version" "$date" >"$debian/changelog"
