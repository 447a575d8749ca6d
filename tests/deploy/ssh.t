#!/bin/bash
# weft-ssh against a real sshd on loopback, under several names: the same bytes, whatever happens to connections, and
# nothing left behind.
#
# Not tried: hosts that are other machines (silent.t has those that are network namespaces, and links that go silent).
. tests/tap.sh
for program in ssh ssh-keygen pgrep; do
    command -v $program >/dev/null || skip_all "no $program here; not tried"
done
[ -x /usr/sbin/sshd ] || skip_all 'no sshd here; not tried; the package openssh-server brings it'

# --- machines -------------------------------------------------------------------------------------------------
# loom and mule are this one, each with a weft-worker of its own name; spindle has none; nobody answers as down.
[ -d /run/sshd ] || [ "$(id -u)" != 0 ] || { mkdir /run/sshd && trap 'clean_up; rmdir /run/sshd' EXIT; }
hold_port
ssh-keygen -q -t ed25519 -N '' -f "$tmp/id"
ssh-keygen -q -t ed25519 -N '' -f "$tmp/host"
cat >"$tmp/sshd_config" <<END
ListenAddress 127.0.0.1
Port $port
HostKey $tmp/host
AuthorizedKeysFile $tmp/id.pub
PidFile none
StrictModes no
UsePAM no
PermitRootLogin yes
END
cat >"$tmp/ssh_config" <<END
Host loom mule spindle
    HostName 127.0.0.1
    Port $port
    IdentityFile $tmp/id
    IdentitiesOnly yes
    UserKnownHostsFile /dev/null
    StrictHostKeyChecking no
    # What users may have, and what would keep connections open:
    ControlMaster auto
    ControlPath $tmp/run/%C
    ControlPersist yes
Host down
    HostName 127.0.0.1
    Port 1
END
mkdir "$tmp/bin" "$tmp/loom" "$tmp/mule"
printf '#!/bin/sh\nexec %s -F "%s" "$@"\n' "$(command -v ssh)" "$tmp/ssh_config" >"$tmp/bin/ssh"
chmod +x "$tmp/bin/ssh"
ln -s "$worker" "$tmp/loom/weft-worker"
ln -s "$worker" "$tmp/mule/weft-worker"
export PATH=$tmp/bin:$PATH WEFT=$weft
start sshd /usr/sbin/sshd -D -e -f "$tmp/sshd_config"
wait_until "grep -q 'Server listening' '$tmp/sshd.err'" 10 ||
    skip_all "sshd does not run here; not tried: $(cat "$tmp/sshd.err")"

cat >"$tmp/hosts" <<END
# two machines
loom  worker=$tmp/loom/weft-worker threads=1   # slow
mule  worker=$tmp/mule/weft-worker threads=1
END
cat >"$tmp/mixed" <<END
spindle worker=$tmp/spindle/weft-worker
down
loom worker=$tmp/loom/weft-worker threads=1
END
echo 'down' >"$tmp/nobody"

scene=("$scenes/showcase.json" --size 160x90 --samples "$([ "$mode" = sanitize ] && echo 60 || echo 600)")
run "$weft" render "${scene[@]}" -o "$tmp/alone.png"

# --- what is looked at ----------------------------------------------------------------------------------------

worker_of() { # HOST: its process
    pgrep -f "^$tmp/$1/weft-worker --once"
}

client_of() { # HOST: the ssh to it
    pgrep -f -- "-F $tmp/ssh_config .* $1 exec sh"
}

left_over() { # processes of a render of this test, and sockets on the hosts that no process has, in other tests neither
    local socket
    pgrep -af -- "$tmp/(loom|mule)/weft-worker|$tmp/run/weft-ssh|ssh -F $tmp|deploy/weft-ssh $tmp" | grep -v pgrep
    find /tmp -maxdepth 1 -regextype egrep -regex '/tmp/weft-[0-9a-f]{32}\.ipc' -newer "$tmp/hosts" |
        while read -r socket; do
            pgrep -f "$socket" >/dev/null || echo "$socket"
        done
    find "$tmp/run" -mindepth 1 ! -path "$tmp/run/weft" ! -path "$tmp/run/weft/*" # those are weft's own
}

nothing_is_left() { # NAME
    wait_until '[ -z "$(left_over)" ]' 15
    is "$1: nothing is left behind" "$(left_over)" ''
}

# borrow LABEL HOSTS OPTION...: a render in the background
borrow() {
    start "$1" deploy/weft-ssh "$tmp/$2" "${scene[@]}" -o "$tmp/$1.png" --report "$tmp/$1.json" --progress json "${@:3}"
}

both_have_joined() { # LABEL
    [ "$(grep -Ec 'worker [0-9]+ \(.*\) joined: ' "$tmp/$1.err")" -ge 2 ]
}

same_picture() { # LABEL PID
    ends 0 "$1: the render ends well" "$2" 60 "$1"
    same_bytes "$1: the same bytes" "$tmp/$1.png" "$tmp/alone.png"
    nothing_is_left "$1"
}

# --- renders --------------------------------------------------------------------------------------------------
borrow two hosts -w 0
same_picture two "$pid"
is 'two: both hosts have rendered' "$(grep -o '"threads":1,"kernel":"[a-z0-9]*","state":"[a-z]*","bands":[1-9]' "$tmp/two.json" | wc -l)" 2
is 'two: no other has' "$(grep -o '"pid":' "$tmp/two.json" | wc -l)" 2

borrow mixed mixed -w 0
same_picture mixed "$pid"
like 'a host without weft-worker is named' "$(cat "$tmp/mixed.err")" \
    "^weft-ssh: spindle: no weft-worker there; it takes no part any more$"
like 'and so is one that does not answer' "$(cat "$tmp/mixed.err")" \
    '^weft-ssh: down: cannot be reached; it takes no part any more$'

borrow local nobody -w 1
same_picture local "$pid"
like 'with no host at all this machine goes on alone' "$(cat "$tmp/local.err")" 'no host is left; the workers of this machine go on alone'
exits 1 'or it is an error, if it is not to take part' deploy/weft-ssh "$tmp/nobody" "${scene[@]}" -o "$tmp/none.png" --workers=0
like 'which is told' "$err" 'weft-ssh: no host can be used, and there are no workers on this machine$'
ok 'and no picture' absent "$tmp/none.png"
nothing_is_left none

# --- connections ----------------------------------------------------------------------------------------------
borrow cut hosts -w 0
ok 'cut: both hosts take part' wait_until 'both_have_joined cut && has_rows cut 5' 30
kill -KILL "$(ps -o ppid= -p "$(ps -o ppid= -p "$(worker_of loom)" | tr -d ' ')" | tr -d ' ')" # its sshd
same_picture cut "$pid"
like 'cut: it is told' "$(cat "$tmp/cut.err")" '^weft-ssh: loom: the connection is lost; trying again$'

borrow client hosts -w 0
ok 'client: both hosts take part' wait_until 'both_have_joined client && has_rows client 5' 30
kill -KILL "$(client_of mule)"
same_picture client "$pid"
like 'client: it is told' "$(cat "$tmp/client.err")" '^weft-ssh: mule: ended with status 137; it takes no part any more$'

borrow worker mixed -w 0
ok 'worker: the host takes part' wait_until 'has_rows worker 5' 30
kill -KILL "$(worker_of loom)"
ends 143 'worker: without the last host the render ends' "$pid" 30 worker
like 'worker: and it is told why' "$(cat "$tmp/worker.err")" 'loom: ended with status 137; it takes no part any more'
like 'worker: and what follows' "$(cat "$tmp/worker.err")" 'no host is left, and there are no workers on this machine; giving up'
nothing_is_left worker
borrow worker hosts -w 0 # goes on from the journal
same_picture worker "$pid"

# --- ends -----------------------------------------------------------------------------------------------------
for signal in INT:130 TERM:143 KILL:137; do
    borrow "by-$signal" hosts -w 1 --no-resume
    ok "SIG${signal%:*}: both hosts take part" wait_until "both_have_joined by-$signal && has_rows by-$signal 5" 30
    { kill "-${signal%:*}" "$pid"; } 2>/dev/null
    ends "${signal#*:}" "SIG${signal%:*}: the render ends with ${signal#*:}" "$pid" 10 "by-$signal"
    nothing_is_left "SIG${signal%:*}"
done

exits 3 "weft's exit status is passed on" deploy/weft-ssh "$tmp/hosts" "$scenes/bad/unknown-key.json" -o "$tmp/bad.png"
nothing_is_left bad
exits 2 'usage is told' deploy/weft-ssh "$tmp/hosts"
like 'in a sentence' "$err" 'expected the file of hosts and a scene, found 1 operands'
exits 2 'the endpoint is not for users' deploy/weft-ssh "$tmp/hosts" "${scene[@]}" -l '*'
for line in 'loom thread=4:2: expected threads=N or worker=PATH, found "thread=4"' \
    "loom worker=a;b:2: expected threads=N or worker=PATH, found \"worker=a;b\"" \
    '-oProxyCommand=x:2: expected a host as ssh knows it, found "-oProxyCommand=x"'; do
    printf '#\n%s\n' "${line%%:*}" >"$tmp/wrong"
    exits 3 "a file of hosts with ${line%%:*} is refused" deploy/weft-ssh "$tmp/wrong" "${scene[@]}"
    is 'in a sentence' "$err" "weft-ssh: $tmp/wrong:${line#*:}"
done
exits 0 'help fits a screen' deploy/weft-ssh --help
ok 'of 24 lines' test "$(wc -l <<<"$out")" -le 24

finish
