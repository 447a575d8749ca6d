#!/bin/bash
# Workers that return wrong bytes now and then: with --audit they are found out and left out, and the picture is right.
. tests/tap.sh

liar=$build/tests/farm/liar
adaptive=("$scenes/showcase.json" --size 160x90 --error 0.004)
fixed=("$scenes/showcase.json" --size 160x90 --samples 16)
"$weft" render "${adaptive[@]}" -q -o "$tmp/adaptive.png"
"$weft" render "${fixed[@]}" -q -o "$tmp/fixed.png"
mkdir "$tmp/pictures"
hold_port

# Machines are told apart by their keys, or else by their addresses, of which there is one here.
keys=$tmp/keys
"$weft" keygen "$keys" >"$tmp/keygen.out"
for name in good bad worse; do
    "$weft" keygen --worker "$name" "$keys" >>"$tmp/keygen.out"
done

# coordinator LABEL OPTION...: starts a render of pictures/LABEL.png on the port.
coordinator() {
    local label=$1
    shift
    start "$label" "$weft" render --listen "tcp://127.0.0.1:$port" --band 4 --report "$tmp/$label.report" \
        -o "$tmp/pictures/$label.png" "$@"
    coordinator=$pid
}

# lie LABEL LIES OPTION...: a worker that lies; an honest one.
lie() {
    local label=$1 lies=$2
    shift 2
    start "$label" env "LIES=$lies" "$liar" --threads 1 "$@" "127.0.0.1:$port"
    liars+=("$pid")
}
liars=()

honest() { # LABEL OPTION...
    local label=$1
    shift
    start "$label" "$worker" --once "$@" "127.0.0.1:$port"
}

# right NAME LABEL PICTURE: the render ends well, with these bytes, and nothing else is left. What could not be begun
# anew in time is another matter.
right() {
    ends 0 "$1: the render ends well" "$coordinator" 60 "$2"
    same_bytes "$1: the picture is right" "$tmp/pictures/$2.png" "$3"
    rm -f "$tmp/pictures/$2.png"
    ok "$1: nothing else is left" is_empty "$tmp/pictures"
    for pid in "${liars[@]}"; do
        slay "$pid"
    done
    liars=()
    wait_until '[ -z "$(processes weft-worker)$(processes liar)" ]' 60
}

audited() { # LABEL: how many bands
    sed -n 's/.*"bands_audited":\([0-9]*\).*/\1/p' "$tmp/$1.report"
}

found_out() { # NAME LABEL
    like "$1: the liar is named" "$(cat "$tmp/$2.err")" 'worker [0-9]+ \(.*\) returned wrong bytes for rows [0-9]+ to [0-9]+'
}

# --- it does lie ----------------------------------------------------------------------------------------------
coordinator unaudited "${fixed[@]}" --workers 0
lie unaudited-liar '3 100'
ends 0 'without audits nobody notices' "$coordinator" 60 unaudited
ok 'and the picture is wrong' bash -c "! cmp -s '$tmp/pictures/unaudited.png' '$tmp/fixed.png'"
rm "$tmp/pictures/unaudited.png"
kill -KILL "${liars[@]}"
liars=()

# --- one liar -------------------------------------------------------------------------------------------------
# From its 1st result on, which is of the survey, or from its 15th, of the render.
for from in 0 14; do
    coordinator "one-$from" "${adaptive[@]}" --workers 0 --audit 100 --keys "$keys"
    lie "one-$from-liar" "$from 7" --keys "$keys/bad"
    wait_until "grep -q 'worker 1 .*joined' '$tmp/one-$from.err'" 60
    honest "one-$from-honest" --threads 1 --keys "$keys/good"
    right "a liar from result $from on and an honest worker" "one-$from" "$tmp/adaptive.png"
    found_out "a liar from result $from on and an honest worker" "one-$from"
    ok "from result $from on: bands were audited" [ "$(audited "one-$from")" -gt 0 ]
    ok "from result $from on: one that says it is of the same machine, but has another key, stays" \
        bash -c "! grep -q 'wrong bytes' '$tmp/one-$from-honest.err'"
done
like 'a liar is told why it is left out' "$(cat "$tmp/one-0-liar.err")" 'returned wrong bytes'
like 'nor may it come again' "$(cat "$tmp/one-0.err")" 'refused a worker .*: a worker of that machine returned wrong bytes'

coordinator fixed "${fixed[@]}" --workers 1 --threads 1 --audit 100
lie fixed-liar '1 5'
right 'a liar and a local worker' fixed "$tmp/fixed.png"

# Two of one address, of which the second says what the first does: it is not asked.
coordinator alike "${fixed[@]}" --workers 0 --audit 100
lie alike-first '0 2'
lie alike-second '0 2'
right 'two liars of one machine' alike "$tmp/fixed.png"
like 'two liars of one machine: a worker of its own audits them' "$(cat "$tmp/alike.err")" \
    'to tell whose bytes are right'
found_out 'two liars of one machine' alike

# --- nobody honest --------------------------------------------------------------------------------------------
coordinator none "${fixed[@]}" --workers 0 --audit 100 --keys "$keys"
lie none-first '2 3' --keys "$keys/bad"
lie none-second '3 3' --keys "$keys/worse"
right 'two liars' none "$tmp/fixed.png"
like 'two liars: a worker of its own settles it' "$(cat "$tmp/none.err")" 'to tell whose bytes are right'
found_out 'two liars' none

# --- honest ones ----------------------------------------------------------------------------------------------
# Bytes, those of figures and surveys too, do not depend on kernel or threads: else somebody would be accused.
coordinator honest "${adaptive[@]}" --workers 0 --audit 100 --keys "$keys"
honest honest-ref --threads 1 --kernel ref --keys "$keys/good"
honest honest-best --threads 3 --keys "$keys/bad"
right 'two honest workers of different kernels and threads' honest "$tmp/adaptive.png"
ok 'nobody is accused' bash -c "! grep -q 'wrong bytes' '$tmp/honest.err'"
ok 'each of the 90/4 bands, and those of the survey, were audited' [ "$(audited honest)" -ge 23 ]

exits 0 'two workers of this machine audit each other' "$weft" render "${fixed[@]}" --workers 2 --threads 2 --band 4 \
    --audit 100 --report "$tmp/pair.report" -o "$tmp/pair.png"
same_bytes 'the picture is the same' "$tmp/pair.png" "$tmp/fixed.png"
ok 'all bands were audited' [ "$(audited pair)" -ge 23 ]

exits 0 'a worker alone is given company' "$weft" render "${fixed[@]}" --audit 20 -o "$tmp/alone.png"
same_bytes 'the picture is the same' "$tmp/alone.png" "$tmp/fixed.png"

# --- an earlier run's -----------------------------------------------------------------------------------------
long=("$scenes/showcase.json" --size 160x90 --samples "${slow[-1]}")
"$weft" render "${long[@]}" -q -o "$tmp/long.png"
coordinator before "${long[@]}" --workers 0 --progress json
lie before-liar '0 2' --kernel ref
wait_until 'has_rows before 20' 60
kill -KILL "$coordinator" "${liars[@]}"
{ wait "$coordinator"; } 2>/dev/null
liars=()
wait_until '[ -z "$(processes liar)" ]' 60
coordinator before "${long[@]}" --workers 0 --audit 100
honest before-honest --threads 2
right 'rows that an earlier run had of a liar' before "$tmp/long.png"
like 'it is said whose they were' "$(cat "$tmp/before.err")" 'an earlier run returned wrong bytes'

exits 2 'a share beyond all is refused' "$weft" render "${fixed[@]}" --audit 101 -o "$tmp/no.png"
like 'and it is said what was expected' "$err" '^weft: --audit: expected a number from 0 to 100, found "101"'

finish
