#!/usr/bin/env python3
"""Writes knot.obj: a tube along the (2, 3) torus knot, closed, with a normal for each vertex."""
from math import cos, hypot, pi, sin

STEPS, SIDES, RADIUS = 80, 8, 0.266


def curve(t):
    """Parameter 0..2π; a knot about the y axis, lying flat, 3.2 wide."""
    ring = 1.1 + 0.5 * cos(3 * t)
    return (ring * cos(2 * t), 0.5 * sin(3 * t), ring * sin(2 * t))


def unit(v):
    length = hypot(*v)
    return tuple(x / length for x in v)


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


points, normals = [], []
for i in range(STEPS):
    t = 2 * pi * i / STEPS
    here, ahead, behind = curve(t), curve(t + 1e-4), curve(t - 1e-4)
    along = unit(tuple(a - b for a, b in zip(ahead, behind)))
    outward = unit((here[0], 0, here[2]))  # never along the knot, and back at its start after 2π
    side = unit(cross(along, outward))
    up = cross(side, along)
    for k in range(SIDES):
        angle = 2 * pi * k / SIDES
        normal = tuple(cos(angle) * u + sin(angle) * s for u, s in zip(up, side))
        points.append(tuple(h + RADIUS * n for h, n in zip(here, normal)))
        normals.append(normal)

with open("knot.obj", "w") as file:
    print("# Written by knot.py.\nmtllib knot.mtl\nusemtl copper", file=file)
    for point in points:
        print("v %.4g %.4g %.4g" % point, file=file)
    for normal in normals:
        print("vn %.3f %.3f %.3f" % normal, file=file)
    for i in range(STEPS):
        for k in range(SIDES):
            a, b = i * SIDES + k, i * SIDES + (k + 1) % SIDES
            d, c = (a + SIDES) % len(points), (b + SIDES) % len(points)
            print("f " + " ".join(f"{n + 1}//{n + 1}" for n in (a, b, c, d)), file=file)
