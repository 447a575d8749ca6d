#!/bin/bash
# make install puts what is to be there where it is to be, and it works from there; make uninstall takes all of it away
# and nothing else. Versions come from one place.
. tests/tap.sh
. tests/deploy/versions.sh

root="$tmp/a root" # names with spaces
prefix='/opt/my farm'

installs() { # install|uninstall NAME VARIABLE...
    local verb=$1 name=$2
    shift 2
    # -o: what the tests were given is installed as it is
    exits 0 "$name" make -s -o all "B=$build" "$@" "$verb"
}

files() { # FOLDER: what is in it, without folders
    (cd "$1" && find . ! -type d | sort)
}

digests() { # FOLDER
    (cd "$1" && find . -type f -exec sha256sum {} + | sort)
}

# --- where things are -----------------------------------------------------------------------------------------
mkdir -p "$root$prefix/bin"
echo theirs >"$root$prefix/bin/other"
installs install 'make install, with spaces in DESTDIR and PREFIX' "DESTDIR=$root" "PREFIX=$prefix"
for file in bin/weft bin/weft-worker bin/weft-ssh share/man/man1/weft.1 share/man/man1/weft-worker.1 \
    share/man/man1/weft-ssh.1 share/man/man5/weft-scene.5 share/bash-completion/completions/weft \
    share/bash-completion/completions/weft-worker share/bash-completion/completions/weft-ssh \
    share/weft/weft.schema.json share/weft/report.schema.json share/weft/snapshot.schema.json \
    share/doc/weft/README.md share/doc/weft/CHANGELOG.md \
    share/doc/weft/scenes/README.md share/doc/weft/examples/showcase.json share/doc/weft/deploy/README.md \
    lib/systemd/system/weft-worker.service lib/systemd/system/weft-worker@.service etc/default/weft-worker; do
    ok "$file" test -s "$root$prefix/$file"
done
is 'programs can be run, and the rest cannot' "$(cd "$root$prefix" && find . -type f -perm /111 ! -name other | sort | xargs)" \
    './bin/weft ./bin/weft-ssh ./bin/weft-worker'
is 'all can read all of it' "$(find "$root" ! -perm -444 ! -type l)" ''
is 'only the owner can write' "$(find "$root" -perm /022 ! -type l)" ''
is 'the services are those of the prefix' "$(grep -h '^ExecStart' "$root$prefix"/lib/systemd/system/*.service | sort -u)" \
    "ExecStart=\"$prefix/bin/weft-worker\" \$WEFT_SECURITY \$WEFT_OPTIONS \$WEFT_COORDINATOR"

# --- it works -------------------------------------------------------------------------------------------------
examples=$root$prefix/share/doc/weft/examples
exits 0 'every example is a good scene' bash -c "for s in \"\$1\"/*.json; do case \$s in *.schema.json) ;; *)
    '$root$prefix/bin/weft' check \"\$s\" || exit; esac; done" - "$examples"
exits 0 'the showcase is rendered where it is installed, with the worker that is' \
    "$root$prefix/bin/weft" render "$examples/showcase.json" -s 64x36 --samples 2 -o "$tmp/installed.png"
run "$weft" render "$scenes/showcase.json" -s 64x36 --samples 2 -o "$tmp/built.png"
same_bytes 'to the same bytes' "$tmp/installed.png" "$tmp/built.png"
dead=$(cd "$root$prefix/share/doc/weft" && for page in README.md scenes/README.md deploy/README.md; do
    grep -oE '\]\([^)#:]+' "$page" | sed "s|^](|$(dirname $page)/|" | sort -u | while read -r link; do
        [ -e "$link" ] || echo "$page: $link"
    done
done | grep -vE ': (./https|./(common|coordinator|tests|deploy/man)/|scenes/bad)') # the last ones are of the sources
is 'what its documents name is there' "$dead" ''

# --- versions -------------------------------------------------------------------------------------------------
for program in weft weft-worker weft-ssh; do
    run env PATH="$root$prefix/bin:$PATH" "$program" --version
    is "$program --version" "$out" "$program $version"
done
for page in "$root$prefix"/share/man/man?/*; do
    is "${page##*/} names it" "$(grep '^\.Os' "$page")" ".Os weft $version"
done
is 'the changelog begins with it' "$(sed -n 's/^## \([0-9.]*\) - [0-9-]*$/\1/p' CHANGELOG.md | head -n 1)" "$version"
if command -v dpkg-parsechangelog >/dev/null; then
    deploy/debian/changelog-of CHANGELOG.md 'Some One <one@example.org>' >"$tmp/changelog"
    run dpkg-parsechangelog -l "$tmp/changelog" --all --count 100 -S Version
    is "Debian's changelog too" "$out" "$version"
    is 'and it is read without warnings' "$err" ''
    is 'with all its items' "$(grep -c '^  \* ' "$tmp/changelog")" "$(grep -c '^- ' CHANGELOG.md)"
else
    skip "Debian's changelog" 'there is no dpkg-parsechangelog here'
fi

# --- and away -------------------------------------------------------------------------------------------------
before=$(digests "$root")
installs install 'installing again' "DESTDIR=$root" "PREFIX=$prefix"
is 'changes nothing' "$(digests "$root")" "$before"
installs uninstall 'make uninstall' "DESTDIR=$root" "PREFIX=$prefix"
is 'leaves what was there before, and no more' "$(files "$root")" "./opt/my farm/bin/other"
is 'nor a folder of its own' "$(find "$root" -type d -name '*weft*')" ''

installs install 'with the default PREFIX' "DESTDIR=$root"
ok 'programs are in /usr/local' test -x "$root/usr/local/bin/weft"
echo 'WEFT_COORDINATOR=loom' >>"$root/etc/default/weft-worker"
installs install 'installing over changed settings' "DESTDIR=$root"
like 'keeps them' "$(cat "$root/etc/default/weft-worker")" '^WEFT_COORDINATOR=loom$'
installs uninstall 'uninstalling them' "DESTDIR=$root"
like 'says that they stay' "$err" 'etc/default/weft-worker has been changed and stays$'
is 'and leaves them alone' "$(files "$root")" './etc/default/weft-worker
./opt/my farm/bin/other'

exits 2 'a relative PREFIX is refused' make -s -o all "B=$build" "DESTDIR=$root" PREFIX=here install
like 'and said why' "$err" 'expected absolute paths, found "here"'

finish
