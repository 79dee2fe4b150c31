# SPDX-License-Identifier: MIT
# Completion of the command lines of farlight and its other programs for bash; to be installed as
# .../bash-completion/completions/farlight, with a link to it for each other program.
# Subcommands, options and the values of settings are asked of the programs themselves.

# The options of a command, as it lists them.
_farlight_options()
{
    "$@" --usage 2>/dev/null | grep -o -e '--[a-z][a-z0-9-]*'
}

_farlight()
{
    local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} subcommand=${COMP_WORDS[1]}
    local program=${COMP_WORDS[0]} words=

    if [ "$COMP_CWORD" -eq 1 ] || [ "$subcommand" = help ]; then
        words="$("$program" help 2>/dev/null | sed -n 's/^  \([a-z]*\) .*/\1/p') --version"
    else
        case $before in
        --layers) words="beauty,albedo,normal beauty,depth beauty,albedo,normal,depth,position,ao,id beauty,unknown" ;;
        --scale) words="1 2 4 8" ;;
        --still-encoding) words="raw zstd predicted jpeg" ;;
        --format) words="png jpeg exr hdr webp tiff gif mp4 mkv y4m glb gltf obj ply stl fbx dae 3mf nff" ;;
        --metadata) words="stable full" ;;
        --stereo-layout) words="side over files" ;;
        --views) [ "$subcommand" = view ] && words="off auto on" || words="rays quadtree" ;;
        --lens | --eyes) words="rays quadtree" ;;
        --holes) words="fill pattern" ;;
        --layout) words="heat side" ;;
        --at) words="0,0,0 0,0,0:0,90,0 0,0,0:0,0,0:1" ;;
        --fail-above) words="psnr= shown_psnr= mean= rms= max= beyond= ssim= butteraugli= visible= nonfinite= agree=" ;;
        --*) words=$("$program" complete "$before" 2>/dev/null) ;;
        esac
        if [[ -z $words && $word == -* ]]; then
            local usage=("$program" "$subcommand")
            [[ " ${COMP_WORDS[*]} " == *" --tracers "* ]] && usage=("$program" compare --tracers bvh,naive)
            words=$(_farlight_options "${usage[@]}")
            [[ $words == *--timings* ]] && words="$words --timings=json"
        fi
    fi
    COMPREPLY=()
    [ -z "$words" ] || mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
}

_farlight_program()
{
    local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} program=${COMP_WORDS[0]} words=

    case ${program##*/}:$before in
    farlightd:--device) words="auto software $("$program" --list-devices 2>/dev/null | sed -n 's/^\([0-9][0-9]*\).*/\1/p')" ;;
    farlightd:--log-level) words="error warning info debug" ;;
    farlight-view:--*) words=$("${program%-view}" complete "$before" 2>/dev/null) ;;
    farlight-export:--format) words="png jpeg exr hdr webp tiff gif" ;;
    esac
    [[ -n $words || $word != -* ]] || words=$(_farlight_options "$program")
    COMPREPLY=()
    [ -z "$words" ] || mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
}
complete -o default -F _farlight farlight
complete -o default -F _farlight_program farlightd farlight-view farlight-web farlight-import farlight-export farlight-video
