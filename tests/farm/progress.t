#!/bin/bash
# What is shown while a render runs: JSON lines, nothing, plain lines on a pipe, a bar on a terminal.
. tests/tap.sh

picture=$tmp/a.png
escape=$'\e'
brief=("${slow[@]}" --samples "$([ "$mode" = sanitize ] && echo 4 || echo 36)") # long enough for a bar to be drawn

# --- JSON lines -----------------------------------------------------------------------------------------------
# every FILE EXPRESSION: the Perl expression holds for each line of the file, as the decoded object $_.
every() {
    perl -MJSON::PP -e 'my ($file, $test) = @ARGV; open F, "<", $file or die; my @lines = <F>; @lines or die "no line\n";
        for my $line (@lines) { local $_ = decode_json($line); eval "no warnings; $test" or die "not so: $line" }' "$1" "$2" 2>&1
}

# as_promised NAME FILE: each of its lines is what the schema says.
as_promised() {
    local said
    said=$(perl tests/farm/as_promised.pl coordinator/snapshot.schema.json "$2" lines 2>&1)
    report $? "$1" || note "$said"
}

# holds NAME FILE EXPRESSION
holds() {
    local said
    said=$(every "$2" "$3")
    report $? "$1" || note "$said"
}

exits 0 "a render with --progress json" "$weft" render "${slow[@]}" --progress json --workers 2 -o "$picture"
cp "$tmp/run.out" "$tmp/all.json"
tail -n 1 "$tmp/all.json" >"$tmp/last.json"
head -n 1 "$tmp/all.json" >"$tmp/first.json"
as_promised "every line is a JSON object with the promised members" "$tmp/all.json"
holds "with one job" "$tmp/all.json" '@{$_->{jobs}} == 1'
holds "whose scene and output are named" "$tmp/all.json" "\$_->{jobs}[0]{scene} eq '${slow[0]}' and
    \$_->{jobs}[0]{output} eq '$picture' and \$_->{jobs}[0]{width} == 160 and \$_->{jobs}[0]{height} == $slow_rows"
holds "whose rows are those of the picture" "$tmp/all.json" \
    "\$_->{jobs}[0]{rows_done} + \$_->{jobs}[0]{rows_in_work} <= $slow_rows"
holds "of bands from the top without gaps" "$tmp/all.json" "my \$next = 0; !grep({ my \$gap = \$_->{first_row} != \$next;
    \$next = \$_->{first_row} + \$_->{rows}; \$gap || !\$_->{rows} } @{\$_->{jobs}[0]{bands}}) && \$next == $slow_rows"
holds "which are as many rows done as it says" "$tmp/all.json" 'my $j = $_->{jobs}[0]; my %rows;
    $rows{$_->{state}} += $_->{rows} for @{$j->{bands}};
    ($rows{"done"} // 0) == $j->{rows_done} && ($rows{"in work"} // 0) == $j->{rows_in_work}'
holds "each in work by a worker that is there" "$tmp/all.json" 'my %there = map { ($_->{number} => 1) }
    grep { $_->{state} ne "gone" } @{$_->{workers}}; !grep { ($_->{state} eq "in work") != ($there{$_->{worker} // 0} // 0) }
    @{$_->{jobs}[0]{bands}}'
holds "nobody is in trouble" "$tmp/all.json" '$_->{refused} == 0 && !grep { defined $_->{trouble} } @{$_->{workers}}'
holds "nothing goes backwards" "$tmp/all.json" 'my $j = $_->{jobs}[0]; my $back = $j->{rows_done} < $main::rows ||
    $_->{elapsed} < $main::elapsed; ($main::rows, $main::elapsed) = ($j->{rows_done}, $_->{elapsed}); !$back'
holds "the first line is early" "$tmp/first.json" "\$_->{jobs}[0]{rows_done} < $slow_rows and \$_->{jobs}[0]{state} ne 'done'"
holds "the last one says that all is done" "$tmp/last.json" "my \$j = \$_->{jobs}[0]; \$j->{state} eq 'done' and
    \$j->{rows_done} == $slow_rows and \$j->{rows_in_work} == 0 and \$j->{remaining} == 0 and \$j->{rays} > 0"
holds "how good it is" "$tmp/last.json" 'my $j = $_->{jobs}[0]; $j->{rmse} > 0 and $j->{rmse} < 0.02 and
    $j->{samples} == $j->{samples_max} and !defined $j->{error}'
holds "and who did it" "$tmp/last.json" 'my $rows = 0; $rows += $_->{rows_done} for @{$_->{workers}};
    @{$_->{workers}} == 2 and $rows >= $_->{jobs}[0]{height}'
ok "there are some lines between" [ "$(wc -l <"$tmp/all.json")" -ge 4 ]

exits 0 "a render that is to meet an error" \
    "$weft" render "$scenes/glass.json" --size 96x54 --error 0.01 --progress json --workers 2 -o "$picture"
cp "$tmp/run.out" "$tmp/error.json"
tail -n 1 "$tmp/error.json" >"$tmp/last.json"
as_promised "is told as promised, of its survey too" "$tmp/error.json"
holds "says on every line which, and what pixels may take" "$tmp/error.json" \
    '$_->{jobs}[0]{error} == 0.01 and $_->{jobs}[0]{samples_max} == 1024'
like "tells each state as soon as it has changed, however quick it is" \
    "$(sed -E 's/.*"output":"[^"]*","state":"([a-z]+)".*/\1/' "$tmp/error.json" | uniq | paste -sd ' ')" \
    '^(waiting )?surveying running done$'
holds "and says in the end what it took" "$tmp/last.json" 'my $j = $_->{jobs}[0]; $j->{state} eq "done" and
    $j->{rmse} > 0.001 and $j->{rmse} <= 0.01 and $j->{samples} > 1 and $j->{samples} < 16'

odd=$tmp/$'odd "name"\\\t\xff é.json'
cp "$scenes/first.json" "$odd"
exits 0 "a scene with an odd name" "$weft" render "$odd" --size 20x10 --samples 1 --progress json -o "$picture"
cp "$tmp/run.out" "$tmp/odd.json"
holds "is JSON still, a byte that is not UTF-8 replaced" "$tmp/odd.json" \
    '$_->{jobs}[0]{scene} =~ m{/odd "name"\\\t\x{FFFD} \x{E9}\.json$}'

start ended "$weft" render "${endless[@]}" --progress json -o "$picture"
wait_until "has_rows ended 1" 60
kill -TERM "$pid"
ends 143 "an interrupted render" "$pid" 60 ended
as_promised "has whole lines only" "$tmp/ended.out"
holds "and does not say that it was done" "$tmp/ended.out" '$_->{jobs}[0]{state} ne "done"'

start lost "$weft" render "${endless[@]}" --workers 2 --progress json -o "$picture"
wait_until "has_rows lost 1" 60
kill -KILL "$(processes weft-worker "$pid" | head -n 1)"
wait_until "grep -q '\"gone\".*\"trouble\":\"lost\"' '$tmp/lost.out'" 60
kill -TERM "$pid"
ends 143 "a render that loses a worker" "$pid" 60 lost
as_promised "is told as promised" "$tmp/lost.out"
tail -n 1 "$tmp/lost.out" >"$tmp/last.json"
holds "with its trouble" "$tmp/last.json" 'join(" ", grep { $_ } map { $_->{trouble} } grep { $_->{state} eq "gone" }
    @{$_->{workers}}) =~ /^lost/'

# --- nothing --------------------------------------------------------------------------------------------------
exits 0 "a quiet render" "$weft" render "${brief[@]}" -q -o "$picture"
is "says nothing at all" "$out$err" ""
exits 0 "with --progress none" "$weft" render "${brief[@]}" --progress none -o "$picture"
is "only the result is on standard output" "$(sed 's/[0-9.]* s, .*//' <<<"$out")" "$picture: 160×90, ${brief[-1]} samples a pixel, "
is "and no progress on standard error" "$(grep -c '%' <<<"$err")" 0

# --- a pipe ---------------------------------------------------------------------------------------------------
for progress in auto json none; do
    exits 0 "on a pipe, --progress $progress" env TERM=xterm "$weft" render "${brief[@]}" --progress $progress -o "$picture"
    is "there are no escape sequences" "$(grep -c "$escape" <<<"$out$err")" 0
done

# --- a terminal -----------------------------------------------------------------------------------------------
# screen COLUMNS: what a terminal shows that got the bytes of standard input: line feed, carriage return, cursor up (A),
# erase to the end of the line (K) and of the screen (J), printable text that wraps; anything else is an error.
screen() {
    perl -CS -e 'my ($columns, $x, $y, @rows) = ($ARGV[0], 0, 0); local $/; $_ = <STDIN>;
        while (/\G(?:\e\[(\d*)([A-Za-z])|([\r\n])|([^\x00-\x1F\x7F])|(.))/gs) {
            if (defined $5) { die sprintf "character %x\n", ord $5 }
            elsif (defined $4) {
                if ($x == $columns) { $x = 0; $y++ }
                $rows[$y][$x++] = $4;
            } elsif (defined $3) { $3 eq "\r" ? ($x = 0) : $y++ }
            elsif ($2 eq "A") { $y -= $1 || 1; $y >= 0 or die "above the screen\n" }
            elsif ($2 eq "K") { $#{$rows[$y]} = $x - 1 if @{$rows[$y] // []} > $x }
            elsif ($2 eq "J") { $#{$rows[$y]} = $x - 1 if @{$rows[$y] // []} > $x; $#rows = $y if $#rows > $y }
            else { die "sequence ending in $2\n" }
        }
        for (@rows) { my $line = join "", map { $_ // " " } @$_; $line =~ s/ +$//; print "$line\n" }' "$1" 2>&1
}

if ! type script >/dev/null 2>&1; then
    skip "a bar on a terminal" "there is no script(1)"
else
    on_terminal() { # COLUMNS OPTION...: the bytes that a terminal of that width gets, to $tmp/terminal
        local columns=$1 command
        shift
        printf -v command '%q ' "$weft" render "${brief[@]}" -o a.png "$@"
        run env -C "$tmp" TERM=xterm script -qec "stty cols $columns rows 24; $command" /dev/null
        cp "$tmp/run.out" "$tmp/terminal"
    }
    for columns in 80 40; do
        on_terminal $columns
        is "on a terminal of $columns columns the render ends well" "$status" 0
        like "a strip is drawn" "$(cat "$tmp/terminal")" '[█▒░1]{20}'
        like "and how far it is" "$(cat "$tmp/terminal")" '[0-9]+ %'
        # What is left is what would be there had no bar been drawn: log lines and the result, wrapped.
        left=$(screen $columns <"$tmp/terminal" | tr -d '\n')
        like "the result is left on the screen" "$left" 'a\.png: ?160×90, '
        is "of the bar nothing is left" "$(grep -Ec '█|▒|░|→|rays/s  (working|idle)' <<<"$left")" 0
    done
    on_terminal 80 --progress none
    is "with --progress none there are no escape sequences" "$(grep -c "$escape" "$tmp/terminal")" 0
    on_terminal 80 -q
    is "with -q there is nothing" "$(cat "$tmp/terminal")" ""
    run env -C "$tmp" TERM=dumb script -qec "$weft render ${brief[*]} -o a.png" /dev/null
    is "on a terminal that cannot move its cursor there is no bar" "$(grep -c "$escape" <<<"$out")" 0
fi

finish
