#!/bin/bash
# Every folder includes only what lies above it: dependencies point one way. The table below is the one place that says
# which way; common/README.md says what each folder is for. The test proves on a planted copy that it can fail.
export LC_ALL=C

# FOLDER: what #include "…" in it may begin with
may_include='
common/base:   base
common/math:   base math
common/image:  base math image
common/scene:  base math image scene
common/trace:  base math image scene trace core_revision.h
common/trace/lanes: base math trace
common/wire:   base wire
coordinator:   base math image scene trace wire coordinator page_data.h
worker:        base math image scene trace wire worker
'

# offences ROOT: prints "FILE:LINE: text" of each wrong include, and each folder of sources that the table lacks.
# Of includes in angle brackets only those that lead to a folder of ours are judged.
offences() {
    (cd "$1" && find common coordinator worker -name '*.[ch]' | sort | xargs awk -v table="$may_include" '
        BEGIN {
            count = split(table, lines, "\n")
            for (i = 1; i <= count; i++) {
                words = split(lines[i], word, "[: ]+")
                for (k = 2; k <= words; k++) {
                    allowed[word[1], word[k]] = 1
                    ours[word[k]] = 1
                }
                if (words)
                    known[word[1]] = 1
            }
        }
        FNR == 1 {
            folder = FILENAME
            sub("/[^/]*$", "", folder)
            if (!(folder in known))
                print FILENAME ": in a folder that the table lacks"
        }
        match($0, /^[ \t]*#[ \t]*include[ \t]*[<"]/) {
            path = substr($0, RSTART + RLENGTH)
            quoted = substr($0, RLENGTH, 1) == "\""
            sub("[>\"].*", "", path)
            first = path
            sub("/.*", "", first)
            if (path ~ /\.\.?\// || (quoted || first in ours) && !((folder, first) in allowed))
                print FILENAME ":" FNR ": " $0
        }')
}

tests=0
failed=0
report() { # NAME FOUND EXPECTED
    tests=$((tests + 1))
    if [ "$2" = "$3" ]; then
        echo "ok $tests - $1"
    else
        failed=$((failed + 1))
        echo "not ok $tests - $1"
        printf 'expected:\n%s\nfound:\n%s\n' "$3" "$2" | sed 's/^/# /'
    fi
}

copy=$(mktemp -d "${TMPDIR:-/tmp}/weft-include.XXXXXX")
trap 'rm -rf "$copy"' EXIT

# plant NAME FILE LINE: with LINE as the last of FILE in a copy of the sources, just that is found.
plant() {
    rm -rf "${copy:?}"/*
    cp -r common coordinator worker "$copy"
    mkdir -p "$copy/$(dirname "$2")"
    echo "$3" >>"$copy/$2"
    report "$1" "$(offences "$copy")" "$2:$(awk 'END { print NR }' "$copy/$2"): $3"
}

report 'includes point one way' "$(offences .)" ''
plant 'base may not include wire' common/base/bytes.c '#include "wire/message.h"'
plant 'wire may not include scene' common/wire/message.h '  #  include "scene/model.h" // why not'
plant 'image may not include trace in angle brackets' common/image/image.h '#include <trace/ray.h>'
plant 'the worker may not include the coordinator' worker/pool.c '#include "coordinator/scheduler.h"'
plant 'the coordinator may not include the worker' coordinator/farm.c '#include "worker/session.h"'
plant 'nobody includes tests' coordinator/main.c '#include "tests/random.h"'
plant 'the revision is for trace alone' common/scene/load.c '#include "core_revision.h"'
plant 'paths do not climb' common/trace/plan.c '#include "trace/../wire/rows.h"'
plant 'a name beside the file is not a path of ours' coordinator/peer.c '#include "peer.h"'
rm -rf "${copy:?}"/*
cp -r common coordinator worker "$copy"
mkdir "$copy/common/extra"
echo >"$copy/common/extra/new.c"
report 'a new folder needs a row' "$(offences "$copy")" 'common/extra/new.c: in a folder that the table lacks'
echo "1..$tests"
[ "$failed" -eq 0 ]
