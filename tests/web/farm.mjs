// Renders to be looked at: processes of weft, each in a folder of its own under FOLDER.
import {spawn} from 'node:child_process';
import {mkdtempSync} from 'node:fs';
import {join} from 'node:path';
import {setTimeout as sleep} from 'node:timers/promises';

const {WEFT, SCENES, FOLDER} = process.env;

export const scenePath = name => join(SCENES, name);
export const newFolder = () => mkdtempSync(join(FOLDER, 'web-'));

// Renders that take their time on any machine: the slowest kernel, few threads, many samples.
export const slow = [scenePath('showcase.json'), '--size', '320x180', '--kernel', 'ref', '--threads', '2',
                     '--workers', '2', '--band', '6'];

export class Render {
  // Starts `weft render ARGUMENTS --http PORT` in the folder; url says where its page is.
  static async start(folder, options, port = 0) {
    const render = new Render();
    render.child = spawn(WEFT, ['render', ...options, '--http', String(port)], {cwd: folder});
    render.text = '';
    render.ended = new Promise(resolve => render.child.on('close', resolve));
    render.child.stderr.on('data', data => render.text += data);
    render.child.stdout.on('data', data => render.text += data);
    await until(() => /status page at \S+/.test(render.text), 'a status page', 30000);
    render.url = render.text.match(/status page at (http:\/\/[^/]+\/)/)[1];
    render.port = Number(new URL(render.url).port);
    return render;
  }

  async state() {
    return (await fetch(this.url + 'api/job')).json();
  }

  async kill(signal = 'SIGKILL') {
    this.child.kill(signal);
    return this.ended;
  }
}

// Waits until the condition, which may be a promise, holds.
export async function until(condition, what, patience = 60000) {
  const latest = Date.now() + patience;
  for (;;) {
    try {
      if (await condition()) return;
    } catch { /* not yet */ }
    if (Date.now() > latest) throw new Error(`waited in vain for ${what}`);
    await sleep(50);
  }
}
