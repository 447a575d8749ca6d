#!/bin/bash
# Links that are cut, cut in one direction, lossy or slow: the picture has the same bytes, and workers come back.
. tests/fault/network.sh

machine loom heddle shuttle
"$weft" render "${steady[@]}" -q -o "$tmp/steady.png"
"$weft" render "${quickly[@]}" -q -o "$tmp/slow.png"

# until_lost LABEL WORKER: waits until the worker has noticed that it hears nothing.
until_lost() {
    ok "$1: the worker notices" wait_until "said $2 'no word from the coordinator'" 60
}

coordinator cut "${slow[@]}"
render=$pid
join victim loom
victim=$pid
join survivor heddle --once
wait_until "has_rows cut 1 && said cut joined 2" 60
cut loom
complete "one of two links cut for good" cut "$render" "$tmp/slow.png"
ends 0 "one of two links cut for good: the other worker ends well" "$pid" 10 survivor
until_lost "one of two links cut for good" victim
kill -TERM "$victim"
ends 0 "one of two links cut for good: its worker can be ended" "$victim" 10 victim
heal loom

coordinator healed "${slow[@]}" # much must be left to do when all three links have their faults
render=$pid
declare -A worker_on # MACHINE: its worker
for machine in loom heddle shuttle; do
    join "$machine" "$machine"
    worker_on[$machine]=$pid
done
wait_until "has_rows healed 1 && said healed joined 3" 60
cut loom
deafen heddle
mute shuttle
until_lost "a link cut for a while" loom
until_lost "a worker that hears nothing for a while" heddle
ok "a worker that is not heard for a while: the coordinator notices" \
    wait_until "said healed '$(hostname), process ${worker_on[shuttle]}\) has been silent too long'" 60
for machine in loom heddle shuttle; do
    heal "$machine"
done
complete "all links healed" healed "$render" "$tmp/slow.png"
ok "all links healed: workers have joined again" said healed joined 4
for machine in loom heddle shuttle; do
    kill -TERM "${worker_on[$machine]}"
    ends 0 "all links healed: the worker on $machine ends well" "${worker_on[$machine]}" 10 "$machine"
done

# without_end NAME FAULT ARGUMENT: both links have that fault from before the workers join to the end.
without_end() {
    local name=$1 label=${1// /-} render first
    $2 loom "$3"
    $2 heddle "$3"
    coordinator "$label" "${steady[@]}"
    render=$pid
    join "$label-1" loom
    first=$pid
    join "$label-2" heddle
    complete "$name" "$label" "$render" "$tmp/steady.png"
    kill -TERM "$first" "$pid"
    ends 0 "$name: the first worker ends well" "$first" 60 "$label-1"
    ends 0 "$name: the second worker ends well" "$pid" 60 "$label-2"
    heal loom
    heal heddle
}
without_end "one packet in five is lost" lossy 0.2
without_end "1 Mbit a second" slow_down 1mbit

finish
