# What the shell tests share; sourced by a test that runs in the project's root. Results are TAP lines, every test
# has a folder of its own, and neither the folder nor any process outlives the test.
#
# Given to the test: WEFT_BUILD, the folder of the programs; WEFT_MODE, release or sanitize.
# Given by this file: $weft and $worker, the programs; $mode; $tmp, an empty folder; $scenes, an absolute path.
# A test ends with `finish`; one that stops earlier has no plan and so counts as failed.

# shellcheck shell=bash disable=SC2034 # the variables are for the tests
build=$(realpath "${WEFT_BUILD:-build}")
weft=$build/weft
worker=$build/weft-worker
mode=${WEFT_MODE:-release}
scenes=$PWD/scenes
tests=0
failed=0

tmp=$(mktemp -d "${TMPDIR:-/tmp}/weft-test.XXXXXX")
mkdir -m 700 "$tmp/run" "$tmp/sanitizer"
export LC_ALL=C.UTF-8 # by which grep counts characters, and all say the same
export XDG_RUNTIME_DIR=$tmp/run # where coordinators put their sockets; it also marks the processes of this test
export ASAN_OPTIONS=log_path=$tmp/sanitizer/report UBSAN_OPTIONS=log_path=$tmp/sanitizer/report

# A render of the showcase that takes two seconds or more, long enough to be disturbed. The slowest kernel and a fixed
# number of threads keep it so on other machines; workers that a test starts itself are to have both too.
slow=("$scenes/showcase.json" --size 160x90 --kernel ref --threads 2
    --samples "$([ "$mode" = sanitize ] && echo 40 || echo 200)")
slow_rows=90
steady=("${slow[@]:0:7}" --samples "$([ "$mode" = sanitize ] && echo 12 || echo 60)") # a third of that
endless=("${slow[@]}" --size 400x9999 --band 1 --no-resume) # until it is told to end, but a row is there soon
quickly=("${slow[@]:0:3}" --samples "${slow[-1]}") # the same picture as slow, by the best kernel and all cores

# --- results --------------------------------------------------------------------------------------------------

report() { # STATUS NAME
    tests=$((tests + 1))
    [ "$1" -eq 0 ] || failed=$((failed + 1))
    echo "$([ "$1" -eq 0 ] || echo 'not ')ok $tests - $2"
    [ "$1" -eq 0 ]
}

note() { # TEXT: lines for whoever reads a failure
    sed 's/^/# /' <<<"$1"
}

ok() { # NAME COMMAND...: the command succeeds
    local name=$1 status=0
    shift
    "$@" || status=$?
    report "$status" "$name" || note "failed with $status: $*"
}

is() { # NAME FOUND EXPECTED
    [ "$2" = "$3" ]
    report $? "$1" || note "expected: $3
found:    $2"
}

like() { # NAME TEXT PATTERN: the pattern, an extended regular expression, is somewhere in the text
    grep -Eq -e "$3" <<<"$2"
    report $? "$1" || note "expected something like: $3
found: $2"
}

same_bytes() { # NAME FILE FILE
    local difference
    difference=$(cmp "$2" "$3" 2>&1)
    report $? "$1" || note "$difference"
}

absent() { # PATH: nothing is there, not even a dangling link
    [ ! -e "$1" ] && [ ! -L "$1" ]
}

is_empty() { # FOLDER
    [ -z "$(ls -A "$1")" ]
}

skip() { # NAME REASON: instead of a result
    tests=$((tests + 1))
    echo "ok $tests - $1 # SKIP $2"
}

skip_all() { # REASON
    echo "1..0 # SKIP $1"
    exit 0
}

finish() {
    if [ "$mode" = sanitize ]; then
        local reports # but not that a thread ended just while leaks were looked for
        reports=$(find "$tmp/sanitizer" -type f -exec cat {} + | grep -v ' *==[0-9]*==Unable to get registers from thread')
        is "no sanitizer has reported anything" "$reports" ''
    fi
    echo "1..$tests"
    exit $((failed > 0))
}

# --- running programs -----------------------------------------------------------------------------------------

# run COMMAND...: leaves $status, $out and $err behind; a command that hangs ends with status 124.
run() {
    status=0
    timeout --kill-after=5 120 "$@" >"$tmp/run.out" 2>"$tmp/run.err" </dev/null || status=$?
    out=$(cat "$tmp/run.out")
    err=$(cat "$tmp/run.err")
}

exits() { # STATUS NAME COMMAND...: runs the command, which exits with that status
    local expected=$1 name=$2
    shift 2
    run "$@"
    [ "$status" -eq "$expected" ]
    report $? "$name" || note "expected exit status $expected, found $status, of: $*
$err"
}

# start LABEL COMMAND...: runs it in the background with its output in $tmp/LABEL.out and .err; leaves $pid behind.
# The shell makes background processes ignore SIGINT; these do not.
start() {
    local label=$1
    shift
    : >"$tmp/$label.out" 2>"$tmp/$label.err" # there to be looked at from now on
    env --default-signal "$@" >"$tmp/$label.out" 2>"$tmp/$label.err" </dev/null &
    pid=$!
    started+=("$pid")
}
started=()

# is_over PID: of what was a child, whose number may be another process's by now.
is_over() {
    local stat
    { read -r stat <"/proc/$1/stat"; } 2>/dev/null || return 0
    read -r _ stat _ <<<"${stat##*) }"
    [ "$stat" != $$ ]
}

slay() { # PID: of a child
    is_over "$1" || kill -KILL "$1"
    wait "$1"
} 2>/dev/null # the shell's word on it too

# ends STATUS NAME PID SECONDS LABEL: the background process ends in time, with that status.
ends() {
    local found
    wait_until "is_over $3" "$4" || kill -KILL "$3"
    { wait "$3"; } 2>/dev/null
    found=$?
    [ "$found" -eq "$1" ]
    report $? "$2" || note "expected exit status $1 within $4 s, found $found
$(cat "$tmp/$5.err")"
}

# kill_workers_of PID SECONDS: kills the local workers of a render, again and again, until it is over or for so long.
kill_workers_of() {
    local latest=$((SECONDS + $2)) process
    while ! is_over "$1" && [ "$SECONDS" -lt $latest ]; do
        for process in $(processes weft-worker "$1"); do
            kill -KILL "$process" 2>/dev/null
        done
    done
}

# wait_until COMMAND SECONDS: fails if the command does not succeed in time.
wait_until() {
    local deadline=$((${EPOCHREALTIME/[.,]/} + $2 * 1000000))
    until eval "$1"; do
        [ "${EPOCHREALTIME/[.,]/}" -lt "$deadline" ] || return 1
        sleep 0.01
    done
}

# said LABEL PATTERN [TIMES]: whether the program has said what is like the pattern on so many lines.
said() {
    [ "$(grep -Ec -e "$2" "$tmp/$1.err")" -ge "${3:-1}" ]
}

# says NAME LABEL PATTERN [TIMES]: the program has said so, or does so soon; what it says may come a little later than
# what else is seen of it.
says() {
    local label=$2 pattern=$3 times=${4:-1}
    wait_until 'said "$label" "$pattern" "$times"' 60
    report $? "$1" || note "expected something like: $pattern
found: $(cat "$tmp/$label.err")"
}

# processes NAME [PARENT]: ids of the running processes of this test whose program is NAME, or of PARENT's children.
processes() {
    local folder name stat
    for folder in /proc/[0-9]*; do
        { read -r name <"$folder/comm"; } 2>/dev/null || continue
        [ "$name" = "$1" ] && grep -qszx "XDG_RUNTIME_DIR=$XDG_RUNTIME_DIR" "$folder/environ" || continue
        { read -r stat <"$folder/stat"; } 2>/dev/null || continue
        read -r _ stat <<<"${stat##*) }"
        if [ "${stat%% *}" = "${2:-${stat%% *}}" ]; then
            echo "${folder#/proc/}"
        fi
    done
}

# --- watching a render ----------------------------------------------------------------------------------------

# has_rows LABEL ROWS: whether the render, started with --progress json, has that many rows.
has_rows() {
    local rows
    rows=$(sed -n 's/.*"rows_done":\([0-9]*\),"rows_in_work".*/\1/p' "$tmp/$1.out" | tail -n 1)
    [ "${rows:-0}" -ge "$2" ]
}

# listening LABEL: waits until the coordinator listens; leaves $endpoint behind.
listening() {
    wait_until "grep -q 'listening on' '$tmp/$1.err'" 60 || return 1
    endpoint=$(sed -n 's/.*listening on //p' "$tmp/$1.err")
}

# hold_port: leaves $port behind, a TCP port of 127.0.0.1 that nobody else is given until the test ends. It is bound
# but does not listen, which lets a coordinator (whose socket has SO_REUSEADDR, as this one) listen there.
hold_port() {
    start port perl -MSocket -e '$| = 1; socket(S, PF_INET, SOCK_STREAM, 0) && setsockopt(S, SOL_SOCKET, SO_REUSEADDR, 1)
        && bind(S, sockaddr_in(0, INADDR_LOOPBACK)) or die "no port: $!"; print +(sockaddr_in(getsockname S))[0], "\n"; sleep'
    wait_until "[ -s '$tmp/port.out' ]" 60
    port=$(cat "$tmp/port.out")
}

# --- the end --------------------------------------------------------------------------------------------------

clean_up() {
    local process
    for process in "${started[@]}"; do
        is_over "$process" || kill -KILL "$process"
    done
    for process in $(processes weft) $(processes weft-worker); do
        kill -KILL "$process"
    done
    wait
    rm -rf "$tmp"
} 2>/dev/null
trap clean_up EXIT
trap 'exit 130' INT
trap 'exit 143' TERM
