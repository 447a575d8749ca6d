// Small plots of the last minutes, and what they show in words.

import {count, duration} from './text.js';

const width = 300, height = 80, namespace = 'http://www.w3.org/2000/svg';

const plots = [
  {id: 'rate', key: 'rays_per_second', name: 'Rays a second', text: count},
  {id: 'remaining', key: 'remaining', name: 'Remaining time', text: duration},
];

// Stretches of samples whose value is known.
function stretches(samples, key) {
  const found = [[]];
  for (const sample of samples) {
    if (sample[key] !== null) found.at(-1).push(sample);
    else if (found.at(-1).length) found.push([]);
  }
  return found.filter(stretch => stretch.length);
}

function path(className, d) {
  const element = document.createElementNS(namespace, 'path');
  element.setAttribute('class', className);
  element.setAttribute('d', d);
  return element;
}

function draw(svg, samples, key, most) {
  const from = samples[0].elapsed, span = Math.max(samples.at(-1).elapsed - from, 1e-3);
  const x = sample => ((sample.elapsed - from) / span * width).toFixed(1);
  const y = sample => (height - sample[key] / most * (height - 6)).toFixed(1);
  const parts = [];
  for (const stretch of stretches(samples, key)) {
    const line = stretch.map(sample => `${x(sample)} ${y(sample)}`).join('L');
    parts.push(path('below', `M${x(stretch[0])} ${height}L${line}L${x(stretch.at(-1))} ${height}Z`));
    parts.push(path('curve', `M${line}`));
  }
  svg.replaceChildren(...parts);
}

function show(plot, samples) {
  const svg = document.getElementById(`${plot.id}-plot`);
  const known = samples.map(sample => sample[plot.key]).filter(value => value !== null);
  const span = samples.length ? samples.at(-1).elapsed - samples[0].elapsed : 0;
  document.getElementById(`${plot.id}-peak`).textContent =
    known.length ? `at the peak ${plot.text(Math.max(...known))}` : '';
  svg.parentElement.querySelector('.axis span').textContent = span ? `${duration(span)} ago` : '';
  if (known.length < 2) {
    svg.setAttribute('aria-label', `${plot.name}: not known yet`);
    svg.replaceChildren();
    return;
  }
  svg.setAttribute('aria-label', `${plot.name} over the last ${duration(span)}: now ${plot.text(known.at(-1))}, ` +
    `between ${plot.text(Math.min(...known))} and ${plot.text(Math.max(...known))}`);
  draw(svg, samples, plot.key, Math.max(...known) || 1);
}

export function update(samples) {
  for (const plot of plots) show(plot, samples);
}
