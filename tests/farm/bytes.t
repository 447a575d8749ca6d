#!/bin/bash
# A picture has the same bytes from any number of workers and threads, in bands of any height, in every format.
. tests/tap.sh

picture() { # OUTPUT SCENE OPTION...
    local output=$1 scene=$2
    shift 2
    run "$weft" render "$scenes/$scene.json" -q -o "$tmp/$output" "$@"
}

# repeats NAME SCENE REFERENCE OPTION...: the options give the bytes of the reference.
repeats() {
    local name=$1 scene=$2 reference=$3
    shift 3
    picture "again.${reference##*.}" "$scene" "$@"
    same_bytes "$name" "$tmp/$reference" "$tmp/again.${reference##*.}" || note "status $status: $err"
}

# --- 8 bits ---------------------------------------------------------------------------------------------------
size=(--size 121x68 --samples 4)
for scene in first showcase; do
    picture "$scene.png" "$scene" "${size[@]}" --workers 1 --threads 1
    is "$scene: rendered by one thread" "$status" 0
done

# Every number of workers with every number of threads, and each with every height of bands somewhere.
bands=(1 2 7 68 65535)
at=0
for workers in 1 2 3; do
    for threads in 1 2 5; do
        for scene in first showcase; do
            band=${bands[at++ % 5]}
            repeats "$scene: $workers workers, $threads threads, bands of $band" $scene $scene.png \
                "${size[@]}" --workers $workers --threads $threads --band $band
        done
    done
done
for band in "${bands[@]}"; do
    repeats "showcase: 2 workers, bands of $band" showcase showcase.png "${size[@]}" --workers 2 --band $band
done
repeats "showcase: bands as the program likes" showcase showcase.png "${size[@]}" --workers 2
repeats "showcase: the reference kernel" showcase showcase.png "${size[@]}" --kernel ref

# --- other formats and sizes ----------------------------------------------------------------------------------
for format in "linear.pfm" "deep.png --bits 16"; do
    read -r reference bits <<<"$format"
    # shellcheck disable=SC2086 # two words or none
    picture "$reference" showcase "${size[@]}" --workers 1 --threads 1 $bits
    for parts in "2 2 1" "3 5 7" "1 2 65535"; do
        read -r workers threads band <<<"$parts"
        # shellcheck disable=SC2086
        repeats "$reference: $workers workers, $threads threads, bands of $band" showcase "$reference" \
            "${size[@]}" --workers "$workers" --threads "$threads" --band "$band" $bits
    done
done
picture tent.png showcase "${size[@]}" --filter tent --workers 1 --threads 1
for parts in "1 3 1" "2 2 7" "3 5 2"; do
    read -r workers threads band <<<"$parts"
    repeats "with a tent: $workers workers, $threads threads, bands of $band" showcase tent.png \
        "${size[@]}" --filter tent --workers "$workers" --threads "$threads" --band "$band"
done
repeats "with a tent: the reference kernel" showcase tent.png "${size[@]}" --filter tent --kernel ref
ok "the filter shows" [ "$(sha256sum <"$tmp/tent.png")" != "$(sha256sum <"$tmp/showcase.png")" ]
repeats "with a box, which is the default" showcase showcase.png "${size[@]}" --filter box
picture asked.pfm filter "${size[@]}" --filter tent
repeats "the filter may be the scene's" filter asked.pfm "${size[@]}"
picture asked.pfm filter "${size[@]}" --filter box
sed 's/, "filter": "tent"//' "$scenes/filter.json" >"$tmp/unsaid.json"
run "$weft" render "$tmp/unsaid.json" -q "${size[@]}" -o "$tmp/unsaid.pfm"
same_bytes "and another may be asked for" "$tmp/asked.pfm" "$tmp/unsaid.pfm"
for tiny in 1x1 1x41 67x1; do
    picture "tiny.png" showcase --size $tiny --workers 1 --threads 1
    repeats "a picture of $tiny pixels" showcase tiny.png --size $tiny --workers 3 --threads 5
done

# --- what the files say about themselves ----------------------------------------------------------------------
# chunks FILE: the types of a PNG's chunks, one a line, with the contents of texts and of IHDR's size and depth.
chunks() {
    perl -e 'local $/; $_ = <STDIN>; s/^\x89PNG\r\n\x1a\n// or die "no PNG\n";
        while (s/^(.{4})(.{4})//s) {
            my ($size, $type) = (unpack("N", $1), $2);
            my $data = substr $_, 0, $size;
            substr $_, 0, $size + 4, "";
            print $type, $type eq "tEXt" ? " " . join("=", split /\0/, $data) : "",
                $type eq "IHDR" ? sprintf(" %dx%d %d %d", unpack("NNCC", $data)) : "", "\n";
        }
        length and die "bytes after the last chunk\n"' <"$1"
}

described=$(chunks "$tmp/showcase.png" | uniq)
like "its header is of 121x68 pixels, 8 bits, RGB" "$described" '^IHDR 121x68 8 2$'
like "its colours are said to be sRGB" "$described" '^sRGB$'
like "it names the program" "$described" '^tEXt Software=weft [0-9.]+$'
like "it names its source by digest" "$described" '^tEXt Source=sha256:[0-9a-f]{64}$'
is "it names no time" "$(grep -c tIME <<<"$described")" 0
like "with 16 bits, the header says so" "$(chunks "$tmp/deep.png")" '^IHDR 121x68 16 2$'
is "the source is that of every picture of the scene" \
    "$(chunks "$tmp/deep.png" | grep Source)" "$(grep Source <<<"$described")"
ok "and differs from another scene's" [ "$(chunks "$tmp/first.png" | grep Source)" != "$(grep Source <<<"$described")" ]
is "a PFM has the header PF, size and little-endian scale" "$(head -n 3 "$tmp/linear.pfm" | tr '\n' ' ')" "PF 121 68 -1.0 "
is "and three floats a pixel" "$(stat -c %s "$tmp/linear.pfm")" $((3 + 7 + 5 + 121 * 68 * 12))

finish
