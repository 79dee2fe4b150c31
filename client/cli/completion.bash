# SPDX-License-Identifier: MIT
# Completion of farlight's command line for bash; to be installed as .../bash-completion/completions/farlight.
# Subcommands, options and the values of settings are asked of the program itself.

_farlight()
{
    local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} subcommand=${COMP_WORDS[1]}
    local program=${COMP_WORDS[0]} words=

    if [ "$COMP_CWORD" -eq 1 ] || [ "$subcommand" = help ]; then
        words="$("$program" help 2>/dev/null | sed -n 's/^  \([a-z]*\) .*/\1/p') --version"
    else
        case $before in
        --layers) words="beauty,albedo,normal beauty,depth beauty,albedo,normal,depth,position,ao,id" ;;
        --scale) words="1 2 4 8" ;;
        --still-encoding) words="raw zstd predicted jpeg" ;;
        --format) words="png jpeg exr hdr mp4 mkv y4m" ;;
        --metadata) words="stable full" ;;
        --layout) words="heat side" ;;
        --fail-above) words="psnr= mean= rms= max= beyond= ssim= butteraugli= visible= nonfinite= agree=" ;;
        --*) words=$("$program" complete "$before" 2>/dev/null) ;;
        esac
        if [[ -z $words && $word == -* ]]; then
            local usage=("$program" "$subcommand" --usage)
            [[ " ${COMP_WORDS[*]} " == *" --tracers "* ]] && usage=("$program" compare --tracers bvh,naive --usage)
            words=$("${usage[@]}" 2>/dev/null | grep -o -e '--[a-z][a-z0-9-]*')
            [[ $words == *--timings* ]] && words="$words --timings=json"
        fi
    fi
    COMPREPLY=()
    [ -z "$words" ] || mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
}
complete -o default -F _farlight farlight
