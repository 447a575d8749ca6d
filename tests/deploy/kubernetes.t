#!/bin/bash
# The manifests: what kustomize makes of them fits the types of Kubernetes, and their commands run as they are, by
# nobody, with keys as a Secret is mounted, until a picture is complete.
untried() { # REASON
    echo "1..0 # SKIP manifests of Kubernetes could not be tried: $1"
    exit 0
}
if [ -z "${WEFT_NETWORK-}" ]; then
    [ "$(id -u)" = 0 ] || untried "only root can be nobody"
    unshare --mount --net ip link set lo up 2>/dev/null || untried "network namespaces cannot be made here"
    WEFT_NETWORK=own exec unshare --mount --net "$BASH" "$0" "$@"
fi
ip link set lo up
. tests/tap.sh

packages=$build/kubernetes
[ -e "$packages/complete" ] || untried "no $packages; deploy/install-dependencies --kubernetes $packages brings it"
check() {
    NODE_FOLDER=$packages node tests/deploy/kubernetes.mjs "$@"
}

# --- what they say --------------------------------------------------------------------------------------------
exits 0 "kustomize takes them" "$packages/kubectl" kustomize deploy/kubernetes
cp "$tmp/run.out" "$tmp/all.yaml"
is "the API's types fit them" "$(check <"$tmp/all.yaml" 2>&1)" "9 objects"

# wrong NAME CHANGE PATTERN: what sed changes is found.
wrong() {
    like "$1 is found" "$(sed "$2" "$tmp/all.yaml" | check 2>&1)" "$3"
}
wrong "a misspelt field" 's/readOnlyRootFilesystem/readOnlyRootFileSystem/' 'has no field "readOnlyRootFileSystem"'
wrong "a wrong type" 's/backoffLimit: 6/backoffLimit: six/' 'Job weft-coordinator: .*backoffLimit'
wrong "a missing field" 's/^\( *\)selector:/\1selectors:/' 'Deployment weft-worker: .*selector'
wrong "a container that may become root" 's/allowPrivilegeEscalation: false/allowPrivilegeEscalation: true/' \
    'not restricted: worker: allowPrivilegeEscalation'

is "and the pod for copying files" "$(check <deploy/kubernetes/files.yaml 2>&1)" "1 objects"
like "which may not become root either" "$(sed s/runAsNonRoot/runAsRoot/ deploy/kubernetes/files.yaml | check 2>&1)" \
    'not restricted: runAsNonRoot'
is "it mounts the volume that there is" "$(sed -n 's/.*claimName: //p' deploy/kubernetes/files.yaml)" \
    "$(sed -n 's/.*claimName: //p' deploy/kubernetes/coordinator.yaml)"

count() { # PATTERN
    grep -Ec -e "$1" "$tmp/all.yaml"
}
is "an image of its own name stands nowhere any more" "$(count 'image: weft$')" 0
names=$(sed -n 's/^ *app.kubernetes.io\/name: //p' "$tmp/all.yaml" | sort -u)
of_pods=$(awk '/^  template:/ { inside = 1 } inside && /name: weft-/ { print $2; inside = 0 }' "$tmp/all.yaml" | sort -u)
is "every name in a selector is that of a pod" "$names" "$of_pods"
exits 0 "the scene is a good one" "$weft" check deploy/kubernetes/scene.json

cp -r deploy/kubernetes "$tmp/own"
sed -i '/^# components:$/,/^# *- own-keys$/s/^# //' "$tmp/own/kustomization.yaml"
exits 0 "kustomize gives each worker a key of its own" "$packages/kubectl" kustomize "$tmp/own"
cp "$tmp/run.out" "$tmp/own.yaml"
is "the API's types fit that too" "$(check <"$tmp/own.yaml" 2>&1)" "9 objects"
like "a misspelt field is found there too" "$(sed 's/subPathExpr/subPathExpression/' "$tmp/own.yaml" | check 2>&1)" \
    'StatefulSet weft-worker: .*subPathExpression|has no field "subPathExpression"'
is "it has no worker of the other kind" "$(grep -c '^kind: Deployment' "$tmp/own.yaml")" 0

# --- what they do ---------------------------------------------------------------------------------------------
# mounted SECRET FILE...: a folder as the kubelet makes one of a Secret with defaultMode 0400 and fsGroup 65532: the
# files are root's, the group may read them, and names lead to them by two links.
mounted() {
    local folder=$tmp/$1
    shift
    mkdir -p "$folder/..2026"
    cp "$@" "$folder/..2026"
    ln -s ..2026 "$folder/..data"
    for file; do
        ln -s "..data/${file##*/}" "$folder/${file##*/}"
    done
    chown -R root:65532 "$folder"
    chmod 440 "$folder"/..data/*
    chmod 3755 "$folder"
}
"$weft" keygen "$tmp/keys" >"$tmp/keygen.out"
mounted coordinator-keys "$tmp"/keys/{coordinator.key,workers,watchers}
mounted worker-keys "$tmp"/keys/{coordinator.pub,worker.key}
mkdir -m 711 "$tmp/pod"
mkdir -m 2770 "$tmp/pictures"
chown root:65532 "$tmp/pictures"
chmod 711 "$tmp"
sed 's/"camera"/"image": {"width": 160, "height": 90}, \n &/' deploy/kubernetes/scene.json \
    >"$tmp/scene.json"
"$weft" render "$tmp/scene.json" -q -o "$tmp/own.png"
printf '127.0.0.1 localhost weft-coordinator\n' >"$tmp/hosts"
mount --bind "$tmp/hosts" /etc/hosts

# as_pod LABEL KIND KEYS OPTION...: starts the pod's command with that folder of keys, as the user that it has there.
as_pod() {
    local words
    mapfile -t words < <(check "$2" <"$manifests" |
        sed "s#^weft#$build/weft#; s#=/keys#=$tmp/$3#; s#^/scene/#$tmp/#; s#=/pictures#=$tmp/pictures#")
    [ "$2" = Job ] || words[-1]=${words[-1]#"$build/"} # the worker's last word is the service's name
    start "$1" setpriv --reuid 65532 --regid 65532 --clear-groups --no-new-privs --bounding-set=-all \
        env -u XDG_RUNTIME_DIR TMPDIR="$tmp/pod" "${words[@]}" "${@:4}"
}
manifests=$tmp/all.yaml
as_pod early Deployment worker-keys
worker_pod=$pid
ok "a worker waits for its coordinator" wait_until "grep -q 'waiting for a coordinator' '$tmp/early.err'" 20 ||
    note "$(cat "$tmp/early.err")"
as_pod coordinator Job coordinator-keys
ok "the coordinator listens, with keys that root has given to its group" listening coordinator ||
    note "$(cat "$tmp/coordinator.err")"
(exec 3<>/dev/tcp/127.0.0.1/7420) # as the startup probe does
ends 0 "the render is completed" "$pid" 60 coordinator
same_bytes "the picture is the same" "$tmp/pictures/scene.png" "$tmp/own.png"
like "by a worker that joined by the service's name" "$(cat "$tmp/early.err")" 'joined'
note "a probe is told as: $(grep refused "$tmp/coordinator.err")"
kill -TERM "$worker_pod"
ends 0 "the worker drains" "$worker_pod" 20 early

chmod 444 "$tmp"/worker-keys/..data/*
as_pod open Deployment worker-keys
ends 3 "a secret that everybody may read is refused" "$pid" 20 open
like "and that is said" "$(cat "$tmp/open.err")" 'worker.key: expected a secret file'

# --- a key for each worker ------------------------------------------------------------------------------------
cp "$tmp/keys/coordinator.pub" "$tmp"
for i in 0 1 2; do
    "$weft" keygen --worker "weft-worker-$i" "$tmp/keys" >>"$tmp/keygen.out"
    cp "$tmp/keys/weft-worker-$i/worker.key" "$tmp/weft-worker-$i.key"
done
cp "$tmp/keys/workers" "$tmp/coordinator-keys/..data/"
mounted own-keys "$tmp/coordinator.pub" "$tmp"/weft-worker-{0,1,2}.key

# mounted_in POD: a folder with single files of the Secret, as the StatefulSet's volumeMounts have them.
mounted_in() {
    local target source
    mkdir "$tmp/$1"
    sed -n 's#.* mountPath: /keys/##p; s#^ *subPath\(Expr\)\?: ##p' "$tmp/own.yaml" | paste -d ' ' - - |
        while read -r target source; do
            : >"$tmp/$1/$target"
            mount --bind "$(realpath "$tmp/own-keys/${source//\$(POD)/$1}")" "$tmp/$1/$target"
        done
}
manifests=$tmp/own.yaml
rm "$tmp/pictures/scene.png"
as_pod audited Job coordinator-keys --audit 100 --report "$tmp/pictures/report.json"
render=$pid
pods=()
for i in 0 1; do
    mounted_in "weft-worker-$i"
    as_pod "pod-$i" StatefulSet "weft-worker-$i"
    pods+=("$pid")
done
ends 0 "with a key for each worker the render is completed" "$render" 60 audited
same_bytes "with a key for each worker the picture is the same" "$tmp/pictures/scene.png" "$tmp/own.png"
like "they audit each other" "$(cat "$tmp/pictures/report.json")" '"bands_audited":[1-9]'
is "nobody else is needed for that" "$(grep -c ' joined: ' "$tmp/audited.err")" 2
kill -TERM "${pods[@]}"
wait "${pods[@]}"
umount "$tmp"/weft-worker-?/*

note "Could not be tried here: a cluster. What its API server would add and refuse, that its network keeps the policies,
volumes of more than one node, probes and termination by a kubelet."
finish
