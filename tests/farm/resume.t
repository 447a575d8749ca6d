#!/bin/bash
# A render that was killed goes on where it was, and ends with the same bytes; what it cannot go on from it says.
. tests/tap.sh

mkdir "$tmp/pictures"
slow=("${slow[@]:0:5}" --samples "$([ "$mode" = sanitize ] && echo 30 || echo 150)") # many of them: less long
quick=("${slow[@]:0:3}" --samples "${slow[-1]}") # the same picture as slow, by a faster kernel
adaptive=("$scenes/showcase.json" --size 160x90 --error "$([ "$mode" = sanitize ] && echo 0.002 || echo 0.0015)")
"$weft" render "${quick[@]}" -q -o "$tmp/slow.png"
"$weft" render "${adaptive[@]}" -q -o "$tmp/adaptive.png"

# begin LABEL OPTION...: starts a render of pictures/LABEL.png in the background.
begin() {
    local label=$1
    shift
    start "$label" "$weft" render --threads 1 --band 4 --progress json -o "$tmp/pictures/$label.png" "$@"
}

# interrupt LABEL ROWS SIGNAL OPTION...: a render that is ended at so many rows.
interrupt() {
    local label=$1 rows=$2 signal=$3
    shift 3
    begin "$label" "$@"
    wait_until "has_rows $label $rows" 60
    kill -"$signal" "$pid"
    { wait "$pid"; } 2>/dev/null
    wait_until '[ -z "$(processes weft-worker)" ]' 60
}

# resumed REPORT: how many rows of the render came from its journal.
resumed() {
    sed -n 's/.*"rows_resumed":\([0-9]*\).*/\1/p' "$1"
}

# go_on NAME LABEL PICTURE OPTION...: the same command again ends well, with PICTURE's bytes, and nothing else is left.
go_on() {
    local name=$1 label=$2 picture=$3
    shift 3
    exits 0 "$name: the same command again ends well" "$weft" render -o "$tmp/pictures/$label.png" \
        --report "$tmp/$label.report" "$@"
    same_bytes "$name: the picture is the same" "$tmp/pictures/$label.png" "$picture"
    rm -f "$tmp/pictures/$label.png"
    ok "$name: nothing else is left" is_empty "$tmp/pictures"
}

# --- killed ---------------------------------------------------------------------------------------------------
for rows in 1 60; do
    interrupt "killed-$rows" "$rows" KILL "${slow[@]}"
    ok "killed at $rows rows: there is no picture" absent "$tmp/pictures/killed-$rows.png"
    go_on "killed at $rows rows" "killed-$rows" "$tmp/slow.png" "${quick[@]}"
    like "killed at $rows rows: it says that it goes on" "$err" 'going on from its journal: [0-9]+ of 90 rows are there'
    ok "killed at $rows rows: at least these are not rendered again" [ "$(resumed "$tmp/killed-$rows.report")" -ge "$rows" ]
done

begin survey "${adaptive[@]}" --kernel ref
wait_until "[ -s '$tmp/survey.out' ]" 60
kill -KILL "$pid"
{ wait "$pid"; } 2>/dev/null
wait_until '[ -z "$(processes weft-worker)" ]' 60
go_on "killed early, with an error to be met" survey "$tmp/adaptive.png" "${adaptive[@]}"

for rows in 1 30 60; do # again and again
    interrupt twice "$rows" KILL "${adaptive[@]}" --kernel ref
done
go_on "killed three times, with an error to be met" twice "$tmp/adaptive.png" "${adaptive[@]}"
ok "killed three times: what the last one had is not rendered again" [ "$(resumed "$tmp/twice.report")" -ge 60 ]

interrupt ended 30 TERM "${slow[@]}"
like "ended by SIGTERM: it says that it can go on" "$(cat "$tmp/ended.err")" 'the same command will go on from here'
go_on "ended by SIGTERM" ended "$tmp/slow.png" "${quick[@]}"
ok "ended by SIGTERM: it goes on" [ "$(resumed "$tmp/ended.report")" -ge 30 ]

# All rows are there, but the picture was not put in place: nobody renders anything.
interrupt whole 30 KILL "${slow[@]}"
cp "$tmp/pictures/.whole.png.journal" "$tmp/journal"
begin whole "${slow[@]}"
while ! is_over "$pid"; do
    cp "$tmp/pictures/.whole.png.journal" "$tmp/journal.new" 2>/dev/null && mv "$tmp/journal.new" "$tmp/journal"
done
cp "$tmp/journal" "$tmp/pictures/.whole.png.journal"
go_on "killed after the last row or shortly before" whole "$tmp/slow.png" "${quick[@]}"

# --- what it cannot go on from --------------------------------------------------------------------------------
changed=(--size 160x90 --samples 4)
interrupt stale 20 KILL "${slow[@]}"
exits 0 "other settings: the render is done" "$weft" render "$scenes/showcase.json" "${changed[@]}" \
    -o "$tmp/pictures/stale.png"
like "other settings: it says so" "$err" 'stale\.png: its journal is of a render with other settings; starting anew'
rm "$tmp/pictures/stale.png"

cp "$scenes/first.json" "$tmp/scene.json"
first=("$tmp/scene.json" --size 160x90 --samples "$((4 * ${slow[-1]}))") # a cheap scene
interrupt scene 20 KILL "${first[@]}" --kernel ref
sed -i 's/^{/{ /' "$tmp/scene.json"
exits 0 "a changed scene: the render is done" "$weft" render "${first[@]}" -o "$tmp/pictures/scene.png"
like "a changed scene: it says so" "$err" 'its journal is of another scene, or a file that the scene reaches has changed'
rm "$tmp/pictures/scene.png"

interrupt broken 40 KILL "${slow[@]}"
size=$(stat -c %s "$tmp/pictures/.broken.png.journal")
perl -e 'open F, "+<:raw", $ARGV[0] or die; seek F, $ARGV[1], 0; read F, $_, 1; seek F, $ARGV[1], 0; print F ~$_' \
    "$tmp/pictures/.broken.png.journal" $((size / 2))
go_on "a journal that is broken in the middle" broken "$tmp/slow.png" "${quick[@]}"
like "a journal that is broken in the middle: it says so" "$err" 'bytes of its journal are not whole bands; they are dropped'

interrupt short 40 KILL "${slow[@]}"
truncate -s -77 "$tmp/pictures/.short.png.journal"
go_on "a journal that is cut short" short "$tmp/slow.png" "${quick[@]}"

echo "no journal at all" >"$tmp/pictures/.text.png.journal"
go_on "a file that is no journal" text "$tmp/slow.png" "${quick[@]}"
like "a file that is no journal: it says so" "$err" 'its journal is broken; starting anew'

# --- without a journal ----------------------------------------------------------------------------------------
interrupt none 20 KILL "${slow[@]}" --no-resume
go_on "not resumed" none "$tmp/slow.png" "${quick[@]}"
is "not resumed: nothing was kept" "$(resumed "$tmp/none.report")" 0

interrupt spared 20 KILL "${slow[@]}"
cp "$tmp/pictures/.spared.png.journal" "$tmp/journal"
exits 0 "--no-resume beside a journal: the render is done" "$weft" render "${quick[@]}" --no-resume \
    -o "$tmp/pictures/spared.png"
same_bytes "--no-resume beside a journal: it is left as it was" "$tmp/pictures/.spared.png.journal" "$tmp/journal"
rm "$tmp/pictures/.spared.png.journal" "$tmp/pictures/spared.png"

# --- two at once ----------------------------------------------------------------------------------------------
for option in "" --no-resume; do
    name="two to one output${option:+, the first with $option}"
    begin both "${slow[@]}" $option
    wait_until "has_rows both 1" 60
    first=$pid
    kill -STOP "$first" # so that it does not end before
    exits 4 "$name: the second ends at once" "$weft" render "${quick[@]}" -o "$tmp/pictures/both.png"
    kill -CONT "$first"
    like "$name: it says why" "$err" 'both\.png: another weft is rendering it'
    ends 0 "$name: the first ends well" "$first" 60 both
    same_bytes "$name: the picture is the same" "$tmp/pictures/both.png" "$tmp/slow.png"
    rm -f "$tmp/pictures/both.png"
done
ok "two to one output: nothing else is left" is_empty "$tmp/pictures"

# --- several scenes -------------------------------------------------------------------------------------------
several=("$scenes/sphere.json" "${quick[@]}")
"$weft" render "${several[@]}" -q -o "$tmp/several"
start several "$weft" render "${several[@]}" --kernel ref --threads 1 --band 4 --progress json -o "$tmp/pictures"
wait_until "[ -e '$tmp/pictures/sphere.png' ] && [ -e '$tmp/pictures/.showcase.png.journal' ]" 60
slay "$pid"
exits 0 "several scenes: the same command again ends well" "$weft" render "${several[@]}" -o "$tmp/pictures"
for name in sphere showcase; do
    same_bytes "several scenes: $name" "$tmp/pictures/$name.png" "$tmp/several/$name.png"
    rm -f "$tmp/pictures/$name.png"
done
ok "several scenes: nothing else is left" is_empty "$tmp/pictures"

finish
