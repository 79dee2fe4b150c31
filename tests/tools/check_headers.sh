#!/bin/sh
# SPDX-License-Identifier: MIT
# Every header compiles alone. Usage: check_headers.sh CC INCLUDE_FLAGS..
# A header that its own source includes first, as check_includes.py demands, is compiled alone with that source. The others
# are compiled here: the compiler takes longer to start than to read one.
set -u
sources=$(find protocol server shaders client -name '*.c')
with_source=$(mktemp)
trap 'rm -f "$with_source"' EXIT
# The first directive of a source; nothing else is read of it.
# shellcheck disable=SC2086
awk '/^#/ {
    header = FILENAME; sub(/c$/, "h", header)
    name = $2; gsub(/"/, "", name)
    if ($1 == "#include" && (header == name || substr(header, length(header) - length(name)) == "/" name))
        print header
    nextfile
}' $sources | sort >"$with_source"
alone=$(find protocol server shaders client -name '*.h' | sort | comm -23 - "$with_source")
if echo "$alone" | xargs -P "$(nproc)" -n 16 "$@" -std=c17 -D_GNU_SOURCE -fsyntax-only -Wall -Wextra -x c; then
    echo "headers compiled alone: $(echo "$alone" | wc -l), and with their sources: $(wc -l <"$with_source")"
else
    echo "a header does not compile alone: see above"
    exit 1
fi
