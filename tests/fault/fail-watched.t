#!/bin/bash
# Whatever fails in a render at which a browser and `weft status --watch` look all the time: the picture or a sentence,
# as without them. What they get whole is right. Where the page cannot be had at the start, that is an error; later its
# connections may fail, and the render goes on. `make failures` tries most of it, `make test` some.
. tests/fault/failing.sh

# some FEW MANY: one of so many is tried, by make test or make failures.
some() {
    [ -z "${FULL-}" ] && echo "$1" || echo "$2"
}

hold_port
more=(--http "$port")
start browser perl tests/fault/browser.pl "$port"

# watch: looks at every render that comes, until there is the file $tmp/enough; its exit statuses go to $tmp/statuses.
watch() {
    local socket status
    until [ -e "$tmp/enough" ]; do
        sleep 0.01
        for socket in "$tmp/run/weft"/*.ipc; do
            [ -S "$socket" ] || continue
            status=0
            "$weft" status --watch --json --wait 1 "ipc://$socket" >>"$tmp/seen" 2>>"$tmp/watch.err" || status=$?
            echo "$status" >>"$tmp/statuses"
        done
    done
}
watch &
watcher=$!

# --- the coordinator ------------------------------------------------------------------------------------------
FULL='' every weft memory '0|1|5' "$(some 997 7)"
FULL='' every weft descriptor '0|1|5' "$(some 9 1)"
FULL='' every weft send 0 "$(some 29 1)"
FULL='' every weft receive 0 "$(some 37 1)"

# The thread that serves the page; 5: what it allocates itself, not by libmicrohttpd or libpng.
[ -z "${FULL-}" ] || every weft thread 5
thread=MHD
FULL='' every weft memory '0|5' "$(some 397 3)"
thread=

# --- who looked -----------------------------------------------------------------------------------------------
# Many of those renders are over before anybody has looked.
exits 0 "a render in which nothing fails" "$weft" render "${slow[@]}" -q "${more[@]}" -o "$tmp/slow.png"
touch "$tmp/enough"
wait "$watcher"
is "nothing was wrong with what the browser got" "$(grep '^wrong' "$tmp/browser.out" | sort | uniq -c)" ''
is "it got every page" "$(sed -n 's/ 200$//p' "$tmp/browser.out" | sort -u | wc -l)" 9
like "who asks ends with the last answer or without" "$(sort -u "$tmp/statuses" | tr '\n' ' ')" '^0 (1 )?$'
like "and saw pictures to their end" "$(cat "$tmp/seen")" '"state":"done"'
is "saying nothing but sentences" "$(grep -v '^weft: [^ ].* ' "$tmp/watch.err")" ''

# --- who asks -------------------------------------------------------------------------------------------------
more=()
start idle "$weft" render "${steady[@]}" --workers 0 --listen "ipc://$tmp/socket" -o "$tmp/idle.png"
idle=$pid
listening idle

# What fails from here on does in weft status; the coordinator stays.
# shellcheck disable=SC2317 # they are called by those of failing.sh
render() { # FOLDER [VARIABLE=VALUE...]
    shift
    run env "$@" "$weft" status --json --wait 3 "ipc://$tmp/socket"
}

# shellcheck disable=SC2317
attempt() { # STATUSES
    render "$tmp/out" "${environment[@]}"
    [[ $status =~ ^($1)$ ]] || echo "exit status $status"
    { [ "$status" = 0 ] && [[ $out = *'"state":"waiting"'* ]]; } || grep -q '^weft: [^ ].* ' <<<"$err" ||
        echo "nothing is said"
    [[ $err != *expected* ]] || echo "the coordinator is blamed: $err"
}

every weft memory '0|1|5' 97
every weft descriptor '0|1|5'
every weft send 0 7
every weft receive '0' 7
exits 0 "the coordinator still answers" "$weft" status "ipc://$tmp/socket"
kill -TERM "$idle"
ends 143 "and ends" "$idle" 10 idle

nothing_left
finish
