#!/bin/bash
# The Debian package: as Debian wants it, the same bytes whenever it is built, and installed, used and removed in a
# clean root.
. tests/tap.sh
. tests/deploy/versions.sh
. tests/deploy/root.sh
need dh dpkg-buildpackage debootstrap

ok 'make deb' package
like 'its name has the version' "$package" "/weft_${version}_[a-z0-9]+\.deb$"
is 'and so has its control file' "$(dpkg-deb -f "$package" Version)" "$version"
like 'libraries it needs are named by shlibdeps' "$(dpkg-deb -f "$package" Depends)" 'libzmq5 \(>= .*'
note "$(ls -l "$package")"

if command -v lintian >/dev/null; then
    run lintian --no-cfg --allow-root --display-info --fail-on error "$package"
    is 'lintian finds no errors' "$status $(grep '^E:' <<<"$out")" '0 '
    # Running workers have to be restarted without waiting for them, instances too, which deb-systemd-invoke cannot.
    is 'and warns of nothing but what is meant' "$(grep '^W:' <<<"$out" | grep -v maintainer-script-calls-systemctl)" ''
else
    skip 'lintian finds no errors' 'there is no lintian here'
fi

first=$(sha256sum <"$package")
cp "$package" "$tmp/first.deb"
mkdir -p "$tmp/elsewhere"
make -s deb "B=$tmp/elsewhere" "CC=${CC:-gcc}" >"$tmp/again.log" 2>&1
is 'built again, in another folder, it is the same bytes' "$(sha256sum <"$tmp/elsewhere/deb/${package##*/}")" "$first"

# --- in a clean root ------------------------------------------------------------------------------------------
root=$tmp/root
fresh_root "$root"
listing() { # what apt may not leave behind: everything but its own records
    (cd "$root" && find . -xdev \( -path ./var/lib/apt -o -path ./var/cache -o -path ./var/lib/dpkg -o -path ./var/log \
        -o -path ./root -o -path ./dev \) -prune -o -print | sort)
}
libraries=$(dpkg-deb -f "$package" Depends | sed 's/([^)]*)//g; s/,/ /g')
if ! in_root "$root" sh -c "apt-get -q update && apt-get install -q -y --no-install-recommends $libraries" \
    >"$tmp/apt.log" 2>&1; then
    note "$(tail -n 5 "$tmp/apt.log")"
    skip 'in a clean root' 'the packages that weft needs cannot be fetched here; not tried'
    finish
fi
listing >"$tmp/before"
ok 'it installs' install_package "$root"
is 'dpkg has nothing to say of it' "$(in_root "$root" dpkg --audit)" ''
is 'programs run' "$(in_root "$root" weft --version; in_root "$root" weft-worker --version)" "weft $version
weft-worker $version"
in_root "$root" weft render /usr/share/doc/weft/examples/showcase.json -s 160x90 --samples 4 -w 2 -o /root/deb.png \
    >"$tmp/render.log" 2>&1
ok 'a render with two local workers' test -s "$root/root/deb.png"
run "$weft" render "$scenes/showcase.json" -s 160x90 --samples 4 -o "$tmp/here.png"
same_bytes 'to the same bytes as here' "$root/root/deb.png" "$tmp/here.png"
is 'no service has been enabled' "$(find "$root/etc/systemd" -name '*weft*')" ''
is 'the settings are a conffile' "$(in_root "$root" dpkg-query -W -f '${Conffiles}' weft | awk '{ print $1 }' | xargs)" \
    /etc/default/weft-worker
is 'the installed files are as packed' "$(in_root "$root" dpkg --verify weft)" ''

in_root "$root" apt-get -q -y purge weft >"$tmp/purge.log" 2>&1
listing >"$tmp/after"
is 'removed, it leaves nothing' "$(diff "$tmp/before" "$tmp/after")" ''

finish
