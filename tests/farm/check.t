#!/bin/bash
# weft check says what a scene takes to render: what was compiled in for it, and what was left out.
. tests/tap.sh

cat >"$tmp/small.json" <<'EOF'
{
  "camera": {"from": [0, 2, 6], "at": [0, 1, 0]},
  "lights": [
    {"type": "point", "position": [4, 6, 5], "color": "#fff"},
    {"type": "point", "position": [4, 6, 5], "color": "#000"},
    {"type": "spot", "position": [0, 3, 0], "direction": [0, 1, 0], "angle": 30}
  ],
  "objects": [
    {"type": "sphere", "center": [0, 1, 0], "radius": 1, "material": {"specular": 0.4}},
    {"type": "plane", "point": [0, 0, 0], "normal": [0, 1, 0],
      "material": {"color": {"type": "checker", "colors": ["#ccc", "#ccc"]}}}
  ]
}
EOF
exits 0 "a small scene" "$weft" check "$tmp/small.json"
is "all that is said of it" "$(grep -v -e '^kernel:' -e '^files:' <<<"$out")" "$tmp/small.json: good
image: 640×360
sampling: until the error is 0.005
objects: 2, of 2 primitives
lights: 1
depth: 8
compiled in:
  primitives: 1 sphere, 1 plane
  search: every ray tries every primitive
  lights: 1 point
  objects by texture: 2 of one colour
  objects by material: 1 with a highlight
left out:
  1 light: black
  1 light: no surface in reach answers
  1 pattern: its colours are equal
  the search tree: there are too few primitives
  texture footprints: nothing is textured
  boundaries: no two refracting objects touch
  primitives: spheres close to the camera, ellipsoids, discs, cylinders or cones, boxes, triangles, instances of shared meshes
  lights: directional, spot
  objects by texture: checkers, striped, gradients, with images
  objects by material: mirrors, transparent, refracting, absorbing, smooth meshes"
like "the kernel is named" "$out" '^kernel: (ref|sse2|avx2|avx512|neon)$'

sed '1s/{/{"image": {"filter": "tent"},/' "$tmp/small.json" >"$tmp/tent.json"
exits 0 "a scene with a tent" "$weft" check "$tmp/tent.json"
like "has its filter told" "$out" '^filter: tent$'
exits 0 "the showcase" "$weft" check "$scenes/showcase.json"
like "asks for samples" "$out" '^sampling: 4 samples a pixel$'
like "has a tree, with the floor beside it" "$out" '^  search: a tree of [0-9]+ nodes? \([0-9]+ bytes\), and 1 beside it'
like "has images" "$out" '^  images: 4 \(46137336 bytes'
like "and footprints" "$out" '^  texture footprints: what'
exits 0 "glass in glass" "$weft" check "$scenes/nested-glass.json"
like "has boundaries" "$out" '^  boundaries: refracting objects may touch'

if [ -w /dev/full ]; then
    exits 4 "a full disk is noticed" bash -c "'$weft' check '$scenes/first.json' >/dev/full"
    like "and said" "$err" '^weft: standard output cannot be written: No space left on device$'
fi

finish
