// The page asks the coordinator once a second for its state and shows it. Whatever is shown is what was asked for last,
// so it does not matter when the page is opened, in which order rows come, or that another coordinator goes on.

import * as picture from './picture.js';
import * as plots from './plots.js';
import * as server from './server.js';
import * as workers from './workers.js';
import {count, decibels, duration, error, percent, put, time} from './text.js';

const period = 1000, hiddenPeriod = 5000; // ms

const status = document.getElementById('status'), scene = document.getElementById('scene');
const lines = document.getElementById('lines'), tokenForm = document.getElementById('token-form');

let state = null;     // as it was told last,
let run = null;       // and by whom
let nextLine = 0;     // of the log
let hurried = false; // something else is to be shown
let wake = () => {}; // ends the pause between two rounds

// --- which scene -----------------------------------------------------------------------------------------------

const open = job => job.state === 'surveying' || job.state === 'running';

function currentIndex({jobs}) {
  const running = jobs.findIndex(open);
  if (running >= 0) return running;
  const waiting = jobs.findIndex(job => job.state === 'waiting');
  return waiting >= 0 ? waiting : jobs.length - 1;
}

function chosenIndex(told) {
  const chosen = Number(scene.value);
  return scene.value === '' || chosen >= told.jobs.length ? currentIndex(told) : chosen;
}

function updateChoice() {
  document.getElementById('scene-choice').hidden = state.jobs.length < 2;
  if (scene.options.length !== state.jobs.length + 1)
    scene.replaceChildren(new Option('the one being rendered', ''), ...state.jobs.map((job, i) => new Option('', i)));
  state.jobs.forEach((job, i) => {
    const text = `${i + 1}. ${job.scene} (${job.state})`;
    if (scene.options[i + 1].text !== text) scene.options[i + 1].text = text;
  });
}

// --- figures ---------------------------------------------------------------------------------------------------

function smallBelow(id, large, small) {
  const element = document.getElementById(id);
  if (element.dataset.text === large + small) return;
  element.dataset.text = large + small;
  element.textContent = large;
  if (!small) return;
  const below = document.createElement('small');
  below.textContent = small;
  element.append(below);
}

function updateFigures(job) {
  const present = state.workers.filter(worker => worker.state !== 'gone');
  const threads = present.reduce((sum, worker) => sum + worker.threads, 0);
  smallBelow('percent', percent(job.rows_done / job.height), `${job.rows_done} of ${job.height} rows`);
  put('remaining', job.state === 'done' ? '0 s' : duration(job.remaining));
  put('elapsed', duration(job.elapsed));
  put('rate', count(state.rays_per_second));
  smallBelow('rmse', error(job.rmse),
    [decibels(job.rmse), job.error && `asked for: ${job.error}`].filter(Boolean).join(', '));
  put('samples', job.samples === null ? '–' : job.samples.toFixed(job.error ? 1 : 0));
  put('size', `${job.width}×${job.height}`);
  smallBelow('worker-count', String(present.length),
    `${threads} thread${threads === 1 ? '' : 's'}` + (state.refused ? `, ${state.refused} refused` : ''));
  const bar = document.getElementById('progress');
  bar.value = job.rows_done / job.height;
  document.title = `${percent(job.rows_done / job.height)} ${job.scene.split('/').pop()} – weft`;
}

// --- the status line -------------------------------------------------------------------------------------------

function say(text, trouble = false) {
  put('status', text);
  status.classList.toggle('trouble', trouble);
}

const isOver = () => state.jobs.every(job => job.state === 'done' || job.state === 'failed');

function outcome() {
  const failed = state.jobs.filter(job => job.state === 'failed').length;
  if (failed) return `${failed} of ${state.jobs.length} scenes failed; the log says why`;
  return state.jobs.length > 1 ? `All ${state.jobs.length} pictures are done` : `${state.jobs[0].output} is done`;
}

const doing = {waiting: 'Waiting for workers:', surveying: 'Surveying', running: 'Rendering'};

// Of the render as a whole, whichever scene is shown.
function sayState() {
  const index = currentIndex(state), job = state.jobs[index];
  const which = state.jobs.length > 1 ? `scene ${index + 1} of ${state.jobs.length}, ` : '';
  if (isOver()) say(outcome(), state.jobs.some(each => each.state === 'failed'));
  else say(`${doing[job.state]} ${which}${job.scene}`);
}

function sayGone() {
  if (!state) say('The coordinator does not answer; asking again.', true);
  else if (isOver()) say(`${outcome()}; the coordinator has ended.`);
  else say('The coordinator has ended, or cannot be reached; what is shown is its last word. Asking again.', true);
  if (!state || !isOver()) document.title = 'No answer – weft';
}

// --- the log ---------------------------------------------------------------------------------------------------

function lineOf(entry) {
  const item = document.createElement('li'), when = document.createElement('time');
  const text = document.createElement('span');
  when.textContent = time(entry.time);
  when.dateTime = new Date(entry.time * 1000).toISOString();
  text.textContent = (entry.level === 'info' || entry.level === 'debug' ? '' : `${entry.level}: `) + entry.text;
  text.className = entry.level;
  item.append(when, text);
  return item;
}

function updateLog(log) {
  const most = 500, box = document.getElementById('log-lines');
  const atEnd = box.scrollTop + box.clientHeight >= box.scrollHeight - 4;
  lines.append(...log.lines.map(lineOf));
  while (lines.children.length > most) lines.firstChild.remove();
  nextLine = log.next;
  if (atEnd) box.scrollTop = box.scrollHeight;
}

// --- rounds ----------------------------------------------------------------------------------------------------

// Another process answers: what the last one has said of its workers and in its log is past.
function beginRun(teller) {
  if (run !== null) {
    lines.replaceChildren();
    workers.forget();
  }
  run = teller;
}

// All that a round shows.
async function ask() {
  const told = await server.askJson('/api/job'), teller = server.run;
  const index = chosenIndex(told);
  const log = await server.askJson(`/api/log?from=${teller === run ? nextLine : 0}`);
  const history = await server.askJson('/api/history');
  const view = await picture.ask(index);
  if (server.run !== teller) return ask(); // meanwhile another one answers
  return {told, teller, index, log, history, view};
}

// What belongs together is shown at once.
async function round() {
  const {told, teller, index, log, history, view} = await ask();
  askForToken(false);
  if (teller !== run) beginRun(teller);
  state = told;
  updateChoice();
  sayState();
  updateFigures(state.jobs[index]);
  workers.update(state.workers);
  updateLog(log);
  plots.update(history.samples);
  picture.update(state.jobs[index], view, state.workers);
}

function askForToken(wanted) {
  if (tokenForm.hidden !== wanted) return;
  tokenForm.hidden = !wanted;
  document.querySelector('main').hidden = wanted;
  document.querySelector('footer').hidden = true; // links cannot show the token
}

function sayUnauthorised() {
  askForToken(true);
  say(server.hasToken() ? 'That is not its token.' : 'This coordinator wants a token.', true);
}

async function roundWhateverComes() {
  try {
    await round();
  } catch (reason) {
    if (reason instanceof server.Unauthorised) sayUnauthorised();
    else if (reason instanceof server.Unanswered) sayGone();
    else throw reason;
  }
}

function pause() {
  return new Promise(resolve => {
    const timer = setTimeout(resolve, hurried ? 0 : document.hidden ? hiddenPeriod : period);
    wake = () => { clearTimeout(timer); resolve(); };
  });
}

function hurry() {
  hurried = true;
  wake();
}

document.getElementById('render').addEventListener('change', hurry);
document.addEventListener('visibilitychange', hurry);
tokenForm.addEventListener('submit', event => {
  event.preventDefault();
  server.setToken(document.getElementById('token').value);
  hurry();
});

for (;;) {
  hurried = false;
  await roundWhateverComes();
  await pause();
}
