#!/bin/bash
# What is said goes to a file as well, with times, from the coordinator and from its workers; and as JSON for programs.
. tests/tap.sh

quick=("$scenes/showcase.json" --size 121x68)
stamp='^[0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9]{2}:[0-9]{2}:[0-9]{2}\.[0-9]{3}Z'

# --- a file ---------------------------------------------------------------------------------------------------
said=$("$weft" render "${quick[@]}" --workers 2 --listen 'tcp://127.0.0.1:*' -q --log "$tmp/log" -o "$tmp/quick.png" 2>&1)
is "with a log, -q is as quiet as without" "$said" ''
is "each line has a time, a level and a process" \
    "$(grep -Evc "$stamp (error|warning|info|debug) weft(-worker)?\[[0-9]+\]: ." "$tmp/log")" 0
like "the coordinator's lines are there" "$(cat "$tmp/log")" ' info weft\[[0-9]+\]: listening on tcp://127'
is "and those of both local workers" "$(grep -o ' weft-worker\[[0-9]*\]' "$tmp/log" | sort -u | wc -l)" 2

before=$(cat "$tmp/log")
"$weft" render "${quick[@]}" --log "$tmp/log" -o "$tmp/quick.png" --progress none >"$tmp/out" 2>&1
is "a second render appends" "$(head -c "$(wc -c <<<"$before")" "$tmp/log")" "$before"
like "what standard output gets is information in the log" "$(cat "$tmp/log")" \
    " info weft\[[0-9]+\]: $tmp/quick.png: 121×68"

# --- JSON -----------------------------------------------------------------------------------------------------
"$weft" render "${quick[@]}" --log "$tmp/json" --log-json -v -o "$tmp/quick.png" >"$tmp/out" 2>"$tmp/err"
ok "a log of JSON is JSON, line by line, with the same members" perl -MJSON::PP -e '
    while (<>) {
        join(" ", sort keys %{decode_json $_}) eq "level message pid program time" or die $_;
    }' "$tmp/json"
like "and standard error is for people then" "$(cat "$tmp/err")" '^weft: '

"$weft" render "${quick[@]}" --log-json -v -o "$tmp/quick.png" >"$tmp/out" 2>"$tmp/err"
is "without a log, standard error is all JSON" "$(grep -Evc '^\{"time":".*"\}$' "$tmp/err")" 0
ok "and not empty" test -s "$tmp/err"
like "and standard output is what it was" "$(cat "$tmp/out")" "^$tmp/quick.png: 121×68"

# --- what a worker is told ------------------------------------------------------------------------------------
start none "$worker" --wait 1 --log "$tmp/lonely" "ipc://$tmp/nobody.ipc"
ends 1 "a worker that finds nobody ends" "$pid" 10 none
like "and its log has the reason" "$(cat "$tmp/lonely")" "$stamp [a-z]+ weft-worker\[$pid\]: no coordinator answered within 1 s"

# --- what cannot be a log -------------------------------------------------------------------------------------
refused() { # STATUS NAME PATTERN COMMAND...
    local expected=$1 name=$2 pattern=$3 said status=0
    shift 3
    said=$("$@" 2>&1) || status=$?
    is "$name: status" "$status" "$expected"
    like "$name: one sentence" "$said" "$pattern"
}
mkdir "$tmp/folder"
refused 4 "a folder" "^weft: $tmp/folder: the log cannot be written: Is a directory\$" \
    "$weft" render "${quick[@]}" -o "$tmp/no.png" --log "$tmp/folder"
refused 4 "a worker's" "^weft-worker: $tmp/no/log: the folder $tmp/no is not there\$" \
    "$worker" --log "$tmp/no/log" "ipc://$tmp/nobody.ipc"
cp "$tmp/quick.png" "$tmp/kept.png"
refused 2 "the picture itself" "and --log would both be written to $tmp/kept.png" \
    "$weft" render "${quick[@]}" -o "$tmp/kept.png" --log "$tmp/kept.png"
same_bytes "which is not touched" "$tmp/kept.png" "$tmp/quick.png"

ok "a full disk under the log does not end the render" \
    "$weft" render "${quick[@]}" -q --log /dev/full -o "$tmp/full.png" 2>"$tmp/err"
like "and is said" "$(cat "$tmp/err")" '^weft: warning: lines are missing in the log: No space left on device$'
same_bytes "the picture is the same" "$tmp/full.png" "$tmp/quick.png"

finish
