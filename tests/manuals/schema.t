#!/bin/bash
# scenes/weft.schema.json, by Python's jsonschema where that is installed: it takes every scene that weft takes, and
# where it refuses what became of one by a change of one value, weft refuses it too. (The reverse need not be: the
# schema cannot express everything. That both know the same keys is the matter of scene-keys.t.)
. tests/tap.sh
[ "$mode" = release ] || skip_all "it is the same schema in release mode, where this takes less time"
python3 -c 'import jsonschema' 2>/dev/null || skip_all "there is no jsonschema for Python here"

ln -s "$scenes/textures" "$scenes/meshes" "$tmp/" # what the changed scenes name
python3 - "$weft" "$tmp" scenes/*.json scenes/hard/*.json scenes/pictures/*.json >"$tmp/found" <<'EOF'
import copy, json, subprocess, sys
import jsonschema

weft, folder, *scenes = sys.argv[1:]
with open("scenes/weft.schema.json", encoding="utf-8") as file:
    schema = json.load(file)
jsonschema.Draft202012Validator.check_schema(schema)
validator = jsonschema.Draft202012Validator(schema)
OTHERS = [None, -1, 1e31, "@", []]


def weft_takes(scene):
    with open(folder + "/changed.json", "w", encoding="utf-8") as file:
        json.dump(scene, file)
    status = subprocess.run([weft, "check", folder + "/changed.json"], capture_output=True).returncode
    if status not in (0, 3):
        print("weft check ends with", status, "on", json.dumps(scene))
    return status == 0


def type_of(value):
    return "<%s>" % value["type"] if isinstance(value, dict) and "type" in value else ""


def places(value, path=(), kind=""):
    """The paths to all values within, each with its kind, for which it does not matter which number of an array, or
    which material of a scene, it is, nor who wears that."""
    keys = value if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()
    for key in keys:
        if isinstance(value, list) or kind == ".materials":
            inner = kind + ".#"
        else:
            inner = {"material": ".materials.#", "transform": ".transform"}.get(key, kind + "." + key)
        inner = ".number" if inner.endswith(".#") and isinstance(value[key], (int, float)) else inner
        yield path + (key,), inner + type_of(value[key])
        yield from places(value[key], path + (key,), inner + type_of(value[key]))


def changed(scene, path, other):
    scene = copy.deepcopy(scene)
    inner = scene
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = other
    return scene


def check_changes(name, scene, done):
    for path, kind in places(scene):
        if kind in done:
            continue
        done.add(kind)
        for other in OTHERS:
            variant = changed(scene, path, other)
            if not validator.is_valid(variant) and weft_takes(variant):
                print("only the schema refuses", kind, "=", json.dumps(other), "in", name)


done = set()
for name in scenes:
    if name.endswith(".schema.json"):
        continue
    with open(name, encoding="utf-8") as file:
        scene = json.load(file)
    for fault in validator.iter_errors(scene):
        print(name, list(fault.path), fault.message)
    if "/pictures/" not in name: # these name files elsewhere
        check_changes(name, scene, done)
EOF
is "the schema is one" $? 0
is "it refuses only what weft refuses" "$(cat "$tmp/found")" ''

finish
