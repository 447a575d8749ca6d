#!/bin/bash
# In a bash that has sourced deploy/completion/weft, words are completed as one would wish, and every option is there.
. tests/tap.sh
. deploy/completion/weft
PATH=$build:$PATH

export LC_ALL=C # for sort

# offered WORD...: what is offered for the last of the words, sorted, on one line.
offered() {
    local function
    COMP_WORDS=("$@")
    COMP_CWORD=$(($# - 1))
    function=$(complete -p "${1##*/}" | sed -n 's/.* -F \([^ ]*\) .*/\1/p')
    "$function" "$1" "${@: -1}" "${@: -2:1}"
    printf '%s\n' "${COMPREPLY[@]}" | sort | paste -sd ' '
}

offers() { # EXPECTED WORD...
    local expected=$1
    shift
    is "$*[TAB]" "$(offered "$@")" "$expected"
}

options_of() { # PROGRAM...: the long options in its help, sorted, on one line
    "$@" --help | grep -oE '^  (-.,|   ) --[a-z-]+' | grep -oE -e '--.*' | sort | paste -sd ' '
}

commands=$(sed -n 's/^    {"\([a-z]*\)", command_.*/\1/p' coordinator/main.c)
all=$(printf '%s\n' "$commands" help | sort | paste -sd ' ')
offers "--help --version $all" weft ''
offers 'render' weft re
offers "$all" weft help ''
for command in $commands; do
    offers "$(options_of weft "$command")" weft "$command" --
done
offers "$(options_of weft-worker)" weft-worker --
offers "$(options_of weft-worker)" "$worker" --
offers "$(options_of weft render | sed 's/--listen //')" weft-ssh hosts.txt --
offers '--filter' "$PWD/deploy/weft-ssh" hosts.txt room.json --fi
offers '--help --version' weft-ssh --

# --- what options take ----------------------------------------------------------------------------------------
kernels='ref sse2 avx2 avx512 neon'
like "the kernels are those of the help" "$(weft render --help)" "kernel NAME .*${kernels// /, }"
offers 'avx2 avx512 neon ref sse2' weft render --kernel ''
offers 'avx2 avx512' weft render scene.json --kernel av
offers 'avx2 avx512' weft-worker --kernel = av
offers 'neon' weft-worker --kernel = ne
offers 'avx2 avx512 neon ref sse2' weft-worker --kernel =
offers '16 8' weft render --bits ''
offers 'box tent' weft render --filter ''
offers 'auto bar json none' weft render --progress ''
offers '' weft render --samples ''
offers '' weft render -s ''

# --- files ----------------------------------------------------------------------------------------------------
mkdir -p "$tmp/files/folder" "$tmp/files/keys"
cd "$tmp/files" || exit 1
touch room.json old.nff notes.txt picture.png light.pfm 'two words.json'
offers 'folder keys old.nff room.json two words.json' weft render ''
offers 'room.json' weft check ro
offers 'folder keys light.pfm picture.png' weft compare ''
offers 'folder keys' weft keygen ''
offers 'keys' weft render --keys k
offers 'folder keys' weft-worker --keys ''
offers 'folder keys light.pfm picture.png' weft render -o ''
offers 'folder keys picture.png' weft compare --output ''
offers 'folder keys picture.png' weft render --error-map ''
offers 'room.json' weft render --report r
offers 'room.json' weft render --quiet r
offers 'room.json' weft render -q r
offers 'folder keys light.pfm notes.txt old.nff picture.png room.json two words.json' weft-ssh ''
offers 'notes.txt' weft-ssh n
offers 'folder keys old.nff room.json two words.json' weft-ssh notes.txt ''
offers 'folder keys light.pfm picture.png' weft-ssh notes.txt room.json -o ''
cd "$OLDPWD" || exit 1

finish
