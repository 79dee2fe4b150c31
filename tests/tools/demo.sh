#!/bin/sh
# SPDX-License-Identifier: MIT
# Starts a daemon on a private socket, renders bundled scenes through it, one of them with all that moves, a lens and a
# shutter, and stops it.
# Usage: demo.sh BUILD_FOLDER OUT_FOLDER
set -eu
bin=$1
out=$2
mkdir -p "$out/orbit"
private=$(mktemp -d)
daemon=
finish() {
    status=$?
    trap - EXIT INT TERM
    if [ -n "$daemon" ]; then
        kill "$daemon" 2>/dev/null || true
        wait "$daemon" 2>/dev/null || true
    fi
    rm -rf "$private"
    exit "$status"
}
trap finish EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

"$bin/tests/tools/make_scenes" "$private/scenes"
"$bin/farlightd" --listen "unix:$private/farlight.sock" >"$private/ready" 2>"$private/log" &
daemon=$!
tries=0
until grep -q READY "$private/ready"; do
    if ! kill -0 "$daemon" 2>/dev/null || [ $((tries += 1)) -gt 300 ]; then
        echo "the daemon did not start:" >&2
        cat "$private/log" >&2
        exit 1
    fi
    sleep 0.1
done

server="unix:$private/farlight.sock"
scene=$private/scenes/teapot.glb
sky=$private/scenes/sky.hdr
echo "--- $out/demo.png, from a bundled scene, with the time of every stage"
"$bin/farlight" render "$scene" --environment "$sky" --server "$server" --size 960x540 --samples 4 --timings -o "$out/demo.png"
echo "--- $out/demo.exr, linear; the same scene again, so that no bulk data moves"
"$bin/farlight" render "$scene" --environment "$sky" --server "$server" --size 960x540 --samples 4 --timings -o "$out/demo.exr"
echo "--- $out/orbit/, 24 frames once around a sphereflake"
"$bin/farlight" animate "$private/scenes/sphereflake-3.nff" --server "$server" --size 480x270 --orbit \
    --frames 1-24 --fps 24 -o "$out/orbit/%04d.png"
carousel=$private/scenes/carousel.glb
dusk=$private/scenes/dusk.hdr
echo "--- $out/carousel.mp4, the clip 'ride' once: soft shadows, gloss, and a shutter that is open for half of every frame"
"$bin/farlight" animate "$carousel" --environment "$dusk" --server "$server" --clip ride --fps 12 --frames 1-36 \
    --size 480x270 --samples 6 --shutter 0.5 -o "$out/carousel.mp4"
echo "--- $out/shot.mp4, conf/examples/shot.json, smaller and with fewer frames: camera, focus, a lamp and a colour change"
cp conf/examples/shot.json "$private/scenes/shot.json"
"$bin/farlight" animate --script "$private/scenes/shot.json" --server "$server" --fps 8 --frames 1-24 \
    --size 320x180 --samples 6 -o "$out/shot.mp4"
echo "--- $out/lens.png, the clip at 0.7 s through a wide open lens, in focus on the nearest pot"
"$bin/farlight" render "$carousel" --environment "$dusk" --server "$server" --clip ride --time 0.7 --size 640x360 \
    --samples 16 --aperture 0.3 --focus 7.4 --timings -o "$out/lens.png"
echo "--- $out/ldc.png, the first scene by layered depth cubes beside an exact tracer, and where they differ"
"$bin/farlight" compare "$scene" --environment "$sky" --server "$server" --size 480x270 --tracers ldc,bvh -o "$out/ldc.png"
echo "--- $out/abuffer.png, ambient occlusion in a box by voxels and A-buffers beside an exact tracer, and where they differ"
"$bin/farlight" compare "$private/scenes/cornell.glb" --server "$server" --size 320x240 --integrator ao --samples 1 \
    --tracers abuffer,bvh -o "$out/abuffer.png"
echo "--- $out/path.png, the first scene by path tracing, refined in passes of 4 samples"
"$bin/farlight" render "$scene" --environment "$sky" --server "$server" --size 400x225 --integrator path --samples 16 \
    --progressive=4 -o "$out/path.png"
echo "--- $out/layers.exr, the picture with albedo, normals, depth and numbers of objects as channels of one file"
"$bin/farlight" render "$scene" --environment "$sky" --server "$server" --size 480x270 \
    --layers beauty,albedo,normal,depth,id -o "$out/layers.exr"
echo "--- the daemon, afterwards"
"$bin/farlight" stats --server "$server"
