#!/bin/bash
# The image: built from the Dockerfile on a base made by debootstrap, and run as it is meant to be: by nobody, with a
# root folder that cannot be written, and without any capability.
# In a mount namespace of its own, so that no mount outlives it.
if [ -z "${WEFT_MOUNTS-}" ] && unshare --mount true 2>/dev/null; then
    WEFT_MOUNTS=own exec unshare --mount "$BASH" "$0" "$@"
fi
. tests/tap.sh

untried() { # REASON
    skip_all "containers could not be tried: $1"
}
[ "$(id -u)" = 0 ] || untried "only root can make their base and run them here"
for program in debootstrap buildah podman runc; do
    command -v $program >/dev/null || untried "$program is not installed"
done

# --- a store of images and containers of our own --------------------------------------------------------------
store=$build/container # the base and the image stay for the next time, containers do not
mkdir -p "$store"
# Without overlays of folders every container is a copy.
driver=$(grep -q overlay /proc/filesystems && echo overlay || echo vfs)
where=(--root "$store/images" --runroot "$store/run" --storage-driver "$driver")
how=(--cgroup-manager cgroupfs --runtime runc --tmpdir "$store/tmp")
podman=(podman "${where[@]}" "${how[@]}")
podman() {
    command "${podman[@]}" "$@"
}
group=/weft-test-$$
clean_up_containers() {
    podman rm --all --force --time 0
    find /sys/fs/cgroup -depth -type d -path "*$group*" -exec rmdir {} +
    clean_up
} >/dev/null 2>&1
trap clean_up_containers EXIT

# make_base: Debian as debootstrap makes it; no registry need be reached.
make_base() {
    ! podman image exists localhost/weft-base || return 0
    debootstrap --variant=minbase bookworm "$tmp/base" "${DEBIAN_MIRROR:-http://deb.debian.org/debian}" \
        >"$tmp/base.out" 2>&1 &&
        printf 'FROM scratch\nCOPY . /\n' >"$tmp/Dockerfile.base" &&
        buildah "${where[@]}" bud --quiet --isolation chroot -t weft-base -f "$tmp/Dockerfile.base" "$tmp/base" &&
        rm -rf "$tmp/base"
} >"$tmp/make-base.out" 2>&1
podman rm --all --force --time 0 >"$tmp/rm.out" 2>&1 # of a test that was killed
make_base || untried "no base could be made: $(tail -n 1 "$tmp/make-base.out" "$tmp/base.out" 2>/dev/null)"

# Unchanged sources are not built again.
sources=$(find Makefile LICENSE common coordinator worker deploy/container -type f -print0 | sort -z | xargs -0 cat |
    sha256sum | cut -c 1-64)
build_image() {
    [ "$(podman image inspect --format '{{.Labels.sources}}' localhost/weft 2>/dev/null)" != "$sources" ] || return 0
    buildah "${where[@]}" bud --isolation chroot --ignorefile deploy/container/Dockerfile.dockerignore \
        --build-arg BASE=localhost/weft-base --label "sources=$sources" -t weft -f deploy/container/Dockerfile . \
        >"$tmp/build.out" 2>&1 || { note "$(tail -n 20 "$tmp/build.out")" && false; }
    podman image prune --force >"$tmp/prune.out"
}
ok "the image is built" build_image || finish

# --- what it is -----------------------------------------------------------------------------------------------
size=$(podman image inspect --format '{{.Size}}' localhost/weft)
ok "it is small" [ "$size" -lt 25000000 ]
note "the image's size: $((size / 100000)) times 100 kB"
is "its user is nobody" "$(podman image inspect --format '{{.User}}' localhost/weft)" 65532:65532
root=$(podman image mount localhost/weft)
is "it holds two programs" "$(ls "$root/usr/bin" | tr '\n' ' ')" "weft weft-worker "
is "and libraries and copyright notices, no more" "$(find "$root" -type f -printf '/%P\n' |
    grep -Ev '^/(usr/bin/weft(-worker)?|(usr/)?lib(64)?/.*\.so[.0-9]*|usr/share/doc/[^/]*/copyright)$')" ""
is "nothing that would change who runs it" "$(find "$root" -perm /6000)" ""
podman image unmount localhost/weft >"$tmp/unmount.out"

# --- how it runs ----------------------------------------------------------------------------------------------
mkdir "$tmp/work"
cp -r "$scenes/showcase.json" "$scenes/textures" "$tmp/work"
chown -R 65532:65532 "$tmp/work"
chmod 711 "$tmp" # nobody is to reach the folder in it
here=(--network host --cgroup-parent "$group" --read-only --cap-drop all --security-opt no-new-privileges
    --ulimit nofile=4096:4096 --ulimit nproc=4096:4096 --volume "$tmp/work:/work")

contained=("${podman[@]}" run --rm "${here[@]}" localhost/weft) # and a command, which runs in a container of its own
# start_contained NAME [PODMAN-OPTION...] -- COMMAND...
start_contained() {
    local name=$1 extra=()
    shift
    while [ "$1" != -- ]; do
        extra+=("$1")
        shift
    done
    start "$name" "${podman[@]}" run --name "$name" "${here[@]}" \
        "${extra[@]}" localhost/weft "${@:2}"
}

quick=(showcase.json --size 160x90 --samples 16)
long=(showcase.json --size 160x90 --samples 3000 --band 2 --progress json)
(cd "$tmp/work" && "$weft" render "${quick[@]}" -q -o "$tmp/quick.png" &&
    "$weft" render "${long[@]:0:5}" -q -o "$tmp/long.png")

run "${contained[@]}"
like "without a command it says what it can do" "$out" '^usage: weft COMMAND'
run "${contained[@]}" sh -c true
is "there is no shell in it" "$status" 127
run "${contained[@]}" weft keygen keys
is "keys are made" "$status" 0
run "${contained[@]}" weft keygen --worker crowd keys
is "and those of workers" "$status $(stat -c '%a %u' "$tmp/work/keys/crowd/worker.key")" "0 600 65532"
run "${contained[@]}" weft render "${quick[@]}" --output quick.png
is "a render with a local worker is completed" "$status" 0 || note "$err"
same_bytes "the picture is the same as outside" "$tmp/work/quick.png" "$tmp/quick.png"
run "${contained[@]}" weft render "${quick[@]}" --output /none.png
is "its root folder cannot be written" "$status" 4

# --- a farm of containers -------------------------------------------------------------------------------------
hold_port
coordinator=(weft render "${long[@]}" --workers 0 --listen "tcp://127.0.0.1:$port" --keys keys --output long.png)
worker=(weft-worker --keys keys/crowd "127.0.0.1:$port")
start_contained coordinator -- "${coordinator[@]}"
killed=$pid
start_contained one --cpus 1 -- "${worker[@]}"
start_contained two -- "${worker[@]}"
ok "two workers join" wait_until "[ \"\$(grep -c joined '$tmp/coordinator.err')\" = 2 ] && has_rows coordinator 4" 60
like "one that may use one core has one thread" "$(grep joined "$tmp/coordinator.err")" ' 1 threads?,'
podman kill --signal KILL coordinator >"$tmp/kill.out"
ends 137 "the coordinator is killed" "$killed" 20 coordinator
start_contained again -- "${coordinator[@]}"
again=$pid
ok "another one goes on from its journal" wait_until "grep -q 'going on from its journal' '$tmp/again.err'" 60
ok "the workers come back" wait_until "[ \"\$(grep -c joined '$tmp/again.err')\" = 2 ]" 60
podman stop --time 60 two >"$tmp/stop.out"
is "a worker that is stopped drains" "$(podman inspect --format '{{.State.ExitCode}}' two)" 0
ends 0 "the render is completed" "$again" 120 again
same_bytes "the picture is the same as outside" "$tmp/work/long.png" "$tmp/long.png"
podman stop --time 60 one >"$tmp/stop.out"
is "a worker that waits ends too" "$(podman inspect --format '{{.State.ExitCode}}' one)" 0
rm "$tmp/work/long.png"
start_contained stopped -- "${coordinator[@]}"
stopped=$pid
wait_until "grep -q 'listening on' '$tmp/stopped.err'" 60
podman stop --time 60 stopped >"$tmp/stop.out"
ends 143 "a coordinator that is stopped ends" "$stopped" 60 stopped

# --- nothing is left ------------------------------------------------------------------------------------------
podman rm --all --force --time 0 >"$tmp/rm.out"
find /sys/fs/cgroup -depth -type d -path "*$group*" -exec rmdir {} + 2>"$tmp/rmdir.err"
is "no control group is left" "$(find /sys/fs/cgroup -type d -path "*$group*")" ""
ok "nor a mount" [ "$(grep -cF "$store" /proc/mounts)" = 0 ]

# --- compose --------------------------------------------------------------------------------------------------
compose=deploy/container/compose.yaml
if command -v docker-compose >/dev/null; then
    run env WEFT_USER=1000:1000 docker-compose -f $compose config
    is "compose.yaml is a good one" "$status" 0 || note "$err"
    run env -u WEFT_USER docker-compose -f $compose config
    like "which says what it must be told" "$err" 'WEFT_USER.*expected the owner'
else
    skip "compose.yaml is a good one" "docker-compose, which would tell, is not installed"
fi
note "Could not be tried here: docker, a registry, names of services on a network of containers, rootless podman."
finish
