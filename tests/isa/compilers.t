#!/bin/bash
# The same bits from every compiler and optimisation on this machine.
. tests/tap.sh
. tests/isa/signature.sh

for way in 'gcc -O1' 'gcc -O3 -march=x86-64-v3' 'gcc -O3 -march=native' 'clang -O2' 'clang -O3 -march=native'; do
    read -r compiler flags <<<"$way"
    if [ "$(uname -m)" != x86_64 ] && [[ $flags == *x86* ]]; then
        skip "$way" "this machine is no x86-64"
    elif command -v "$compiler" >/dev/null; then
        same_bits "$way" "" CC="$compiler" CFLAGS_release="$flags"
    else
        skip "$way" "no $compiler here; deploy/install-dependencies --isa brings it"
    fi
done

# What all this guards against, once, to show that it would be seen.
if grep -qw fma /proc/cpuinfo; then
    build_signature "gcc contracted" CC=gcc CFLAGS_release='-O3 -march=native' NUMERIC=-ffp-contract=fast
    run "$program"
    like "with multiplications and additions contracted, pixels differ" "$out" '^not ok .* pixels/showcase'
else
    skip "with multiplications and additions contracted, pixels differ" "this processor has no FMA"
fi

finish
