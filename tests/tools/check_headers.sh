#!/bin/sh
# SPDX-License-Identifier: MIT
# Every header compiles alone. Usage: check_headers.sh CC INCLUDE_FLAGS..
set -u
headers=$(find protocol server shaders client -name '*.h' | sort)
if echo "$headers" | xargs -P "$(nproc)" -n 16 "$@" -std=c17 -D_GNU_SOURCE -fsyntax-only -Wall -Wextra -x c; then
    echo "headers compiled alone: $(echo "$headers" | wc -l)"
else
    echo "a header does not compile alone: see above"
    exit 1
fi
