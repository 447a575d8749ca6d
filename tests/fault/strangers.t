#!/bin/bash
# A thousand connections that say nothing, that say what is no message, and that break off in the middle: an honest
# worker still joins, with keys and without, and the render ends.
. tests/tap.sh

scene=("$scenes/showcase.json" --size 121x68)
"$weft" render "${scene[@]}" -q -o "$tmp/expected.png"
"$weft" keygen "$tmp/farm" >"$tmp/keygen.out"
"$weft" keygen --worker here "$tmp/farm" >>"$tmp/keygen.out"
hold_port
ulimit -n "$(ulimit -Hn)"

# crowd NAME LABEL WORKER-OPTIONS -- OPTIONS...
crowd() {
    local name=$1 label=$2 mine=()
    shift 2
    while [ "$1" != -- ]; do
        mine+=("$1")
        shift
    done
    shift
    start "$label" "$weft" render "${scene[@]}" --workers 0 --listen "tcp://127.0.0.1:$port" -o "$tmp/$label.png" "$@"
    coordinator=$pid
    listening "$label"
    start "$label-strangers" perl tests/fault/strangers.pl "$port" 700 200 100
    strangers=$pid
    ok "$name: a thousand strangers are there" wait_until "grep -q ready '$tmp/$label-strangers.out'" 60
    start "$label-worker" "$worker" --once --threads 2 "${mine[@]}" "127.0.0.1:$port"
    ends 0 "$name: an honest worker joins them, and the render ends" "$coordinator" 60 "$label"
    same_bytes "$name: the picture is the same" "$tmp/$label.png" "$tmp/expected.png"
    ok "$name: the worker ends" wait_until "is_over $pid" 60
    slay "$strangers"
}

crowd 'without keys' plain --
crowd 'with keys' keys --keys "$tmp/farm/here" -- --keys "$tmp/farm"

finish
