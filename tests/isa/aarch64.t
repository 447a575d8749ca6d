#!/bin/bash
# The same bits on AArch64, emulated.
. tests/tap.sh
. tests/isa/signature.sh
. tests/build/objects.sh

arm64=$build/arm64
libraries=$arm64/usr/lib/aarch64-linux-gnu
search="-isystem $arm64/usr/include -L$libraries -Wl,-rpath,$libraries"
for program in aarch64-linux-gnu-gcc qemu-aarch64-static; do
    command -v $program >/dev/null || skip_all "no $program here; deploy/install-dependencies --isa brings it"
done
[ -e "$arm64/complete" ] || skip_all "no libraries in $arm64; deploy/install-dependencies --isa $arm64 brings them"

same_bits_by() { # NAME COMPILER FLAGS
    same_bits "aarch64 $1 $3" "qemu-aarch64-static -cpu max -L /usr/aarch64-linux-gnu" \
        CC="$2 $search" AR=aarch64-linux-gnu-ar CFLAGS_release="$3"
    is "aarch64 $1 $3: no inexact instructions" "$(inexact_instructions aarch64-linux-gnu-objdump "$folder")" ""
}

for flags in -O1 -O3; do
    same_bits_by gcc aarch64-linux-gnu-gcc "$flags"
done
if command -v clang >/dev/null; then
    same_bits_by clang "clang --target=aarch64-linux-gnu -Wno-unused-command-line-argument" -O2
else
    skip "aarch64 clang -O2" "no clang here; deploy/install-dependencies --isa brings it"
fi

# The search for such instructions finds them.
for flags in -O2 '-O3 -march=armv8.2-a+sve'; do
    # shellcheck disable=SC2086 # a list of words
    aarch64-linux-gnu-gcc $flags -ffp-contract=fast -c -o "$tmp/fused.o" tests/build/fused.c
    like "aarch64 gcc $flags: a contracted addition is found" \
        "$(inexact_instructions aarch64-linux-gnu-objdump "$tmp/fused.o")" 'fmadd|fmla|fmad'
done

finish
