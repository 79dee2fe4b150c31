#!/bin/sh
# Prints a C file that holds every file named on the command line and a table of them, under their paths below the
# folder that they are in.
# Usage: embed.sh FOLDER FILE.. ; the assembler reads the files, so the C file names them by path.
set -eu
cat <<'C'
/* Made by shaders/embed.sh; do not edit. */
#include "gpu/shader_sources.h"
C
root=$1
shift
n=0
table=
for file in "$@"; do
    printf '__asm__(".section .rodata\\n.balign 16\\nshader_%d: .incbin \\"%s/%s\\"\\nshader_%d_end: .byte 0\\n.previous\\n");\n' \
        "$n" "$root" "$file" "$n"
    printf 'extern const char shader_%d[], shader_%d_end[];\n' "$n" "$n"
    table="$table    {\"$file\", shader_$n, shader_${n}_end},
"
    n=$((n + 1))
done
printf 'const struct shader_source shader_sources[] = {\n%s};\nconst unsigned shader_source_count = %d;\n' "$table" "$n"
