#!/bin/bash
# A coordinator's machine that is named: its name may have no address, or not yet, or the server of names may be mute.
. tests/tap.sh

nobody=$(printf 'x%.0s' {1..64}).invalid # a part of more than 63 characters, so no server of names is asked
lacking="the name $nobody leads to no address: .+"

started_ms=${EPOCHREALTIME/[.,]/}
exits 1 "weft status ends where the name has no address" "$weft" status --wait 30 --insecure "$nobody:7420"
like "and says that" "$err" "^weft: tcp://$nobody:7420: $lacking$"
ok "without waiting" [ $((${EPOCHREALTIME/[.,]/} - started_ms)) -lt 15000000 ]

exits 1 "a worker goes on" "$worker" --wait 3 --insecure "$nobody"
like "and says why it hears nothing" "$err" "^weft-worker: warning: $lacking; trying again and again$"
is "once, however often it tries" "$(grep -c "$nobody leads" <<<"$err")" 1
like "until it gives up" "$err" "^weft-worker: no coordinator answered within 3 s$"

# --- names of our own -----------------------------------------------------------------------------------------
echo 'hosts: files' >"$tmp/files"
echo 'hosts: dns' >"$tmp/dns"
echo '127.0.0.1 localhost' >"$tmp/hosts"
echo 'nameserver 127.0.0.77' >"$tmp/mute"
named=(unshare --mount bash -c 'cd "$0" && mount --bind hosts /etc/hosts && mount --bind files /etc/nsswitch.conf &&
    exec "$@"' "$tmp")
mute=(unshare --mount bash -c 'cd "$0" && mount --bind mute /etc/resolv.conf && mount --bind dns /etc/nsswitch.conf &&
    exec "$@"' "$tmp")
if ! "${named[@]}" true 2>"$tmp/mount"; then
    skip "a name that gets its address later" "this user may not put a file over another"
else
    start coordinator "$weft" render "$scenes/first.json" --size 64x36 --workers 0 --listen 'tcp://127.0.0.1:*' \
        -o "$tmp/named.png"
    coordinator=$pid
    listening coordinator
    start early "${named[@]}" "$worker" --once --insecure "warp.test:${endpoint##*:}"
    ok "a worker whose coordinator's name has no address yet says so" \
        wait_until "grep -q 'warning: the name warp.test leads to no address' '$tmp/early.err'" 20
    echo '127.0.0.1 warp.test' >>"$tmp/hosts"
    ends 0 "and joins once there is one" "$coordinator" 30 coordinator
    ends 0 "and ends well" "$pid" 10 early
    like "having said that too" "$(cat "$tmp/early.err")" "the coordinator's name leads to an address now"
fi

# Takes questions, and answers none.
start server perl -MSocket -e '$| = 1; socket S, PF_INET, SOCK_DGRAM, 0;
    bind S, sockaddr_in(53, inet_aton("127.0.0.77")) or exit 1;
    print "there\n"; print "asked\n" while defined recv S, my $question, 512, 0'
wait_until "[ -s '$tmp/server.out' ] || is_over $pid" 10
if ! "${mute[@]}" true 2>"$tmp/mount" || is_over "$pid"; then
    skip "a server of names that is mute" "this user may not be one, or not ask it"
else
    start waiting "${mute[@]}" "$worker" --insecure warp.test
    ok "a mute server of names is asked" wait_until "grep -q asked '$tmp/server.out'" 20
    kill -TERM "$pid"
    ends 0 "a worker that waits for it ends when it is told to" "$pid" 7 waiting
    exits 1 "and weft status when its time is over" "${mute[@]}" "$weft" status --wait 1 --insecure warp.test
    like "with a sentence" "$err" '^weft: tcp://warp.test:7420: no address of that name was found within 1 s$'
fi

finish
