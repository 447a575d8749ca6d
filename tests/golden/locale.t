#!/bin/bash
# The scene reader gives the same numbers, and so the same pixels, where the locale writes 0,5 for 0.5. weft never sets
# a locale, but a program around its library might.
. tests/tap.sh

program=$build/tests/isa/signature.t
made=$tmp/locale/de_DE.UTF-8
mkdir "$tmp/locale"
localedef -i de_DE -f UTF-8 "$made" 2>"$tmp/localedef.err" ||
    skip_all "no locale with a comma can be made: $(head -n 1 "$tmp/localedef.err")"

run env LC_ALL=C "$program"
usual=$(sed 1d <<<"$out")
# What glibc keeps of LOCPATH it never frees.
run env ASAN_OPTIONS="$ASAN_OPTIONS:detect_leaks=0" LOCPATH="$tmp/locale" LC_ALL=de_DE.UTF-8 "$program"
like "the locale is in force" "$out" '^# locale de_DE.UTF-8, decimal point ,$'
is "and every digest is that of the C locale" "$(sed 1d <<<"$out")" "$usual"

finish
