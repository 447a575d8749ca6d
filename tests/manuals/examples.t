#!/bin/bash
# Every example in README.md, scenes/README.md and the manual pages runs, page by page, in the order in which it stands.
#
# Examples are lines of .Dl in the pages and begin with `$ ` or, on another machine, with its name, as in `loom$
# weft-worker`. In README.md they are indented by four blanks, and begin with a program, or with that name. A machine is
# a folder here, and scp copies between them; 192.0.2.1 is 127.0.0.1, and port 7420 one that is free. Pictures are
# rendered small, make only says what it would do, and man may be missing. Workers run beside what follows them, as they
# would in another window. Scenes are literal displays behind their file names in weft-scene(5), and blocks of json in
# scenes/README.md. What asks for the status of a render has one beside it, which takes some seconds.
# Nobody answers ssh.
. tests/tap.sh

hold_port
mkdir "$tmp/bin"
for program in weft weft-worker; do
    cat >"$tmp/bin/$program" <<EOF
#!/bin/bash
for word; do
    word=\${word//192.0.2.1:7420/127.0.0.1:$port}
    word=\${word//127.0.0.1:7420/127.0.0.1:$port}
    words+=("\$(sed -E 's/^(192\.0\.2\.1|127\.0\.0\.1)\$/127.0.0.1:$port/' <<<"\$word")")
done
[ "\$1" != render ] || words+=(--size 24x16)
exec '$build/$program' "\${words[@]}"
EOF
done
cat >"$tmp/bin/scp" <<'EOF'
#!/bin/sh
machine=${3%%:*}
mkdir -p "../$machine"
exec cp "$1" "$2" "../$machine/${3#*:}"
EOF
printf '#!/bin/sh\nexec %s -n -C "%s" "$@"\n' "$(command -v make)" "$PWD" >"$tmp/bin/make"
command -v man >/dev/null || printf '#!/bin/sh\n' >"$tmp/bin/man"
printf '#!/bin/sh\nexit 255\n' >"$tmp/bin/ssh"
chmod +x "$tmp"/bin/*
ln -s "$PWD/deploy/weft-ssh" "$tmp/bin"
PATH=$tmp/bin:$PATH

# scenes_of PAGE FOLDER: writes the scenes of a manual page into the folder.
scenes_of() {
    awk -v folder="$2" '
        /^\.Pa [a-z]*\.json :$/ { name = folder "/" $2 }
        /^\.Ed/ { name = shown = "" }
        shown { print >name }
        /^\.Bd -literal/ && name { shown = 1 }' "$1"
}

# commands_of PAGE: its examples, a line each, behind the machine that they are for.
commands_of() {
    case $1 in
    *.md) sed -nE 's/^    ((build\/|(make|man|scp|\.) ).*)/here \1/p; s/^    ([a-z]+)\$ (.*)/\1 \2/p' "$1" ;;
    *) sed -nE 's/^\.Dl \$ (.*)/here \1/p; s/^\.Dl ([a-z]+)\$ (.*)/\1 \2/p' "$1" ;;
    esac
}

# run_page PAGE: in a folder of its own, which holds those of the machines.
run_page() {
    local page=${1##*/} root=$tmp/${1##*/} machine command workers=()
    mkdir -p "$root/here"
    scenes_of deploy/man/weft-scene.5 "$root/here"
    ln -s "$scenes" "$PWD/deploy" "$root/here/"
    while read -r machine command; do
        mkdir -p "$root/$machine"
        ln -sfn "$tmp/bin" "$root/$machine/build"
        if [[ $command =~ ^(build/)?weft\ status ]]; then
            run_beside "$root" "$page: $command" bash -c "cd '$root/$machine' && $command"
        elif [[ $command =~ ^(build/)?weft-worker ]]; then
            start "$page.${#workers[@]}" bash -c "cd '$root/$machine' && exec $command"
            workers+=("$pid $command")
        else
            exits 0 "$page: $command" bash -c "cd '$root/$machine' && $command"
        fi
    done < <(commands_of "$1")
    end_workers "$page" "${workers[@]}"
}

# run_beside FOLDER NAME COMMAND...: beside a render, with the farm's keys if there are some. A watcher sees it end.
run_beside() {
    local root=$1 name=$2 keyed=() scene=("${endless[@]}")
    shift 2
    [[ $* != *--watch* ]] || scene=("${slow[@]}" --samples "$((3 * slow[-1]))")
    [ ! -d "$root/here/keys" ] || keyed=(--keys "$root/here/keys")
    start beside "$weft" render "${scene[@]}" --listen "tcp://127.0.0.1:$port" "${keyed[@]}" \
        -o "$root/beside.png"
    local render=$pid
    listening beside
    exits 0 "$name" "$@"
    is_over "$render" || kill -TERM "$render"
    wait "$render"
}

# end_workers PAGE WORKER...: a worker is its id and command. Those that do not end with their coordinator are told to,
# when they have said that they have joined it, or wait for it: then they listen.
end_workers() {
    local page=$1 number=0 worker process command
    shift
    for worker in "$@"; do
        read -r process command <<<"$worker"
        if [[ $command != *--once* ]]; then
            wait_until "[ -s '$tmp/$page.$number.err' ]" 60
            kill -TERM "$process"
        fi
        ends 0 "$page: $command" "$process" 60 "$page.$number"
        number=$((number + 1))
    done
}

mkdir "$tmp/scenes"
scenes_of deploy/man/weft-scene.5 "$tmp/scenes"
awk -v name="$tmp/scenes/readme.json" '/^```$/ { on = 0 } on { print >name } /^```json$/ { on = 1 }' scenes/README.md
is "scenes were found" "$(cd "$tmp/scenes" && echo *)" "lens.json readme.json room.json"
for scene in "$tmp"/scenes/*.json; do
    exits 0 "${scene##*/} is a good scene" "$weft" check "$scene"
done
for page in README.md deploy/man/*; do
    ok "$page has examples" test -n "$(commands_of "$page")"
    run_page "$page"
done

finish
