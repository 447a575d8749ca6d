#!/bin/bash
# weft-ssh and links that go silent: packets get lost, and nobody is told that a connection is over. Between network
# namespaces, each with an sshd of its own. Three renders go on at once, as most of the time is waiting.
. tests/fault/network.sh
for program in ssh ssh-keygen ss pgrep; do
    command -v $program >/dev/null || skip_all "no $program here; not tried"
done
sshd=/usr/sbin/sshd
[ -x "$sshd" ] || skip_all 'no sshd here; not tried; the package openssh-server brings it'

# --- machines -------------------------------------------------------------------------------------------------
mkdir -p /run/sshd "$tmp/bin"
ssh-keygen -q -t ed25519 -N '' -f "$tmp/id"
ssh-keygen -q -t ed25519 -N '' -f "$tmp/host"
printf '#!/bin/sh\nexec %s -F "%s" "$@"\n' "$(command -v ssh)" "$tmp/ssh_config" >"$tmp/bin/ssh"
chmod +x "$tmp/bin/ssh"
export PATH=$tmp/bin:$PATH WEFT=$weft

start_sshd() { # MACHINE
    local address=${hub_of[$1]%.1}.2
    printf '%s\n' "Host $1" "HostName $address" "IdentityFile $tmp/id" 'IdentitiesOnly yes' \
        'UserKnownHostsFile /dev/null' 'StrictHostKeyChecking no' >>"$tmp/ssh_config"
    printf '%s\n' "ListenAddress $address" "HostKey $tmp/host" "AuthorizedKeysFile $tmp/id.pub" 'PidFile none' \
        'StrictModes no' 'UsePAM no' 'PermitRootLogin yes' >"$tmp/$1.config"
    echo "$1 worker=$worker threads=1" >"$tmp/$1.hosts"
    start "sshd.$1" ip netns exec "$1" "$sshd" -D -e -f "$tmp/$1.config"
    wait_until "grep -q 'Server listening' '$tmp/sshd.$1.err'" 20
}
machine loom mule heddle
for name in loom mule heddle; do
    ok "$name can be reached by ssh" start_sshd "$name"
done

silence() { # MACHINE
    deafen "$1"
    mute "$1"
}

# --- renders --------------------------------------------------------------------------------------------------
# Some twenty seconds of one core.
scene=("$scenes/showcase.json" --size 160x90 --band 1 --samples "$([ "$mode" = sanitize ] && echo 200 || echo 2000)")
"$weft" render "${scene[@]}" -q -o "$tmp/alone.png"

declare -A render_on # MACHINE: the weft-ssh that borrows it

# borrow MACHINE LOCAL: starts a render on the hub with a worker on that machine and so many of its own.
borrow() {
    start "$1" ip netns exec hub deploy/weft-ssh "$tmp/$1.hosts" "${scene[@]}" -o "$tmp/$1.png" --progress json -w "$2"
    render_on[$1]=$pid
    ok "$1 takes part" wait_until "said $1 'weft: worker [0-9]+ .* joined' $((1 + $2)) && has_rows $1 1" 60
    sockets+=("$(on_machine "$1" | grep -o '/tmp/weft-[0-9a-f]*\.ipc' | head -n 1)")
}
sockets=() # on the machines; they have one file system

on_machine() { # MACHINE: its processes, but the sshd that listens, and its connections
    ip netns pids "$1" | xargs -r ps -o pid=,args= -p | grep -v "$1.config \[listener\]"
    on "$1" ss -Htn state established
}

same_picture() { # MACHINE
    ends 0 "$1: the render ends well" "${render_on[$1]}" 120 "$1"
    same_bytes "$1: the same bytes" "$tmp/$1.png" "$tmp/alone.png"
}

tells() { # MACHINE WORD...: that it is told
    ok "$1: it is told: ${*:2}" wait_until "said $1 '^weft-ssh: $1: ${*:2}'" 60
}

nothing_is_left() { # MACHINE SECONDS
    wait_until "[ -z \"\$(on_machine $1)\" ]" "$2"
    is "$1: nothing is left there" "$(on_machine "$1")" ''
}

borrow mule 0
borrow heddle 0
borrow loom 1
is "each has a socket of its own" "$(ls "${sockets[@]}" | wc -l)" 3
since=$SECONDS
for name in loom mule heddle; do
    silence "$name"
done

# --- what becomes of them -------------------------------------------------------------------------------------
tells heddle 'the connection is lost; trying again'
heal heddle
ok "heddle: once it can be reached again it takes part again" wait_until "said heddle 'weft: worker 2 .* joined'" 60
sockets+=("$(on_machine heddle | grep -o '/tmp/weft-[0-9a-f]*\.ipc' | tail -n 1)")
same_picture heddle
nothing_is_left heddle 20

same_picture loom
ok "loom: its bands went to others" said loom 'warning: worker [0-9]+ .* silent too long; its bands go to others'

tells mule 'cannot be reached; it takes no part any more'
ends 143 "mule: without hosts the render ends" "${render_on[mule]}" 10 mule
ok "mule: and says why" said mule 'no host is left, and there are no workers on this machine; giving up$'
ok "mule: no picture" absent "$tmp/mule.png"
ok "mule: what is done stays" test -s "$tmp/.mule.png.journal"

nothing_is_left loom 30
nothing_is_left mule 30
note "$((SECONDS - since)) seconds after the links went silent"
wait_until "[ -z \"\$(ip netns pids hub)\" ]" 30
is "nor here" "$(ip netns pids hub | xargs -r ps -o pid=,args= -p)" ''
is "nor any socket there" "$(ls "${sockets[@]}" 2>/dev/null)" ''
is "nor any file here" "$(find "$tmp/run" -mindepth 1 ! -type d)" ''

finish
