#!/bin/bash
# Nothing in the objects that decide a pixel can round differently on another machine: no fused or approximate
# instructions, nothing of libm but what is exact, and the flags that the numbers rest on.
. tests/tap.sh
. tests/build/objects.sh

ok "there are objects to look at" [ "$(objects "$build" | wc -l)" -gt 40 ]

# --- instructions -----------------------------------------------------------------------------------------------------
is "no inexact instructions" "$(inexact_instructions objdump "$build")" ""

if [ "$(uname -m)" = x86_64 ]; then
    compile() { # NAME FLAG...: a C source from standard input
        local name=$1
        shift
        gcc "$@" -x c -c -o "$tmp/$name.o" -
    }
    finds() { # NAME PATTERN
        like "a search finds $1" "$(inexact_instructions objdump "$tmp/$1.o")" "$2"
    }
    compile fused -O2 -mfma -ffp-contract=fast <tests/build/fused.c
    finds fused vfmadd
    compile vectors -O3 -march=x86-64-v4 -ffp-contract=fast <tests/build/fused.c
    finds vectors vfmadd
    compile x87 -O2 <<<'long double f(long double x, long double y) { return x * y; }'
    finds x87 fmul
    compile reciprocal -O2 -ffast-math <<<'#include <math.h>
        float f(float x) { return 1 / sqrtf(x); }'
    finds reciprocal rsqrtss
    compile control -O2 <<<'void f(unsigned x) { __builtin_ia32_ldmxcsr(x); }'
    finds control ldmxcsr
else
    skip "a search finds what it looks for" "the samples are for x86-64; make test-isa has some for AArch64"
fi

# --- libm -------------------------------------------------------------------------------------------------------------
is "nothing of libm but $exact_in_libm" "$(libm_calls "$build")" ""
gcc -O2 -x c -c -o "$tmp/sine.o" - <<<'#include <math.h>
    double f(double x) { return sin(floor(x)); }'
is "a search finds sin, and lets floor pass" "$(libm_calls "$tmp/sine.o")" "$tmp/sine.o: sin"

# --- flags ------------------------------------------------------------------------------------------------------------
# gcc notes its options in the debug information.
options_of() { # OBJECT
    readelf --debug-dump=info "$1" | sed -n 's/.*DW_AT_producer.*: \(GNU C.*\)/\1/p'
}

without_flags() { # OBJECT...: those compiled without a flag that pixels need, or with one that they cannot bear
    local object flag options
    for object; do
        options=" $(options_of "$object") "
        for flag in -ffp-contract=off -fno-tree-slp-vectorize; do
            [[ $options == *" $flag "* ]] || echo "$object: no $flag"
        done
        for flag in -ffast-math -Ofast -funsafe-math-optimizations -fassociative-math -freciprocal-math \
            -ffinite-math-only -frounding-math -mfpmath=387; do
            [[ $options == *" $flag "* ]] && echo "$object: $flag"
        done
    done
}

first=$(objects "$build" | head -n 1)
if [ -n "$(options_of "$first")" ]; then
    # shellcheck disable=SC2046 # a list of words
    is "every object was compiled with the flags that pixels need" "$(without_flags $(objects "$build"))" ""
    gcc -g -O2 -ffast-math -c -o "$tmp/fused.o" tests/build/fused.c
    is "one that was not is found" "$(without_flags "$tmp/fused.o" | wc -l)" 3
else
    skip "every object was compiled with the flags that pixels need" "only gcc notes them"
fi

finish
