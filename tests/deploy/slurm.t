#!/bin/bash
# One render as a Slurm job, on three nodes: the same bytes, whatever fails, and nothing is left of it.
. tests/deploy/cluster.sh

submitted=$PWD
mkdir "$tmp/shared"
export WEFT_BIN=$build
quick=("$scenes/showcase.json" --size 160x90 --samples 16)
samples=$([ "$mode" = sanitize ] && echo 400 || echo 4000)
long=("$scenes/showcase.json" --size 160x90 --samples "$samples" --band 2 --progress json) # many seconds
"$weft" render "${quick[@]}" -q -o "$tmp/quick.png"
"$weft" render "${long[@]:0:5}" -q -o "$tmp/long.png"

ok "a controller and three nodes start" start_cluster

# --- the job as a whole ---------------------------------------------------------------------------------------
script=$submitted/deploy/slurm/weft.sbatch
cd "$tmp/shared" || exit

# submit ARGUMENT...: of the script; leaves $job and $log behind.
submit() {
    run sbatch --parsable --nodes=3 "$script" "$@"
    job=$out
    log=$tmp/shared/weft-$job.log
    : >>"$log"
}

# over NAME STATE EXIT: the job ends in that state, and with that exit status.
over() {
    local found
    wait_until "grep -Eq '^(COMPLETED|FAILED|CANCELLED|TIMEOUT|NODE_FAIL)' <<<\"\$(state_of $job)\"" 150
    found="$(state_of "$job") $(exit_of "$job")"
    is "$1: the job ends" "$found" "$2 $3"
    [ "$found" = "$2 $3" ] || note "$(grep -v '^{' "$log")"
}

# tidy NAME FILE...: once the job is over only these files are there, and no process of it.
tidy() {
    local name=$1 files
    shift
    ok "$name: no process of it is left" wait_until "[ -z \"\$(processes weft)\$(processes weft-worker)\" ]" 20
    files=$(find . -mindepth 1 -printf '%P\n' | sort | tr '\n' ' ')
    is "$name: nor any file but these" "$files" "$(printf '%s\n' "$@" | sort | tr '\n' ' ')"
    rm -rf ./* .??*
}

in_log() { # PATTERN [TIMES]
    [ "$(grep -Ec -e "$1" "$log")" -ge "${2:-1}" ]
}

rows_done() { # of the render's latest start
    sed -n 's/.*"rows_done":\([0-9]*\),"rows_in_work".*/\1/p' "$log" | tail -n 1
}

# in_the_middle ROWS: waits until the job has so many rows, and a worker on every node.
in_the_middle() {
    wait_until "[ \"\$(rows_done)\" -ge $1 ] && in_log joined 3" 60 2>/dev/null
}

submit "${quick[@]}" -o quick.png --report report.json --band 1
over "a job" COMPLETED 0:0
same_bytes "a job: the picture is the same" quick.png "$tmp/quick.png"

is "a job: all nodes have joined" "$(grep -c joined "$log")" 3
tidy "a job" quick.png report.json "weft-$job.log"

submit "$tmp/none.json"
over "a scene that is not there" FAILED 3:0
ok "a scene that is not there: it is said" in_log "none.json: cannot be"
tidy "a scene that is not there" "weft-$job.log"

mkdir "$tmp/no-worker"
cp "$weft" "$tmp/no-worker"
WEFT_BIN=$tmp/no-worker submit "${quick[@]}" -o quick.png
over "nodes without weft-worker" FAILED 143:0
ok "nodes without weft-worker: it is said" in_log '^weft.sbatch: no worker is left'
tidy "nodes without weft-worker" "weft-$job.log"

# --- keys -----------------------------------------------------------------------------------------------------
submit "${long[@]}" -o long.png
in_the_middle 4
is "keys: secret, and the job's own" "$(stat -c '%a' ".weft-$job" ".weft-$job"/*.key | tr '\n' ' ')" "700 600 600 600 "
is "keys: one for each node" "$(cat ".weft-$job"/node-*/worker.key | grep -v '^#' | sort -u | wc -l)" 3
port=$((7420 + job % 20000))
"$weft" keygen "$tmp/strange" >"$tmp/keygen"
cp ".weft-$job/coordinator.pub" "$tmp/strange/"
start stranger "$worker" --keys "$tmp/strange" "10.7.0.1:$port"
ok "keys: a stranger is refused" wait_until "in_log 'refused 10.7.0.1: its key .* is not among'" 20
kill -TERM "$pid"

# --- nodes that fail ------------------------------------------------------------------------------------------
# resumed NAME: the job, which has been interrupted, starts a second time and goes on to the end.
resumed() {
    over "$1" COMPLETED 0:0
    is "$1: the job has started twice" "$(scontrol --oneliner show job "$job" | grep -o 'Restarts=[0-9]*')" Restarts=1
    ok "$1: the render went on" in_log 'going on from its journal: [0-9]+ of 90'
    same_bytes "$1: the picture is the same" long.png "$tmp/long.png"
    tidy "$1" long.png "weft-$job.log"
}

# fails NODE: in the middle of the job, and is there again a little later. Slurm itself would take some time to see it.
fails() {
    kill_node "$1"
    scontrol update NodeName="$1" State=DOWN Reason=power
    ok "$1 fails: the job is queued again" wait_until "[ \"\$(state_of $job)\" = PENDING ]" 60
    ok "$1 fails: the journal is there" [ -s .long.png.journal ]
    start_node "$1"
    scontrol update NodeName="$1" State=RESUME
}
fails n3
resumed "n3 fails"

submit "${long[@]}" -o long.png
in_the_middle 10
fails n1
resumed "n1, where the coordinator is, fails"

submit "${long[@]}" -o long.png
in_the_middle 10
kill -KILL "$(processes weft-worker | head -n 1)"
over "a worker dies" COMPLETED 0:0
ok "a worker dies: after it had joined, and that is said" in_log 'warning: worker [0-9]+ .* (is lost|silent)'
same_bytes "a worker dies: the picture is the same" long.png "$tmp/long.png"
tidy "a worker dies" long.png "weft-$job.log"

# --- jobs that are told to end --------------------------------------------------------------------------------
submit "${long[@]}" -o long.png
in_the_middle 10
scancel --batch --signal=USR1 "$job" # as Slurm does before the time is over
ok "the time is nearly over: that is said" wait_until "in_log '^weft.sbatch: the time is nearly over'" 30
resumed "the time is nearly over"

# again NAME STATE: the job ends in that state, all that is left is the journal, and the same job goes on from there.
again() {
    ok "$1: the job ends" wait_until "[ \"\$(state_of $job)\" = $2 ]" 60
    ok "$1: its processes too" wait_until "[ -z \"\$(processes weft)\$(processes weft-worker)\" ]" 20
    ok "$1: and its keys" wait_until "absent .weft-$job" 20
    ok "$1: the journal stays" [ -s .long.png.journal ]
    rm "weft-$job.log"
    submit "${long[@]}" -o long.png
    over "$1: the same job again" COMPLETED 0:0
    ok "$1: the same job again: the render went on" in_log 'going on from its journal: [0-9]+ of 90'
    same_bytes "$1: the same job again: the picture is the same" long.png "$tmp/long.png"
    tidy "$1: the same job again" long.png "weft-$job.log"
}
submit "${long[@]}" -o long.png
in_the_middle 10
scancel "$job"
again scancel CANCELLED

# --- jobs whose time is over ----------------------------------------------------------------------------------
# Slurm looks at the time every 30 seconds. Until then the workers are held, or the render would be complete. So it can
# be a shorter one.
hold() {
    # shellcheck disable=SC2046 # a list of numbers
    kill -STOP $(processes weft-worker)
}
long=("${long[@]/#$samples/$((samples / 2))}")
"$weft" render "${long[@]:0:5}" -q -o "$tmp/long.png"

SBATCH_TIMELIMIT=1 submit "${long[@]}" -o long.png
in_the_middle 10
hold
ok "a minute's job: Slurm signals it" wait_until "in_log '^weft.sbatch: the time is nearly over'" 60
ok "a minute's job: it is queued again" wait_until "[ \"\$(state_of $job)\" = PENDING ]" 60
scontrol update JobId="$job" TimeLimit=30 # or it would be queued every 30 seconds
resumed "a minute's job"

SBATCH_SIGNAL=CONT@1 submit "${long[@]}" -o long.png # nothing that the script would heed
in_the_middle 10
hold
scontrol update JobId="$job" EndTime=now+1
again "a job that does not heed its time" TIMEOUT

note "Could not be tried here: a shared folder other than one machine's, nodes with names and addresses of their own,
and cores given by control groups."
finish
