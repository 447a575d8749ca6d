#!/bin/bash
# Every loop over lanes, in the files that hold little else, becomes vector instructions. gcc says so itself; a loop
# that it leaves scalar gives the same bits, only several times slower, and nothing else would tell.
. tests/tap.sh

[ "$(uname -m)" = x86_64 ] || skip_all "the loops' reports are known for x86-64"
version=$(gcc -dumpversion 2>/dev/null)
[ "${version%%.*}" = 12 ] || skip_all "the compiler is not gcc 12, whose reports are known, but ${version:-none}"
[ "$mode" = release ] || skip_all "sanitizers leave loops scalar"

files=(collect children lights camera surfaces patterns)

# Loops known to stay scalar, as SOURCE:MACRO(ARGUMENT), each with its reason: none today.
exceptions=()

# --- what the compiler says -------------------------------------------------------------------------------------------
# compile_command ISA FILE: as the Makefile compiles it.
compile_command() {
    env -u MAKEFLAGS make -nB V=1 B="$build" CC=gcc "$build/obj/common/trace/lanes/$2.$1.o" |
        grep -- "-DLANES_SUFFIX=$1 .*lanes/$2\.c"
}

# vectorised COMMAND SOURCE: the lines of the source at which a loop was vectorised. Equal functions (the spreads of
# what is flat) are kept apart, or only one of them would be reported.
vectorised() {
    local command=${1%% -MMD*}
    command=${command/ -g / } # nothing but the report is wanted, so nothing is spent on debuggers and the assembler
    rm -f "$tmp/report"
    eval "$command -fno-ipa-icf -fopt-info-vec-optimized=$tmp/report -S -o /dev/null $2" || return
    sed -n "s|^$2:\([0-9]*\):.*loop vectorized.*|\1|p" "$tmp/report" | sort -nu
}

# --- what the source says ---------------------------------------------------------------------------------------------
# loops SOURCE: the lines that gcc reports for its lane loops, each with a name: of a loop, the line of its `for`; of
# one that a macro defines, the line of each use of the macro.
loops() {
    awk '
        /^#define / { macro = $2; sub(/\(.*/, "", macro) }
        /LANES_LOOP/ { if (macro != "") loops[macro] = 1; else waiting = 1; if (macro == "") next }
        waiting && /for \(/ { print FNR, "line"; waiting = 0 }
        /^DEFINE_/ && macro == "" {
            name = $0; sub(/\(.*/, "", name); argument = $0; sub(/^[^(]*\(/, "", argument); sub(/,.*/, "", argument)
            if (name in loops) print FNR, name "(" argument ")"
        }
        !/\\$/ { macro = "" }' "$1"
}

# missing SOURCE LINES: the loops that are not among the lines, one a line.
missing() {
    local line name
    loops "$1" | while read -r line name; do
        grep -qx "$line" <<<"$2" || [[ " ${exceptions[*]} " == *" $1:$name "* ]] || echo "$1:$line: $name"
    done
}

# --- tests ------------------------------------------------------------------------------------------------------------
for isa in avx512 avx2; do
    for file in "${files[@]}"; do
        source=common/trace/lanes/$file.c
        command=$(compile_command $isa $file)
        lines=$(vectorised "$command" "$source")
        is "$source, $isa: all $(loops "$source" | wc -l) loops are vectorised" "$(missing "$source" "$lines")" ""
    done
done

is "every LANES_LOOP is looked at" \
    "$(for file in "${files[@]}"; do loops "common/trace/lanes/$file.c"; done | grep -c ' line$')" \
    "$(for file in "${files[@]}"; do grep -c '^ *LANES_LOOP$' "common/trace/lanes/$file.c"; done | awk '{ sum += $1 } END { print sum }')"

# A scalar loop is found: gcc 12 gathers no truth values.
cat >"$tmp/scalar.c" <<'EOF'
#include "trace/lanes.h"
void scalar(const _Bool *from, const unsigned *index, double *to, size_t count);
void scalar(const _Bool *from, const unsigned *index, double *to, size_t count)
{
    LANES_LOOP
    for (size_t i = 0; i < count; i++)
        to[i] = from[index[i]] ? 1 : 2;
}
EOF
like "a scalar loop is found" "$(missing "$tmp/scalar.c" "$(vectorised "$(compile_command avx2 camera)" "$tmp/scalar.c")")" \
    'scalar.c:6: line'

finish
