#!/bin/bash
# The pictures of scenes/README.md are what weft renders now: the same pixels (PNG bytes may differ with other versions
# of libpng and zlib). `make pictures` renders them anew: a change of them is a change of pictures, so say in the commit
# why they change.
. tests/tap.sh
[ "$mode" = release ] || skip_all "pictures have the same pixels in release mode, and render there in a few seconds"

exits 0 "the pictures are rendered" scenes/pictures/render "$weft" "$tmp/pictures"
is "they are those that are kept" "$(cd scenes/pictures && echo *.png)" "$(cd "$tmp/pictures" && echo *)"
for picture in scenes/pictures/*.png; do
    exits 0 "$picture" "$weft" compare --max-rmse 0 "$picture" "$tmp/pictures/${picture##*/}"
done
for scene in scenes/pictures/*.json; do
    ok "$scene has its picture" test -e "${scene%.json}.png"
done

finish
