#!/bin/bash
# Wrong command lines end with status 2 and one line that says what is wrong; help is complete.
. tests/tap.sh

# wrong PATTERN PROGRAM ARGUMENT...: the sentence is like the pattern.
wrong() {
    local pattern=$1
    shift
    local name="${1##*/} ${*:2}"
    exits 2 "$name" "$@"
    like "$name: the sentence" "$err" "^weft(-worker)?: $pattern"
    is "$name: one line, and nothing on standard output" "$(wc -l <<<"$err")$out" 1
}

first=$scenes/first.json
sources=$PWD
cd "$tmp" || exit 1

wrong 'unknown command "nosuch"' "$weft" nosuch
wrong 'unknown command "--nosuch"' "$weft" --nosuch
wrong 'expected a scene' "$weft" render
wrong '--nosuch: unknown option; see --help$' "$weft" render --nosuch "$first"
wrong '--s: may stand for --size, --samples and others$' "$weft" render --s 4 "$first"
wrong 'unknown option -Z' "$weft" render -Z "$first"
wrong 'unknown option -Z' "$weft" render -qZ "$first"
wrong '--size: expected an argument' "$weft" render "$first" --size
wrong '-o: expected an argument' "$weft" render "$first" -o
wrong '--quiet=1: --quiet takes no argument$' "$weft" render --quiet=1 "$first"
for size in 5 5x 0x5 5x0 -5x5 65536x5 5x5x5 5X5 ' 5x5' 5.5x5 1e2x5 99999999999999999999x1 ''; do
    wrong "--size: expected WIDTHxHEIGHT, each from 1 to 65535, found \"$size\"" "$weft" render --size "$size" "$first"
done
for option in samples:65536 threads:4096 band:65535; do
    most=${option#*:}
    for number in 0 -1 $((most + 1)) 2.5 1e1 0x10 many '' 99999999999999999999; do
        wrong "--${option%:*}: expected a whole number from 1 to $most, found \"$number\"" \
            "$weft" render "--${option%:*}" "$number" "$first"
    done
done
for number in 3 0 -4 65537 16.5 many ''; do
    wrong "--max-samples: expected a whole number from 4 to 65536, found \"$number\"" "$weft" render --max-samples "$number" "$first"
done
for number in 0 0.0004 0.51 -0.01 nan inf 0x1 much ''; do
    wrong "--error: expected a number from 0.0005 to 0.5, found \"$number\"" "$weft" render --error "$number" "$first"
done
wrong '--samples and --error: expected one of them' "$weft" render --samples 4 --error 0.01 "$first"
wrong '--samples and --max-samples: expected one of them' "$weft" render --max-samples 64 --samples 4 "$first"
for map in sample error; do
    wrong "--$map-map: expected a file that ends with .png, found \"map.pfm\"" "$weft" render --$map-map map.pfm "$first"
    wrong "--$map-map: expected a file that ends with .png, found \"\"" "$weft" render --$map-map '' "$first"
    wrong '--sample-map and --error-map: expected one scene, found 2' "$weft" render --$map-map map.png "$first" "$scenes/glass.json"
    wrong "--$map-map and --report would both be written to ./map.png" "$weft" render --$map-map map.png --report ./map.png "$first"
done
wrong '--sample-map and --error-map would both be written to map.png' "$weft" render --sample-map map.png --error-map map.png "$first"
wrong '.*first.json and --report would both be written to first.png' "$weft" render --report first.png "$first"
wrong '--workers: expected a whole number from 0 to 1024' "$weft" render --workers -1 "$first"
wrong '--workers: expected a whole number from 0 to 1024' "$weft" render -w 1025 "$first"
wrong '--workers 0 needs --listen' "$weft" render --workers 0 "$first"
wrong '--bits: expected 8 or 16, found "12"' "$weft" render --bits 12 "$first"
wrong '--filter: expected box or tent, found "gauss"' "$weft" render --filter gauss "$first"
wrong '--filter: expected box or tent, found ""' "$weft" render --filter '' "$first"
wrong '--progress: expected auto, bar, json or none, found "loud"' "$weft" render --progress loud "$first"
wrong '--kernel: expected a kernel .*found "nosuch"' "$weft" render --kernel nosuch "$first"
wrong '.*expected an output that ends with .png or .pfm' "$weft" render -o picture.jpg "$first"
wrong '.*would both be written to first.png' "$weft" render "$first" "$first"

# --- nothing is written over what is read ---------------------------------------------------------------------
mkdir own
cp "$first" own/scene.json
cp "$scenes/textures/emblem.png" own/globe.png
cat >own/globe.json <<'EOF'
{"camera": {"from": [0, 0, 5], "at": [0, 0, 0]},
 "objects": [{"type": "sphere", "radius": 1, "material": {"color": {"type": "image", "file": "globe.png"}}}]}
EOF
cp own/globe.png own/scene.png
sed 's/globe.png/scene.png/' own/globe.json >own/ball.json
echo 0123456789abcdef >own/token
chmod 600 own/token
cp -r own own.before
for option in report log; do
    wrong "--$option: expected another output than own/scene.json, which is read" \
        "$weft" render --$option own/../own/scene.json own/scene.json
    wrong "--$option: expected another output than own/token, which is read" \
        "$weft" render --$option own/token --http 0 --http-token own/token "$first"
done
for option in output error-map; do
    wrong ".*: expected another output than own/globe.png, which is read" \
        "$weft" render --$option own/globe.png own/globe.json
done
cd own || exit 1
wrong "globe.json: expected another output than globe.png, which is read" "$weft" render globe.json
wrong "scene.json: expected another output than scene.png, which is read" "$weft" render scene.json ball.json -o .
wrong "--output: expected another output than globe.png, which is read" \
    "$weft" compare globe.png globe.png -o ./globe.png
cd .. || exit 1
exits 0 "all is as it was" diff -r own own.before

wrong 'expected one scene' "$weft" check
wrong 'expected one scene' "$weft" check "$first" "$first"
wrong '--nosuch: unknown' "$weft" check --nosuch "$first"

wrong 'expected two images' "$weft" compare
wrong 'expected two images' "$weft" compare one.png
wrong 'expected two images' "$weft" compare one.png two.png three.png
wrong '--nosuch: unknown' "$weft" compare --nosuch one.png two.png
for number in -1 1.1 nan inf 0x1 many ''; do
    wrong "--max-rmse: expected a number from 0 to 1, found \"$number\"" "$weft" compare --max-rmse "$number" one.png two.png
done
for number in 9 1001 many; do
    wrong "--ppd: expected a number from 10 to 1000, found \"$number\"" "$weft" compare --ppd "$number" one.png two.png
done
wrong 'd.pfm: expected an output that ends with .png' "$weft" compare -o d.pfm one.png two.png

wrong 'expected one folder, found 0' "$weft" keygen
wrong 'expected one folder, found 2' "$weft" keygen keys more
wrong '--nosuch: unknown' "$weft" keygen --nosuch keys
wrong 'worker "../loom": expected a name' "$weft" keygen --worker ../loom keys
wrong '--keys and --insecure: expected one of them' "$weft" render --keys keys --insecure "$first"

wrong 'expected one endpoint, found 0' "$worker"
wrong 'expected one endpoint, found 2' "$worker" 127.0.0.1 127.0.0.2
wrong '--threads: expected a whole number from 1 to 1024' "$worker" --threads 0 127.0.0.1
wrong '--wait: expected a whole number from 1' "$worker" --wait -1 127.0.0.1
wrong '--kernel: expected a kernel .*found "nosuch"' "$worker" --kernel nosuch 127.0.0.1
wrong 'unknown option -Z' "$worker" -Z 127.0.0.1
wrong '--keys and --insecure: expected one of them' "$worker" --keys keys --insecure 127.0.0.1

# --- endpoints ------------------------------------------------------------------------------------------------
for endpoint in '' tcp:// tcp://127.0.0.1:0 127.0.0.1:65536 127.0.0.1:port tcp://:7420 'tcp://[::1' ipc:// udp://127.0.0.1:7420; do
    wrong "endpoint \"${endpoint//[/\\[}\": expected" "$weft" render --listen "$endpoint" "$first"
    wrong "endpoint \"${endpoint//[/\\[}\": expected" "$worker" "$endpoint"
done
for endpoint in tcp://0.0.0.0:7420 'tcp://*:7420' '*' 0.0.0.0:7420 192.0.2.1 'tcp://[::]:7420'; do
    wrong '--listen: .*can be reached from other machines.*--keys DIR.*--insecure' "$weft" render --listen "$endpoint" "$first"
done
for endpoint in tcp://192.0.2.1:7420 192.0.2.1 '[2001:db8::1]' render.example:7420; do
    wrong '.* is on another machine.*--keys DIR.*--insecure' "$worker" "$endpoint"
done
exits 1 "with --insecure a worker tries to join another machine's" "$worker" --insecure --wait 1 192.0.2.1
exits 0 "with --insecure every interface may be listened on" \
    "$weft" render --listen 'tcp://0.0.0.0:*' --insecure --size 8x8 --samples 1 "$first" -o any.png
like "which is told" "$err" 'listening on tcp://0\.0\.0\.0:[0-9]+'

start busy "$weft" render --workers 0 --listen 'tcp://127.0.0.1:*' "$first" -o busy.png
listening busy
exits 1 "a port in use" "$weft" render --listen "$endpoint" "$first" -o other.png
like "is told" "$err" "^weft: .*$endpoint.*(in use|Address already in use)"
kill -TERM "$pid"
ends 143 "who has it goes on until it is told to end" "$pid" 60 busy
exits 1 "an address of another machine" "$weft" render --listen tcp://192.0.2.1:7420 --insecure "$first" -o other.png
like "is told" "$err" '^weft: .*192\.0\.2\.1'
ok "no picture was written" absent other.png

# --- help -----------------------------------------------------------------------------------------------------
cd "$sources" || exit 1
exits 0 "weft --help" "$weft" --help
commands=$out
for command in $(sed -n 's/^    {"\([a-z]*\)", command_.*/\1/p' coordinator/main.c); do
    like "names the command $command" "$commands" "^  $command "
    exits 0 "weft $command --help" "$weft" "$command" --help
    source=coordinator/${command}_command.c
    like "begins with the usage" "$(head -n 1 <<<"$out")" "^usage: weft $command "
    for option in $(sed -n '/option_spec options/,/^};/s/^    {[^"]*"\([a-z-]*\)".*/\1/p' "$source"); do
        like "and has --$option" "$out" "^  (-[a-zA-Z],|   ) --$option"
    done
done
exits 0 "weft-worker --help" "$worker" --help
for option in $(sed -n '/option_spec options/,/^};/s/^    {[^"]*"\([a-z-]*\)".*/\1/p' worker/main.c); do
    like "has --$option" "$out" "^  (-[a-zA-Z],|   ) --$option"
done
is "weft help prints what weft --help prints" "$("$weft" help)" "$commands"
is "weft help render what weft render --help prints" "$("$weft" help render)" "$("$weft" render --help)"
wrong 'unknown command "nosuch"' "$weft" help nosuch
exits 2 "weft without a command is wrong usage" "$weft"
like "and shows the help" "$err" '^usage: weft COMMAND'
for program in "$weft" "$weft render" "$weft check" "$weft compare" "$weft keygen" "$worker"; do
    # shellcheck disable=SC2086 # program and command
    exits 0 "${program##*/} --version" $program --version
    like "prints it" "$out" '^weft(-worker)? [0-9]+\.[0-9]+\.[0-9]+$'
done

finish
