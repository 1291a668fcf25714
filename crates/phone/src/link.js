// ---- The key: a link's token is exchanged once, and then leaves the address. The browser's history keeps the token, so
// it opens nothing any more; the key stays with this page, which can be closed and opened again.
let key = null, heard = null;
const entered = () => key !== null;
const LASTING = 'Started with --serve-key FILE, boresight keeps its links, and this wouldn’t be needed.';
function random() {
  const bytes = crypto.getRandomValues(new Uint8Array(32));
  return btoa(String.fromCharCode(...bytes)).replace(/\+/g, '-').replace(/\//g, '_').replace(/=/g, '');
}
async function enter() {
  const token = location.hash.slice(1), claim = random();
  const known = JSON.parse(store.getItem('key') || 'null');
  if (token) history.replaceState(null, '', location.pathname);
  let refused = null;
  while (token && !refused) {
    const answer = await request('/api/enter', { token, claim }, null);
    if (is(answer, 'application/json')) {
      const given = await answer.json().catch(() => null);
      if (given && given.key) {
        store.setItem('key', JSON.stringify(given));
        key = given.key; role = given.role;
        return true;
      }
    }
    if (answer && (answer.status === 401 || answer.status === 410)) refused = answer.status;
    // The answer may have been lost: the same claim gets the same key.
    else { closed('No connection', 'The computer at the camera doesn’t answer. The page tries again.'); await pause(1000); }
  }
  if (known && refused !== 401) { key = known.key; role = known.role; return true; }
  if (refused === 401) closed('This link isn’t valid any more', 'boresight was started again, and made new links. Scan the QR code that it shows now. ' + LASTING);
  else if (refused) closed('This link is used up', 'Each link lets one phone in. Scan the QR code that the computer at the camera shows now.');
  else closed('Scan the QR code', 'The computer at the camera shows it, in its terminal or window.');
  return false;
}
// True for an answer of boresight's: a portal answers everything, with a page of its own.
const is = (answer, type) => !!answer && answer.status === 200 && (answer.headers.get('content-type') || '').startsWith(type);
function closed(what, why) {
  key = null;
  el('closedwhat').textContent = what; el('closedwhy').textContent = why;
  el('gone').hidden = true;
  show('closed');
  if (started) { aloud(what); buzz([200, 100, 200]); }
}
async function request(path, body, bearer, signal) {
  const headers = {};
  if (bearer) headers.Authorization = 'Bearer ' + bearer;
  if (body) headers['Content-Type'] = 'application/json';
  try {
    return await fetch(path, { method: body ? 'POST' : 'GET', headers, body: body ? JSON.stringify(body) : undefined, signal, cache: 'no-store', credentials: 'omit' });
  } catch (e) { return null; }
}

// ---- The link: events with the newest state, and one picture at a time.
let pictureBorn = null, pictureAge = null, pictureNumber = 0;
const ages = [];
let lastBytes = -1e9, stream = null, asking = null;
const linked = () => now() - lastBytes < 1300;
function timeout(ms, controller) { return setTimeout(() => controller.abort(), ms); }
const pause = ms => new Promise(done => setTimeout(done, ms));
// Several attempts may be under way: a slow link gets the time that it needs, and a new one isn't waited for.
const MOST_ATTEMPTS = 4, NEXT_ATTEMPT = 1200;
async function connect() {
  const attempts = [];
  let mine = null;
  while (key && !mine) {
    const controller = new AbortController();
    const attempt = { controller };
    attempt.answer = request('/api/events' + (heard === null ? '' : '?heard=' + heard), null, key, controller.signal).then(answer => { attempt.over = answer; return attempt; });
    attempts.push(attempt);
    if (attempts.length > MOST_ATTEMPTS) attempts.shift().controller.abort();
    const began = now();
    const first = await Promise.race([...attempts.map(a => a.answer), pause(NEXT_ATTEMPT)]);
    if (!first) continue;
    attempts.splice(attempts.indexOf(first), 1);
    if (first.over && (first.over.status === 401 || is(first.over, 'text/event-stream'))) mine = first;
    else await pause(Math.max(300, NEXT_ATTEMPT / 2 - (now() - began)));
  }
  for (const other of attempts) other.controller.abort();
  return mine;
}
async function follow() {
  while (key) {
    const connected = await connect();
    if (!connected) return;
    const answer = connected.over;
    if (answer.status === 401) { store.removeItem('key'); return closed('Scan the QR code again', 'boresight was started again, and doesn’t know this phone yet. Every view taken is stored on its computer. ' + LASTING); }
    if (answer.body) {
      stream = connected.controller;
      lastBytes = now();
      // All is sent anew: boresight may have been started again, and counts from one.
      plan = ended = null; pictureNumber = 0; clock = null;
      const reader = answer.body.getReader(), decoder = new TextDecoder();
      let text = '';
      try {
        for (;;) {
          const part = await reader.read();
          if (part.done) break;
          lastBytes = now();
          text += decoder.decode(part.value, { stream: true });
          let end;
          while ((end = text.indexOf('\n\n')) >= 0) { event(text.slice(0, end)); text = text.slice(end + 2); }
          tellMissed();
          paint();
        }
      } catch (e) { /* The link is gone: again. */ }
      stream = null;
    }
    await pause(300);
  }
}
// How much later than at best the newest state came. The clocks may drift apart a little.
const SLOW = 1500;
let clock = null;
const late = () => clock === null ? 0 : clock.late;
function tick(at) {
  const came = now(), took = came - at;
  const best = clock === null ? took : Math.min(took, clock.best + 1e-4 * (came - clock.came));
  clock = { came, best, late: took - best };
}
const UNANSWERED = 'Can’t reach the computer. The session continues without the phone.';
function lacks() {
  if (!linked()) return { lost: true, what: 'No connection', why: UNANSWERED, result: 'The computer at the camera doesn’t answer any more. The report and every export are stored there.' };
  return late() > SLOW ? { lost: false, what: 'Slow connection', why: 'What arrives is ' + Math.round(late() / 1000) + ' s old. Go nearer to the access point.' } : null;
}
function event(text) {
  const [, name, data] = /^event: (\w+)\ndata: (.*)$/.exec(text) || [];
  if (!name) return;
  const value = JSON.parse(data);
  if (name === 'clock') tick(value);
  if (name === 'heard') heard = value;
  if (name === 'news') heard = value.number;
  receive(name, value);
}
async function pictures() {
  while (key) {
    if (!wantsPicture()) { forgetPicture(); await pause(200); continue; }
    const controller = asking = new AbortController(), patience = timeout(6000, controller), asked = now();
    const answer = await request('/api/picture?after=' + pictureNumber, null, key, controller.signal);
    if (is(answer, 'image/jpeg')) {
      try {
        const blob = await answer.blob(), came = now();
        const head = name => Number(answer.headers.get(name) || 0);
        const next = await decode(blob);
        if (bitmap && bitmap.close) bitmap.close();
        bitmap = next;
        pictureNumber = head('x-number');
        // The way there and back, too: never younger than it is.
        pictureAge = head('x-age-ms') + Math.max(0, came - asked - head('x-held-ms'));
        pictureBorn = came - pictureAge;
        ages.push(now() - pictureBorn); if (ages.length > 2000) ages.shift();
        draw();
        // Half of the link at most: what to do comes first.
        await pause(Math.min(1000, came - asked - head('x-held-ms')));
      } catch (e) { await pause(300); /* Half a picture: the next one. */ }
    } else if (!answer || answer.status !== 204) await pause(300);
    clearTimeout(patience);
  }
}
const wantsPicture = () => shown === 'guide' && !!live && (live.stage === 'guiding' || live.stage === 'adjusting') && !document.body.classList.contains('big') && !document.hidden;
function forgetPicture() { forget(); pictureBorn = pictureAge = null; }
function decode(blob) {
  if (window.createImageBitmap) return createImageBitmap(blob);
  return new Promise((done, failed) => {
    const image = new Image(), url = URL.createObjectURL(blob);
    image.onload = () => { URL.revokeObjectURL(url); done(image); };
    image.onerror = () => { URL.revokeObjectURL(url); failed(new Error('picture')); };
    image.src = url;
  });
}
let had = { link: true, picture: true }, pausedSince = null;
const PAUSED_AGAIN = 30000;
setInterval(() => {
  if (!key || !started) return;
  if (now() - lastBytes > 2000 && stream) stream.abort();
  const isLinked = linked() || !live;
  // A slow link's pictures are older, and come less often. In a pause, pictures that wait to be judged don't come.
  const isFresh = !wantsPicture() || live.paused || (pictureBorn !== null && now() - pictureBorn < 1000 + 3 * pictureAge);
  el('stale').hidden = isFresh;
  say(el('age'), pictureBorn === null || !isFresh ? '' : 'picture ' + Math.round(pictureAge) + ' ms old');
  if (isLinked !== had.link) { had.link = isLinked; if (!isLinked) loseLink(); else { forgetPicture(); back('Connected again'); paint(); } }
  // Without a picture, the link may be gone, too: that is known in a moment, and says more.
  const isSure = isFresh || !isLinked || now() - lastBytes < 700;
  if (isFresh !== had.picture && isSure) { had.picture = isFresh; if (!isFresh && isLinked && pictureBorn !== null) lose('No picture'); }
  const isPaused = isLinked && !!live && live.stage === 'guiding' && live.paused;
  if (!isPaused) pausedSince = null;
  else if (pausedSince === null) pausedSince = now();
  else if (now() - pausedSince > PAUSED_AGAIN) { pausedSince = now(); lose('Still paused'); }
}, 100);
function loseLink() { lose('Connection lost'); paint(); }
function back(text) { queue.offer(now() / 1000, { rank: 'back', text, mirrored: text }); }
function lose(text) { queue.offer(now() / 1000, { rank: 'lost', text, mirrored: text }); buzz([200, 100, 200]); }

// ---- Commands and files.
async function command(body, path) {
  for (let tries = 0; tries < 4; tries++) {
    const controller = new AbortController(), patience = timeout(2500, controller);
    const answer = await request(path || '/api/command', body, key, controller.signal);
    clearTimeout(patience);
    if (answer && answer.ok) return true;
    if (answer && answer.status !== 503) { toast((await answer.text()).trim()); return false; }
    if (!answer) { toast('No connection. Try again.'); return false; }
    await pause(200);
  }
  toast('The session is busy. Try again.');
  return false;
}
async function fetchFile(file, n) {
  const answer = await request('/api/file/' + n, null, key);
  if (!answer || !answer.ok) return toast('Could not fetch the file. Try again.');
  const blob = await answer.blob();
  await deliver(blob, file.name);
}
addEventListener('hashchange', () => location.reload());
// A page that the browser keeps in the background would keep its connections, of which a browser has few.
addEventListener('pagehide', () => { for (const open of [stream, asking]) if (open) open.abort(); });
say(el('kept'), 'Everything is stored on the computer at the camera, too.');
el('code').hidden = false;
if (Element.prototype.replaceChildren) {
  say(el('closedwhat'), 'Connecting…'); say(el('closedwhy'), '');
  enter().then(ok => { if (ok) { el('silent').checked = !speaks; paint(); follow(); pictures(); } });
}
