// The picture so far, its maps, and who has or had which rows.

import * as server from './server.js';
import {colour, error, percent, put} from './text.js';

const picture = document.getElementById('picture'), bands = document.getElementById('bands');
const legend = document.getElementById('legend'), byWorker = document.getElementById('by-worker');

const scales = {samples: ['1 sample a pixel', '65,536'], error: ['0.0005 or less', '0.5 or more']};
const titles = {
  picture: 'The picture',
  samples: 'A map of where the samples went',
  error: 'A map of the estimated error',
};

let shown = null;   // which coordinator's which picture of which scene is on the canvas,
let version = null; // and the version of it that the coordinator has given

function chosen() {
  return document.querySelector('input[name=show]:checked').value;
}

// What there is to show of scene number `index`: which picture of whose, its version and its image (null: as it was), and
// whose its rows are, where that is wanted.
export async function ask(index) {
  const kind = chosen();
  const response = await server.ask(`/preview.png?job=${index}&show=${kind}`,
    {headers: version ? {'If-None-Match': version} : {}, good: [200, 304]});
  return {
    kind,
    what: `${server.run} ${index} ${kind}`,
    version: response.headers.get('ETag'),
    image: response.status === 304 ? null : await createImageBitmap(await response.blob()),
    rows: byWorker.checked ? (await server.askJson(`/api/rows?job=${index}`)).rows : null,
  };
}

function drawPicture(view) {
  if (view.what !== shown) picture.getContext('2d').clearRect(0, 0, picture.width, picture.height);
  shown = view.what;
  version = view.version;
  if (!view.image) return;
  picture.width = view.image.width;
  picture.height = view.image.height;
  document.getElementById('frame').style.setProperty('--aspect', view.image.width / view.image.height);
  picture.getContext('2d').drawImage(view.image, 0, 0);
}

// Paints rows first..first + rows of the scene over the picture.
function paint(context, job, first, rows, style) {
  const scale = bands.height / job.height;
  const top = Math.round(first * scale), bottom = Math.max(top + 1, Math.round((first + rows) * scale));
  context.fillStyle = style;
  context.fillRect(0, top, bands.width, bottom - top);
}

// In work: a veil, and its worker's colour at both sides.
function paintWork(context, job, band) {
  paint(context, job, band.first_row, band.rows, colour(band.worker, 0.35));
  const scale = bands.height / job.height, side = Math.max(3, bands.width / 60);
  const top = Math.round(band.first_row * scale), height = Math.max(1, Math.round(band.rows * scale) - 1);
  context.fillStyle = colour(band.worker);
  context.fillRect(0, top, side, height);
  context.fillRect(bands.width - side, top, side, height);
}

function drawBands(job, done) {
  const ratio = window.devicePixelRatio || 1;
  bands.width = Math.max(1, Math.round(picture.clientWidth * ratio));
  bands.height = Math.max(1, Math.round(picture.clientHeight * ratio));
  const context = bands.getContext('2d');
  for (const share of done) paint(context, job, share.first_row, share.rows,
    share.worker === null ? 'rgb(128 128 128 / 0.45)' : colour(share.worker, 0.45));
  context.globalCompositeOperation = 'destination-in'; // only where the picture is there, which may be a little older
  context.drawImage(picture, 0, 0, bands.width, bands.height);
  context.globalCompositeOperation = 'source-over';
  for (const band of job.bands) if (band.state === 'in work') paintWork(context, job, band);
}

// Who is seen in the picture: number and rows of those with most rows, in an order that stays.
function drawLegend(done, workers) {
  const rows = new Map();
  for (const share of done) rows.set(share.worker, (rows.get(share.worker) ?? 0) + share.rows);
  const entries = [...rows].sort((a, b) => b[1] - a[1]).slice(0, 24).sort((a, b) => a[0] - b[0]);
  legend.replaceChildren(...entries.map(([number, its]) => {
    const item = document.createElement('li'), swatch = document.createElement('span');
    swatch.className = 'swatch';
    swatch.style.background = number === null ? 'gray' : colour(number);
    const host = workers.find(worker => worker.number === number)?.host ?? '';
    const who = number === null ? 'an earlier run' : `worker ${number}, ${host}`;
    item.append(swatch, `${who}: ${its} rows`);
    return item;
  }));
  if (rows.size > entries.length) legend.append(`and ${rows.size - entries.length} more`);
}

function describe(job, kind) {
  const label = `${titles[kind]} of ${job.scene}: ${percent(job.rows_done / job.height)} of its rows are there` +
    (job.rmse === null ? '' : `, estimated error ${error(job.rmse)}`);
  if (picture.getAttribute('aria-label') !== label) picture.setAttribute('aria-label', label);
  document.getElementById('scale').hidden = !(kind in scales);
  if (kind in scales) {
    put('scale-from', scales[kind][0]);
    put('scale-to', scales[kind][1]);
  }
}

// Shows what was asked for of a scene of the state.
export function update(job, view, workers) {
  drawPicture(view);
  drawBands(job, view.rows ?? []);
  legend.hidden = !view.rows;
  if (view.rows) drawLegend(view.rows, workers);
  describe(job, view.kind);
}
