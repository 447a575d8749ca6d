#!/bin/bash
# What a render can be asked to tell of itself: a report, and maps of its samples and of its errors.
. tests/tap.sh

size=(--size 61x34)
glass=("$scenes/glass.json" "${size[@]}")
pixels=$((61 * 34))

# holds NAME FILE EXPRESSION: the Perl expression holds of the report, the decoded object $_ with the first job $j.
holds() {
    local said
    said=$(perl -MJSON::PP -MList::Util=sum0 -e 'my ($file, $test) = @ARGV; local $/; open F, "<", $file or die;
        local $_ = decode_json(<F>); my $j = $_->{jobs}[0]; eval $test or die "not so: ", $@, encode_json($_)' "$2" "$3" 2>&1)
    report $? "$1" || note "$said"
}

# as_promised NAME FILE: the report has exactly the members of the schema, and values of their types.
as_promised() {
    local said
    said=$(perl tests/farm/as_promised.pl coordinator/report.schema.json "$2" 2>&1)
    report $? "$1" || note "$said"
}

# --- the report -----------------------------------------------------------------------------------------------
told=$tmp/told.json
exits 0 "a render with a report" "$weft" render "${glass[@]}" --error 0.01 --workers 3 --band 7 --report "$told" \
    --progress none -o "$tmp/a.png"
is "one line is told, as without it" "$(wc -l <<<"$out")" 1
as_promised "the report is what the schema says" "$told"
holds "it says what was rendered" "$told" "\$j->{scene} eq '$scenes/glass.json' && \$j->{output} eq '$tmp/a.png' &&
    \$j->{state} eq 'done'"
holds "from what, as the picture does" "$told" "\$j->{source} =~ /^sha256:[0-9a-f]{64}\$/ &&
    do { local \$/; open P, '<', '$tmp/a.png'; <P> =~ /Source\\0\$j->{source}/ }"
holds "as what" "$told" 'my $s = $j->{settings}; $s->{width} == 61 && $s->{height} == 34 && $s->{bits} == 8 &&
    $s->{filter} eq "box" && !defined $s->{samples} && $s->{error} == 0.01 && $s->{samples_max} == 1024'
holds "by which sampling" "$told" 'my $s = $j->{sampling}; $s->{least} == 1 && $s->{most} == 1024 && $s->{threshold} > 0'
holds "how long it took" "$told" 'my $s = $j->{seconds}; $s->{survey} > 0 && $s->{render} > 0 &&
    abs($s->{survey} + $s->{render} - $s->{total}) < 0.0015 && $s->{total} <= $_->{seconds}'
holds "which rays" "$told" 'my $r = $j->{rays}; $r->{survey} > 0 && $r->{camera} + $r->{secondary} + $r->{shadow} == $r->{render}'
holds "how good it is, as the line says" "$told" "sprintf('%.1f', \$j->{psnr_decibels}) eq
    '$(sed -n 's/.*(\([0-9.]*\) dB).*/\1/p' <<<"$out")' && \$j->{rmse} > 0.001 && \$j->{rmse} <= 0.01 && \$j->{error_met}"
holds "pixels of every number of samples make up the picture" "$told" "sum0(values %{\$j->{histogram}}) == $pixels"
# A pixel that goes on after its first sample drops it.
holds "and their samples are all there are" "$told" "my \$h = \$j->{histogram};
    sum0(map { (\$_ + (\$_ > 1)) * \$h->{\$_} } keys %\$h) == \$j->{rays}{camera} &&
    abs(\$j->{samples_mean} - \$j->{rays}{camera} / $pixels) < 1e-5"
holds "bands go from top to bottom" "$told" 'my $next = 0; my $gaps = grep { my $gap = $_->{first_row} != $next;
    $next = $_->{first_row} + $_->{rows}; $gap || $_->{rows} > 7 } @{$j->{bands}}; !$gaps && $next == 34 && $j->{rows} == 34'
holds "their rays and samples are those of the picture" "$told" 'sum0(map { $_->{rays} } @{$j->{bands}}) == $j->{rays}{render} &&
    sum0(map { $_->{samples} } @{$j->{bands}}) == $j->{rays}{camera}'
holds "their squared errors that of the picture" "$told" \
    'abs(sqrt(sum0(map { $_->{rows} * $_->{rmse} ** 2 } @{$j->{bands}}) / 34) - $j->{rmse}) < 0.1 * $j->{rmse}'
holds "workers are told with the rows of their bands" "$told" 'my $bands = $j->{bands}; 3 == @{$_->{workers}} && !grep { my $w = $_;
    $w->{rows} != sum0(map { $_->{worker} == $w->{number} ? $_->{rows} : 0 } @$bands) || $w->{pid} < 2 || $w->{kernel} eq "" } @{$_->{workers}}'
holds "and have traced all rays" "$told" \
    'sum0(map { $_->{rays} } @{$_->{workers}}) >= $j->{rays}{render}'

exits 0 "one of a fixed number of samples" "$weft" render "${glass[@]}" --samples 6 --bits 16 --filter tent \
    --report "$tmp/fixed.json" -q -o "$tmp/a.png"
as_promised "the report is what the schema says" "$tmp/fixed.json"
holds "it says so" "$tmp/fixed.json" "my \$s = \$j->{settings}; \$s->{samples} == 6 && !defined \$s->{error} &&
    !defined \$s->{samples_max} && \$s->{bits} == 16 && \$s->{filter} eq 'tent' && !defined \$j->{error_met} &&
    \$j->{histogram}{6} == $pixels && \$j->{samples_mean} == 6 && \$j->{seconds}{survey} == 0 && \$j->{rays}{survey} == 0"
exits 0 "one of a single sample" "$weft" render "${glass[@]}" --samples 1 --report "$tmp/fixed.json" -q -o "$tmp/a.pfm"
as_promised "the report is what the schema says" "$tmp/fixed.json"
holds "its error is that of the survey, not of bands" "$tmp/fixed.json" '$j->{rmse} > 0 && $j->{psnr_decibels} > 0 &&
    $j->{rays}{survey} > 0 && !grep { defined $_->{rmse} } @{$j->{bands}}'

exits 0 "several scenes" "$weft" render "${glass[0]}" "$scenes/mirror.json" "${size[@]}" --samples 2 --report "$tmp/both.json" \
    -q -o "$tmp/both"
as_promised "the report is what the schema says" "$tmp/both.json"
holds "and tells of each" "$tmp/both.json" "2 == @{\$_->{jobs}} && \$_->{jobs}[1]{scene} eq '$scenes/mirror.json' &&
    !grep { \$_->{state} ne 'done' } @{\$_->{jobs}}"

# --- a render that fails --------------------------------------------------------------------------------------
rm -f "$tmp/ended.json"
start ended "$weft" render "${slow[@]}" --samples 800 --band 1 --progress json --report "$tmp/ended.json" -o "$tmp/ended.png"
wait_until "has_rows ended 1" 60
kill -TERM "$pid"
ends 143 "an interrupted render" "$pid" 60 ended
as_promised "has a report" "$tmp/ended.json"
holds "of what it had come to" "$tmp/ended.json" "\$j->{state} eq 'running' && \$j->{rows} == @{\$j->{bands}} &&
    \$j->{rows} > 0 && \$j->{rows} < $slow_rows && sum0(values %{\$j->{histogram}}) == 160 * \$j->{rows} && !defined \$j->{rmse}"
start hopeless "$weft" render "${slow[@]}" --samples 800 --workers 2 --report "$tmp/failed.json" -o "$tmp/ended.png"
kill_workers_of "$pid" 60
ends 1 "a render whose workers are killed again and again" "$pid" 60 hopeless
as_promised "has a report" "$tmp/failed.json"
holds "that says so" "$tmp/failed.json" '$j->{state} eq "failed" && !defined $j->{rmse} && $j->{seconds}{total} < 60 &&
    !grep { $_->{state} ne "gone" } @{$_->{workers}}'
exits 3 "a bad scene" "$weft" render "$scenes/bad/zero-radius.json" --report "$tmp/bad.json" -o "$tmp/bad.png"
ok "has no report" absent "$tmp/bad.json"

# --- a report that cannot be written --------------------------------------------------------------------------
cp "$told" "$tmp/kept.png"
exits 4 "a report in a folder that is not there" \
    "$weft" render "${glass[@]}" --report "$tmp/none/report.json" -o "$tmp/kept.png"
like "it is named" "$err" "$tmp/none/report.json: the folder $tmp/none is not there"
same_bytes "that shows before anything is rendered" "$tmp/kept.png" "$told"

mkdir "$tmp/full"
small=("$scenes"/{sphere,box,cone,disc,plane,cylinder}.json) # their journals are small, the report of all is not
exits 4 "a report that is larger than files may be" bash -c 'ulimit -f 2 && exec "$@"' "$0" \
    "$weft" render "${small[@]}" --size 4x4 --samples 4 --report "$tmp/full/report.json" -o "$tmp/full/pictures"
like "it is named" "$err" "$tmp/full/report.json"
is "the pictures stay, and nothing else" "$(ls -A "$tmp/full")" pictures
is "all of them" "$(ls -A "$tmp/full/pictures" | wc -l)" 6

# --- maps -----------------------------------------------------------------------------------------------------
maps=("${glass[@]}" --error 0.01 -q)
exits 0 "a render with maps" "$weft" render "${maps[@]}" --sample-map "$tmp/s.png" --error-map "$tmp/e.png" -o "$tmp/a.png"
"$weft" render "${maps[@]}" -o "$tmp/plain.png"
same_bytes "the picture is the same as without" "$tmp/a.png" "$tmp/plain.png"
for shared in "1 1 7" "3 3 7" "3 5 1"; do
    read -r workers threads band <<<"$shared"
    mkdir "$tmp/again"
    "$weft" render "${maps[@]}" --workers "$workers" --threads "$threads" --band "$band" \
        --sample-map "$tmp/again/s.png" --error-map "$tmp/again/e.png" -o "$tmp/again/a.pfm"
    for map in s e; do
        same_bytes "$map.png: $workers workers, $threads threads, bands of $band" "$tmp/again/$map.png" "$tmp/$map.png"
    done
    rm -r "$tmp/again"
done
for map in sample error; do
    exits 0 "--$map-map alone" "$weft" render "${maps[@]}" --$map-map "$tmp/alone.png" -o "$tmp/a.png"
    same_bytes "the map is the same" "$tmp/alone.png" "$tmp/${map:0:1}.png"
done
ok "the maps are two" bash -c '! cmp -s "$@"' "$0" "$tmp/s.png" "$tmp/e.png"

printf '{"camera": {"from": [0, 0, 5], "at": [0, 0, 0]}}' >"$tmp/black.json"
exits 0 "a black picture" "$weft" render "$tmp/black.json" "${size[@]}" --error 0.01 -q -o "$tmp/a.png" \
    --sample-map "$tmp/black-s.png" --error-map "$tmp/black-e.png"
same_bytes "takes one sample everywhere and is right everywhere" "$tmp/black-s.png" "$tmp/black-e.png"

# colours FILE: how many different pixels a picture has.
colours() {
    perl -MCompress::Zlib=uncompress -e 'local $/; open F, "<:raw", $ARGV[0] or die; $_ = <F>; my ($at, $data) = (8, "");
        while ($at < length) { my ($n, $kind) = unpack "Na4", substr $_, $at; $data .= substr $_, $at + 8, $n if $kind eq "IDAT";
            ($w, $h) = unpack "NN", substr $_, $at + 8, 8 if $kind eq "IHDR"; $at += 12 + $n }
        my @bytes = unpack "C*", uncompress($data); my ($step, @above, %seen) = (3 * $w + 1, (0) x (3 * $w));
        for my $y (0 .. $h - 1) { my ($filter, @row) = @bytes[$y * $step .. $y * $step + $step - 1];
            for my $i (0 .. $#row) { my ($a, $b, $c) = ($i < 3 ? 0 : $row[$i - 3], $above[$i], $i < 3 ? 0 : $above[$i - 3]);
                my ($p, $q, $r) = (abs($b - $c), abs($a - $c), abs($a + $b - 2 * $c));
                my $guess = (0, $a, $b, $a + $b >> 1, $p <= $q && $p <= $r ? $a : $q <= $r ? $b : $c)[$filter];
                $row[$i] = $row[$i] + $guess & 255 }
            $seen{join ",", @row[3 * $_ .. 3 * $_ + 2]} = 1 for 0 .. $w - 1; @above = @row }
        print scalar keys %seen' "$1"
}

for samples in 1 4 6; do
    "$weft" render "${glass[@]}" --samples $samples -q -o "$tmp/a.png" --sample-map "$tmp/fixed-$samples.png"
    is "the sample map of $samples samples everywhere has one colour" "$(colours "$tmp/fixed-$samples.png")" 1
done
same_bytes "6 samples have the colour of 4" "$tmp/fixed-4.png" "$tmp/fixed-6.png"
exits 0 "a report of the same render as the maps" "$weft" render "${maps[@]}" --report "$tmp/a.json" -o "$tmp/a.png"
holds "says as many numbers of samples as the map has colours" "$tmp/a.json" "keys %{\$j->{histogram}} == $(colours "$tmp/s.png")"
exits 4 "a map in a folder that is not there" "$weft" render "${glass[@]}" --error-map "$tmp/none/e.png" -o "$tmp/nothing.png"
ok "nothing is written" absent "$tmp/nothing.png"

finish
