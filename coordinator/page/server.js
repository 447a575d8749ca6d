// Asking the coordinator. The token, where it wants one, stands behind the # of the page's address, which browsers send
// to nobody.

const patience = 8000; // ms

export class Unanswered extends Error {}  // nobody is there, or it takes too long
export class Unauthorised extends Error {}

let token = decodeURIComponent(location.hash.slice(1));
if (document.getElementById(token)) token = ''; // a place in the page

export let run = null; // which process has answered last

export function setToken(text) {
  token = text;
  history.replaceState(null, '', '#' + encodeURIComponent(text));
}

export function hasToken() {
  return token !== '';
}

// The response to GET path, whose status is one of `good`.
export async function ask(path, {headers = {}, good = [200]} = {}) {
  let response;
  try {
    response = await fetch(path, {
      headers: token ? {...headers, Authorization: `Bearer ${token}`} : headers,
      cache: 'no-store',
      signal: AbortSignal.timeout(patience),
    });
  } catch (reason) {
    throw new Unanswered(reason.message);
  }
  if (response.status === 401) throw new Unauthorised();
  if (!good.includes(response.status)) throw new Unanswered(`${path}: ${response.status}`);
  run = response.headers.get('Weft-Run');
  return response;
}

export async function askJson(path) {
  const response = await ask(path);
  try {
    return await response.json();
  } catch (reason) {
    throw new Unanswered(reason.message);
  }
}
