#!/bin/sh
# Prints a C file that holds every file named on the command line (paths below shaders/) and a table of them.
# Usage: embed.sh SHADERS_DIR FILE.. ; the assembler reads the files, so the C file names them by path.
set -eu
root=$1
shift
cat <<'C'
/* Made by shaders/embed.sh; do not edit. */
#include "gpu/shader_sources.h"
C
n=0
for file in "$@"; do
    printf '__asm__(".section .rodata\\n.balign 16\\nshader_%d: .incbin \\"%s/%s\\"\\nshader_%d_end: .byte 0\\n.previous\\n");\n' \
        "$n" "$root" "$file" "$n"
    printf 'extern const char shader_%d[], shader_%d_end[];\n' "$n" "$n"
    n=$((n + 1))
done
printf 'const struct shader_source shader_sources[] = {\n'
n=0
for file in "$@"; do
    printf '    {"%s", shader_%d, shader_%d_end},\n' "$file" "$n" "$n"
    n=$((n + 1))
done
printf '};\nconst unsigned shader_source_count = %d;\n' "$n"
