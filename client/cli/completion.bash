# SPDX-License-Identifier: MIT
# Completion of farlight's command line for bash; to be installed as .../bash-completion/completions/farlight.

_farlight()
{
    local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} subcommand=${COMP_WORDS[1]}
    local job="--output --format --half --float --server --key --size --samples --depth --seed --environment --exposure
        --tone-map --camera --eye --look-at --up --fov --tracer --bvh-bounds --integrator --primary --encoding
        --quality --timings --timings=json --trace-file --quiet --help --filter --aperture --focus --shutter --clip
        --clip-once --clip-start --clip-speed --bvh-rays --ldc-resolution --ldc-tolerance --ldc-build --ldc-levels --ldc-images
        --ldc-block --ldc-rays --abuffer-resolution --voxels --search --bounces --brdf --ao-distance --ao-falloff
        --ao-rays --layer-opacity --layers"
    local words=

    if [ "$COMP_CWORD" -eq 1 ]; then
        words="render animate view info compare serve scenes stats ping key bridge help --version"
    else
        case $before in
        --tracer) words="bvh naive reference ldc abuffer" ;;
        --tracers) words="bvh,reference ldc,reference abuffer,reference bvh,naive naive,reference ldc,bvh" ;;
        --bvh-bounds) words="auto box sphere" ;;
        --integrator) words="whitted distributed raycast ao path" ;;
        --filter) words="blackman-harris gaussian tent box" ;;
        --bvh-rays) words="0 1 2 3 4 8" ;;
        --ldc-resolution) words="512 1024 2048" ;;
        --ldc-build) words="auto peel lists" ;;
        --ldc-levels) words="auto blocks pyramid cells" ;;
        --ldc-images) words="overlap one" ;;
        --ldc-block) words="2 4 8 16 32" ;;
        --ldc-rays) words="0 1 4" ;;
        --abuffer-resolution) words="640 1280 2560" ;;
        --voxels) words="auto 16 32 64 128 256" ;;
        --search) words="auto dda linear3 linear1" ;;
        --brdf) words="ggx ward" ;;
        --layers) words="beauty,albedo,normal beauty,depth beauty,albedo,normal,depth,position,ao,id" ;;
        --primary) words="raster trace" ;;
        --scale) words="1 2 4 8" ;;
        --still-encoding) words="raw zstd predicted jpeg" ;;
        --encoding) words="raw zstd predicted jpeg" ;;
        --tone-map) words="neutral aces none" ;;
        --format) words="png jpeg exr hdr mp4 mkv y4m" ;;
        --layout) words="heat side" ;;
        --fail-above) words="psnr= mean= rms= max= beyond= ssim= butteraugli= visible= nonfinite= agree=" ;;
        *)
            case $subcommand in
            render) words="$job --scene --time --progressive" ;;
            animate) words="$job --scene --script --dry-run --frames --fps --orbit --keys --shard --resume --retries
                --lossless" ;;
            view) words="--scene --server --key --size --samples --pass-samples --fps --scale --encoding --still-encoding
                --quality --adapt --no-adapt --weight --replay --headless --depth --seed --environment --exposure --tone-map
                --camera --eye --look-at --up --fov --tracer --bvh-bounds --integrator --primary --filter --aperture --focus
                --shutter --clip --clip-speed --bvh-rays --ldc-resolution --ldc-tolerance --ldc-build --ldc-levels --ldc-images
                --ldc-block --ldc-rays --abuffer-resolution --voxels --search --bounces --brdf --ao-distance --ao-falloff
                --ao-rays --layer-opacity --quiet --help" ;;
            info) words="--json --environment --help" ;;
            compare) words="--output --layout --heat-top --threshold --fail-above --ignore-alpha --json --help
                --tracers --far --server --key --size --samples --depth --seed --environment --exposure --camera --eye --look-at
                --up --fov --aperture --focus --shutter --filter --clip --clip-once --clip-start --clip-speed --time
                --bvh-bounds --bvh-rays --ldc-resolution --ldc-tolerance --ldc-build --ldc-levels --ldc-images --ldc-block --ldc-rays
                --abuffer-resolution --voxels --search --bounces --brdf --ao-distance --ao-falloff --ao-rays --layer-opacity
                --integrator --encoding --quality --quiet" ;;
            serve) words="--listen --server --key --name --environment --quiet --help" ;;
            scenes) words="--server --key --json --help" ;;
            stats) words="--server --key --json --help" ;;
            ping) words="--server --key --count --help" ;;
            help) words="render animate view info compare serve scenes stats ping key bridge" ;;
            esac
            [[ $word == -* || $subcommand == help ]] || words=
            ;;
        esac
    fi
    COMPREPLY=()
    [ -z "$words" ] || mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
}
complete -o default -F _farlight farlight
