#!/bin/bash
# The README's example of two machines, word for word, between two network namespaces: this machine with the address
# 192.0.2.1, and one called loom, which copies come to by a real sshd.
. tests/fault/network.sh

machine loom
ip -n hub address add 192.0.2.1/24 dev loom
ip -n loom address add 192.0.2.2/24 dev hub

here=$tmp/here there=$tmp/loom
mkdir "$here" "$there"
ln -s "$build" "$here/build"
ln -s "$build" "$there/build"
ln -s "$scenes" "$here/scenes"

# Commands of the section, one a line; those of loom begin with its prompt.
commands=$(sed -n '/^## Two machines$/,/^## [^T]/s/^    //p' README.md)
keygen=$(grep '^build/weft keygen' <<<"$commands")
copy=$(grep '^scp ' <<<"$commands")
render=$(grep '^build/weft render' <<<"$commands")
worker=$(sed -n 's/^loom\$ //p' <<<"$commands")
is "the section has these commands and no others" "$(wc -l <<<"$commands")" \
    "$(printf '%s\n' "$keygen" "$copy" "$render" "$worker" | wc -l)"

exits 0 "keys are made" ip netns exec hub env -C "$here" sh -ec "$keygen"

# --- copying them ---------------------------------------------------------------------------------------------
# An sshd on loom, which takes no password and knows one key; files come into the folder there.
start_sshd() {
    mkdir -p /run/sshd "$tmp/ssh"
    ssh-keygen -q -t ed25519 -N '' -f "$tmp/ssh/host"
    ssh-keygen -q -t ed25519 -N '' -f "$tmp/ssh/user"
    printf '%s\n' 'ListenAddress 192.0.2.2' "HostKey $tmp/ssh/host" "AuthorizedKeysFile $tmp/ssh/user.pub" \
        'StrictModes no' 'UsePAM no' 'PidFile none' 'PermitRootLogin yes' "Subsystem sftp internal-sftp -d $there" \
        >"$tmp/ssh/sshd_config"
    printf '%s\n' 'Host loom' 'HostName 192.0.2.2' "IdentityFile $tmp/ssh/user" 'StrictHostKeyChecking no' \
        "UserKnownHostsFile $tmp/ssh/known" >"$tmp/ssh/config"
    start sshd ip netns exec loom "$(command -v sshd)" -D -e -f "$tmp/ssh/sshd_config"
    wait_until "grep -q 'Server listening' '$tmp/sshd.err'" 20
}
PATH=$PATH:/usr/sbin
if command -v sshd scp >/dev/null; then
    ok "an sshd runs on loom" start_sshd
    exits 0 "the worker's keys are copied" ip netns exec hub env -C "$here" scp -F "$tmp/ssh/config" ${copy#scp }
else
    skip "the worker's keys are copied" "copying by scp could not be tried: openssh-server is not installed"
    cp -rp "$here/keys/loom" "$there/keys"
fi
is "its secret key stays secret" "$(stat -c %a "$there/keys" "$there/keys/worker.key" | tr '\n' ' ')" "700 600 "

# --- rendering ------------------------------------------------------------------------------------------------
start_here() { # LABEL COMMAND
    start "$1" ip netns exec hub env -C "$here" sh -c "exec $2"
}
start_there() { # LABEL COMMAND
    start "$1" ip netns exec loom unshare --uts env -C "$there" sh -c "hostname loom && exec $2"
}

# shared NAME LABEL: the picture is rendered by both machines, and has the bytes of this machine's own.
shared() {
    ends 0 "$1: the render is completed" "$coordinator" 120 "$2"
    ok "$1: loom has joined" grep -Eq 'worker [0-9]+ \(loom, process [0-9]+\) joined: ' "$tmp/$2.err"
    same_bytes "$1: the picture is the same" "$here/show.png" "$tmp/own.png"
    rm "$here/show.png"
}
(cd "$here" && sh -c "$(sed 's/--listen.*/-q/; s/show\.png/..\/own.png/' <<<"$render")")

start_there before "$worker"
loom=$pid
ok "a worker waits for the render" wait_until "said before 'waiting for a coordinator'" 20
start_here first "$render"
coordinator=$pid
shared "a worker that was there before" first
ok "the worker waits for the next render" wait_until "[ \"\$(grep -c 'waiting for' '$tmp/before.err')\" -ge 2 ]" 20
kill -TERM "$loom"
ends 0 "told to end, it ends" "$loom" 20 before

start_here second "$render"
coordinator=$pid
ok "a render listens" listening second
start_there after "$worker"
loom=$pid
shared "a worker that comes after" second
kill -TERM "$loom"
ends 0 "told to end, it ends" "$loom" 20 after

start_here strange "$render"
coordinator=$pid
listening strange
exits 2 "without keys a worker does not go beyond its machine" ip netns exec loom env -C "$there" \
    build/weft-worker 192.0.2.1
ends 0 "the render goes on" "$coordinator" 120 strange

note "Could not be tried here: two real machines, and a firewall between them."
finish
