// The table of workers.

import {colour, count, put} from './text.js';

const most = 500; // rows of the table

// Who is well and who is not comes first: on a narrow screen the rest is scrolled to.
const columns = [
  {key: 'number', title: 'Worker', number: true, text: worker => String(worker.number)},
  {key: 'host', title: 'Machine', text: worker => worker.host},
  {key: 'state', title: 'State', text: worker => worker.state},
  {key: 'trouble', title: 'Last trouble', text: worker => worker.trouble ?? 'none'},
  {key: 'rows_done', title: 'Rows done', number: true, text: worker => String(worker.rows_done)},
  {key: 'rays_per_second', title: 'Rays a second', number: true, text: worker => count(worker.rays_per_second)},
  {key: 'bands_held', title: 'Bands held', number: true, text: worker => String(worker.bands_held)},
  {key: 'threads', title: 'Threads', number: true, text: worker => String(worker.threads)},
  {key: 'kernel', title: 'Kernel', text: worker => worker.kernel},
  {key: 'pid', title: 'Process', number: true, text: worker => String(worker.pid)},
];
const troubleIndex = columns.findIndex(column => column.key === 'trouble');

const body = document.getElementById('worker-rows'), hideGone = document.getElementById('hide-gone');
const rows = new Map(); // of the table, by the worker's number
let sort = {column: columns[0], sign: 1};
let latest = [];

function compare(a, b) {
  const key = sort.column.key, left = a[key] ?? '', right = b[key] ?? '';
  const order = typeof left === 'number' && typeof right === 'number' ? left - right
                                                                       : String(left).localeCompare(String(right));
  return sort.sign * order || a.number - b.number;
}

function sortBy(column) {
  sort = {column, sign: sort.column === column ? -sort.sign : 1};
  markSorted();
  draw();
}

function markSorted() {
  const heads = document.getElementById('worker-heads').children;
  columns.forEach((column, i) => {
    if (column === sort.column) heads[i].setAttribute('aria-sort', sort.sign > 0 ? 'ascending' : 'descending');
    else heads[i].removeAttribute('aria-sort');
  });
}

function makeHeads() {
  document.getElementById('worker-heads').append(...columns.map(column => {
    const head = document.createElement('th'), button = document.createElement('button');
    head.scope = 'col';
    head.className = column.number ? 'number' : '';
    button.type = 'button';
    button.textContent = column.title;
    button.addEventListener('click', () => sortBy(column));
    head.append(button);
    return head;
  }));
  markSorted();
}

function makeRow(worker) {
  const row = document.createElement('tr');
  columns.forEach((column, i) => {
    const cell = document.createElement(i ? 'td' : 'th');
    if (!i) cell.scope = 'row';
    if (column.number) cell.className = 'number';
    if (!i) {
      const swatch = document.createElement('span');
      swatch.className = 'swatch';
      swatch.style.background = colour(worker.number);
      cell.append(swatch);
    }
    cell.append('');
    row.append(cell);
  });
  return row;
}

function fill(row, worker) {
  row.className = worker.state === 'gone' ? 'gone' : '';
  columns.forEach((column, i) => {
    const text = row.children[i].lastChild, value = column.text(worker);
    if (text.data !== value) text.data = value;
  });
  row.children[troubleIndex].className = worker.trouble ? 'trouble' : '';
}

function rowOf(worker) {
  let row = rows.get(worker.number);
  if (!row) rows.set(worker.number, row = makeRow(worker));
  fill(row, worker);
  return row;
}

function draw() {
  const wanted = latest.filter(worker => !hideGone.checked || worker.state !== 'gone').sort(compare);
  const wantedRows = wanted.slice(0, most).map(rowOf);
  if (wantedRows.length !== body.children.length || wantedRows.some((row, i) => row !== body.children[i]))
    body.replaceChildren(...wantedRows);
  const hidden = wanted.length - wantedRows.length;
  put('worker-note', hidden ? `and ${hidden} more` : latest.length ? '' : 'Nobody has joined yet.');
}

export function update(workers) {
  latest = workers;
  draw();
}

// Another coordinator numbers its workers anew.
export function forget() {
  rows.clear();
  body.replaceChildren();
}

makeHeads();
hideGone.addEventListener('change', draw);
