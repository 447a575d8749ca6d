#!/bin/bash
# Keys: made once and never overwritten; with them a farm takes over TCP whom it knows, and nobody else; whoever
# knocks, the picture has the same bytes.
. tests/tap.sh

quick=("$scenes/showcase.json" --size 121x68)
"$weft" render "${quick[@]}" -q -o "$tmp/quick.png"
keys=$tmp/keys

# --- keygen ---------------------------------------------------------------------------------------------------
modes() { # FOLDER: of it and all in it
    (cd "$1" && stat -c '%a %n' . ./* | tr '\n' ' ')
}
farm_modes='700 . 600 ./coordinator.key 644 ./coordinator.pub 600 ./watcher.key 644 ./watcher.pub 644 ./watchers '
farm_modes+='600 ./worker.key 644 ./worker.pub 644 ./workers '

exits 0 "keygen makes a farm's keys" "$weft" keygen "$keys"
is "secrets can be read by their owner only" "$(modes "$keys")" "$farm_modes"
exits 0 "also where everything may be read by everybody" bash -c "umask 000; exec '$weft' keygen '$tmp/other'"
is "secrets can be read by their owner only" "$(modes "$tmp/other")" "$farm_modes"
is "every file says what it is" "$(head -qn 1 "$keys"/* | grep -c '^# .*\.$')" 8
is "and has one key" "$(cat "$keys"/* | grep -c '^[^ ]\{40\}\( # .*\)\?$')" 8
is "no two are the same" "$(cat "$keys"/*.??? "$tmp/other"/*.??? | grep -v '^# ' | sort -u | wc -l)" 12

exits 0 "keygen --worker makes keys for one more worker" "$weft" keygen --worker loom-2 "$keys"
is "all that its machine needs" "$(modes "$keys/loom-2")" \
    '700 . 644 ./coordinator.pub 600 ./worker.key 644 ./worker.pub '
is "its key is admitted" "$(tail -n 1 "$keys/workers")" "$(tail -n 1 "$keys/loom-2/worker.pub") # loom-2"

# unchanged NAME FOLDER COMMAND...: the command exits with 4 and leaves the folder as it was.
unchanged() {
    local name=$1 folder=$2 before
    before=$(tar -C "$folder" --sort=name --mtime=@0 -c . | sha256sum)
    shift 2
    exits 4 "$name" "$@"
    is "$name: nothing is changed" "$(tar -C "$folder" --sort=name --mtime=@0 -c . | sha256sum)" "$before"
}
unchanged "keys are not overwritten" "$keys" "$weft" keygen "$keys"
like "and that is said" "$err" "^weft: $keys/coordinator.key: is there already, and keys are never overwritten$"
unchanged "a worker's neither" "$keys" "$weft" keygen --worker loom-2 "$keys"
like "and that is said" "$err" "^weft: $keys/loom-2: is there already, and keys are never overwritten$"
mkdir "$tmp/half"
echo mine >"$tmp/half/watchers"
unchanged "no folder is left half made" "$tmp/half" "$weft" keygen "$tmp/half"
exits 4 "a file is not a folder" "$weft" keygen "$keys/workers"
for name in '' . ../loom -x a/b 'a b' "$(printf 'a%.0s' {1..65})"; do
    exits 2 "\"$name\" is no name for a worker" "$weft" keygen "--worker=$name" "$keys"
done
printf '%s' "$(cat "$keys/workers")" >"$tmp/other/workers" # without the end of its last line
exits 0 "a worker is added behind a line without an end" "$weft" keygen --worker loom-3 "$tmp/other"
is "on a line of its own" "$(grep -c '^[^ ]\{40\} # ' "$tmp/other/workers")" 3

# --- files that are not as they should be ---------------------------------------------------------------------
# broken NAME FILE COMMAND PATTERN: after COMMAND was done to a copy of the keys, who reads FILE refuses it.
broken() {
    local program=("$weft" render "$scenes/first.json" --listen '127.0.0.1:*' -o "$tmp/none.png")
    [[ $2 = worker.key || $2 = coordinator.pub ]] && program=("$worker" 127.0.0.1:1)
    rm -rf "$tmp/broken"
    cp -rp "$keys" "$tmp/broken"
    (cd "$tmp/broken" && eval "$3")
    exits 3 "$2 $1 is refused" "${program[@]}" --keys "$tmp/broken"
    like "$2 $1: the sentence" "$err" "^weft(-worker)?: $tmp/broken/$2$4$"
}
for file in coordinator.key worker.key; do
    broken "readable by the group" $file "chmod 640 $file" ': expected a secret file .*, found mode 0640'
    broken "readable by all" $file "chmod 604 $file" ': expected a secret file .*, found mode 0604'
    broken "cut short" $file "truncate -s -9 $file" ':2: expected a key of 40 characters, found 32'
    broken "empty" $file ": >$file" ': expected a key, found none in 0 lines'
    broken "twice" $file "tail -n 1 $file >>$file" ':3: expected no second key'
    broken "not a key" $file "sed -i '2s/./~/' $file" ':2: expected a key in Z85, found 40 characters that are not'
    broken "missing" $file "rm $file" ': cannot be opened: No such file or directory'
    broken "a folder" $file "rm $file; mkdir $file" ': expected a regular file'
done
broken "writable by all" workers 'chmod 646 workers' ': expected a file that only its owner can write .* 0646'
broken "cut short" workers 'truncate -s 60 workers' ':2: expected a key of 40 characters, found 8'
broken "writable by the group" coordinator.pub 'chmod 664 coordinator.pub' ': expected a file that .* 0664'
broken "with a name before the key" workers 'sed -i "2s/^/loom-1 /" workers' ':2: expected one key, and .*'
# A file of root's is for the group that root gave it to, as one that Kubernetes mounts.
given() { # MODE: to a group, one of whom starts a worker
    rm -rf "$tmp/given"
    cp -rp "$keys/loom-2" "$tmp/given"
    chown -R root:65532 "$tmp/given"
    chmod 755 "$tmp/given"
    chmod "$1" "$tmp/given/worker.key"
    chmod 711 "$tmp"
    run "${nobody[@]}" "$worker" --wait 1 --keys "$tmp/given" 127.0.0.1:1
}
name="a secret that root gave to a group"
nobody=(setpriv --reuid 65532 --regid 65532 --clear-groups)
if [ "$(id -u)" = 0 ] && "${nobody[@]}" "$worker" --version >"$tmp/version" 2>&1; then
    given 440
    like "$name is used" "$err" '^weft-worker: no coordinator answered within 1 s'
    for mode in 460 444 450; do
        given $mode
        like "$name is refused with mode $mode" "$status $err" "^3 weft-worker: .*: expected a secret file .* 0$mode"
    done
else
    skip "$name is used" "only root can give one, and the programs must be where everybody may run them"
fi
ok "no picture was written" absent "$tmp/none.png"

# --- right keys -----------------------------------------------------------------------------------------------
# coordinator LABEL OPTION...: starts a render that listens; leaves $coordinator and $endpoint behind.
coordinator() {
    local label=$1
    shift
    start "$label" "$weft" render "${quick[@]}" --listen 'tcp://127.0.0.1:*' -o "$tmp/$label.png" "$@"
    coordinator=$pid
    listening "$label"
}

# completed LABEL NAME: the render ends well, with the right picture.
completed() {
    ends 0 "$2: the render is completed" "$coordinator" 60 "$1"
    same_bytes "$2: the picture is the same" "$tmp/$1.png" "$tmp/quick.png"
}

# helped LABEL NAME: as completed, by a worker that comes over the private endpoint, as local workers do.
helped() {
    start "$1-helper" "$worker" --once "ipc://$tmp/run/weft/$coordinator.ipc"
    completed "$1" "$2"
    like "$2: nobody joined before the local worker" "$(grep -m 1 joined "$tmp/$1.err")" "worker 1 .*process $pid\)"
}

# through relay|forge ARGUMENT...: leaves $relay, its id, and $there, an endpoint from which a relay leads to the
# coordinator.
through() {
    start relay perl tests/farm/relay.pl "$1" "${endpoint##*:}" "${@:2}"
    relay=$pid
    wait_until "[ -s '$tmp/relay.out' ]" 60
    there=127.0.0.1:$(head -n 1 "$tmp/relay.out")
}

coordinator right --keys "$keys" --workers 0
through relay "$tmp/recorded"
start first "$worker" --once --keys "$keys" --threads 1 "$there"
completed right "a worker with the farm's key"
ends 0 "it ends well" "$pid" 60 first
ok "what it said is kept" wait_until "[ -s '$tmp/recorded' ]" 60
ok "nothing of it can be read on the way" [ "$(grep -c WEFT "$tmp/recorded")" = 0 ]
coordinator own --keys "$keys" --workers 0
start second "$worker" --once --keys "$keys/loom-2" "$endpoint"
completed own "a worker with a key of its own"
coordinator mixed --keys "$keys" --workers 1
start third "$worker" --keys "$keys" "$endpoint"
third=$pid
completed mixed "local and remote workers"
kill -TERM "$third"
ends 0 "the remote one ends well" "$third" 20 third
for _ in {1..10}; do
    coordinator again --keys "$keys" --workers 0
    "$worker" --once --keys "$keys" "$endpoint" 2>>"$tmp/again.said"
    wait "$coordinator"
    cat "$tmp/again.err" >>"$tmp/again.told"
done
is "ten workers more come and go" "$(grep -c 'worker 1 .*joined' "$tmp/again.told")" 10
is "who ends with the coordinator makes no connection after that" "$(tail -n +2 "$tmp/relay.out")" ''
is "nobody is taken for a stranger" \
    "$(cat "$tmp"/{right,own,mixed}.err "$tmp/again.told" | grep 'refused')" ''

# --- wrong keys, and none -------------------------------------------------------------------------------------
mkdir "$tmp/unknown" "$tmp/watcher"
cp -p "$keys/coordinator.pub" "$tmp/unknown"
cp -p "$tmp/other/worker.key" "$tmp/unknown"
cp -p "$keys/coordinator.pub" "$tmp/watcher"
cp -p "$keys/watcher.key" "$tmp/watcher/worker.key"

coordinator guarded --keys "$keys" --workers 0
# refused NAME PATTERN WORKER-OPTION...: the coordinator says that it refused the worker, which ends when told to.
refused() {
    local name=$1 pattern=$2
    shift 2
    start intruder "$worker" "$@" "$endpoint"
    ok "$name: it is refused, and that is said" wait_until "grep -Eq -e '$pattern' '$tmp/guarded.err'" 60
    kill -TERM "$pid"
    ends 0 "$name: it has not joined" "$pid" 60 intruder
    ok "$name: nor does it think so" [ "$(grep -c joined "$tmp/intruder.err")" = 0 ]
}
refused "no key" 'refused somebody at tcp://127\.0\.0\.1:[0-9]+: it (showed no key|came without keys)'
unknown='refused 127\.0\.0\.1: its key [^ ]{40} is not among the workers or watchers'
refused "an unknown key" "$unknown" --keys "$tmp/unknown"
ok "the key that is told can be admitted" grep -qF "its key $(tail -n 1 "$tmp/other/worker.pub") is" "$tmp/guarded.err"
refused "a key for another coordinator" 'refused somebody at .* not encrypted for this coordinator' --keys "$tmp/other"
exits 1 "a watcher gets nothing" "$worker" --wait 2 --keys "$tmp/watcher" "$endpoint"
like "and is told what may be the matter" "$err" "no coordinator answered within 2 s .*keys.* may not match"
for frame in "1 greeting" "2 proof of its key" "3 first message"; do
    name="a worker whose ${frame#* } is forged on the way"
    through forge "$tmp/forged" "${frame%% *}"
    start honest "$worker" --keys "$keys" "$there"
    ends 0 "$name: its connection ends" "$relay" 60 relay
    slay "$pid"
    ok "$name: it has not joined" [ "$(grep -c joined "$tmp/honest.err")" = 0 ]
done
exits 0 "what another worker said is said again: the connection ends" \
    timeout 20 perl tests/farm/relay.pl replay "${endpoint##*:}" "$tmp/recorded"
for _ in {1..50}; do
    perl tests/farm/zmtp.pl dealer "${endpoint##*:}" <<<00 >"$tmp/knock" 2>&1
done
ok "fifty who knock without keys do not fill the log" [ "$(grep -c 'refused' "$tmp/guarded.err")" -le 20 ]
helped guarded "after all of these"
is "nobody else has joined" "$(grep -c joined "$tmp/guarded.err")" 1

coordinator plain --workers 0
exits 1 "a worker with keys does not join a coordinator without" "$worker" --wait 1 --keys "$keys" "$endpoint"
like "and is told what may be the matter" "$err" "no coordinator answered within 1 s .*keys.* may not match"
helped plain "a coordinator without keys"

# --- every interface ------------------------------------------------------------------------------------------
exits 0 "with keys every interface may be listened on" \
    "$weft" render "${quick[@]}" --listen 'tcp://0.0.0.0:*' --keys "$keys" -o "$tmp/open.png"
same_bytes "the picture is the same" "$tmp/open.png" "$tmp/quick.png"

finish
