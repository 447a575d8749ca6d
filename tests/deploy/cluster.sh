# A Slurm cluster for tests, on top of tests/tap.sh: a controller and three nodes, n1 to n3, which are daemons on this
# machine.
#
# The whole test runs in mount, network and process namespaces of its own, with an empty /run, so all daemons and jobs
# go with the test, even if it is killed.
# shellcheck shell=bash

why_not() {
    [ "$(id -u)" = 0 ] || echo "only root can start Slurm's daemons"
    for program in slurmctld slurmd srun munged unshare ip; do
        command -v "$program" >/dev/null || echo "$program is not installed; Debian's packages are slurm-wlm and munge"
    done
    unshare --mount --net --pid --fork --mount-proc mount -t tmpfs none /run >/dev/null 2>&1 ||
        echo "namespaces cannot be made here"
}

if [ -z "${WEFT_CLUSTER-}" ]; then
    reason=$(why_not | head -n 1)
    if [ -n "$reason" ]; then
        echo "1..0 # SKIP a Slurm cluster could not be tried: $reason"
        exit 0
    fi
    WEFT_CLUSTER=own exec unshare --mount --net --pid --fork --kill-child --mount-proc "$BASH" "$0" "$@"
fi
mount -t tmpfs none /run
ip link set lo up
ip address add 10.7.0.1/24 dev lo # where there is only 127.0.0.1, Slurm resolves no address at all
. tests/tap.sh

cluster=$tmp/cluster
mkdir -p /run/slurm "$cluster/log" "$cluster/state" "$cluster"/spool.n{1,2,3} "$tmp/munge"
export SLURM_CONF=$cluster/slurm.conf
cat >"$SLURM_CONF" <<SETTINGS
ClusterName=weft
SlurmctldHost=$(hostname -s)(10.7.0.1)
SlurmctldPort=26817
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=/run/munge.socket,cred_expire=5
CredType=cred/munge
StateSaveLocation=$cluster/state
SlurmdSpoolDir=$cluster/spool.%n
SlurmctldPidFile=$cluster/slurmctld.pid
SlurmdPidFile=$cluster/slurmd.%n.pid
SlurmctldLogFile=$cluster/log/slurmctld
SlurmdLogFile=$cluster/log/slurmd.%n
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerType=sched/backfill
SchedulerParameters=sched_interval=2,bf_interval=2
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
ReturnToService=2
SlurmdParameters=config_overrides
SlurmdTimeout=10
KillWait=5
NodeName=DEFAULT CPUs=2 Boards=1 SocketsPerBoard=1 CoresPerSocket=2 ThreadsPerCore=1 RealMemory=2000 State=UNKNOWN
NodeName=n[1-3] NodeHostname=$(hostname -s) NodeAddr=10.7.0.1 Port=[27001-27003]
PartitionName=farm Nodes=ALL Default=YES MaxTime=INFINITE State=UP
SETTINGS
printf 'CgroupPlugin=cgroup/v1\nCgroupAutomount=no\n' >"$cluster/cgroup.conf"

start_cluster() {
    chown munge: "$tmp/munge"
    chmod 711 "$tmp" # munged wants to reach what is its own
    head -c 1024 /dev/urandom >"$tmp/munge/key"
    chown munge: "$tmp/munge/key"
    chmod 600 "$tmp/munge/key"
    touch /run/munge.socket.lock
    chown munge: /run
    start munged setpriv --reuid munge --regid munge --clear-groups munged --foreground --force \
        --socket /run/munge.socket --key-file "$tmp/munge/key" --pid-file "$tmp/munge/pid" \
        --seed-file "$tmp/munge/seed" --log-file "$tmp/munge/log"
    wait_until "[ -S /run/munge.socket ]" 10
    start slurmctld slurmctld -D
    for node in n1 n2 n3; do
        start_node "$node"
    done
    wait_until "[ \"\$(sinfo --noheader --Node --states=idle 2>/dev/null | wc -l)\" = 3 ]" 60
}

declare -A daemon_of # NODE: its slurmd
start_node() { # NODE
    start "slurmd.$1" slurmd -D -N "$1"
    daemon_of[$1]=$pid
}

# kill_node NODE: with all that runs on it, as when the power fails; its daemons, which are those that write its log,
# first, as they would tell of the others.
kill_node() {
    local folder daemons processes=()
    daemons=$(find /proc/[0-9]*/fd -lname "$cluster/log/slurmd.$1" 2>/dev/null | cut -d / -f 3 | sort -u)
    for folder in /proc/[0-9]*; do
        grep -qszx "SLURMD_NODENAME=$1" "$folder/environ" && processes+=("${folder#/proc/}")
    done
    # shellcheck disable=SC2086 # a list of numbers
    kill -KILL $daemons "${processes[@]}"
    wait "${daemon_of[$1]}"
} 2>/dev/null # the shell's word on it too

state_of() { # JOB
    scontrol --oneliner show job "$1" | sed -n 's/.* JobState=\([^ ]*\) .*/\1/p'
}

exit_of() { # JOB: STATUS:SIGNAL
    scontrol --oneliner show job "$1" | sed -n 's/.* ExitCode=\([^ ]*\) .*/\1/p'
}
