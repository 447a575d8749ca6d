#!/bin/bash
# One picture by machines of three kinds together: this one's best kernel, its least one, and an emulated AArch64.
. tests/tap.sh

arm64=$build/arm64
libraries=$arm64/usr/lib/aarch64-linux-gnu:$arm64/lib/aarch64-linux-gnu
untried() { # REASON
    skip_all "machines of several kinds in one farm could not be tried: $1"
}
for program in aarch64-linux-gnu-gcc qemu-aarch64-static; do
    command -v $program >/dev/null || untried "no $program here; deploy/install-dependencies --isa $arm64 brings it"
done
[ -e "${libraries%:*}/libzmq.so.5" ] ||
    untried "no libraries in $arm64; deploy/install-dependencies --isa $arm64 brings them"
[ "$(uname -m)" = x86_64 ] || untried "this is no x86-64 machine"

# --- a worker for AArch64 -------------------------------------------------------------------------------------
folder=$build/isa/worker
sources=$(printf '%s\n' worker/*.c | grep -v /main.c | tr '\n' ' ')
if ! env -u MAKEFLAGS -u MAKELEVEL make -s -j"$(nproc)" B="$folder" AR=aarch64-linux-gnu-ar FARM="$sources" \
    LDLIBS='-lzmq -lcjson -lpng -lsodium -lm' \
    CC="${CROSS-aarch64-linux-gnu-gcc} -isystem $arm64/usr/include -L${libraries%:*} -Wl,-rpath-link,$libraries" \
    "$folder/weft-worker" >"$tmp/make.out" 2>&1; then
    report 1 "a worker for AArch64 is built" || note "$(tail -n 20 "$tmp/make.out")"
    finish
fi
foreign=(qemu-aarch64-static -cpu max -L /usr/aarch64-linux-gnu -E "LD_LIBRARY_PATH=$libraries" "$folder/weft-worker")
unset ASAN_OPTIONS UBSAN_OPTIONS # these would reach into the emulator
like "a worker for AArch64 is built" "$("${foreign[@]}" --version 2>&1)" '^weft-worker [0-9]'

# --- the farm -------------------------------------------------------------------------------------------------
best=
for kernel in avx512 avx2; do
    [ -n "$best" ] || ! "$worker" --kernel $kernel --version >/dev/null 2>&1 || best=$kernel
done

# has_done KERNEL ROWS: whether workers of that kind have.
has_done() {
    local rows
    rows=$(tail -n 1 "$tmp/farm.out" | grep -o "\"kernel\":\"$1\"[^}]*\"rows_done\":[0-9]*" | grep -o '[0-9]*$')
    [ "${rows:-0}" -ge "$2" ]
}

# one_more KERNEL COMMAND...: a worker, which gets on before the next one comes, however slow it is.
one_more() {
    local kernel=$1
    shift
    start "$kernel" "$@" --once --threads 1 "$endpoint"
    worker_of[$kernel]=$pid
    ok "$kernel: it has returned rows" wait_until "has_done $kernel 1 || is_over $render" 120
}
declare -A worker_of

# mixed NAME OPTION...: renders by three kinds of workers, and by one alone, and compares.
mixed() {
    local name=$1 kernel shares
    shift
    "$weft" render "$@" -q -o "$tmp/alone.png"
    start farm "$weft" render "$@" --band 1 --workers 0 --listen 'tcp://127.0.0.1:*' --progress json \
        --report "$tmp/report.json" -o "$tmp/farm.png"
    render=$pid
    listening farm
    one_more neon "${foreign[@]}"
    one_more sse2 "$worker" --kernel sse2
    [ -z "$best" ] || one_more "$best" "$worker" --kernel "$best"
    ends 0 "$name: the render is completed" "$render" 120 farm
    same_bytes "$name: the picture is the same" "$tmp/farm.png" "$tmp/alone.png"
    shares=$(tr -d ' \n' <"$tmp/report.json" | grep -o '"kernel":"[^}]*' |
        sed 's/"kernel":"\([^"]*\)".*"rows":\([0-9]*\).*/ \1:\2/' | tr -d '\n')
    for kernel in "${!worker_of[@]}"; do
        ends 0 "$name: $kernel ends well" "${worker_of[$kernel]}" 60 "$kernel"
        like "$name: $kernel has rendered rows of the picture" "$shares" " $kernel:[1-9]"
    done
    note "$name: rows of each:$shares"
}
# So much that each gets some of it.
if [ "$mode" = sanitize ]; then
    mixed "a number of samples" "$scenes/showcase.json" --size 160x90 --samples 16
    mixed "an error to be met" "$scenes/showcase.json" --size 160x90 --error 0.004
else
    mixed "a number of samples" "$scenes/showcase.json" --size 160x90 --samples 150
    mixed "an error to be met" "$scenes/showcase.json" --size 160x90 --error 0.0013
fi

[ -n "$best" ] || note "Could not be tried here: AVX2 and AVX-512, which this machine has not."
note "Could not be tried here: an AArch64 machine that is not emulated."
finish
