#!/bin/bash
# The status page in a real browser (Chromium without a screen), driven by page.mjs. Screenshots are left in tests/web
# of the build folder. deploy/install-dependencies --web build/web fetches what this needs.
. tests/tap.sh

web=$(realpath -m "${WEFT_WEB:-build/web}")
[ "$mode" = release ] || skip_all "the page is the same in release mode"
browser=$(command -v chromium || command -v chromium-browser) || skip_all "there is no chromium here"
node=$(command -v node) || skip_all "there is no node here"
[ "$("$node" -p 'process.versions.node.split(".")[0]')" -ge 18 ] || skip_all "node is older than 18"
[ -e "$web/node_modules/playwright-core" ] || skip_all "there is no playwright-core in $web"

mkdir -p "$build/tests/web"
BROWSER=$browser MODULES=$web WEFT=$weft SCENES=$scenes FOLDER=$tmp SHOTS=$build/tests/web "$node" tests/web/page.mjs
