# Clean roots of Debian for the tests of deploy, as the one that everybody starts with: only what debootstrap makes.
# The first one takes a minute and is kept, packed, in $build/deploy for the next ones. For root alone.
#
# Given by tests/tap.sh: $build, $tmp. Given by this file: $package, by `package`.

# shellcheck shell=bash

need() { # PROGRAM...: skips all where one is missing
    local program
    [ "$(id -u)" = 0 ] || skip_all 'only root can do this; not tried'
    for program in "$@"; do
        command -v "$program" >/dev/null ||
            skip_all "no $program here; not tried; deploy/install-dependencies --deploy brings it"
    done
}

# The release and mirror of this machine, if it is a Debian; else those of weft's own package.
mirror() {
    cat /etc/apt/sources.list /etc/apt/sources.list.d/*.sources 2>/dev/null |
        awk '/^URIs:/ { print $2; exit } /^deb / { for (i = 2; i <= NF; i++) if ($i ~ "://") { print $i; exit } }'
}

codename() {
    (. /etc/os-release && echo "${VERSION_CODENAME:-bookworm}")
}

# fresh_root FOLDER: unpacks a clean root there, with systemd; skips all where none can be made.
fresh_root() {
    local packed=$build/deploy/root.tar url
    if [ ! -e "$packed" ]; then
        mkdir -p "$build/deploy"
        url=$(mirror)
        debootstrap --variant=minbase --include=systemd,systemd-sysv,dbus,procps "$(codename)" "$tmp/base" \
            "${url:-http://deb.debian.org/debian}" >"$tmp/debootstrap.log" 2>&1 || {
            note "$(tail -n 5 "$tmp/debootstrap.log")"
            skip_all 'debootstrap cannot make a root here; not tried'
        }
        tar -C "$tmp/base" --numeric-owner -cf "$packed.part" .
        mv "$packed.part" "$packed"
        rm -rf "$tmp/base"
    fi
    mkdir -p "$1"
    tar -C "$1" --numeric-owner -xf "$packed"
    cp /etc/resolv.conf "$1/etc/resolv.conf"
}

# in_root FOLDER COMMAND...: runs a command there, in namespaces of its own, so that nothing of it stays.
in_root() {
    unshare --mount --pid --fork --kill-child --propagation private -- bash -c '
        mount --bind "$1" "$1" && cd "$1" && mount -t proc proc proc && mount -t tmpfs tmpfs tmp &&
            mount --rbind /dev dev || exit
        root=$1
        shift
        exec env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive \
            chroot "$root" "$@"' in_root "$@"
}

# The package, made where it is missing or older than the sources.
package() {
    local newer
    package=$(ls "$build"/deb/weft_*.deb 2>/dev/null)
    newer=$([ -z "$package" ] || find Makefile CHANGELOG.md common coordinator worker scenes deploy -newer "$package" -type f)
    if [ -z "$package" ] || [ -n "$newer" ]; then
        make -s deb "B=$build" "CC=${CC:-gcc}" >"$tmp/deb.log" 2>&1 || note "$(tail -n 20 "$tmp/deb.log")"
        package=$(ls "$build"/deb/weft_*.deb 2>/dev/null)
    fi
    [ -n "$package" ]
}

# Installs the package with all that it depends on, as a user would.
install_package() { # ROOT
    cp "$package" "$1/root/"
    in_root "$1" sh -c 'apt-get -q update && apt-get install -q -y --no-install-recommends /root/weft_*.deb' \
        >"$tmp/apt.log" 2>&1 || { note "$(tail -n 20 "$tmp/apt.log")"; return 1; }
}
