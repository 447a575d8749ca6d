#!/bin/bash
# Workers as services of systemd, from the package, in a container that is booted: what is tried is
# service-inside.
. tests/tap.sh
. tests/deploy/root.sh
need debootstrap systemd-nspawn dh dpkg-buildpackage
root=$tmp/root

# boot SECONDS: runs the system until it powers off. It has no network but a loopback of its own.
boot() {
    unshare --mount --pid --fork --kill-child --propagation private -- bash -c '
        mount -t proc proc /proc && exec systemd-nspawn -q -D "$1" --register=no --keep-unit --console=pipe \
            --private-network --boot' boot "$root" >"$tmp/boot.log" 2>&1 </dev/null &
    started+=($!)
    wait_until "is_over $!" "$1"
}

# systemd-nspawn leaves those behind where nobody else manages control groups.
remove_control_groups() {
    local name
    for name in payload supervisor; do
        find /sys/fs/cgroup -depth -type d -newer "$tmp/epoch" \
            \( -path "*/$name" -o -path "*/$name/*" \) -exec rmdir {} \; 2>/dev/null
    done
}

package || { report 1 'make deb'; finish; }
fresh_root "$root"
if ! install_package "$root"; then
    skip 'in a booted container' 'the packages that weft needs cannot be fetched here; not tried'
    finish
fi
mkdir -p "$root/root/try/tests"
cp tests/tap.sh "$root/root/try/tests"
cp tests/deploy/service-inside "$root/root/try"
ln -s /usr/share/doc/weft/scenes "$root/root/try/scenes"
cat >"$root/etc/systemd/system/try.service" <<'END'
[Unit]
After=multi-user.target
SuccessAction=poweroff
FailureAction=poweroff
[Service]
Type=oneshot
WorkingDirectory=/root/try
Environment=WEFT_BUILD=/usr/bin WEFT_MODE=release HOME=/root
ExecStart=-/root/try/service-inside
StandardOutput=file:/root/try/results
StandardError=file:/root/try/errors
END
mkdir -p "$root/etc/systemd/system/default.target.wants"
ln -s ../try.service "$root/etc/systemd/system/default.target.wants/try.service"
touch "$tmp/epoch"
boot 240
over=$?
remove_control_groups
if [ ! -e "$root/root/try/results" ]; then
    note "$(tail -n 20 "$tmp/boot.log")"
    skip_all 'a container does not boot here; the services are not tried'
fi
[ $over = 0 ] || echo 'Bail out! the container does not end'
cat "$root/root/try/results" # with a plan of its own
sed 's/^/# /' "$root/root/try/errors"
! grep -q '^not ok' "$root/root/try/results"
