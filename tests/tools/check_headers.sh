#!/bin/sh
# SPDX-License-Identifier: MIT
# Every header compiles alone. Usage: check_headers.sh CC INCLUDE_FLAGS..
set -u
failed=0
count=0
for header in $(find protocol server shaders client -name '*.h' | sort); do
    count=$((count + 1))
    "$@" -std=c17 -D_GNU_SOURCE -fsyntax-only -Wall -Wextra -x c "$header" 2>/tmp/header.$$ || {
        echo "$header does not compile alone:"
        head -3 /tmp/header.$$
        failed=$((failed + 1))
    }
done
rm -f /tmp/header.$$
echo "headers compiled alone: $count, failed: $failed"
[ "$failed" -eq 0 ]
