#!/bin/bash
# Connections that are late, stall, break and damage what they carry: the picture has the same bytes.
#
# Damage is done to encrypted connections alone: with keys nothing wrong can get through. Without keys TCP's checksum,
# which the proxy makes anew, is what tells damage to pixels; weft could not.
. tests/tap.sh

mkdir "$tmp/pictures"
"$weft" render "${steady[@]}" -q -o "$tmp/steady.png"
"$weft" keygen "$tmp/keys" >/dev/null
seed=${SEED:-$((RANDOM * 32768 + RANDOM))}
note "seed $seed"

# through LABEL OPTION...: starts a proxy to $endpoint; leaves its own endpoint in $there.
through() {
    local label=$1
    shift
    start "$label" perl tests/fault/proxy.pl "${endpoint#tcp://}" "$seed" "$@"
    wait_until "[ -s '$tmp/$label.out' ]" 60
    there=127.0.0.1:$(head -n 1 "$tmp/$label.out")
}

# has_done LABEL WHAT TIMES: whether the proxy has done that so often.
# shellcheck disable=SC2317 # wait_until calls it
has_done() {
    [ "$(grep -c "$2" "$tmp/$1.out")" -ge "$3" ]
}

# trial LABEL TIMES FAULT SECURITY...: a render by two workers behind a proxy each; one more, that is near, comes when
# the first proxy has done its fault so many times.
trial() {
    local label=$1 times=$2 fault=$3 render workers=() k
    shift 3
    start "$label" "$weft" render "${steady[@]}" --band 2 --workers 0 --listen 'tcp://127.0.0.1:*' "$@" \
        --progress none -o "$tmp/pictures/$label.png"
    render=$pid
    listening "$label"
    for k in 1 2; do
        through "$label-proxy-$k" delay=100 "$fault"
        start "$label-worker-$k" "$worker" --threads 1 --kernel ref "$@" "$there"
        workers+=("$pid")
    done
    ok "$label: it happens, or the render is over before" \
        wait_until "has_done $label-proxy-1 '$label' $times || is_over $render" 60
    start "$label-near" "$worker" --threads 1 --kernel ref --once "$@" "$endpoint"
    ends 0 "$label: the render is completed" "$render" 60 "$label"
    same_bytes "$label: the picture is the same" "$tmp/pictures/$label.png" "$tmp/steady.png"
    rm -f "$tmp/pictures/$label.png"
    ok "$label: nothing else is written" is_empty "$tmp/pictures"
    kill -TERM "${workers[@]}"
    for k in 1 2; do
        ends 0 "$label: worker $k ends well" "${workers[k - 1]}" 60 "$label-worker-$k"
    done
}

trial stalled 3 stall=0.05:300
trial cut 3 cut=0.02
trial corrupted 3 corrupt=0.02 --keys "$tmp/keys"

finish
