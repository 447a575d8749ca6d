#!/bin/bash
# Why the Makefile turns one vectoriser off: the code of tests/numeric/conversion.c without that flag and with it.
. tests/tap.sh

conversions() { # FLAG...: how many of five conversions to float a program compiled so carries out
    gcc -std=c11 "$@" -I. -include tests/numeric/rounding.h -x c -o "$tmp/conversions" - \
        <<<'int main(void) { return conversions_done(); }' && run "$tmp/conversions"
}

for level in -O2 -O3; do
    conversions $level -fno-tree-slp-vectorize
    is "gcc $level -fno-tree-slp-vectorize carries out all" "$status" 5
    conversions $level
    if [ "$status" -eq 5 ]; then
        skip "gcc $level alone loses some" "this compiler ($(gcc -dumpfullversion), $(uname -m)) has not got the fault"
    else
        ok "gcc $level alone loses some: it carries out $status of 5" [ "$status" -lt 5 ]
    fi
done

finish
