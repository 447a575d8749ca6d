#!/bin/bash
# ratios.awk on curves that are straight on log-log axes, where interpolation is exact.
. tests/tap.sh

# curve SCENE NAME SECONDS CODES...: points where the time is SECONDS × CODES^−2, CODES being the RMSE in 1/255.
curve() {
    local codes
    for codes in "${@:4}"; do
        awk -v OFS=, -v name="$1,32,32,$2,options" -v factor="$3" -v codes="$codes" \
            'BEGIN { print name, factor / codes ^ 2, 0, 0, 1, codes / 255, 0 }'
    done
}

# row SCENE: of the first table, the only one whose ratios are between two programs' adaptive sampling.
row() {
    grep -m 1 "^| $1 " <<<"$out"
}

{
    echo scene,width,height,curve,setting,seconds,least,most,rounds,rmse,flip
    curve within weft-adaptive 2 5 0.7
    curve within weft-fixed 5 0.5 1.1 3 8        # not in the order of its times
    curve within povray-am1 20 9 3.3             # POV-Ray's best is one method,
    curve within povray-fixed 20 3 0.3           # between two, or another,
    curve within povray-am2 100 3.1 1.5          # though this one has points that no other point beats
    curve within tachyon 30 20 0.1
    curve peers weft-adaptive 1 8 0.5
    curve peers tachyon 7 10 0.5
    curve peers povray-am1 8 3 0.5               # at 4/255 it is better already
    curve short weft-adaptive 1 1.5 0.5          # better than 2/255 at once
    curve short tachyon 9 20 1.5                 # does not come down to 1/255
    curve lone tachyon 9 20 0.5
} >"$tmp/results.csv"

exits 0 "results are read" awk -f tests/bench/error/ratios.awk "$tmp/results.csv"
is "lines between points, the best of POV-Ray's methods" "$(row within)" \
    '| within | 10.00 (povray) | 10.00 (povray-fixed) | 10.00 (povray-fixed) |'
is "the quicker peer" "$(row peers)" '| peers | 7.00 (tachyon) | 7.00 (tachyon) | 7.00 (tachyon) |'
is "levels beyond a curve's ends are bounds" "$(row short)" \
    '| short | ≥ 1.27 (tachyon) | ≥ 5.06 (tachyon) | ≥ 4.00 |'
is "no curve, no ratio" "$(row lone)" '| lone | – | – | – |'
is "bounds are left out of the means" "$(row geometric)" \
    "| geometric mean (of scenes) | 8.37 (2) | 8.37 (2) | 8.37 (2) |"
like "every table has its rows: fixed over adaptive sampling" "$out" '^\| within \| 2\.50 \| 2\.50 \| 2\.50 \|$'
like "every table has its rows: peers over fixed sampling" "$out" \
    '^\| within \| 4\.00 \(povray\) \| 4\.00 \(povray-fixed\) \| 4\.00 '

finish
