#!/bin/bash
# weft compare says how far two images are apart; --max-rmse makes it a gate, -o shows where.
. tests/tap.sh

# pfm FILE SIZE RED GREEN BLUE: of one colour, in linear light; a number is a perl expression of the pixel's number $i.
pfm() {
    perl -e '($file, $size, @colour) = @ARGV; ($w, $h) = split /x/, $size; open F, ">:raw", $file or die;
        print F "PF\n$w $h\n-1.0\n"; for $i (0 .. $w * $h - 1) { print F pack "f<3", map { eval } @colour }' -- "$@"
}

# png FILE BITS CODE...: one row of greys.
png() {
    perl -MCompress::Zlib -e '($file, $bits, @codes) = @ARGV; sub chunk { pack("N", length $_[1]) . "$_[0]$_[1]" .
        pack "N", crc32("$_[0]$_[1]") } open F, ">:raw", $file or die; print F "\x89PNG\r\n\x1a\n",
        chunk("IHDR", pack "NNCCCCC", scalar @codes, 1, $bits, 0, 0, 0, 0),
        chunk("IDAT", compress("\0" . pack $bits == 8 ? "C*" : "n*", @codes)), chunk("IEND", "")' -- "$@"
}

# says NAME TEXT: it was printed, as a line of its own.
says() {
    ok "$1: $2" grep -qxF -- "$2" <<<"$out"
}

# refused STATUS PATTERN ARGUMENT...: that status, one line like the pattern, and no result.
refused() {
    exits "$1" "refused: ${*:3}" "$weft" compare "${@:3}"
    like "says why" "$err" "^weft: .*$2"
    is "in one line, and nothing else" "$(wc -l <<<"$err")$out" 1
}

cd "$tmp" || exit 1
mkdir -p folder

# --- figures --------------------------------------------------------------------------------------------------
exits 0 "a picture and itself" "$weft" compare "$scenes/showcase.png" "$scenes/showcase.png" --max-rmse 0
is "do not differ" "$out" "image: 960×540
RMSE: 0
PSNR: infinite
maximum error: 0
off by more than 1/255: 0 % of the pixels
FLIP: 0"
is "and nothing is complained of" "$err" ""

pfm white.pfm 40x30 1 1 1
pfm black.pfm 40x30 0 0 0
exits 0 "white and black" "$weft" compare white.pfm black.pfm
is "differ by all there is; FLIP is that of HyAB 100" "$out" "image: 40×30
RMSE: 1
PSNR: 0.00 dB
maximum error: 1
off by more than 1/255: 100 % of the pixels
FLIP: 0.96738"
pfm brighter.pfm 40x30 7 1e30 1
exits 0 "light above 1" "$weft" compare white.pfm brighter.pfm --max-rmse 0
says "is white" "RMSE: 0"
pfm quarter.pfm 40x30 '$i % 4 == 0' 0 0
exits 0 "one channel of a quarter of the pixels" "$weft" compare black.pfm quarter.pfm
says "counts a twelfth" "RMSE: 0.288675"
says "counts a twelfth" "off by more than 1/255: 25 % of the pixels"

png codes8.png 8 0 51 102 255
png codes16.png 16 0 13107 26214 65535
exits 0 "the same codes of 8 and 16 bits" "$weft" compare codes8.png codes16.png --max-rmse 0
png step8.png 8 1 52 103 254
exits 0 "a step of 8 bit codes" "$weft" compare codes8.png step8.png
says "is 1/255" "RMSE: 0.00392157"
says "and not more" "off by more than 1/255: 0 % of the pixels"
png step16.png 16 1 13108 26215 65534
exits 0 "a step of 16 bit codes" "$weft" compare codes16.png step16.png
like "is 1/65535, but for what float loses" "$out" '^RMSE: 1\.52[56][0-9]*e-05$'
pfm linear.pfm 4x1 '(0, 0.0331047666, 0.1328683216, 1)[$i]' '(0, 0.0331047666, 0.1328683216, 1)[$i]' \
    '(0, 0.0331047666, 0.1328683216, 1)[$i]'
exits 0 "a PFM is encoded" "$weft" compare codes16.png linear.pfm --max-rmse 1e-7

# --- the gate -------------------------------------------------------------------------------------------------
exits 0 "an RMSE that is allowed" "$weft" compare codes8.png step8.png --max-rmse 0.004
exits 1 "an RMSE that is not" "$weft" compare codes8.png step8.png --max-rmse 0.0039 -o gate.png
is "is told" "$err" "weft: codes8.png and step8.png: expected an RMSE of at most 0.0039, found 0.00392157"
says "beside the figures" "RMSE: 0.00392157"
ok "and the picture is there" [ -s gate.png ]

# --- the picture ----------------------------------------------------------------------------------------------
exits 0 "a picture of no difference" "$weft" compare black.pfm black.pfm -o none.png
pfm magma-0.pfm 40x30 0 0 '(4 / 255) / 12.92'
exits 0 "is magma's first colour" "$weft" compare none.png magma-0.pfm --max-rmse 1e-7
pfm green.pfm 40x30 0 1 0
pfm blue.pfm 40x30 0 0 1
exits 0 "green and blue" "$weft" compare green.pfm blue.pfm -o most.png
says "are farthest apart" "FLIP: 1"
pfm magma-1.pfm 40x30 0.97344529 0.98225055 0.52099557
exits 0 "the picture is magma's last colour" "$weft" compare most.png magma-1.pfm --max-rmse 1e-7
exits 0 "as large as the images" "$weft" compare none.png most.png
says "as large as the images" "image: 40×30"
exits 0 "a picture may be larger on the retina" "$weft" compare "$scenes/showcase.png" "$scenes/showcase.png" --ppd 20

# --- what is wrong --------------------------------------------------------------------------------------------
pfm small.pfm 40x29 1 1 1
echo text >text.png
printf '\xff\xd8\xff\xe0 JPEG' >photo.png
head -c 100 white.pfm >short.pfm
head -c 60 codes8.png >short.png
pfm nan.pfm 4x1 '"nan"' 0 0
refused 3 'one size, found white.pfm of 40 × 30 and small.pfm of 40 × 29' white.pfm small.pfm
refused 3 'nosuch.png' nosuch.png white.pfm
refused 3 'nosuch.png' white.pfm nosuch.png
refused 3 'folder' folder white.pfm
refused 3 'text.png: expected a PNG or PFM image' text.png white.pfm
refused 3 'photo.png: expected a PNG or PFM image, found a JPEG image' white.pfm photo.png
refused 3 'short.pfm: expected 14400 bytes' short.pfm white.pfm
refused 3 'short.png: damaged PNG' short.png codes8.png
refused 3 'nan.pfm: .*finite' nan.pfm codes8.png
exits 4 "an output that cannot be written" "$weft" compare white.pfm black.pfm -o nosuch/d.png
like "is told" "$err" '^weft: nosuch/d.png: '
ok "nothing is left beside the pictures" [ "$(find . -name '*.part' | wc -l)" -eq 0 ]

# --- what cannot be told --------------------------------------------------------------------------------------
if [ -w /dev/full ]; then
    exits 4 "a full disk is noticed" \
        bash -c "'$weft' compare '$scenes/showcase.png' '$scenes/showcase.png' >/dev/full"
    like "and said" "$err" '^weft: standard output cannot be written: No space left on device$'
fi

finish
