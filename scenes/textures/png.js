// A small palette PNG encoder: quantises an RGB picture to at most 256 colours and writes it
// with node's own zlib. Format: PNG specification, third edition (W3C), chunks IHDR, sRGB, PLTE, IDAT, IEND.
//
// The pixels depend on the picture alone; the bytes also on the zlib that node carries.
'use strict';

const fs = require('fs');
const zlib = require('zlib');

const SIGNATURE = Buffer.from([0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a]);
const COLOUR_TYPE_PALETTE = 3;
const REFINEMENTS = 6;

const CRC_TABLE = Uint32Array.from({ length: 256 }, (_, n) => {
    for (let bit = 0; bit < 8; bit++) {
        n = n & 1 ? 0xedb88320 ^ (n >>> 1) : n >>> 1;
    }
    return n;
});

function crc32(bytes) {
    let crc = 0xffffffff;
    for (const byte of bytes) {
        crc = CRC_TABLE[(crc ^ byte) & 0xff] ^ (crc >>> 8);
    }
    return (crc ^ 0xffffffff) >>> 0;
}

function chunk(type, data) {
    const body = Buffer.concat([Buffer.from(type, 'latin1'), data]);
    const out = Buffer.alloc(body.length + 8);
    out.writeUInt32BE(data.length, 0);
    body.copy(out, 4);
    out.writeUInt32BE(crc32(body), body.length + 4);
    return out;
}

// The distinct colours of a picture: [{rgb: [r, g, b], count}], in order of their 24 bit key.
function histogram(rgb) {
    const counts = new Map();
    for (let i = 0; i < rgb.length; i += 3) {
        const key = (rgb[i] << 16) | (rgb[i + 1] << 8) | rgb[i + 2];
        counts.set(key, (counts.get(key) || 0) + 1);
    }
    return [...counts.entries()]
        .sort((a, b) => a[0] - b[0])
        .map(([key, count]) => ({ key, count, rgb: [key >> 16, (key >> 8) & 255, key & 255] }));
}

// The channel in which a box of colours spreads widest, and that spread times the box's weight.
// The root of the pixel count stands for the weight, so that a wide plain area does not take every colour.
function boxSpread(box) {
    const ranges = [0, 1, 2].map((c) => {
        let low = 255;
        let high = 0;
        for (const { rgb } of box) {
            low = Math.min(low, rgb[c]);
            high = Math.max(high, rgb[c]);
        }
        return high - low;
    });
    const channel = ranges.indexOf(Math.max(...ranges));
    const pixels = box.reduce((sum, colour) => sum + colour.count, 0);
    return { channel, score: ranges[channel] * Math.sqrt(pixels) };
}

function splitBox(box, channel) {
    const sorted = [...box].sort((a, b) => a.rgb[channel] - b.rgb[channel] || a.key - b.key);
    const half = sorted.reduce((sum, colour) => sum + colour.count, 0) / 2;
    let seen = 0;
    let cut = 0;
    while (cut < sorted.length - 1 && seen < half) {
        seen += sorted[cut++].count;
    }
    return [sorted.slice(0, cut), sorted.slice(cut)];
}

function meanColour(colours) {
    const sum = [0, 0, 0];
    let weight = 0;
    for (const { rgb, count } of colours) {
        weight += count;
        rgb.forEach((value, c) => { sum[c] += value * count; });
    }
    return sum.map((value) => Math.round(value / weight));
}

// Median cut (Heckbert, "Color image quantization for frame buffer display", 1982).
function medianCut(colours, size) {
    const boxes = [{ box: colours, ...boxSpread(colours) }];
    while (boxes.length < size) {
        const widest = boxes.reduce((best, b, i) => (b.score > boxes[best].score ? i : best), 0);
        if (boxes[widest].score === 0) {
            break;
        }
        const halves = splitBox(boxes[widest].box, boxes[widest].channel);
        boxes.splice(widest, 1, ...halves.map((box) => ({ box, ...boxSpread(box) })));
    }
    return boxes.map(({ box }) => meanColour(box));
}

function nearest(palette, rgb) {
    let best = 0;
    let bestDistance = Infinity;
    for (let i = 0; i < palette.length; i++) {
        const dr = palette[i][0] - rgb[0];
        const dg = palette[i][1] - rgb[1];
        const db = palette[i][2] - rgb[2];
        const distance = dr * dr + dg * dg + db * db;
        if (distance < bestDistance) {
            bestDistance = distance;
            best = i;
        }
    }
    return best;
}

// A few rounds of Lloyd's algorithm move each palette colour to the mean of the colours it serves.
function refine(palette, colours) {
    const served = palette.map(() => []);
    colours.forEach((colour) => served[nearest(palette, colour.rgb)].push(colour));
    return palette.map((old, i) => (served[i].length > 0 ? meanColour(served[i]) : old));
}

// rgb: a byte array, 3 bytes a pixel. Returns {palette: [[r, g, b]], indices: one byte a pixel}.
function quantise(rgb, size) {
    const colours = histogram(rgb);
    let palette = medianCut(colours, size);
    for (let i = 0; i < REFINEMENTS; i++) {
        palette = refine(palette, colours);
    }
    palette.sort((a, b) => a[0] + a[1] + a[2] - b[0] - b[1] - b[2] || a[0] - b[0] || a[1] - b[1]);
    const indexOf = new Map(colours.map((colour) => [colour.key, nearest(palette, colour.rgb)]));
    const indices = new Uint8Array(rgb.length / 3);
    for (let i = 0; i < indices.length; i++) {
        indices[i] = indexOf.get((rgb[3 * i] << 16) | (rgb[3 * i + 1] << 8) | rgb[3 * i + 2]);
    }
    return { palette, indices };
}

function header(width, height) {
    const data = Buffer.alloc(13);
    data.writeUInt32BE(width, 0);
    data.writeUInt32BE(height, 4);
    data[8] = 8;
    data[9] = COLOUR_TYPE_PALETTE;
    return data;
}

// Each row is preceded by its filter byte; 0 (none) suits palette indices best.
function scanlines(indices, width, height) {
    const rows = Buffer.alloc((width + 1) * height);
    for (let y = 0; y < height; y++) {
        rows.set(indices.subarray(y * width, (y + 1) * width), y * (width + 1) + 1);
    }
    return rows;
}

// Writes rgb (8 bit sRGB, 3 bytes a pixel, top row first) as a PNG of at most `colours` colours.
function writePng(path, width, height, rgb, colours) {
    const { palette, indices } = quantise(rgb, colours);
    const bytes = Buffer.concat([
        SIGNATURE,
        chunk('IHDR', header(width, height)),
        chunk('sRGB', Buffer.from([0])),
        chunk('PLTE', Buffer.from(palette.flat())),
        chunk('IDAT', zlib.deflateSync(scanlines(indices, width, height), { level: 9, memLevel: 9 })),
        chunk('IEND', Buffer.alloc(0)),
    ]);
    fs.writeFileSync(path, bytes);
    console.log(`${path}: ${width}x${height}, ${palette.length} colours, ${bytes.length} bytes`);
}

module.exports = { writePng };
