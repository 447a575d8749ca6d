#!/bin/bash
# The services are as systemd wants them, shut off from the rest of the machine, and alike.
. tests/tap.sh

folder=deploy/systemd

# Names: lines of a service that the other has otherwise.
settings() { # FILE: without comments
    grep -v '^#' "$1"
}

is 'one worker and one of several differ in name, settings and keys alone' \
    "$(settings "$folder/weft-worker@.service" | sed 's/ %i$//; s/-%i//; /^EnvironmentFile=-/d')" \
    "$(settings "$folder/weft-worker.service")"

# A root in which the program is where the services say.
systemd=$(command -v systemd-analyze) || {
    skip 'what systemd says of the services' 'there is no systemd-analyze here'
    finish
}
mkdir -p "$tmp/units"
for unit in weft-worker.service weft-worker@.service; do
    sed "s|/usr/bin/weft-worker|$worker|" "$folder/$unit" >"$tmp/units/$unit"
    instance=${unit/@/@one}
    [ "$unit" = "$instance" ] || cp "$tmp/units/$unit" "$tmp/units/$instance"
    run "$systemd" verify --man=no "$tmp/units/$instance"
    is "systemd-analyze verify $unit: silent" "$status $out$err" '0 '
    exits 0 "systemd-analyze security $unit: at most 2.0" \
        "$systemd" security --offline=true --threshold=20 "$tmp/units/$instance"
    note "$(tail -n 1 <<<"$out")"
done
sed 's/^ProtectSystem=.*/ProtectSystm=strict/' "$tmp/units/weft-worker.service" >"$tmp/units/misspelt.service"
run "$systemd" verify --man=no "$tmp/units/misspelt.service"
like 'a misspelt setting is found' "$err" "ProtectSystm"
grep -v '^Restrict\|^Protect\|^Private\|^System' "$tmp/units/weft-worker.service" >"$tmp/units/open.service"
exits 1 'an open service is found' "$systemd" security --offline=true --threshold=20 "$tmp/units/open.service"

finish
