#!/bin/sh
# SPDX-License-Identifier: MIT
# Renders the bundled scenes through a daemon on a private socket: one picture within seconds, then the others behind a
# line with the time left. What the commands print goes to OUT_FOLDER/demo.log.
# Usage: demo.sh BUILD_FOLDER OUT_FOLDER [FAST]; with FAST, other than 0, it ends after the first picture.
set -eu
begin_s=$(date +%s)
bin=$1
out=$2
fast=${3:-0}
mkdir -p "$out"
private=$(mktemp -d)
daemon=
job=
finish() {
    status=$?
    trap - EXIT INT TERM
    # A command that is told to end removes what it has not finished; the daemon ends after it.
    for process in $job $daemon; do
        kill "$process" 2>/dev/null || true
        wait "$process" 2>/dev/null || true
    done
    rm -rf "$private"
    exit "$status"
}
trap finish EXIT
trap 'clear_line; exit 130' INT
trap 'clear_line; exit 143' TERM

is_terminal=0
[ -t 2 ] && [ "${TERM:-dumb}" != dumb ] && is_terminal=1
clear_line() {
    [ "$is_terminal" = 0 ] || printf '\r\033[K' >&2
}

# The time left, from the relative costs: done_cost took spent_s, and this picture has run for running_s.
time_left() {
    later_s=$(((all_cost - done_cost - cost) * spent_s / done_cost))
    left_s=$(((all_cost - done_cost) * spent_s / done_cost - running_s))
    [ "$left_s" -ge "$later_s" ] || left_s=$later_s
    printf '%d:%02d left' $((left_s / 60)) $((left_s % 60))
}

show_progress() {
    line="picture $number of $count, $(time_left): $name, $what"
    if [ "$is_terminal" = 1 ]; then
        printf '\r%.79s\033[K' "$line" >&2
    elif [ "$announced" != "$number" ]; then
        announced=$number
        printf '%.79s\n' "$line" >&2
    fi
}

fail() {
    clear_line
    echo "$1; the last lines of its log:" >&2
    tail -n 20 "$2" >&2
    exit 1
}

# picture COST NAME DESCRIPTION COMMAND..: renders OUT_FOLDER/NAME, or counts it before anything is rendered.
picture() {
    cost=$1 name=$2 what=$3
    shift 3
    if [ "$pass" = count ]; then
        count=$((count + 1)) all_cost=$((all_cost + cost))
        return
    fi
    number=$((number + 1)) running_s=0 picture_begin_s=$(date +%s)
    printf '%s\n' "--- $name, $what" >>"$out/demo.log"
    "$bin/farlight" "$@" --server "$server" --quiet -o "$out/$name" >>"$out/demo.log" 2>&1 &
    job=$!
    while kill -0 "$job" 2>/dev/null; do
        [ "$done_cost" = 0 ] || show_progress
        sleep 0.2
        running_s=$(($(date +%s) - picture_begin_s))
    done
    wait "$job" || fail "$out/$name was not rendered" "$out/demo.log"
    job= done_cost=$((done_cost + cost)) spent_s=$((spent_s + running_s))
    clear_line
    if [ "$number" = 1 ]; then
        echo "$out/$name, $what: finished after $(($(date +%s) - begin_s)) s"
        [ "$spent_s" -gt 0 ] || spent_s=1
    elif [ "$is_terminal" = 1 ]; then
        echo "$out/$name, $what"
    fi
}

# Costs are seconds of one core, by Mesa's software renderer.
pictures() {
    picture 9 demo.png 'a teapot on a mirror' \
        render "$private/scenes/fine-teapot.glb" --environment "$sky" --size 960x540 --samples 6 \
        --integrator whitted --depth 6 --timings
    [ "$fast" = 0 ] || return 0
    mkdir -p "$out/orbit"
    picture 8 demo.exr 'the same scene in linear light, without a second upload' \
        render "$private/scenes/fine-teapot.glb" --environment "$sky" --size 960x540 --samples 6 \
        --integrator whitted --depth 6 --timings
    picture 4 orbit/%04d.png '24 frames once around a sphereflake' \
        animate "$private/scenes/sphereflake-3.nff" --size 480x270 --orbit --frames 1-24 --fps 24 \
        --eye 2.1,1.3,1.7 --look-at 0,0,0 --up 0,0,1 --fov 45
    picture 28 lens.png 'a lens that is in focus on the nearest pot' \
        render "$carousel" --environment "$dusk" --clip ride --time 0.7 --size 640x360 \
        --samples 64 --aperture 0.3 --focus 7.4 --timings
    picture 7 ldc.png 'layered depth cubes beside an exact tracer' \
        compare "$teapot" --environment "$sky" --size 480x270 --tracers ldc,bvh
    picture 16 abuffer.png 'ambient occlusion by A-buffers beside an exact tracer' \
        compare "$private/scenes/cornell.glb" --size 320x240 --integrator ao --samples 4 --tracers abuffer,bvh
    picture 24 path.png 'path tracing, refined in passes of 16 samples' \
        render "$teapot" --environment "$sky" --size 400x225 --integrator path --samples 64 --progressive=16
    picture 2 layers.exr 'albedo, normals, depth and objects as channels' \
        render "$teapot" --environment "$sky" --size 480x270 --layers beauty,albedo,normal,depth,id
    picture 7 quadtree.png 'reflections and shadows by the depth layers of a cube round the eye' \
        render "$carousel" --environment "$dusk" --size 480x270 --tracer quadtree
    picture 3 stereo.png 'two eyes, made from the depth layers of one view' \
        render "$teapot" --environment "$sky" --size 480x270 --stereo 0.065 --integrator whitted --depth 6
    picture 105 shot.mp4 'a shot script that moves camera, focus and light' \
        animate --script "$private/scenes/shot.json" --fps 8 --frames 1-24 --size 320x180 --samples 12
    picture 200 carousel.mp4 'a clip with soft shadows, gloss and motion blur' \
        animate "$carousel" --environment "$dusk" --clip ride --fps 12 --frames 1-36 \
        --size 480x270 --samples 12 --shutter 0.5
}

: >"$out/demo.log"
"$bin/farlightd" --listen "unix:$private/farlight.sock" >"$private/ready" 2>"$private/log" &
daemon=$!
"$bin/tests/tools/make_scenes" "$private/scenes"
cp conf/examples/shot.json "$private/scenes/shot.json"
tries=0
until grep -q READY "$private/ready"; do
    if ! kill -0 "$daemon" 2>/dev/null || [ $((tries += 1)) -gt 300 ]; then
        fail 'the daemon did not start' "$private/log"
    fi
    sleep 0.1
done

server="unix:$private/farlight.sock"
teapot=$private/scenes/teapot.glb
sky=$private/scenes/sky.hdr
carousel=$private/scenes/carousel.glb
dusk=$private/scenes/dusk.hdr
count=0 all_cost=0 number=0 announced=0 done_cost=0 spent_s=0
pass=count
pictures
pass=render
pictures
"$bin/farlight" stats --server "$server" >>"$out/demo.log"
echo "what the commands printed, with the time of every stage: $out/demo.log"
