// Makes earth.png, an equirectangular map of the Earth: left edge longitude -180, right edge +180,
// top row latitude +90. Coastlines and the outline of Greenland are Natural Earth's, 1:50 million; the
// colours are computed here.
//
//     npm install --prefix /tmp/atlas world-atlas@2.0.2 topojson-client@3.1.0
//     NODE_PATH=/tmp/atlas/node_modules node make-earth.js
//
// The climate is a sketch, not data: winds walk along each parallel, trade winds from the east near the
// equator and westerlies beyond, take up moisture over sea and lose it over land. Where the air arrives dry
// near the belts of sinking air at 23 degrees, there is desert.
'use strict';

const path = require('path');
const topojson = require('topojson-client');
const atlas = require('world-atlas/countries-50m.json');
const { writePng } = require('./png.js');
const { clamp01, mix, mixColour, scaleColour, smoothstep, mixLight, fractal } = require('./shade.js');

const WIDTH = 2048;
const HEIGHT = 1024;
const LINES_PER_ROW = 8; // vertical supersampling; along a line coverage is exact
const PALETTE_COLOURS = 256;
const GREENLAND = '304'; // ISO 3166-1 numeric
const KM_PER_DEGREE = 111.2;
const DEGREES_PER_PX = 180 / HEIGHT;

const latitudeOf = (y) => 90 - (y + 0.5) * DEGREES_PER_PX;
const longitudeOf = (x) => (x + 0.5) * DEGREES_PER_PX - 180;
const cosDegrees = (angle) => Math.cos(angle * Math.PI / 180);
const sinDegrees = (angle) => Math.sin(angle * Math.PI / 180);

// ---- Coastlines to coverage ----

// All rings of a GeoJSON Polygon or MultiPolygon (or a collection of them).
function ringsOf(geometry) {
    switch (geometry.type) {
    case 'FeatureCollection': return geometry.features.flatMap(ringsOf);
    case 'Feature': return ringsOf(geometry.geometry);
    case 'Polygon': return geometry.coordinates;
    case 'MultiPolygon': return geometry.coordinates.flat();
    default: throw new Error(`ringsOf: expected polygons, found ${geometry.type}`);
    }
}

// Removes the jumps at the date line, so that neighbouring points are never more than 180 degrees apart.
// A ring that runs once round the pole (Antarctica) does not come back to its start; it is closed along
// the bottom of the map.
function unwrapRing(ring) {
    const out = [[...ring[0]]];
    for (let i = 1; i < ring.length; i++) {
        const previous = out[i - 1][0];
        const turns = Math.round((previous - ring[i][0]) / 360);
        out.push([ring[i][0] + 360 * turns, ring[i][1]]);
    }
    const [first, last] = [out[0], out[out.length - 1]];
    if (Math.abs(last[0] - first[0]) > 180) {
        out.push([last[0], -90], [first[0], -90]);
    }
    return out;
}

// Notes where the edge a-b, in pixels, crosses each sampling line.
function addEdge(crossings, a, b) {
    const [top, bottom] = a[1] < b[1] ? [a, b] : [b, a];
    const first = Math.max(0, Math.ceil(top[1] * LINES_PER_ROW - 0.5));
    const end = Math.min(crossings.length, Math.ceil(bottom[1] * LINES_PER_ROW - 0.5));
    for (let line = first; line < end; line++) {
        const y = (line + 0.5) / LINES_PER_ROW;
        crossings[line].push(top[0] + (bottom[0] - top[0]) * (y - top[1]) / (bottom[1] - top[1]));
    }
}

// Adds the span from..to (pixels) of one sampling line to the row of coverage that starts at `start`.
function addSpan(coverage, start, from, to) {
    const left = Math.max(0, from);
    const right = Math.min(WIDTH, to);
    for (let x = Math.floor(left); x < right; x++) {
        coverage[start + x] += (Math.min(x + 1, right) - Math.max(x, left)) / LINES_PER_ROW;
    }
}

// The share of each pixel that the rings cover, 0..1, by the even-odd rule. A ring that was unwrapped
// beyond the date line reaches off the map; its copies one turn away bring that part back.
function rasterise(rings) {
    const crossings = Array.from({ length: HEIGHT * LINES_PER_ROW }, () => []);
    for (const ring of rings.map(unwrapRing)) {
        for (const turn of [-360, 0, 360]) {
            const points = ring.map(([lon, lat]) =>
                [(lon + turn + 180) / DEGREES_PER_PX, (90 - lat) / DEGREES_PER_PX]);
            points.forEach((point, i) => addEdge(crossings, point, points[(i + 1) % points.length]));
        }
    }
    const coverage = new Float32Array(WIDTH * HEIGHT);
    crossings.forEach((xs, line) => {
        xs.sort((a, b) => a - b);
        for (let i = 0; i + 1 < xs.length; i += 2) {
            addSpan(coverage, Math.floor(line / LINES_PER_ROW) * WIDTH, xs[i], xs[i + 1]);
        }
    });
    return coverage.map(clamp01);
}

// The share of the sphere that is covered: pixels weighted by cos(latitude).
function sphereFraction(coverage) {
    let sum = 0;
    let total = 0;
    coverage.forEach((value, i) => {
        const weight = cosDegrees(latitudeOf(Math.floor(i / WIDTH)));
        sum += weight * value;
        total += weight;
    });
    return sum / total;
}

// ---- Blurs on the map ----

// Running mean over 2 * radius + 1 values of `line`, which wraps round or else repeats its ends.
function boxFilter(line, radius, wraps) {
    const n = line.length;
    const at = (i) => line[wraps ? ((i % n) + n) % n : Math.min(n - 1, Math.max(0, i))];
    const out = new Float32Array(n);
    let sum = 0;
    for (let i = -radius; i <= radius; i++) {
        sum += at(i);
    }
    for (let i = 0; i < n; i++) {
        out[i] = sum / (2 * radius + 1);
        sum += at(i + radius + 1) - at(i - radius);
    }
    return out;
}

// Two box filters along each parallel, widened by 1 / cos(latitude) so that the blur is round on the globe.
function blurParallels(field, radius) {
    for (let y = 0; y < HEIGHT; y++) {
        const stretched = Math.round(radius / Math.max(cosDegrees(latitudeOf(y)), 1e-6));
        const reach = Math.min(stretched, WIDTH / 2 - 1);
        const row = field.subarray(y * WIDTH, (y + 1) * WIDTH);
        row.set(boxFilter(boxFilter(row, reach, true), reach, true));
    }
}

function blurMeridians(field, radius) {
    const column = new Float32Array(HEIGHT);
    for (let x = 0; x < WIDTH; x++) {
        for (let y = 0; y < HEIGHT; y++) {
            column[y] = field[y * WIDTH + x];
        }
        const smooth = boxFilter(boxFilter(column, radius, false), radius, false);
        for (let y = 0; y < HEIGHT; y++) {
            field[y * WIDTH + x] = smooth[y];
        }
    }
}

// A blurred copy. Parallels come last: beside a pole they average the whole row, so no seam meets there.
function blur(field, degrees) {
    const out = Float32Array.from(field);
    const radius = Math.round(degrees / DEGREES_PER_PX);
    blurMeridians(out, radius);
    blurParallels(out, radius);
    return out;
}

// ---- Climate ----

// Moisture 0..1 of air that walks along one parallel; step is +1 (eastward) or -1. Two rounds, so that
// the value at the start no longer matters.
function walkParallel(land, step, kmPerPx) {
    const uptake = 1 - Math.exp(-kmPerPx / 500);
    const loss = 1 - Math.exp(-kmPerPx / 1800);
    const out = new Float32Array(WIDTH);
    let moisture = 1;
    for (let n = 0; n < 2 * WIDTH; n++) {
        const x = step > 0 ? n % WIDTH : WIDTH - 1 - (n % WIDTH);
        moisture += land[x] > 0.5 ? -moisture * loss : (1 - moisture) * uptake;
        out[x] = moisture;
    }
    return out;
}

// Moisture 0..1 of the prevailing winds everywhere, smoothed over a few degrees.
function moistureMap(land) {
    const out = new Float32Array(WIDTH * HEIGHT);
    for (let y = 0; y < HEIGHT; y++) {
        const latitude = latitudeOf(y);
        const row = land.subarray(y * WIDTH, (y + 1) * WIDTH);
        const kmPerPx = DEGREES_PER_PX * KM_PER_DEGREE * cosDegrees(latitude);
        const westerly = walkParallel(row, +1, kmPerPx);
        const easterly = walkParallel(row, -1, kmPerPx);
        const westerlyShare = mix(0.1, 0.65, smoothstep(27, 42, Math.abs(latitude)));
        for (let x = 0; x < WIDTH; x++) {
            out[y * WIDTH + x] = mix(easterly[x], westerly[x], westerlyShare);
        }
    }
    return blur(out, 2.5);
}

// ---- Colours ----

const TROPICAL = [58, 112, 58];
const SAVANNA = [140, 148, 78];
const TEMPERATE = [104, 140, 76];
const BOREAL = [70, 106, 76];
const TUNDRA = [150, 148, 122];
const DESERT = [214, 186, 134];
const STEPPE = [178, 166, 112];
const ICE = [224, 231, 236];
const ABYSS_WARM = [30, 78, 128];
const ABYSS_COLD = [38, 72, 108];
const SHELF = [92, 156, 178];
const SEA_ICE = [196, 214, 224];

// How far a place is desert, 0..1, from its latitude and the moisture of its wind.
function aridity(latitude, moisture) {
    const from = (Math.abs(latitude) - 23) / 10;
    const sinkingAir = Math.exp(-from * from);
    const inland = smoothstep(0.5, 0.1, moisture) * smoothstep(8, 20, Math.abs(latitude));
    return clamp01(sinkingAir * smoothstep(0.88, 0.36, moisture) + 0.75 * inland);
}

// latitude already carries the wobble that keeps the bands from running straight.
function landColour(latitude, moisture) {
    const away = Math.abs(latitude);
    const wood = mixColour(TEMPERATE, BOREAL, smoothstep(44, 56, away));
    const tropics = mixColour(TROPICAL, SAVANNA, smoothstep(7, 17, away));
    const lush = mixColour(tropics, wood, smoothstep(18, 32, away));
    const dry = mixColour(DESERT, STEPPE, smoothstep(30, 44, away));
    const grown = mixColour(lush, dry, aridity(latitude, moisture) * smoothstep(60, 50, away));
    const north = mixColour(grown, TUNDRA, smoothstep(60, 70, away));
    const ice = latitude > 0 ? smoothstep(72, 80, latitude) : smoothstep(-57, -61, latitude);
    return mixColour(north, ICE, ice);
}

// coastal, shelf: the land cover blurred widely and narrowly, 0..1, which stand for the depth of the sea.
function seaColour(latitude, coastal, shelf) {
    const abyss = mixColour(ABYSS_WARM, ABYSS_COLD, smoothstep(20, 65, Math.abs(latitude)));
    const shallow = clamp01(0.45 * coastal + 0.75 * shelf);
    const water = mixColour(abyss, SHELF, shallow);
    const frozen = latitude > 0 ? smoothstep(72, 86, latitude) : 0.8 * smoothstep(-66, -74, latitude);
    return mixColour(water, SEA_ICE, frozen);
}

function paintPixel(maps, x, y) {
    const i = y * WIDTH + x;
    const latitude = latitudeOf(y);
    const longitude = longitudeOf(x);
    const onSphere = [cosDegrees(latitude) * cosDegrees(longitude),
        cosDegrees(latitude) * sinDegrees(longitude), sinDegrees(latitude)];
    const wobble = 8 * fractal(...onSphere.map((v) => 5 * v + 40), 4);
    const relief = 1 + 0.13 * fractal(...onSphere.map((v) => 22 * v + 90), 3);
    const sea = seaColour(latitude + wobble, maps.coastal[i], maps.shelf[i]);
    const ground = landColour(latitude + wobble, clamp01(maps.moisture[i] + 0.015 * wobble));
    const iced = mixColour(ground, ICE, smoothstep(0.3, 0.8, maps.greenland[i]));
    const land = scaleColour(iced, relief);
    const line = 4 * maps.shore[i] * (1 - maps.shore[i]);
    return mixLight(sea, land, maps.land[i]).map((value) => value * (1 - 0.22 * line * line));
}

function main() {
    const land = rasterise(ringsOf(topojson.feature(atlas, atlas.objects.land)));
    const greenland = atlas.objects.countries.geometries.find((country) => country.id === GREENLAND);
    const maps = {
        land,
        greenland: rasterise(ringsOf(topojson.feature(atlas, greenland))),
        moisture: moistureMap(land),
        coastal: blur(land, 9),
        shelf: blur(land, 1.4),
        shore: blur(land, DEGREES_PER_PX),
    };
    const rgb = new Uint8ClampedArray(WIDTH * HEIGHT * 3);
    for (let y = 0; y < HEIGHT; y++) {
        for (let x = 0; x < WIDTH; x++) {
            rgb.set(paintPixel(maps, x, y), 3 * (y * WIDTH + x));
        }
    }
    console.log(`land covers ${sphereFraction(land).toFixed(4)} of the sphere`);
    writePng(path.join(__dirname, 'earth.png'), WIDTH, HEIGHT, rgb, PALETTE_COLOURS);
}

main();
