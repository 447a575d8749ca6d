#!/bin/bash
# Every scene in scenes/bad/ is refused with exit status 3 and exactly the sentence in the .expected file beside it;
# where images are broken by `weft render` too, which unlike `weft check` does not keep them. BLESS=1 rewrites those
# files; read the difference before you commit it.
weft=${WEFT_BUILD:-build}/weft
scenes=(scenes/bad/*.json scenes/bad/*.nff)
tmp=$(mktemp -d "${TMPDIR:-/tmp}/weft-bad.XXXXXX")
trap 'rm -rf "$tmp"' EXIT
said=$tmp/said
export XDG_RUNTIME_DIR=$tmp # for the sockets of those that render: no other test is to find them

broken_images=(scenes/bad/{broken-texture,texture-is-no-png,texture-is-a-folder}.json
    scenes/bad/{missing-texture,mesh-obj-missing-texture}.json)

# check COMMAND SCENE: prints why it was not refused as expected, or nothing.
check() {
    local expected=${2%.*}.expected status=0
    "$weft" "$1" "$2" >/dev/null 2>"$said" || status=$?
    if [ "$status" -ne 3 ]; then
        echo "# expected exit status 3, found $status"
    elif [ -n "${BLESS:-}" ]; then
        cp "$said" "$expected"
    fi
    diff "$expected" "$said" 2>&1 | sed 's/^/# /'
}

number=0
failed=0
test_scenes() { # COMMAND SCENE...
    local scene trouble command=$1
    shift
    for scene in "$@"; do
        number=$((number + 1))
        trouble=$(check "$command" "$scene")
        if [ -n "$trouble" ]; then
            failed=$((failed + 1))
            echo "not ok $number - $command $scene"
            echo "$trouble"
        else
            echo "ok $number - $command $scene"
        fi
    done
}

echo "1..$((${#scenes[@]} + ${#broken_images[@]}))"
test_scenes check "${scenes[@]}"
test_scenes render "${broken_images[@]}"
[ "$failed" -eq 0 ]
