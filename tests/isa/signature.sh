# shellcheck shell=bash disable=SC2154
# Building the signature program (tests/isa/signature.c) in other ways; sourced after tests/tap.sh by the tests here.

rooms=$(echo common/{base,math,image,scene,trace}/*.c)

# build_signature NAME MAKE_VARIABLE...: builds it without ZeroMQ; leaves $folder, of its own, and $program behind.
build_signature() {
    folder=$build/isa/${1//[^a-z0-9]/_}
    program=$folder/tests/isa/signature.t
    shift
    env -u MAKEFLAGS -u MAKELEVEL make -j"$(nproc)" B="$folder" COMMON="$rooms" FARM= TEST_LIBS= \
        LDLIBS='-lcjson -lpng -lz -lsodium -lm' "$@" "$program" >"$tmp/make.out" 2>&1
}

# agrees NAME COMMAND...: the signature program, run by the command, finds every recorded digest.
agrees() {
    local name=$1 start=${EPOCHREALTIME/[.,]/} out status=0
    shift
    out=$("$@" 2>&1) || status=$?
    report "$status" "$name: $(grep -c '^ok' <<<"$out") digests are the recorded ones" || note "$(grep -A2 '^not ok' <<<"$out")"
    note "ran for $(((${EPOCHREALTIME/[.,]/} - start) / 1000)) ms"
}

# same_bits NAME "COMMAND..." MAKE_VARIABLE...: builds it so, and runs it by the command, which may be empty.
same_bits() {
    local name=$1 runner=$2
    shift 2
    # shellcheck disable=SC2086 # the runner is a list of words
    if build_signature "$name" "$@"; then
        agrees "$name" $runner "$program"
    else
        report 1 "$name: builds" || note "$(tail -n 20 "$tmp/make.out")"
    fi
}
