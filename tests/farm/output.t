#!/bin/bash
# An output appears whole or not at all; what cannot be written is told before the render, with the path.
. tests/tap.sh

quick=("$scenes/first.json" --size 64x36 --samples 2)
"$weft" render "${quick[@]}" -q -o "$tmp/good.png"
"$weft" render "${quickly[@]}" -q -o "$tmp/slow.png"

# refused STATUS NAME OUTPUT PATTERN: that output is refused with a sentence like the pattern, on one line.
refused() {
    exits "$1" "$2" "$weft" render "${quick[@]}" -q -o "$3"
    like "$2: the sentence" "$err" "^weft: $4"
    is "$2: it is one line" "$(wc -l <<<"$err")" 1
}

# --- what cannot be an output ---------------------------------------------------------------------------------
mkdir "$tmp/folder.png"
mkfifo "$tmp/pipe.png"
ln -s nowhere/else.png "$tmp/dangling.png"
refused 4 "a folder as a file" "$tmp/folder.png" "$tmp/folder.png: .*found a folder"
refused 4 "a pipe" "$tmp/pipe.png" "$tmp/pipe.png: .*found a pipe"
refused 2 "a folder alone" "$tmp/folder.png/" "$tmp/folder.png/: expected an output that ends with"
refused 4 "no name before the ending" "$tmp/$(printf 'x%.0s' {1..255}).png" "$tmp/x*\.png: .*File name too long"
for name in a.jpg a.PNGx a png a.png.gz ''; do
    refused 2 "an unknown ending: \"$name\"" "$tmp/$name" "$tmp/${name//./\\.}: expected an output that ends with"
done
ok "nothing is left in the folder" [ -z "$(find "$tmp" -name '.*.part')" ]

refused 4 "a folder of the system's, where nobody makes files" /proc/self/a.png "/proc/self/a.png: .*"

# --- folders --------------------------------------------------------------------------------------------------
mkdir -m 700 "$tmp/own"
as=()
# unplaced OPTION PATH SENTENCE: that path of the option's file is refused with that sentence, before any rendering.
unplaced() {
    exits 4 "$1 $2" "${as[@]}" "$weft" render "${quick[@]}" -q -o "$tmp/own/none.png" "$1" "$2"
    is "$1 $2: the sentence" "$err" "weft: $2: $3"
}
for option in -o --report --sample-map --error-map --log; do
    unplaced $option "$tmp/no/such/a.png" "the folder $tmp/no/such is not there"
    unplaced $option "$tmp/good.png/a.png" "expected a folder at $tmp/good.png, found a file"
    unplaced $option "$tmp/good.png/b/a.png" "expected a folder at $tmp/good.png/b, found a file on the way to it"
done
unplaced -o no-such-folder/a.png "the folder no-such-folder is not there"

# Root may write anywhere, so somebody else is to try.
mkdir -m 555 "$tmp/locked"
if [ "$(id -u)" = 0 ]; then
    as=(env XDG_RUNTIME_DIR="$tmp/own" setpriv --reuid 65532 --regid 65532 --clear-groups)
    chown 65532:65532 "$tmp/own"
    chmod 711 "$tmp"
fi
if "${as[@]}" test -x "$worker" -a -r "$scenes/first.json"; then
    for option in -o --report --sample-map --error-map; do
        unplaced $option "$tmp/locked/a.png" "the folder $tmp/locked cannot be written to: Permission denied"
    done
    unplaced --log "$tmp/locked/a.log" "the log cannot be written: Permission denied"
else
    skip "a folder without permission to write" "the programs are not where everybody may run them"
fi
ok "nothing was rendered or begun" [ -z "$(find "$tmp/own" -type f)" ]

exits 0 "a link to nowhere is replaced" "$weft" render "${quick[@]}" -q -o "$tmp/dangling.png"
same_bytes "by the picture" "$tmp/dangling.png" "$tmp/good.png"

# --- a full disk ----------------------------------------------------------------------------------------------
# full COMMAND...: runs it with $tmp/small as a file system of 16 KiB, which is listed afterwards.
full() {
    unshare --mount bash -c 'mount -t tmpfs -o size=16k small "$0" && cp "$1" "$0/old.png" && shift &&
        { "$@"; status=$?; cmp "$0/old.png" "$GOOD" && ls -A "$0"; exit $status; }' "$tmp/small" "$tmp/good.png" "$@"
}
mkdir "$tmp/small"
export -f full
export tmp GOOD="$tmp/good.png"
if ! full true >/dev/null 2>&1; then
    skip "a full disk" "this user may not mount a file system"
else
    for format in png pfm; do
        exits 4 "a full disk, .$format" \
            bash -c 'full "$@"' full "$weft" render "$scenes/showcase.json" --size 200x120 -o "$tmp/small/new.$format"
        like "is told with the path" "$err" "^weft: $tmp/small/new.$format: .*No space left"
        is "nothing is left of it but the journal" "$out" ".new.$format.journal
old.png"
    done
    exits 4 "a full disk under an old picture" \
        bash -c 'full "$@"' full "$weft" render "$scenes/showcase.json" --size 200x120 --bits 16 -o "$tmp/small/old.png"
    is "which keeps its bytes, beside the journal" "$out" ".old.png.journal
old.png"
fi

# A limit on the size of files, as batch systems set it.
cp "$tmp/good.png" "$tmp/limited.png"
exits 4 "a picture larger than files may be" \
    bash -c 'ulimit -f 8 && exec "$@"' limited "$weft" render "$scenes/showcase.json" --size 200x120 -q -o "$tmp/limited.png"
same_bytes "the old one keeps its bytes" "$tmp/limited.png" "$tmp/good.png"
ok "nothing is left in the folder" [ -z "$(find "$tmp" -name '.*.part')" ]

# --- an output that is there already --------------------------------------------------------------------------
cp "$tmp/good.png" "$tmp/old.png"
start interrupted "$weft" render "${endless[@]}" --progress json -o "$tmp/old.png"
wait_until "has_rows interrupted 1" 60
kill -INT "$pid"
ends 130 "an interrupted render" "$pid" 10 interrupted
same_bytes "leaves the old picture as it was" "$tmp/old.png" "$tmp/good.png"

exits 3 "a bad scene" "$weft" render "$scenes/bad/zero-radius.json" -q -o "$tmp/old.png"
same_bytes "leaves the old picture as it was" "$tmp/old.png" "$tmp/good.png"

ln "$tmp/old.png" "$tmp/other-name.png"
exec 3<"$tmp/old.png"
start replacing "$weft" render "${slow[@]}" --progress json -o "$tmp/old.png"
wait_until "has_rows replacing 5" 60
kill -STOP "$pid" # so that it does not end before
same_bytes "while the new picture is rendered the old one is there" "$tmp/old.png" "$tmp/good.png"
kill -CONT "$pid"
ends 0 "the new picture is completed" "$pid" 60 replacing
same_bytes "and then in its place" "$tmp/old.png" "$tmp/slow.png"
ok "whoever has the old one open still reads it" cmp - "$tmp/good.png" <&3
exec 3<&-
same_bytes "and another name of the old one still names it" "$tmp/other-name.png" "$tmp/good.png"

umask 027
exits 0 "with a umask" "$weft" render "${quick[@]}" -q -o "$tmp/masked.png"
is "the picture has the permissions of any new file" "$(stat -c %a "$tmp/masked.png")" 640

finish
