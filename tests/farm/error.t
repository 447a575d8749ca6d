#!/bin/bash
# Renders that are to meet an error: the same bytes however they are shared out, and an error that is what it says.
. tests/tap.sh

size=(--size 61x34)

# picture OUTPUT SCENE OPTION...: leaves $out behind, the line about it.
picture() {
    local output=$1 scene=$2
    shift 2
    run "$weft" render "$scenes/$scene.json" --progress none -o "$tmp/$output" "$@"
}

# repeats NAME SCENE REFERENCE OPTION...: the options give the bytes of the reference.
repeats() {
    local name=$1 scene=$2 reference=$3
    shift 3
    picture again.pfm "$scene" "$@"
    same_bytes "$name" "$tmp/$reference" "$tmp/again.pfm" || note "status $status: $err"
}

# figures: what $out tells that is not a matter of time.
figures() {
    sed 's/.*: 61/61/; s/ [0-9.]* s,//; s/ [0-9.]*\( [kM]\)\? rays\/s,//' <<<"$out"
}

# rmse: of the line $out; 1 if it tells none.
rmse() {
    sed -n 's/.*, RMSE \([0-9.]*\)\( .*\)\?$/\1/p; t; s/.*/1/p' <<<"$out"
}

# within NAME NUMBER LEAST MOST
within() {
    awk -v x="$2" -v least="$3" -v most="$4" 'BEGIN { exit !(x >= least && x <= most) }'
    report $? "$1" || note "expected $3 to $4, found $2"
}

# --- the same bytes -------------------------------------------------------------------------------------------
for scene in showcase glass; do
    picture $scene.pfm $scene "${size[@]}" --error 0.01 --workers 1 --threads 1
    is "$scene: rendered by one thread" "$status" 0
    line=$(figures)
    for shared in "1 3 1" "3 3 7" "3 5 65535"; do
        read -r workers threads band <<<"$shared"
        repeats "$scene: $workers workers, $threads threads, bands of $band" $scene $scene.pfm \
            "${size[@]}" --error 0.01 --workers "$workers" --threads "$threads" --band "$band"
        is "$scene: and the same figures" "$(figures)" "$line"
    done
    repeats "$scene: 2 workers, bands as the program likes" $scene $scene.pfm "${size[@]}" --error 0.01 --workers 2
    for kernel in ref avx2 neon; do
        if "$worker" --kernel $kernel --version >/dev/null 2>&1; then
            repeats "$scene: kernel $kernel" $scene $scene.pfm "${size[@]}" --error 0.01 --kernel $kernel
        fi
    done
done
ok "another error gives another picture" \
    bash -c '"$@" --error 0.02 && ! cmp -s "$0/other.pfm" "$0/glass.pfm"' "$tmp" \
    "$weft" render "$scenes/glass.json" -q "${size[@]}" -o "$tmp/other.pfm"

mkdir "$tmp/together"
exits 0 "both in one command" "$weft" render "$scenes/showcase.json" "$scenes/glass.json" "${size[@]}" --error 0.01 \
    --workers 2 --progress none -o "$tmp/together"
for scene in showcase glass; do
    picture $scene.png $scene "${size[@]}" --error 0.01
    same_bytes "$scene is the same as alone" "$tmp/together/$scene.png" "$tmp/$scene.png"
done

for tiny in 1x1 1x41 67x1; do
    picture tiny.pfm showcase --size $tiny --error 0.01 --workers 1 --threads 1
    repeats "a picture of $tiny pixels" showcase tiny.pfm --size $tiny --error 0.01 --workers 3 --threads 5
done

# --- a worker dies --------------------------------------------------------------------------------------------
long=("$scenes/showcase.json" --size "$([ "$mode" = sanitize ] && echo 96x54 || echo 480x270)" --kernel ref --error 0.003)
"$weft" render "${long[@]}" -q -o "$tmp/long.png"
for moment in surveying running; do
    start $moment "$weft" render "${long[@]}" --workers 3 --progress json -o "$tmp/$moment.png"
    wait_until "grep -q '\"state\":\"$moment\"' '$tmp/$moment.out'" 60
    worker=$(processes weft-worker "$pid" | head -n 1)
    ok "a worker of it runs" kill -KILL "$worker"
    ends 0 "one of 3 workers killed while $moment" "$pid" 60 $moment
    same_bytes "the picture is the same" "$tmp/$moment.png" "$tmp/long.png"
done

# --- what was asked for is met --------------------------------------------------------------------------------
for scene in showcase glass; do
    picture reference.pfm $scene "${size[@]}" --samples 256
    for error in 0.02 0.005; do
        picture found.pfm $scene "${size[@]}" --error $error
        within "$scene: the estimate is at most $error" "$(rmse)" 0 $error
        exits 0 "$scene: so is the truth, but for what an estimate may be off" "$weft" compare \
            --max-rmse "$(awk -v e=$error 'BEGIN { print 1.5 * e }')" "$tmp/found.pfm" "$tmp/reference.pfm"
    done
done

# --- what is said ---------------------------------------------------------------------------------------------
decibels='RMSE 0\.[0-9]+ \([0-9.]+ dB\)'
picture line.png glass "${size[@]}" --error 0.01
like "the line: time, samples, rays, error" "$out" \
    "^$tmp/line.png: 61×34, [0-9]+\.[0-9] samples a pixel, [0-9.]+ s, [0-9.]+( [kM])? rays, [0-9.]+( [kM])? rays/s, $decibels\$"
picture line.png glass "${size[@]}" --samples 4
like "of a fixed number of samples too" "$out" "61×34, 4 samples a pixel, .*, $decibels\$"
picture line.png glass "${size[@]}" --samples 1
like "one sample is judged by a survey" "$out" ', 1 sample a pixel, .*, RMSE 0\.[0-9]+ '
picture line.png glass "${size[@]}" --error 0.0005 --max-samples 15
like "a limit that is in the way is told" "$out" \
    ", $decibels, above 0\.0005: [0-9.]+ % of the pixels met the limit of 8 samples\$"
printf '{"camera": {"from": [0, 0, 5], "at": [0, 0, 0]}}' >"$tmp/black.json"
run "$weft" render "$tmp/black.json" --size 8x8 --error 0.01 --progress none -o "$tmp/black.png"
like "a black picture is exact" "$out" ', 1\.0 samples a pixel, .*, RMSE 0$'

# --- which sampling counts ------------------------------------------------------------------------------------
picture default.pfm first "${size[@]}"
repeats "without a word an error of 0.005 is asked for" first default.pfm "${size[@]}" --error 0.005
repeats "with at most 1024 samples" first default.pfm "${size[@]}" --max-samples 1024
picture four.pfm showcase "${size[@]}"
like "a scene's own samples count" "$out" ', 4 samples a pixel, '
repeats "as if they were asked for" showcase four.pfm "${size[@]}" --samples 4
picture error.pfm showcase "${size[@]}" --error 0.05
like "--error overrides them" "$out" ', [0-9]\.[0-9] samples a pixel, '
picture limit.pfm showcase "${size[@]}" --max-samples 64
like "so does --max-samples" "$out" ', [0-9]+\.[0-9] samples a pixel, '

finish
