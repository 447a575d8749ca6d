#!/bin/bash
# The pixels of every scene in scenes/, as linear floats, have the SHA-256 in SIGNATURES. BLESS=1 rewrites that file:
# a change of it is a change of pictures, so say in the commit why they change.
. tests/tap.sh

signatures=tests/golden/SIGNATURES
names=$(cd scenes && printf '%s\n' *.json | grep -v '\.schema\.json$')

for name in $names; do
    exits 0 "$name is rendered" "$weft" render "scenes/$name" -q --size 48x27 --samples 2 -o "$tmp/$name.pfm"
    found=$(sha256sum <"$tmp/$name.pfm" | cut -d' ' -f1)
    echo "$found  $name" >>"$tmp/found"
    [ -n "${BLESS:-}" ] ||
        is "$name has the signed pixels" "$found" "$(awk -v name="$name" '$2 == name { print $1 }' "$signatures")"
done
if [ -n "${BLESS:-}" ]; then
    cp "$tmp/found" "$signatures"
fi
is "the signatures are those of the scenes that are there" "$(awk '{ print $2 }' "$signatures")" "$names"

finish
