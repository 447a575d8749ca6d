# What the tests share that need a network, on top of tests/tap.sh: machines, which are network namespaces, and links
# between each of them and the coordinator's, "hub", that can be cut, go deaf, lose packets and be slow.
#
# The whole test runs in a mount and a network namespace of its own, with an empty /run. So names of machines are known
# there alone, nothing touches the network of the real machine, and all of it goes with the test's last process, even
# if the test itself is killed.
# shellcheck shell=bash

why_not() {
    [ "$(id -u)" = 0 ] || echo "only root can make network namespaces"
    for program in ip tc iptables unshare; do
        command -v "$program" >/dev/null || echo "$program is not installed"
    done
    unshare --mount --net sh -c 'mount -t tmpfs none /run && ip netns add try && ip netns exec try iptables -L' \
        >/dev/null 2>&1 || echo "network namespaces cannot be made here"
}

if [ -z "${WEFT_NETWORK-}" ]; then
    reason=$(why_not | head -n 1)
    if [ -n "$reason" ]; then
        echo "1..0 # SKIP $reason"
        exit 0
    fi
    WEFT_NETWORK=own exec unshare --mount --net "$BASH" "$0" "$@"
fi
mount -t tmpfs none /run
. tests/tap.sh

ip netns add hub
ip -n hub link set lo up
declare -A hub_of # MACHINE: the hub's address as it sees it
keys=$tmp/keys
"$weft" keygen "$keys" >/dev/null
mkdir "$tmp/pictures"

# --- machines and their links ---------------------------------------------------------------------------------

# machine NAME...: each with a link of its own to the hub.
machine() {
    local name
    for name; do
        hub_of[$name]=10.7.$((${#hub_of[@]} + 1)).1
        ip netns add "$name"
        ip -n "$name" link set lo up
        ip -n hub link add "$name" type veth peer name hub netns "$name"
        ip -n hub address add "${hub_of[$name]}/24" dev "$name"
        ip -n "$name" address add "${hub_of[$name]%.1}.2/24" dev hub
        ip -n hub link set "$name" up
        ip -n "$name" link set hub up
    done
}

on() { # MACHINE COMMAND...
    ip netns exec "$@"
}

cut() { # MACHINE: its link is down
    ip -n hub link set "$1" down
}

deafen() { # MACHINE: nothing reaches it any more; what it says is heard
    on "$1" iptables -A INPUT -i hub -j DROP
}

mute() { # MACHINE: nothing that it says gets away any more
    on "$1" iptables -A OUTPUT -o hub -j DROP
}

lossy() { # MACHINE SHARE: of all packets, 0..1, in both directions
    on "$1" iptables -A INPUT -i hub -m statistic --mode random --probability "$2" -j DROP
    on "$1" iptables -A OUTPUT -o hub -m statistic --mode random --probability "$2" -j DROP
}

slow_down() { # MACHINE RATE: in both directions, as tc(8) has it: 1mbit
    tc -n hub qdisc replace dev "$1" root tbf rate "$2" burst 16kb latency 500ms
    tc -n "$1" qdisc replace dev hub root tbf rate "$2" burst 16kb latency 500ms
}

heal() { # MACHINE: of everything
    ip -n hub link set "$1" up
    on "$1" iptables -F
    tc -n hub qdisc delete dev "$1" root
    tc -n "$1" qdisc delete dev hub root
} 2>/dev/null # there may be no queue to delete

# --- a farm ---------------------------------------------------------------------------------------------------

# coordinator LABEL OPTION...: starts a render on the hub that listens for workers; leaves $pid behind.
coordinator() {
    local label=$1
    shift
    start "$label" ip netns exec hub "$weft" render --workers 0 --listen tcp://0.0.0.0:7420 --keys "$keys" \
        --progress json -o "$tmp/pictures/$label.png" "$@"
    wait_until "grep -q 'listening on' '$tmp/$label.err' || is_over $pid" 60
}

# join LABEL MACHINE OPTION...: starts a worker on the machine; leaves $pid behind.
join() {
    local label=$1 machine=$2
    shift 2
    start "$label" ip netns exec "$machine" "$worker" --threads 1 --kernel ref --keys "$keys" "$@" "${hub_of[$machine]}"
}

# complete NAME LABEL PID PICTURE: the render ends well, with PICTURE's bytes and nothing else beside it.
complete() {
    ends 0 "$1: the render is completed" "$3" 90 "$2"
    same_bytes "$1: the picture is the same" "$tmp/pictures/$2.png" "$4"
    rm -f "$tmp/pictures/$2.png"
    ok "$1: nothing else is written" is_empty "$tmp/pictures"
}
