// Small shading helpers that the texture generators share: blends, the sRGB curve and value noise.
// Colours are [r, g, b] with sRGB values 0..255 unless a name says linear.
'use strict';

const clamp01 = (x) => Math.min(1, Math.max(0, x));
const mix = (a, b, t) => a + (b - a) * t;
const mixColour = (a, b, t) => [mix(a[0], b[0], t), mix(a[1], b[1], t), mix(a[2], b[2], t)];
const scaleColour = (colour, k) => [colour[0] * k, colour[1] * k, colour[2] * k];

// 0 below `from`, 1 above `to`, a smooth cubic between; `from` may exceed `to` for a falling step.
function smoothstep(from, to, x) {
    const t = clamp01((x - from) / (to - from));
    return t * t * (3 - 2 * t);
}

// The sRGB transfer curve and its inverse, IEC 61966-2-1; value 0..255, linear 0..1.
function toLinear(value) {
    const v = clamp01(value / 255);
    return v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
}

function fromLinear(linear) {
    const v = linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055;
    return Math.round(255 * clamp01(v));
}

// Blends two sRGB colours as light blends: t is the share of b. Returns rounded sRGB.
function mixLight(a, b, t) {
    return a.map((value, c) => fromLinear(mix(toLinear(value), toLinear(b[c]), t)));
}

// An integer hash of a lattice point to 0..1, the same on every machine.
function hash(x, y, z) {
    let h = Math.imul(x, 0x27d4eb2f) ^ Math.imul(y, 0x165667b1) ^ Math.imul(z, 0x9e3779b1);
    h = Math.imul(h ^ (h >>> 15), 0x85ebca6b);
    h = Math.imul(h ^ (h >>> 13), 0xc2b2ae35);
    return ((h ^ (h >>> 16)) >>> 0) / 0xffffffff;
}

// Trilinear value noise, 0..1, lattice spacing 1.
function noise(x, y, z) {
    const [i, j, k] = [Math.floor(x), Math.floor(y), Math.floor(z)];
    const [u, v, w] = [x - i, y - j, z - k].map((t) => t * t * (3 - 2 * t));
    const row = (dy, dz) => mix(hash(i, j + dy, k + dz), hash(i + 1, j + dy, k + dz), u);
    return mix(mix(row(0, 0), row(1, 0), v), mix(row(0, 1), row(1, 1), v), w);
}

// Octaves of noise, each twice as fine and half as strong; the result lies in -1..1.
function fractal(x, y, z, octaves) {
    let sum = 0;
    let total = 0;
    let weight = 1;
    for (let octave = 0; octave < octaves; octave++) {
        const s = 2 ** octave;
        sum += weight * (2 * noise(x * s, y * s, z * s + 17 * octave) - 1);
        total += weight;
        weight /= 2;
    }
    return sum / total;
}

module.exports = {
    clamp01, mix, mixColour, scaleColour, smoothstep, toLinear, fromLinear, mixLight, hash, fractal,
};
