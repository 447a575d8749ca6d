#!/bin/bash
# Several scenes in one command: each as if it were rendered alone, all or nothing when a command is wrong.
. tests/tap.sh

options=(--size 61x34 --samples 2)
mkdir "$tmp/one" "$tmp/copies"
cp "$scenes/first.json" "$tmp/copies/second.json"
sed 's/"#d53"/"#35d"/' "$scenes/first.json" >"$tmp/copies/blue.v2.json"
good=("$scenes/first.json" "$scenes/showcase.json" "$tmp/copies/second.json" "$tmp/copies/blue.v2.json")

for scene in "${good[@]}"; do
    name=$(basename "$scene" .json)
    exits 0 "$name is rendered alone" "$weft" render "$scene" "${options[@]}" -q -o "$tmp/one/$name.png"
done

for workers in 1 3; do
    exits 0 "four scenes with $workers workers" \
        "$weft" render "${good[@]}" "${options[@]}" --workers $workers -o "$tmp/all$workers"
    is "the folder is made, with a picture of each scene and nothing else" "$(ls -A "$tmp/all$workers")" "$(ls -A "$tmp/one")"
    for picture in "$tmp"/one/*; do
        same_bytes "$(basename "$picture") is the same as alone" "$tmp/all$workers/$(basename "$picture")" "$picture"
    done
    is "each is told on standard output" "$(cut -d: -f1 <<<"$out" | sort)" "$(printf '%s\n' "$tmp/all$workers"/* | sort)"
    is "the workers stay from scene to scene" "$(grep -c joined <<<"$err")" $workers
done
ok "a copy under another name is the same picture" cmp "$tmp/one/first.png" "$tmp/one/second.png"

exits 0 "into a folder that is there" \
    "$weft" render "$scenes/first.json" "$scenes/showcase.json" "${options[@]}" -q -o "$tmp/all1/"
same_bytes "the picture is the same" "$tmp/all1/first.png" "$tmp/one/first.png"
mkdir "$tmp/here"
run env -C "$tmp/here" "$weft" render "$scenes/first.json" "$scenes/showcase.json" "${options[@]}" -q
is "without -o they go to the current folder" "$status $(ls -A "$tmp/here" | tr '\n' ' ')" "0 first.png showcase.png "
same_bytes "the picture is the same" "$tmp/here/showcase.png" "$tmp/one/showcase.png"

# --- wrong commands -------------------------------------------------------------------------------------------
cp "$scenes/first.json" "$tmp/copies/first.json"
exits 2 "two scenes with one name are wrong usage" \
    "$weft" render "$scenes/first.json" "$scenes/showcase.json" "$tmp/copies/first.json" "${options[@]}" -o "$tmp/twice"
like "both are named" "$err" "$scenes/first.json and $tmp/copies/first.json would both be written to $tmp/twice/first.png"
ok "nothing is rendered, and no folder made" absent "$tmp/twice"

for place in 0 2; do
    mixed=("${good[@]:0:place}" "$scenes/bad/zero-radius.json" "${good[@]:place}")
    exits 3 "a bad scene at place $place" "$weft" render "${mixed[@]}" "${options[@]}" -o "$tmp/mixed"
    like "it is named" "$err" "$scenes/bad/zero-radius.json: objects"
    is "no good one is told as rendered" "$out" ""
    ok "nothing is rendered" [ -z "$(find "$tmp/mixed" -type f)" ]
done
exits 4 "a file where the folder should be" \
    "$weft" render "$scenes/first.json" "$scenes/showcase.json" "${options[@]}" -o "$tmp/one/first.png"
like "it is named" "$err" "$tmp/one/first.png: expected a folder for the pictures: it is a file"
same_bytes "and it keeps its bytes" "$tmp/one/first.png" "$tmp/one/second.png"
exits 4 "a folder in one that is not there" \
    "$weft" render "$scenes/first.json" "$scenes/showcase.json" "${options[@]}" -o "$tmp/no/such"
like "that is said" "$err" "^weft: $tmp/no/such: the folder $tmp/no is not there$"

# --- interrupted ----------------------------------------------------------------------------------------------
start series \
    "$weft" render "$scenes/first.json" "${slow[@]}" --samples "$((2 * slow[-1]))" --no-resume -o "$tmp/series"
wait_until "[ -e '$tmp/series/first.png' ]" 60
kill -TERM "$pid"
ends 143 "a series that is ended" "$pid" 10 series
is "leaves the pictures that were complete" "$(ls -A "$tmp/series")" first.png

finish
