// Makes the textures of the showcase's boxes: crate.png, weave.png and emblem.png, 512 x 512 each.
//
//     node make-textures.js
//
// Each picture is a function from a point to a colour; x runs right and y down, both 0..1. weave.png tiles.
'use strict';

const path = require('path');
const { writePng } = require('./png.js');
const {
    clamp01, mix, mixColour, scaleColour, smoothstep, toLinear, fromLinear, hash, fractal,
} = require('./shade.js');

const SIZE = 512;
const SAMPLES_PER_SIDE = 3;

const fract = (x) => x - Math.floor(x);

// ---- Sampling ----

// The mean light of a pixel, from a square grid of samples.
function samplePixel(colourAt, px, py) {
    const sum = [0, 0, 0];
    for (let i = 0; i < SAMPLES_PER_SIDE ** 2; i++) {
        const dx = (i % SAMPLES_PER_SIDE + 0.5) / SAMPLES_PER_SIDE;
        const dy = (Math.floor(i / SAMPLES_PER_SIDE) + 0.5) / SAMPLES_PER_SIDE;
        colourAt((px + dx) / SIZE, (py + dy) / SIZE).forEach((value, c) => { sum[c] += toLinear(value); });
    }
    return sum.map((value) => fromLinear(value / SAMPLES_PER_SIDE ** 2));
}

function makeTexture(name, colours, colourAt) {
    const rgb = new Uint8Array(SIZE * SIZE * 3);
    for (let i = 0; i < SIZE * SIZE; i++) {
        rgb.set(samplePixel(colourAt, i % SIZE, Math.floor(i / SIZE)), 3 * i);
    }
    writePng(path.join(__dirname, name), SIZE, SIZE, rgb, colours);
}

// ---- crate.png: boards in a frame with one brace ----

const WOOD_LIGHT = [204, 158, 102];
const WOOD_DARK = [138, 92, 52];
const CREVICE = [58, 38, 24];
const NAIL = [124, 122, 122];

const FRAME = 0.15; // width of the frame's boards
const BRACE = 0.075; // half the width of the brace
const PLANKS = 5;

// Bare wood at `along` and `across` the grain; `board` picks its own grain and shade.
function woodColour(along, across, board) {
    const bend = 0.10 * fractal(along * 2.2, across * 3, board * 7.3, 2);
    const rings = 0.5 + 0.5 * Math.sin(2 * Math.PI * (across * 9 + 6 * bend + 3.1 * board));
    const fibre = fractal(along * 5, across * 110, board * 3.7, 2);
    const tone = clamp01(0.32 + 0.38 * rings ** 3 + 0.22 * fibre);
    const shade = 0.92 + 0.16 * hash(board, 5, 9);
    return scaleColour(mixColour(WOOD_LIGHT, WOOD_DARK, tone), shade);
}

// A board with rounded edges, dark in the gap: `edge` is the distance from its nearest long edge.
function boardColour(along, across, board, edge) {
    const lit = mix(0.72, 1, smoothstep(0.002, 0.012, edge));
    return mixColour(CREVICE, scaleColour(woodColour(along, across, board), lit), smoothstep(0, 0.004, edge));
}

// Darkens what lies under a board that is `distance` away.
const underBoard = (colour, distance) => scaleColour(colour, mix(0.5, 1, smoothstep(0, 0.03, distance)));

function plankColour(x, y) {
    const position = (x - FRAME) / (1 - 2 * FRAME) * PLANKS;
    const edge = Math.min(fract(position), 1 - fract(position)) * (1 - 2 * FRAME) / PLANKS;
    return boardColour(y, x, 1 + Math.floor(position), edge);
}

// Inside the frame: upright planks and the brace that rises to the right.
function panelColour(x, y) {
    const across = (x + y - 1) * Math.SQRT1_2;
    const along = (x - y) * Math.SQRT1_2;
    const outside = Math.abs(across) - BRACE;
    return outside < 0
        ? boardColour(along, across, 11, -outside)
        : underBoard(plankColour(x, y), outside);
}

// The frame: two uprights over the full height, two rails between them.
function frameColour(x, y) {
    const side = Math.min(x, 1 - x);
    const end = Math.min(y, 1 - y);
    if (side < FRAME) {
        return boardColour(y, x, x < 0.5 ? 21 : 22, Math.min(side, FRAME - side) + 0.001);
    }
    return boardColour(x, y, y < 0.5 ? 23 : 24, Math.min(end, FRAME - end, side - FRAME) + 0.001);
}

const CORNER_NAILS = [[0.045, 0.045], [0.105, 0.045], [0.045, 0.105], [0.105, 0.105]];

// A domed nail head, lit from the upper left, in a soft hollow. The nails sit alike in all four corners.
function nailed(colour, x, y) {
    const [fx, fy] = [Math.min(x, 1 - x), Math.min(y, 1 - y)];
    let out = colour;
    for (const [nx, ny] of CORNER_NAILS) {
        const cx = x < 0.5 ? nx : 1 - nx;
        const cy = y < 0.5 ? ny : 1 - ny;
        const distance = Math.hypot(fx - nx, fy - ny) / 0.0125;
        const light = 1 - 0.35 * ((x - cx) + (y - cy)) / 0.0125;
        out = scaleColour(out, mix(0.55, 1, smoothstep(0.9, 1.7, distance)));
        out = mixColour(out, scaleColour(NAIL, light), smoothstep(1.05, 0.95, distance));
    }
    return out;
}

function crateColour(x, y) {
    const depth = Math.min(x, 1 - x, y, 1 - y) - FRAME;
    const bare = depth > 0 ? underBoard(panelColour(x, y), depth) : frameColour(x, y);
    return nailed(bare, x, y);
}

// ---- Threads, for weave.png and emblem.png ----

// How bright a round, twisted thread is: `across` -1..1 from edge to edge, `along` in thread widths.
function threadShade(across, along) {
    const round = Math.sqrt(Math.max(0, 1 - across * across));
    const twist = 0.5 + 0.5 * Math.sin(2 * Math.PI * (2 * along + 0.7 * across));
    return mix(0.42, 1, round) * mix(0.88, 1.06, twist);
}

// ---- weave.png: plain weave of blue warp (upright) and cream weft (level) with two stripes ----

const THREADS = 16;
const WARP = [70, 104, 148];
const WARP_STRIPE = [52, 132, 128];
const WEFT = [208, 190, 156];
const WEFT_STRIPE = [196, 96, 72];
const THREAD_HALF_WIDTH = 0.46; // of the thread spacing, so that a dark gap shows between two
const GAP = [34, 36, 46];

const warpColour = (i) => (i % 8 === 3 ? WARP_STRIPE : WARP);
const weftColour = (j) => (j % 8 === 5 ? WEFT_STRIPE : WEFT);

// u runs across the thread and v along it, both -0.5..0.5 in the cell where the thread lies on top.
// The thread swells in the middle of the cell and dips under its neighbours at both ends.
function topThread(u, v, colour, fibre) {
    const halfWidth = THREAD_HALF_WIDTH * mix(0.9, 1.04, Math.cos(Math.PI * v));
    const across = u / halfWidth;
    if (Math.abs(across) > 1) {
        return null;
    }
    const height = mix(0.7, 1.04, Math.cos(Math.PI * v) ** 0.7);
    return scaleColour(colour, threadShade(across, v + 0.5) * height * (1 + 0.07 * fibre));
}

function weaveColour(x, y) {
    const [i, j] = [Math.floor(x * THREADS), Math.floor(y * THREADS)];
    const [u, v] = [fract(x * THREADS) - 0.5, fract(y * THREADS) - 0.5];
    const fibre = 2 * hash(i, j, 3) - 1;
    const warpOnTop = (i + j) % 2 === 0;
    const top = warpOnTop ? topThread(u, v, warpColour(i), fibre) : topThread(v, u, weftColour(j), fibre);
    return top || GAP;
}

// ---- emblem.png: a W of two crossing V's on cloth, with stitches that tell the sides apart ----

const CLOTH = [206, 194, 168];
const LETTER_A = [52, 92, 146];
const LETTER_B = [190, 84, 60];
const STITCHES = { top: [190, 84, 60], right: [88, 132, 74], bottom: [52, 92, 146], left: [204, 152, 58] };
const BUTTON = [70, 60, 66];

const STRANDS = 3;
const STROKE_HALF_WIDTH = 0.051;
// Two V's that cross: the strokes of the first, then those of the second, from top to bottom.
const STROKES = [
    { from: [0.17, 0.23], to: [0.375, 0.77], colour: LETTER_A },
    { from: [0.375, 0.77], to: [0.60, 0.23], colour: LETTER_A },
    { from: [0.40, 0.23], to: [0.625, 0.77], colour: LETTER_B },
    { from: [0.625, 0.77], to: [0.83, 0.23], colour: LETTER_B },
];

function clothColour(x, y) {
    const [i, j] = [Math.floor(x * 64), Math.floor(y * 64)];
    const [u, v] = [fract(x * 64) - 0.5, fract(y * 64) - 0.5];
    const warpOnTop = (i + j) % 2 === 0;
    const [across, along] = warpOnTop ? [u, v] : [v, u];
    const shade = mix(0.80, 1.03, Math.cos(Math.PI * across) * Math.cos(Math.PI * along) ** 0.5);
    return scaleColour(CLOTH, shade * (warpOnTop ? 0.95 : 1));
}

// Where a point lies beside a stroke: `along` in the texture's units, `across` likewise, signed, and
// `distance` from the stroke's outline, negative inside. The ends are round.
function strokePlace(stroke, x, y) {
    const [dx, dy] = [stroke.to[0] - stroke.from[0], stroke.to[1] - stroke.from[1]];
    const length = Math.hypot(dx, dy);
    const [px, py] = [x - stroke.from[0], y - stroke.from[1]];
    const along = (px * dx + py * dy) / length;
    const across = (py * dx - px * dy) / length;
    const past = along - Math.min(length, Math.max(0, along));
    return { along, across, distance: Math.hypot(past, across) - STROKE_HALF_WIDTH };
}

function strandColour(colour, place) {
    const position = (place.across / STROKE_HALF_WIDTH + 1) / 2 * STRANDS;
    const across = 2 * fract(position) - 1;
    const width = 2 * STROKE_HALF_WIDTH / STRANDS;
    return scaleColour(colour, 1.1 * threadShade(across, place.along / width / 2));
}

// Lays the strokes one upon another; each throws a soft shadow on what is below.
function letterOver(ground, x, y) {
    return STROKES.reduce((below, stroke) => {
        const place = strokePlace(stroke, x, y);
        return place.distance < 0
            ? strandColour(stroke.colour, place)
            : scaleColour(below, mix(0.55, 1, smoothstep(0, 0.022, place.distance)));
    }, ground);
}

// Running stitches along the four sides, each side in its own colour.
function stitchOver(ground, x, y) {
    const sides = [['top', y, x], ['bottom', 1 - y, x], ['left', x, y], ['right', 1 - x, y]];
    return sides.reduce((below, [side, depth, run]) => {
        const across = (depth - 0.075) / 0.017;
        const along = (fract((run - 0.1) * 12.5) - 0.5) / 12.5;
        const distance = Math.hypot(Math.max(0, Math.abs(along) - 0.012) / 0.017, across);
        if (run < 0.1 || run > 0.9 || distance > 1.6) {
            return below;
        }
        return distance < 1
            ? scaleColour(STITCHES[side], 1.1 * threadShade(distance, along / 0.034))
            : scaleColour(below, mix(0.65, 1, smoothstep(1, 1.6, distance)));
    }, ground);
}

// A button in the lower left corner.
function buttonOver(ground, x, y) {
    const [px, py] = [(x - 0.09) / 0.05, (y - 0.91) / 0.05];
    const distance = Math.hypot(px, py);
    const hole = Math.hypot(Math.abs(px) - 0.26, Math.abs(py) - 0.26);
    const rim = 1 + 0.5 * smoothstep(0.62, 0.8, distance) * smoothstep(1, 0.85, distance);
    const face = scaleColour(BUTTON, rim * (1.25 - 0.25 * (px + py)));
    const pierced = mixColour(CLOTH, face, smoothstep(0.10, 0.16, hole));
    const shadowed = scaleColour(ground, mix(0.55, 1, smoothstep(1, 1.5, distance)));
    return mixColour(shadowed, pierced, smoothstep(1.02, 0.98, distance));
}

function emblemColour(x, y) {
    return buttonOver(stitchOver(letterOver(clothColour(x, y), x, y), x, y), x, y);
}

makeTexture('crate.png', 64, crateColour);
makeTexture('weave.png', 96, weaveColour);
makeTexture('emblem.png', 96, emblemColour);
