#!/bin/bash
# weft status: what a running coordinator is doing, for whoever may know; and whoever asks, the picture has the same
# bytes.

# Coordinators outside of any session, as others may run them on this machine, are not to be found: an empty folder hides
# theirs, where that may be mounted.
if [ -z "${WEFT_ALONE-}" ] && unshare --mount true 2>/dev/null; then
    WEFT_ALONE=yes exec unshare --mount "$BASH" -c 'mkdir -p -m 700 "/tmp/weft-$UID" &&
        mount -t tmpfs -o mode=700 none "/tmp/weft-$UID"; exec "$BASH" "$0"' "$0"
fi
. tests/tap.sh

brief=("$scenes/showcase.json" --size 121x68 --samples 4)
endless=("${slow[@]}" --samples 20000 --band 1 --no-resume) # until it is told to end; all of it can be shown
"$weft" render "${brief[@]}" -q -o "$tmp/brief.png"

# as_promised NAME FILE: each of its lines is what the schema says.
as_promised() {
    local said
    said=$(perl tests/farm/as_promised.pl coordinator/snapshot.schema.json "$2" lines 2>&1)
    report $? "$1" || note "$said"
}

# own LABEL: the private endpoint of the render started last, once it is there.
own() {
    endpoint=ipc://$XDG_RUNTIME_DIR/weft/$1.ipc
    wait_until "[ -S '${endpoint#ipc://}' ]" 60
}

# --- nobody to ask --------------------------------------------------------------------------------------------
others=$(ls "/tmp/weft-$(id -u)" 2>/dev/null) # coordinators outside of any session: not this test's
if [ -n "$others" ]; then
    skip "no coordinator" "others run on this machine"
else
    exits 1 "no coordinator" "$weft" status
    like "and that is said" "$err" '^weft: no coordinator of this user runs on this machine; '
fi
exits 1 "nobody there" "$weft" status --wait 1 "ipc://$tmp/none.ipc"
is "and that is said" "$err" "weft: ipc://$tmp/none.ipc: no coordinator answered within 1 s"
exits 1 "nobody there, by --watch" "$weft" status --wait 1 --watch 127.0.0.1:1
is "and that is said" "$err" "weft: tcp://127.0.0.1:1: no coordinator answered within 1 s"
exits 2 "another machine is not asked without keys" "$weft" status 192.0.2.1
like "and that is said" "$err" '^weft: tcp://192\.0\.2\.1:7420 is on another machine, .* --keys DIR .* --insecure'
exits 2 "two endpoints" "$weft" status a b
exits 2 "no endpoint" "$weft" status '!'
exits 2 "keys and no keys" "$weft" status --keys "$tmp" --insecure 127.0.0.1
exits 2 "no time" "$weft" status --wait 0
exits 3 "no keys in the folder" "$weft" status --keys "$tmp" 127.0.0.1
like "and that is said" "$err" "^weft: $tmp/coordinator.pub: cannot be opened"

# --- once -----------------------------------------------------------------------------------------------------
start first "$weft" render "${endless[@]}" -o "$tmp/first.png" --progress json --workers 2
first=$pid
wait_until "has_rows first 2" 60
exits 0 "the coordinator of this machine is found" "$weft" status
like "its scene and picture" "$out" "^showcase\\.json → $tmp/first\\.png  160 × 90, 20000 samples$"
like "how far it is, as a strip" "$out" '^[█▒░0-9]{119}$'
like "and in figures" "$out" '^ *[0-9]+ %  .* rays/s'
is "and its workers" "$(grep -Ec ' threads? +ref .* rays/s  (working|loading|idle)$' <<<"$out")" 2
exits 0 "as JSON" "$weft" status --json "ipc://$XDG_RUNTIME_DIR/weft/$first.ipc"
is "it is one line" "$(wc -l <"$tmp/run.out")" 1
cp "$tmp/run.out" "$tmp/once.json"
as_promised "as promised" "$tmp/once.json"
like "of that render" "$out" "\"output\":\"$tmp/first.png\",\"state\":\"running\""
if [ -w /dev/full ]; then
    exits 4 "a full disk is noticed" bash -c "'$weft' status >/dev/full"
fi

# --- several --------------------------------------------------------------------------------------------------
start second "$weft" render "${endless[@]}" -o "$tmp/second.png" --listen 'tcp://127.0.0.1:*'
second=$pid
listening second
exits 2 "of several coordinators one is to be named" "$weft" status
like "and they are" "$err" "^weft: 2 coordinators run on this machine; say which: ipc://.*, ipc://"
like "the first" "$err" "[ ]ipc://$XDG_RUNTIME_DIR/weft/$first\\.ipc"
like "and the second" "$err" "[ ]ipc://$XDG_RUNTIME_DIR/weft/$second\\.ipc"
exits 0 "one is named, by TCP" "$weft" status "$endpoint"
like "and that is it" "$out" "→ $tmp/second\\.png "
cp "$tmp/run.out" "$tmp/by-tcp"
exits 0 "by its address and port alone" "$weft" status "${endpoint#tcp://}"

# --- watching -------------------------------------------------------------------------------------------------
start interrupted "$weft" status --watch --json "$endpoint"
wait_until "[ \"\$(wc -l <'$tmp/interrupted.out')\" -ge 2 ]" 60
kill -INT "$pid"
ends 130 "a watcher can be interrupted" "$pid" 20 interrupted
start watcher "$weft" status --watch --json "$endpoint"
watcher=$pid
wait_until "said second joined" 60
start lines "$weft" status --watch "$endpoint"
lines=$pid
wait_until "[ \"\$(wc -l <'$tmp/watcher.out')\" -ge 3 ] && [ -s '$tmp/lines.out' ]" 60
kill -TERM "$second"
ends 143 "a render that is watched is interrupted" "$second" 10 second
ends 1 "its watcher ends" "$watcher" 60 watcher
is "and says so" "$(cat "$tmp/watcher.err")" "weft: $endpoint: the render ended before it was complete"
as_promised "what it has written is as promised" "$tmp/watcher.out"
ends 1 "so does one who reads lines" "$lines" 60 lines
is "and says so" "$(cat "$tmp/lines.err")" "weft: $endpoint: the render ended before it was complete"
like "which are those of a render" "$(head -n 1 "$tmp/lines.out")" \
    '^weft: showcase\.json: [0-9]+ %, .* rays/s, 1 worker$'

start lost "$weft" status --watch --wait 3
lost=$pid
wait_until "[ -s '$tmp/lost.out' ]" 60
slay "$first"
ends 1 "a coordinator that is killed is missed" "$lost" 10 lost
like "and that is said" "$(cat "$tmp/lost.err")" "/$first\\.ipc: lost the coordinator: no word for 3 s$"
if [ -n "$others" ]; then
    skip "a socket that a coordinator left" "others run on this machine"
else
    exits 1 "a socket that a coordinator left is not taken for one" "$weft" status
fi

# idle LABEL: starts a render whose worker is yet to come, so that there is time to look.
idle() {
    start "$1" "$weft" render "${slow[@]}" -o "$tmp/$1.png" --progress none --no-resume --workers 0 \
        --listen "ipc://$tmp/$1.ipc"
    own "$pid"
}

# help LABEL: its worker.
help() {
    start "$1-worker" "$worker" --once --threads 2 --kernel ref "ipc://$tmp/$1.ipc"
}

idle whole
whole=$pid
start json "$weft" status --watch --json "$endpoint"
json=$pid
start text "$weft" status --watch
text=$pid
wait_until "[ -s '$tmp/json.out' ] && [ -s '$tmp/text.out' ]" 60
help whole
ends 0 "a render that is watched ends" "$whole" 60 whole
ends 0 "so does its watcher" "$json" 60 json
as_promised "every line is as promised" "$tmp/json.out"
like "the last says that all is done" "$(tail -n 1 "$tmp/json.out")" '"state":"done".*"rows_done":90,'
ends 0 "so does one who reads lines" "$text" 60 text
like "the last of them says it too" "$(tail -n 1 "$tmp/text.out")" '^weft: showcase\.json: 100 %'

# --- a terminal -----------------------------------------------------------------------------------------------
if ! type script >/dev/null 2>&1; then
    skip "a terminal" "there is no script(1)"
else
    idle shown
    shown=$pid
    for columns in 80 40; do
        printf -v command '%q ' "$weft" status "$endpoint"
        run env TERM=xterm script -qec "stty cols $columns rows 24; $command" /dev/null
        is "on a terminal of $columns columns it fits" "$(tr -d '\r' <"$tmp/run.out" | grep -E ".{$columns}")" ''
        like "a strip is drawn" "$out" "^[█▒░0-9]{$((columns - 1))}"
    done
    start terminal env TERM=xterm script -qec "stty cols 80 rows 24; $weft status --watch $endpoint" /dev/null
    terminal=$pid
    wait_until "grep -q ░ '$tmp/terminal.out'" 60
    help shown
    ends 0 "the render ends" "$shown" 60 shown
    ends 0 "one who watches on a terminal sees it to its end" "$terminal" 60 terminal
    like "as a block that is redrawn" "$(cat "$tmp/terminal.out")" $'\e\\[[0-9]A'
    like "which stays" "$(tail -n 4 "$tmp/terminal.out")" '^100 % '
fi

# --- keys -----------------------------------------------------------------------------------------------------
keys=$tmp/keys
"$weft" keygen "$keys" >/dev/null
"$weft" keygen --worker loom "$keys" >/dev/null
"$weft" keygen "$tmp/other" >/dev/null
mkdir "$tmp/watching" "$tmp/unknown"
cp -p "$keys/coordinator.pub" "$keys/watcher.key" "$tmp/watching"
cp -p "$keys/coordinator.pub" "$tmp/other/watcher.key" "$tmp/unknown"
start guarded "$weft" render "${endless[@]}" -o "$tmp/guarded.png" --listen 'tcp://127.0.0.1:*' --keys "$keys"
guarded=$pid
listening guarded
exits 0 "with a watcher's key" "$weft" status --keys "$tmp/watching" "$endpoint"
like "the render is seen" "$out" "→ $tmp/guarded\\.png "
exits 0 "with a worker's key" "$weft" status --keys "$keys/loom" "$endpoint"
like "the render is seen" "$out" "→ $tmp/guarded\\.png "
exits 1 "with an unknown key" "$weft" status --wait 2 --keys "$tmp/unknown" "$endpoint"
like "nothing is, and why is guessed" "$err" \
    "no coordinator answered within 2 s \\(if there is one, its keys and these may not"
like "the coordinator says who was refused" "$(cat "$tmp/guarded.err")" \
    'its key .{40} is not among the workers or watchers'
exits 1 "without a key" "$weft" status --wait 1 "$endpoint"
exits 1 "with keys of another farm" "$weft" status --wait 1 --keys "$tmp/other" "$endpoint"
exits 0 "on the coordinator's machine none is needed" "$weft" status
kill -TERM "$guarded"
ends 143 "the render has not minded" "$guarded" 10 guarded
is "nobody has joined but its own worker" "$(grep -c joined "$tmp/guarded.err")" 1

# --- coordinators that say anything ---------------------------------------------------------------------------
# says NAME STATUS PATTERN HEX OPTION...: a coordinator that answers with those bytes, or not at all; what is shown.
says() {
    local name=$1 expected=$2 pattern=$3
    printf '%s' "$4" >"$tmp/hex"
    shift 4
    start router bash -c "exec perl tests/farm/zmtp.pl router <'$tmp/hex'"
    local router=$pid
    wait_until "[ -s '$tmp/router.out' ]" 60
    exits "$expected" "$name" "$weft" status --wait 2 "$@" "127.0.0.1:$(head -n 1 "$tmp/router.out")"
    like "$name: what is shown" "$out$err" "$pattern"
    is "$name: nothing steers the terminal" "$(tr -d '\n[:print:]\200-\377' <<<"$out$err" | wc -c)" 0
    slay "$router"
}
# status_of TEXT [TOTAL]: a STATUS with that text, as the only part of its answer.
status_of() {
    perl -e 'my ($text, $total) = @ARGV; print unpack "H*", "WEFT" . pack("vCx8Q<Q<CQ<Q<V", 2, 18, 1, 7, 0, 0,
        $total // length $text, length $text) . $text' "$@"
}
job='"state":"running","width":8,"height":2,"samples_max":4,"samples":4,"error":null,"rmse":null,"rows_done":0'
job+=',"rows_in_work":0,"rays":0,"elapsed":1,"remaining":null,'
job+='"bands":[{"first_row":0,"rows":2,"state":"waiting","worker":null}]'
whole_of() { # SCENE HOST
    echo '{"elapsed":1,"rays":0,"rays_per_second":0,"refused":0,"jobs":[{"scene":"'"$1"'","output":"o",'"$job"'}],
        "workers":[{"number":1,"host":"'"$2"'","pid":1,"threads":1,"kernel":"\u001b[5m","state":"idle","bands_held":0,
        "bands_done":0,"rows_done":0,"rays":0,"rays_per_second":0,"trouble":null}]}'
}
says "a good answer" 0 '^good\.json → o  8 × 2' "$(status_of "$(whole_of good.json host)")"
says "names that would steer the terminal" 0 '^.\[2Jx\.json → o' \
    "$(status_of "$(whole_of '\u001b[2Jx.json' '\u009b1m\u202e')")"
says "another version" 1 'speaks version 3 of the protocol, this weft 2$' \
    "$(sed 's/0200/0300/' <<<"$(status_of '{}')")"
says "no message" 1 "expected one of weft's, found other bytes$" 68656c6c6f
says "an empty object" 1 'the status: elapsed: expected a number' "$(status_of '{}')"
says "no JSON" 1 'the status:1:1: expected a value' "$(status_of 'hello')"
says "a picture without height" 1 'jobs\[0\]\.bands: expected all rows' \
    "$(status_of "$(whole_of a b | sed 's/"height":2/"height":0/')")"
says "more than may be" 1 'STATUS: total: expected 0 to 8388608' "$(status_of '{}' 8388609)"
says "less than it announces" 1 'no word for 2 s$' "$(status_of '{}' 100)"
says "a refusal" 1 'the coordinator does not answer: go.away$' \
    "57454654020008$(printf '0%.0s' {1..16})0700676f1b61776179"
says "nothing at all" 1 'no coordinator answered within 2 s$' '' --json

# --- a coordinator that is asked in another version -----------------------------------------------------------
start plain "$weft" render "${endless[@]}" -o "$tmp/plain.png" --listen 'tcp://127.0.0.1:*' --workers 1
plain=$pid
listening plain
answer=$(perl tests/farm/zmtp.pl dealer "${endpoint##*:}" <<<"574546540300ff")
like "who speaks another version is refused in this one" "$answer" '^57454654020008'

# --- many -----------------------------------------------------------------------------------------------------
memory_of() { # PID: the most that it has held, in kB
    sed -n 's/^VmHWM:[^0-9]*\([0-9]*\) kB$/\1/p' "/proc/$1/status"
}
before=$(memory_of "$plain")
ask=$(printf '57454654020011%032d0000000000000000%08d' 0 0)
answer=$(perl tests/farm/zmtp.pl dealer "${endpoint##*:}" 100000 <<<"${ask:0:70}")
like "who asks again and again without hearing gets a ticket, no more" "$answer" '^57454654020012'
after=$(memory_of "$plain")
if [ "$mode" = release ]; then
    ok "and that costs next to no memory ($before kB, then $after kB)" [ $((after - before)) -lt 20000 ]
fi
exits 0 "others are answered" "$weft" status "$endpoint"
kill -TERM "$plain"
ends 143 "the render has not minded" "$plain" 10 plain

many=$([ "$mode" = sanitize ] && echo 10 || echo 100)
start crowd "$weft" render "${brief[@]}" -o "$tmp/crowd.png" --listen 'tcp://127.0.0.1:*' --workers 0
crowd=$pid
listening crowd
watchers=()
for ((i = 0; i < many; i++)); do
    start "watcher$i" "$weft" status --watch --json --wait 60 "$endpoint"
    watchers+=("$pid")
done
ok "$many watchers are answered" \
    wait_until "[ \"\$(cat '$tmp'/watcher[0-9]*.out | grep -c elapsed)\" -ge $((2 * many)) ]" 60
start loop bash -c "while '$weft' status '$endpoint'; do :; done"
loop=$pid
start helper "$worker" --once "$endpoint"
ends 0 "a render under the eyes of $many is completed" "$crowd" 60 crowd
same_bytes "to the same bytes" "$tmp/crowd.png" "$tmp/brief.png"
ended=0
for process in "${watchers[@]}"; do
    wait_until "is_over $process" 70
    wait "$process" && ended=$((ended + 1))
done
is "and all of them see it" "$ended" "$many"
wait_until "is_over $loop" 60

finish
