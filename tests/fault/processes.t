#!/bin/bash
# Processes on several machines that are stopped, go on, and are killed: the picture has the same bytes.
. tests/fault/network.sh

machine loom heddle
"$weft" render "${quickly[@]}" -q -o "$tmp/slow.png"

# --- a worker -------------------------------------------------------------------------------------------------
coordinator asleep "${slow[@]}"
render=$pid
join sleeper loom --once
wait_until "has_rows asleep 1" 60
kill -STOP "$pid"
ok "the only worker is stopped: the coordinator notices" wait_until "said asleep 'has been silent too long'" 60
kill -CONT "$pid"
complete "the only worker is stopped and goes on" asleep "$render" "$tmp/slow.png"
ends 0 "it has joined again, even with --once, and ends well" "$pid" 10 sleeper

coordinator killed "${slow[@]}"
render=$pid
join first loom
wait_until "has_rows killed 20" 60
slay "$pid"
join second heddle --once
complete "the only worker is killed, another comes" killed "$render" "$tmp/slow.png"
ends 0 "that one ends well" "$pid" 10 second

# --- the coordinator ------------------------------------------------------------------------------------------
join third loom
third=$pid
join fourth heddle
fourth=$pid

coordinator stopped "${slow[@]}"
render=$pid
wait_until "has_rows stopped 1 && said stopped joined 2" 60
kill -STOP "$render"
for label in third fourth; do
    ok "the coordinator is stopped: the $label worker notices" \
        wait_until "said $label 'no word from the coordinator'" 60
done
kill -CONT "$render"
complete "the coordinator is stopped and goes on" stopped "$render" "$tmp/slow.png"

for rows in 1 30 60; do
    coordinator resumed "${slow[@]}" --band 3
    wait_until "has_rows resumed $rows" 60
    slay "$pid"
done
coordinator resumed "${slow[@]}" --band 3
complete "the coordinator is killed three times" resumed "$pid" "$tmp/slow.png"
like "it goes on where it was" "$(cat "$tmp/resumed.err")" 'going on from its journal: [0-9]+ of 90 rows'

kill -TERM "$third" "$fourth"
ends 0 "a worker outlives all of that and ends well" "$third" 10 third
ends 0 "so does the other" "$fourth" 10 fourth

finish
