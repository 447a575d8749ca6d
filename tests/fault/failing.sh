# What the tests share that make single operations of weft fail (fail.c), on top of tests/tap.sh. The render is small,
# so that thousands can be run, but has all that touches files and memory: an image, a mesh file, a survey, several
# bands, a journal, a map and a report.
# shellcheck shell=bash
. tests/tap.sh

[ "$mode" = release ] || skip_all "sanitizers have the allocator for themselves"

mkdir "$tmp/out" "$tmp/good"
"$weft" render "$scenes/first.json" --size 8x8 --samples 1 -q -o "$tmp/image.png"
cat >"$tmp/scene.json" <<END
{
  "camera": {"from": [0, 2, 6], "at": [0, 1, 0]},
  "lights": [{"type": "point", "position": [4, 6, 5], "color": "#fff"}],
  "objects": [
    {"type": "mesh", "file": "$scenes/meshes/gem.ply"},
    {"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0], "material": {"color":
      {"type": "image", "file": "image.png", "map": "planar", "origin": [0, 0, 0], "u": [6, 0, 0], "v": [0, 0, -6]}}}
  ]
}
END
result_files=(a.png map.png report)
more=() # options of a render that something fails in
thread= # only in threads whose names begin so

# render FOLDER [VARIABLE=VALUE...]: leaves $status and $err behind, as run does.
render() {
    local folder=$1
    shift
    run env "$@" "$weft" render "$tmp/scene.json" --size 16x12 --error 0.05 --band 4 --threads 1 -q \
        -o "$folder/a.png" --sample-map "$folder/map.png" --report "$folder/report" "${more[@]}"
}

# failing PROGRAM KIND N: the variables with which the Nth operation of that kind fails in the program.
failing() {
    rm -f "$tmp/failed"
    environment=("LD_PRELOAD=$build/tests/fault/fail.so" "WEFT_FAIL=$1 $2 $3 $thread" "WEFT_FAIL_NOTE=$tmp/failed")
}

# count PROGRAM KIND: leaves in $count how many such operations a render has.
count() {
    failing "$1" "$2" 0
    render "$tmp/good" "${environment[@]}"
    count=$(cat "$tmp/failed")
}

# What is wrong in the folder of results: pictures that are not the right ones, files that should not be there.
wrong_files() { # FILE...: what may be there
    local name
    for name in a.png map.png; do
        absent "$tmp/out/$name" || cmp "$tmp/out/$name" "$tmp/good/$name"
    done
    for name in $(ls -A "$tmp/out"); do
        [[ " $* " = *" $name "* ]] || echo "$name is left"
    done
}

# attempt STATUSES: renders with the chosen failure and again without; prints what is wrong. STATUSES, a pattern, are
# those that the first of the two may end with; other than 0 it says why, and no process may be ended by a signal.
# Threads can bring it about that this time there were fewer operations: then nothing has failed.
attempt() {
    render "$tmp/out" "${environment[@]}"
    [[ $status =~ ^($1)$ ]] || { [ "$status" = 0 ] && absent "$tmp/failed"; } || echo "exit status $status"
    [ "$status" = 0 ] || grep -q '^weft: [^ ].* ' <<<"$err" || echo "nothing is said"
    [[ $err != *': an internal failure, told above'* ]] || [[ $err = *$'\n'* ]] || echo "nothing is told above"
    ! grep 'ended by signal' <<<"$err" || echo "a worker crashed"
    wrong_files "${result_files[@]}" .a.png.journal
    local more=()
    render "$tmp/out"
    [ "$status" = 0 ] && [ -e "$tmp/out/a.png" ] || echo "the same command again ends with status $status: $err"
    wrong_files "${result_files[@]}"
    rm -rf "$tmp/out"
    mkdir "$tmp/out"
}

# every PROGRAM KIND STATUSES [STRIDE]: makes each operation of the kind fail in turn; with a stride and without FULL
# only one of so many, other ones in every run.
every() {
    local program=$1 kind=$2 statuses=$3 stride=${4:-1} n wrong='' found count
    [ -z "${FULL-}" ] || stride=1
    count "$program" "$kind"
    for ((n = 1 + RANDOM % stride; n <= count; n += stride)); do
        failing "$program" "$kind" "$n"
        found=$(attempt "$statuses" 2>&1)
        [ -z "$found" ] || wrong+="$kind $n: $found"$'\n'
    done
    [ -z "$wrong" ] && [ "$count" -gt 0 ]
    report $? "$program: $kind fails${thread:+ in $thread}, any of $count times$([ "$stride" = 1 ] ||
        echo ", one of $stride tried")" || note "$wrong"
}

nothing_left() {
    ok "no process is left" wait_until '[ -z "$(processes weft)$(processes weft-worker)" ]' 10
    # The socket of one that aborted is removed by the next.
    ok "no socket is left" is_empty "$tmp/run/weft"
}

render "$tmp/good"
