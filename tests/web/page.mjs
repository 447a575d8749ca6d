// Watches renders in Chromium as a person would, and prints TAP.
import {execFileSync} from 'node:child_process';
import {copyFileSync, writeFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {join} from 'node:path';
import {Render, newFolder, scenePath, slow, until} from './farm.mjs';

const {BROWSER, MODULES, WEFT, SHOTS} = process.env;
const {chromium} = createRequire(join(MODULES, 'node_modules', 'x'))('playwright-core');

let tests = 0, failed = 0;

function ok(name, good, found = '') {
  tests++;
  failed += good ? 0 : 1;
  console.log(`${good ? '' : 'not '}ok ${tests} - ${name}`);
  if (!good) console.log(`# found: ${typeof found === 'string' ? found : JSON.stringify(found)}`);
}

const browser = await chromium.launch({executablePath: BROWSER, args: [
  '--headless', '--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run', '--disable-background-networking',
  '--disable-component-update', '--disable-sync']});
const complaints = []; // of the pages' consoles, but for an absent coordinator

async function open(url, options = {}) {
  const page = await browser.newPage({viewport: {width: 1280, height: 900}, ...options});
  page.on('console', message => {
    const expected = /ERR_CONNECTION|ERR_EMPTY|ERR_INCOMPLETE|status of (401|503)/;
    if (message.type() === 'error' && !expected.test(message.text()))
      complaints.push(message.text());
  });
  page.on('pageerror', error => complaints.push(error.message));
  page.on('dialog', dialog => { complaints.push(`a dialog: ${dialog.message()}`); dialog.dismiss(); });
  await page.goto(url);
  return page;
}

const shoot = (page, name) => page.screenshot({path: join(SHOTS, `${name}.png`), fullPage: true});
const text = (page, selector) => page.locator(selector).innerText();
const done = async page => parseInt(await text(page, '#percent'), 10);

// How much of a canvas is painted, 0 to 1.
const painted = (page, selector) => page.$eval(selector, canvas => {
  const {data} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
  let count = 0;
  for (let i = 3; i < data.length; i += 4) count += data[i] > 0;
  return count / (data.length / 4);
});

// --- a render from its first rows to its end ----------------------------------------------------------------------
async function watchToTheEnd() {
  const folder = newFolder(), render = await Render.start(folder, [...slow, '--samples', '60', '-o', 'a.png']);
  const page = await open(render.url);
  await until(async () => await done(page) >= 15, 'rows on the page');
  const share = await painted(page, '#picture');
  ok('the picture is there in part', share > 0.05 && share < 1, share);
  ok('and said to be', /^The picture of .*showcase\.json: \d+ % of its rows are there/.test(
    await page.locator('#picture').getAttribute('aria-label')));
  ok('bands in work are marked', await painted(page, '#bands') > 0.01);
  ok('the status says what is going on', /^Rendering .*showcase\.json$/.test(await text(page, '#status')),
     await text(page, '#status'));
  await page.check('#by-worker');
  await until(async () => await page.locator('#legend li').count() === 2, 'both workers in the legend');
  const legend = await text(page, '#legend');
  ok('workers have colours, in the order of their numbers',
     /worker 1, .*: \d+ rows[^]*worker 2, .*: \d+ rows/.test(legend), legend);
  await until(() => page.locator('#rate-plot path').count(), 'a plot');
  ok('the plot is put into words', /^Rays a second over the last .*: now/.test(
    await page.locator('#rate-plot').getAttribute('aria-label')));
  await shoot(page, '1-rendering');
  await page.uncheck('#by-worker');
  for (const [show, name] of [['samples', '2-samples'], ['error', '3-error']]) {
    await page.check(`input[value=${show}]`);
    await until(async () => (await page.locator('#picture').getAttribute('aria-label')).startsWith('A map'), 'a map');
    ok(`the map of ${show} has a scale`, await page.locator('#scale').isVisible());
    await shoot(page, name);
  }
  await page.check('input[value=picture]');
  await until(async () => /is done/.test(await text(page, '#status')), 'the end', 120000);
  ok('the page sees the end', await done(page) === 100, await text(page, '#percent'));
  await until(async () => await painted(page, '#picture') === 1, 'the whole picture', 6000);
  ok('the render ends with 0', await render.ended === 0);
  await until(async () => /the coordinator has ended/.test(await text(page, '#status')), 'the coordinator\'s end');
  await shoot(page, '4-done');
  const url = await page.$eval('#picture', canvas => canvas.toDataURL('image/png'));
  writeFileSync(join(folder, 'shown.png'), Buffer.from(url.split(',')[1], 'base64'));
  try {
    execFileSync(WEFT, ['compare', 'shown.png', 'a.png', '--max-rmse', '0'], {cwd: folder});
    ok('what is shown is the picture', true);
  } catch (reason) {
    ok('what is shown is the picture', false, reason.message);
  }
  await page.close();
}

// --- a death, a late look, and a coordinator that goes on ----------------------------------------------------------
async function watchFaults() {
  const folder = newFolder(), command = [...slow, '--samples', '400', '-o', 'b.png'];
  const render = await Render.start(folder, command);
  await until(async () => (await render.state()).jobs[0].rows_done > 0, 'rows', 120000);
  const page = await open(render.url);
  await until(async () => await page.locator('#worker-rows tr').count() === 2, 'two workers');
  ok('opened late, it shows the log from the start', /status page at/.test(await text(page, '#lines')));
  process.kill((await render.state()).workers[0].pid, 'SIGKILL');
  await until(async () => /gone\s.*lost/.test(await text(page, '#worker-rows')), 'a worker that is lost');
  await until(async () => await page.locator('#worker-rows tr').count() === 3, 'its successor');
  ok('a death is seen in the table', true);
  await until(() => page.locator('#lines .warning').count(), 'a warning');
  ok('and in the log', /warning: local worker process \d+ was ended by signal 9/.test(await text(page, '#lines')));
  await shoot(page, '5-worker-lost');
  await page.check('#hide-gone');
  ok('who is gone can be hidden', await page.locator('#worker-rows tr').count() === 2);
  await page.uncheck('#hide-gone');

  await render.kill();
  await until(async () => /has ended, or cannot be reached/.test(await text(page, '#status')), 'its end');
  ok('the end of the coordinator is said', await page.locator('#status.trouble').count() === 1);
  ok('also in the title', /^No answer/.test(await page.title()), await page.title());
  const before = await done(page);
  await shoot(page, '6-coordinator-gone');
  const again = await Render.start(folder, command, render.port);
  await until(async () => /^Rendering/.test(await text(page, '#status')), 'the next coordinator');
  ok('another one that goes on is found', await done(page) >= before, `${before}, then ${await done(page)}`);
  await until(async () => /going on from its journal/.test(await text(page, '#lines')), 'the new log');
  ok('with its own log', await page.locator('#lines .warning').count() === 0);
  await page.check('#by-worker');
  await until(async () => /an earlier run: \d+ rows/.test(await text(page, '#legend')), 'an earlier run');
  ok('what an earlier run did is told', true);
  await shoot(page, '7-resumed');
  await page.close();
  return again;
}

// --- from a keyboard, in the dark, on a telephone ------------------------------------------------------------------
async function useKeyboard(render) {
  const page = await open(render.url);
  await until(async () => await page.locator('#worker-rows tr').count() >= 2, 'workers');
  const focused = () => page.evaluate(() => document.activeElement.outerHTML.slice(0, 80));
  await page.keyboard.press('Tab');
  ok('Tab begins with a way past the picture', /class="skip"/.test(await focused()), await focused());
  await page.keyboard.press('Tab');
  ok('then goes to what is shown', /name="show" value="picture"/.test(await focused()), await focused());
  await page.keyboard.press('ArrowRight');
  await until(async () => /^A map of where/.test(await page.locator('#picture').getAttribute('aria-label')), 'the map');
  ok('an arrow shows the next', true);
  await page.keyboard.press('Tab');
  await page.keyboard.press('Space');
  ok('the space bar colours by worker', await page.isChecked('#by-worker'));
  for (let i = 0; i < 12 && !/Threads/.test(await focused()); i++) await page.keyboard.press('Tab');
  await page.keyboard.press('Enter');
  const head = page.locator('#worker-heads th', {hasText: 'Threads'});
  ok('Enter sorts by a column', await head.getAttribute('aria-sort') === 'ascending', await focused());
  await page.keyboard.press('Enter');
  ok('and the other way', await head.getAttribute('aria-sort') === 'descending');
  await shoot(page, '8-keyboard');
  await page.close();
}

async function lookElsewhere(render) {
  const dark = await open(render.url, {colorScheme: 'dark'});
  await until(async () => await painted(dark, '#picture') > 0, 'a picture');
  const ground = await dark.evaluate(() => getComputedStyle(document.body).backgroundColor.match(/\d+/g).map(Number));
  ok('in the dark the page is dark', Math.max(...ground) < 64, ground);
  await dark.waitForTimeout(2500); // for a plot to be seen
  await shoot(dark, '9-dark');
  await dark.close();
  for (const width of [320, 768, 2560]) {
    const page = await open(render.url, {viewport: {width, height: 800}});
    await until(async () => await painted(page, '#picture') > 0, 'a picture');
    const wide = await page.evaluate(() => document.scrollingElement.scrollWidth);
    ok(`${width} pixels are wide enough`, wide <= width, wide);
    await shoot(page, `10-width-${width}`);
    await page.close();
  }
}

// What a screen reader would miss.
async function listen(render) {
  const page = await open(render.url);
  await until(async () => await page.locator('#worker-rows tr').count() >= 2, 'workers');
  const lacking = await page.evaluate(() => {
    const isNamed = e => e.hasAttribute('aria-label') || e.hasAttribute('aria-labelledby') || e.labels?.length ||
      e.textContent.trim();
    const isHeard = e => !e.closest('[hidden]') && e.getAttribute('aria-hidden') !== 'true';
    const all = [...document.querySelectorAll('button, input, select, progress, canvas, svg, section, [role]')];
    return all.filter(e => isHeard(e) && !isNamed(e)).map(e => e.outerHTML);
  });
  ok('everything has a name', lacking.length === 0, lacking);
  ok('the page has landmarks', await page.locator('header, main, footer').count() === 3);
  ok('its state is told politely', await page.locator('[role=status][aria-live=polite]').count() === 1);
  ok('heads of the table belong to columns', await page.locator('thead th[scope=col]').count() === 10);
  ok('and to rows', await page.locator('tbody th[scope=row]').count() >= 2);
  await page.close();
}

// --- names that would be markup, and several scenes ----------------------------------------------------------------
async function watchSeveral() {
  const folder = newFolder(), odd = '<img src=x onerror=alert(1)>.json';
  copyFileSync(scenePath('first.json'), join(folder, odd));
  const render = await Render.start(folder, [odd, ...slow, '--samples', '400', '-o', 'out']);
  const page = await open(render.url);
  await until(async () => /scene 2 of 2/.test(await text(page, '#status')), 'the second scene', 120000);
  await page.selectOption('#scene', '0');
  const label = () => page.locator('#picture').getAttribute('aria-label');
  await until(async () => /^The picture of <img/.test(await label()), 'the first');
  ok('a scene can be chosen', await done(page) === 100, await text(page, '#percent'));
  ok('its name is text', await page.locator('img[src=x]').count() === 0);
  await shoot(page, '11-several');
  await page.close();
  await render.kill('SIGTERM');
}

// --- the token -----------------------------------------------------------------------------------------------------
async function showToken() {
  const folder = newFolder(), token = 'a-token-of-some-length';
  writeFileSync(join(folder, 'token'), `${token}\n`, {mode: 0o600});
  const render = await Render.start(folder, [...slow, '--samples', '400', '-o', 'c.png', '--http-token', 'token']);
  const page = await open(render.url);
  await page.locator('#token').waitFor({state: 'visible'});
  ok('without the token nothing is shown', await page.locator('main').isHidden());
  await shoot(page, '12-token');
  await page.fill('#token', 'another-token-than-that');
  await page.keyboard.press('Enter');
  await until(async () => /not its token/.test(await text(page, '#status')), 'a refusal');
  await page.fill('#token', token);
  await page.keyboard.press('Enter');
  await until(async () => /^Rendering/.test(await text(page, '#status')), 'the render');
  ok('with it everything is', await page.locator('main').isVisible() && await page.locator('#token-form').isHidden());
  await page.close();
  const other = await open(`${render.url}#${token}`);
  await until(async () => /^Rendering/.test(await text(other, '#status')), 'the render');
  ok('behind a # it does too', true);
  await other.close();
  await render.kill('SIGTERM');
}

try {
  await watchToTheEnd();
  const render = await watchFaults();
  await useKeyboard(render);
  await lookElsewhere(render);
  await listen(render);
  await render.kill('SIGTERM');
  await watchSeveral();
  await showToken();
  ok('the browser had nothing to complain of', complaints.length === 0, complaints);
} catch (reason) {
  ok(`it went on to the end`, false, reason.stack);
}
await browser.close();
console.log(`1..${tests}`);
process.exit(failed ? 1 : 0);
