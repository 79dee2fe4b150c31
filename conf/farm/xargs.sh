#!/bin/bash
# SPDX-License-Identifier: MIT
# An animation on this host without a queue: parts of the frames as processes side by side, each at most 5 times.
# Usage: xargs.sh PARTS AT_ONCE ANIMATE-ARGUMENT...
#   xargs.sh 64 4 room.glb --frames 1-640 -o 'frames/%04d.exr' --samples 64
# Exit status: 0 when all is there; 123 when a part failed for good (its messages say why).
set -eu
if [ $# -lt 3 ] || [[ ! $1 =~ ^[0-9]+$ || ! $2 =~ ^[0-9]+$ ]]; then
    echo "usage: xargs.sh PARTS AT_ONCE MODEL --frames A-B -o 'FOLDER/%04d.exr' [OPTION...]" >&2
    exit 2
fi
parts=$1 at_once=$2
shift 2
# The number of a part comes last: xargs -I would replace {} in names, too.
# shellcheck disable=SC2016 # the inner shell expands it
seq "$parts" | xargs -P "$at_once" -n 1 bash -c '
    parts=$1 part=${!#}
    for attempt in 1 2 3 4 5; do
        farlight-node farlight animate --shard "$part/$parts" --resume --digests --progress lines --retry-for 5 "${@:2:$#-2}"
        status=$?
        case $status in 75 | 137 | 139) sleep "$attempt" ;; *) exit "$status" ;; esac
    done
    exit "$status"' part "$parts" "$@"
