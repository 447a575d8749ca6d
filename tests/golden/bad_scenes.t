#!/bin/bash
# Every scene in scenes/bad/ is refused with exit status 3 and exactly the sentence in the .expected file
# beside it. BLESS=1 rewrites those files; read the difference before you commit it.
weft=${WEFT_BUILD:-build}/weft
scenes=(scenes/bad/*.json scenes/bad/*.nff)
said=$(mktemp)
trap 'rm -f "$said"' EXIT

# check SCENE: prints why it was not refused as expected, or nothing.
check() {
    local expected=${1%.*}.expected status=0
    "$weft" check "$1" >/dev/null 2>"$said" || status=$?
    if [ "$status" -ne 3 ]; then
        echo "# expected exit status 3, found $status"
    elif [ -n "${BLESS:-}" ]; then
        cp "$said" "$expected"
    fi
    diff "$expected" "$said" 2>&1 | sed 's/^/# /'
}

echo "1..${#scenes[@]}"
number=0
failed=0
for scene in "${scenes[@]}"; do
    number=$((number + 1))
    trouble=$(check "$scene")
    if [ -n "$trouble" ]; then
        failed=$((failed + 1))
        echo "not ok $number - $scene"
        echo "$trouble"
    else
        echo "ok $number - $scene"
    fi
done
[ "$failed" -eq 0 ]
