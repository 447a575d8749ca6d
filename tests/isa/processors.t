#!/bin/bash
# The same bits from one program on several processors, emulated: what it and the libraries choose at run time (kernels
# here, variants of floor or of memory copies there) must not show. QEMU has no AVX-512.
. tests/tap.sh
. tests/isa/signature.sh

[ "$(uname -m)" = x86_64 ] || skip_all "this machine is no x86-64"
command -v qemu-x86_64-static >/dev/null ||
    skip_all "no qemu-x86_64-static here; deploy/install-dependencies --isa brings it"

program=$build/tests/isa/signature.t
agrees "this machine" "$program"
for processor in qemu64 Nehalem Haswell max; do
    agrees "$processor" qemu-x86_64-static -cpu $processor "$program"
done

finish
