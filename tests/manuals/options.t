#!/bin/bash
# Every help fits a screen, and the manual pages have the options of the help, no more and no less, with their ranges.
. tests/tap.sh

commands=$(sed -n 's/^    {"\([a-z]*\)", command_.*/\1/p' coordinator/main.c)

# fits LINES PROGRAM...: its help has at most so many lines, of at most 80 columns.
fits() {
    local most=$1 help
    shift
    help=$("$@" --help)
    is "the help of ${*##*/} fits 80 columns" "$(grep -E '.{81}' <<<"$help")" ''
    ok "and $most lines" test "$(wc -l <<<"$help")" -le "$most"
}

fits 24 "$weft"
fits 24 "$worker"
for command in $commands; do
    fits "$([ "$command" = render ] && echo 40 || echo 24)" "$weft" "$command" # render has its options in groups
done

# --- the pages ------------------------------------------------------------------------------------------------

# section PAGE HEADING: what is under it, down to the next heading of any kind.
section() {
    awk -v heading="$2" '/^\.S[hs] / { on = substr($0, 5) == heading } on' "deploy/man/$1"
}

# items: options that an mdoc text explains, a line each: "-o --output".
items() {
    sed -n 's/ \(Ar\|Cm\|Ns\) .*//; s/^\.It Fl //p' | sed 's/, Fl //; s/[^ ]*/-&/g'
}

# of_help PROGRAM...: the same of a help.
of_help() {
    "$@" --help | sed -nE 's/^  (-.), (--[a-z-]+).*/\1 \2/p; s/^      (--[a-z-]+).*/\1/p'
}

# item OPTION: what an mdoc text says of it, on one line.
item() {
    awk -v option="$1" '
        /^\.It / { on = (" " $0 " ") ~ " Fl " substr(option, 2) " " }
        /^\.El/ { on = 0 }
        on' | paste -sd ' '
}

# has_ranges TEXT PROGRAM...: what an mdoc text says of an option names the range that the sentence names by which
# numbers beyond it are refused.
has_ranges() {
    local text=$1 option range
    shift
    for option in $("$@" --help | sed -nE 's/^  (-.,|   ) (--[a-z-]+) [^ ].*/\2/p'); do # those with an argument
        range=$("$@" "$option" none 2>&1 |
            sed -nE "s/.*$option: expected .* from ([0-9.]+) to ([0-9.]+), found .*/\1 to \2/p")
        [ -z "$range" ] || like "${*##*/} $option: its range" "$(item "$option" <<<"$text")" "[ ,]${range//./\\.}[^0-9]"
    done
}

common=$(section weft.1 DESCRIPTION)
for command in $commands; do
    text=$(section weft.1 "weft $command")
    found=$(items <<<"$common$text" | sort)
    is "weft(1) has the options of weft $command" "$found" "$(of_help "$weft" "$command" | sort)"
    has_ranges "$text" "$weft" "$command"
done
text=$(section weft-worker.1 DESCRIPTION)
is "weft-worker(1) has the options of weft-worker" "$(items <<<"$text" | sort)" "$(of_help "$worker" | sort)"
has_ranges "$text" "$worker"

like "weft(1) names every command in its synopsis" "$(section weft.1 SYNOPSIS | sed -n 's/^\.Cm //p' | xargs)" \
    "^$(xargs <<<"$commands") help$"

# --- as man reads them ----------------------------------------------------------------------------------------
for page in deploy/man/*; do
    if command -v man >/dev/null; then
        is "man has nothing to say of $page" "$(man --warnings -E UTF-8 -l "$page" 2>&1 >/dev/null)" ''
    else
        skip "man reads $page" "there is no man here"
    fi
    if command -v mandoc >/dev/null; then
        is "nor mandoc" "$(mandoc -T lint "$page" | grep -v 'STYLE: referenced manual not found')" ''
    else
        skip "mandoc reads $page" "there is no mandoc here"
    fi
done

finish
