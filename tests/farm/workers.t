#!/bin/bash
# Workers that are started by hand: before or after their coordinator, once or again and again, told to end, refused.
. tests/tap.sh

quick=("$scenes/showcase.json" --size 121x68)
"$weft" render "${quick[@]}" -q -o "$tmp/quick.png"
"$weft" render "${quickly[@]}" -q -o "$tmp/slow.png"
hold_port

# coordinator LABEL OPTION...: starts a render without local workers.
coordinator() {
    local label=$1
    shift
    start "$label" "$weft" render --workers 0 -o "$tmp/$label.png" "$@"
}

# --- before and after -----------------------------------------------------------------------------------------
start early "$worker" --once --threads 2 "tcp://127.0.0.1:$port"
early=$pid
wait_until "[ -d /proc/$early/task ] && [ -n \"\$(processes weft-worker)\" ]" 60
coordinator first "${quick[@]}" --listen "tcp://127.0.0.1:$port"
ends 0 "a worker that was there before the render is found" "$pid" 60 first
ends 0 "and ends with it, as told by --once" "$early" 60 early
same_bytes "the picture is the same" "$tmp/first.png" "$tmp/quick.png"

coordinator second "${quick[@]}" --listen 'tcp://127.0.0.1:*'
coordinator=$pid
listening second
like "a free port is chosen and told" "$endpoint" '^tcp://127\.0\.0\.1:[0-9]+$'
start late "$worker" --once --threads 2 "${endpoint#tcp://}"
ends 0 "a worker may come while the render waits, HOST:PORT is enough" "$pid" 60 late
ends 0 "the render then ends" "$coordinator" 60 second
same_bytes "the picture is the same" "$tmp/second.png" "$tmp/quick.png"

coordinator ipc "${quick[@]}" --listen "ipc://$tmp/here.ipc"
coordinator=$pid
start ipc-worker "$worker" --once "ipc://$tmp/here.ipc"
ends 0 "a worker may come by ipc" "$coordinator" 60 ipc
ends 0 "and ends with the render" "$pid" 60 ipc-worker
same_bytes "the picture is the same" "$tmp/ipc.png" "$tmp/quick.png"
ok "no socket is left behind" is_empty "$tmp/run/weft"

coordinator mixed "${slow[@]}" --listen "tcp://127.0.0.1:$port" --progress json
coordinator=$pid
start one "$worker" --once --threads 1 --kernel ref "127.0.0.1:$port"
one=$pid
wait_until "has_rows mixed 1" 60
kill -STOP "$one" # so that it does not come to the end alone
start two "$worker" --once --threads 1 --kernel ref "127.0.0.1:$port"
wait_until "said mixed 'worker 2 .*joined'" 60
kill -CONT "$one"
ends 0 "a second worker may join in the middle" "$coordinator" 60 mixed
ends 0 "the first ends well" "$one" 60 one
ends 0 "the second ends well" "$pid" 60 two
like "both joined" "$(cat "$tmp/mixed.err")" 'worker 2 .*joined'
same_bytes "the picture is the same" "$tmp/mixed.png" "$tmp/slow.png"

# --- one worker, several renders ------------------------------------------------------------------------------
start loyal "$worker" --threads 2 "tcp://127.0.0.1:$port"
loyal=$pid
for render in third fourth; do
    coordinator $render "${quick[@]}" --listen "tcp://127.0.0.1:$port"
    ends 0 "a worker without --once serves the $render render" "$pid" 60 $render
    same_bytes "the $render picture is the same" "$tmp/$render.png" "$tmp/quick.png"
done
ok "it still waits for more" kill -0 "$loyal"
kill -TERM "$loyal"
ends 0 "SIGTERM ends it while it is idle" "$loyal" 10 loyal

# --- draining -------------------------------------------------------------------------------------------------
coordinator drain "${slow[@]}" --listen "tcp://127.0.0.1:$port" --progress json
coordinator=$pid
start leaver "$worker" --threads 1 --kernel ref "tcp://127.0.0.1:$port"
leaver=$pid
wait_until "has_rows drain 5" 60
kill -TERM "$leaver"
ends 0 "SIGTERM drains a busy worker, which ends well" "$leaver" 60 leaver
ok "the render goes on" kill -0 "$coordinator"
ok "the worker is not taken for dead" [ "$(grep -c 'is lost' "$tmp/drain.err")" = 0 ]
start heir "$worker" --once --threads 2 "tcp://127.0.0.1:$port"
ends 0 "another worker completes the render" "$coordinator" 60 drain
same_bytes "the picture is the same" "$tmp/drain.png" "$tmp/slow.png"

# A band as high as the picture, each of whose tiles takes many seconds.
coordinator stuck "${slow[@]}" --samples 60000 --band 65535 --listen "tcp://127.0.0.1:$port" --progress json
coordinator=$pid
start hasty "$worker" --threads 1 --kernel ref "tcp://127.0.0.1:$port"
hasty=$pid
wait_until "grep -q '\"state\":\"working\"' '$tmp/stuck.out'" 60
kill -TERM "$hasty"
ok "a draining worker is shown as such" wait_until "grep -q '\"state\":\"draining\"' '$tmp/stuck.out'" 60
kill -TERM "$hasty"
ends 143 "a second SIGTERM ends it at once" "$hasty" 10 hasty
says "its loss is noticed" stuck 'is lost'
start interrupted "$worker" --threads 1 --kernel ref "tcp://127.0.0.1:$port"
interrupted=$pid
wait_until "grep -q 'worker 2 .*joined' '$tmp/stuck.err'" 60
kill -INT "$interrupted"
ends 130 "SIGINT ends a worker at once" "$interrupted" 10 interrupted
kill -TERM "$coordinator"
ends 143 "SIGTERM ends the render" "$coordinator" 10 stuck

# --- nobody there ---------------------------------------------------------------------------------------------
exits 1 "--wait ends a worker whose coordinator does not come" "$worker" --wait 1 "tcp://127.0.0.1:$port"
like "and it says so" "$err" '^weft-worker: no coordinator answered within 1 s$'
like "and where it looked" "$err" "^weft-worker: looking for a coordinator at tcp://127.0.0.1:$port$"

# --- refused --------------------------------------------------------------------------------------------------
# The messages are those of common/wire/message.h: 15 bytes of header, then a HELLO's two digests of 32 bytes.
start router perl tests/farm/zmtp.pl router
wait_until "[ -s '$tmp/router.out' ]" 60
start greeter "$worker" --once --wait 20 "tcp://127.0.0.1:$(head -n 1 "$tmp/router.out")"
wait_until "[ \"\$(wc -l <'$tmp/router.out')\" -ge 2 ]" 60
hello=$(sed -n 2p "$tmp/router.out")
kill -INT "$pid"
like "a worker says HELLO first" "$hello" '^57454654020001(00){8}'

coordinator strict "${quick[@]}" --listen 'tcp://127.0.0.1:*'
coordinator=$pid
listening strict
# tampered OFFSET: the HELLO with the byte at that offset changed is sent; leaves $answer behind.
tampered() {
    local at=$((2 * $1))
    answer=$(printf '%s%02x%s\n' "${hello:0:at}" $((0x${hello:at:2} ^ 1)) "${hello:at+2}" |
        perl tests/farm/zmtp.pl dealer "${endpoint##*:}" | perl -ne 'print pack "H*", $_' | tr -d '\0')
}
tampered 20
like "a worker with another core is refused" "$answer" 'built from other sources'
says "and the coordinator says so" strict 'refused a worker on .*built from other sources'
tampered 60
like "a worker that computes other bytes is refused" "$answer" 'computes other bytes'
says "and the coordinator says so" strict 'refused a worker on .*computes other bytes'
start honest "$worker" --once "$endpoint"
ends 0 "a true worker is still welcome" "$coordinator" 60 strict
same_bytes "the picture is the same" "$tmp/strict.png" "$tmp/quick.png"

reason="you are not one of us"
mkfifo "$tmp/answers"
start refuser bash -c "exec perl tests/farm/zmtp.pl router <'$tmp/answers'"
exec 3>"$tmp/answers"
wait_until "[ -s '$tmp/refuser.out' ]" 60
printf '574546540200080000000000000000%02x00%s\n' ${#reason} "$(perl -e 'print unpack "H*", shift' "$reason")" >&3
exits 1 "a refused worker with --once ends" "$worker" --once "127.0.0.1:$(cat "$tmp/refuser.out")"
exec 3>&-
like "and says why" "$err" "^weft-worker: the coordinator refused this worker: $reason\$"

printf '574546540300ff' >"$tmp/newer" # of protocol version 3, and who knows what
start newer bash -c "exec perl tests/farm/zmtp.pl router <'$tmp/newer'"
wait_until "[ -s '$tmp/newer.out' ]" 60
exits 1 "a worker with --once ends where another version is spoken" "$worker" --once "127.0.0.1:$(cat "$tmp/newer.out")"
like "and names both" "$err" 'refused this worker: it speaks version 3 of the protocol, this worker version 2$'

finish
