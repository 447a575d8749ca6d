#!/bin/bash
# Whatever dies, the picture has the same bytes or there is none, nothing hangs and nothing is left behind.
. tests/tap.sh

"$weft" render "${quickly[@]}" -q -o "$tmp/slow.png"
longer=(--samples "$((2 * slow[-1]))") # so that a quarter of it is still long enough
"$weft" render "${quickly[@]}" "${longer[@]}" -q -o "$tmp/longer.png"
mkdir "$tmp/pictures"
forever=(--size 400x9999 --band 1) # beside the options of "slow": minutes, but a row soon

# render LABEL OPTION...: starts the slow render in the background.
render() {
    local label=$1
    shift
    start "$label" "$weft" render "${slow[@]}" --progress json -o "$tmp/pictures/$label.png" "$@"
}

# complete NAME LABEL [PICTURE]: the render $pid ends well, with PICTURE's bytes, or slow's, and nothing else.
complete() {
    ends 0 "$1: the render is completed" "$pid" 60 "$2"
    same_bytes "$1: the picture is the same" "$tmp/pictures/$2.png" "${3:-$tmp/slow.png}"
    rm -f "$tmp/pictures/$2.png"
    ok "$1: nothing else is written" is_empty "$tmp/pictures"
}

# --- a worker is killed ---------------------------------------------------------------------------------------
for moment in "2 0" "2 $((slow_rows / 2))" "3 1" "3 $((slow_rows * 3 / 4))"; do
    read -r workers rows <<<"$moment"
    name="one of $workers local workers killed at $rows rows"
    render "killed-$workers-$rows" --workers "$workers" "${longer[@]}"
    wait_until "has_rows killed-$workers-$rows $rows && [ -n \"\$(processes weft-worker)\" ]" 60
    kill -KILL "$(processes weft-worker "$pid" | head -n 1)"
    complete "$name" "killed-$workers-$rows" "$tmp/longer.png"
    like "$name: it is told" "$(cat "$tmp/killed-$workers-$rows.err")" 'process [0-9]+ was ended by signal 9 \(Killed\)'
done

render stopped --workers 2
wait_until "has_rows stopped 5" 60
kill -STOP "$(processes weft-worker "$pid" | head -n 1)"
complete "one of 2 local workers hung" stopped
ok "the hung worker is gone" wait_until '[ -z "$(processes weft-worker)" ]' 60

render remote --workers 0 --listen 'tcp://127.0.0.1:*'
coordinator=$pid
listening remote
start victim "$worker" --threads 1 --kernel ref "$endpoint"
victim=$pid
start survivor "$worker" --threads 1 --kernel ref --once "$endpoint"
survivor=$pid
wait_until "has_rows remote $((slow_rows / 3))" 60
slay "$victim"
pid=$coordinator
complete "one of 2 remote workers killed" remote
ends 0 "the other one ends well" "$survivor" 60 survivor

render last --workers 0 --listen 'tcp://127.0.0.1:*'
coordinator=$pid
listening last
start victim "$worker" --threads 2 --kernel ref "$endpoint"
victim=$pid
wait_until "has_rows last 10" 60
slay "$victim"
start heir "$worker" --threads 2 --once "$endpoint"
pid=$coordinator
complete "the only remote worker killed, another one comes" last

# --- one machine that comes again and again, and each time dies with what it was given ------------------------
render relapse --workers 0 --listen 'tcp://127.0.0.1:*' --band 45
coordinator=$pid
listening relapse
for ((tries = 1; tries <= 10; tries++)); do
    start victim "$worker" --threads 1 --kernel ref "$endpoint"
    victim=$pid
    wait_until "[ \$(grep -c joined '$tmp/relapse.err') = $tries ]" 60
    wait_until "tail -n 1 '$tmp/relapse.out' | grep -q '\"bands_held\":[1-9]'" 60
    slay "$victim"
    wait_until "[ \$(grep -c 'is lost' '$tmp/relapse.err') = $tries ]" 60
    grep -q 'starting a local worker' "$tmp/relapse.err" && break
done
pid=$coordinator
complete "the same machine lost three times with the same rows" relapse
like "a local worker has tried them" "$(cat "$tmp/relapse.err")" \
    'rows [0-9]+ to [0-9]+ were lost 3 times with workers of the same machines; starting a local worker'

# --- all of them, again and again -----------------------------------------------------------------------------
render hopeless --workers 2 "${forever[@]}" --no-resume # a row may be done before the last one is killed
kill_workers_of "$pid" 60
ends 1 "with all local workers killed again and again the render fails" "$pid" 60 hopeless
like "and says so" "$(tail -n 1 "$tmp/hopeless.err")" '^weft: .*(all local workers have died|lost)'
ok "nothing is written" is_empty "$tmp/pictures"
ok "no worker is left" [ -z "$(processes weft-worker)" ]

# --- the coordinator is ended ---------------------------------------------------------------------------------
for end in "INT 130" "TERM 143" "HUP 129"; do
    read -r signal expected <<<"$end"
    for moment in waiting rendering; do
        label=$signal-$moment
        if [ $moment = waiting ]; then
            render "$label" --workers 0 --listen 'tcp://127.0.0.1:*'
            listening "$label"
        else
            render "$label" --workers 2 "${forever[@]}"
            wait_until "has_rows $label 1" 60
        fi
        kill "-$signal" "$pid"
        ends "$expected" "SIG$signal while $moment: exit status $expected" "$pid" 10 "$label"
        left=$([ $moment = waiting ] || echo ".$label.png.journal")
        is "SIG$signal while $moment: no picture, no temporary file" "$(ls -A "$tmp/pictures")" "$left"
        rm -f "$tmp/pictures/.$label.png.journal"
        ok "SIG$signal while $moment: no worker is left" [ -z "$(processes weft-worker)" ]
        ok "SIG$signal while $moment: no socket is left" is_empty "$tmp/run/weft"
        like "SIG$signal while $moment: it is told" "$(cat "$tmp/$label.err")" '^weft: interrupted'
    done
done

render orphans --workers 2 "${forever[@]}"
wait_until "has_rows orphans 1" 60
slay "$pid"
ok "local workers end with a coordinator that is killed" wait_until '[ -z "$(processes weft-worker)" ]' 60
ok "there is no picture" absent "$tmp/pictures/orphans.png"
exits 0 "the next render works" "$weft" render "$scenes/first.json" --size 40x20 --samples 1 -q -o "$tmp/pictures/orphans.png"
ok "the socket that the killed one left is removed" is_empty "$tmp/run/weft"

finish
