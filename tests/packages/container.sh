#!/bin/sh
# SPDX-License-Identifier: MIT
# Builds the image of conf/Containerfile from the packages of out/deb, and renders with its daemon over a sealed connection.
# By buildah, which needs no service and no cgroups. No registry is asked: the image begins with a clean Debian 12.
# Needs root, Debian's archive, and 5 GB below build/. Usage: container.sh BUILD SCENES
set -eu
# shellcheck source=tests/packages/clean_root.sh
. "$(dirname "$0")/clean_root.sh"
folder=$(pwd)/build/container
export BUILDAH_ISOLATION=chroot
in_store()
{
    buildah --storage-driver vfs --root "$folder/store" --runroot "$folder/run" "$@"
}
# Called in a network of its own, as the image's port may be taken outside, and among processes of its own, which end with it.
render()
{
    ip link set lo up
    # shellcheck disable=SC2046 # the words of a command
    in_store run --volume "$folder/daemon.key:/etc/farlight/key:ro" "$CONTAINER" -- \
        $(in_store inspect --format '{{range .OCIv1.Config.Entrypoint}}{{.}} {{end}}' "$CONTAINER") >"$folder/log" 2>&1 &
    for _ in $(seq 300); do
        ! client ping --count 1 >/dev/null 2>&1 || break
        kill -0 $! || fail "the daemon does not start: $(cat "$folder/log")"
        sleep 0.2
    done
    client render "$2/teapot.glb" --size 64x48 --samples 1 -q -o "$folder/picture.png" || fail "no picture: $(cat "$folder/log")"
}
client()
{
    command=$1
    shift
    "$programs/farlight" "$command" --server tcp:127.0.0.1:4170 --key "$folder/my.key" "$@"
}
programs=$1
if [ -n "${CONTAINER:-}" ]; then
    render "$@"
    exit
fi

can_make_root || exit 1
clean()
{
    # Its layers belong to other users, and some cannot be written to.
    rm -rf "$folder/store" "$folder/run" "$folder/packages"
}
trap clean EXIT
clean
mkdir -p "$folder/packages"
make_root "$folder/root"
cp out/deb/*.deb "$folder/packages"
rm -f "$folder"/packages/*dbgsym* "$folder"/*.key "$folder/picture.png"

base=$(in_store from scratch)
in_store copy -q "$base" "$folder/root" / >/dev/null
in_store commit -q --rm "$base" localhost/debian >/dev/null
in_store bud -q --pull-never --from localhost/debian -t farlight -f conf/Containerfile "$folder/packages" >"$folder/log" 2>&1 ||
    fail "the image is not built: $(cat "$folder/log")"
CONTAINER=$(in_store from --pull-never localhost/farlight)
export CONTAINER

"$programs/farlight" key "$folder/my.key"
cp "$folder/my.key" "$folder/daemon.key"
chown 4170:4170 "$folder/daemon.key"
unshare --net --pid --fork --kill-child --mount-proc "$0" "$@"
[ "$(head -c 4 "$folder/picture.png" | tail -c 3)" = PNG ] || fail "the picture is none"
echo "built the image, rendered with it over a sealed connection"
