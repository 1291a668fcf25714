
// ---- One worker sees and decides; this thread shows.
const FILES = 'files', DICTIONARIES = [], CALIBRATION = /\.(ya?ml|xml|json|cameramodel|xmp|txt)$/i;
const worker = new Worker(URL.createObjectURL(new Blob([el('seeing').textContent], { type: 'text/javascript' })));
const video = el('video'), stats = { shown: 0, judged: 0, looks: [] };
let ready = false, busy = false, source = null, request = null;
role = 'owner';
const entered = () => ready;
const lacks = () => null;
function closed(what, why) {
  ready = false;
  release();
  say(el('closedwhat'), what); say(el('closedwhy'), why);
  show('closed');
}
worker.onerror = e => closed('The page has failed', (e.message || 'Its worker ended') + '. Load it again.');
const answers = {
  ready({ dictionaries }) { DICTIONARIES.push(...dictionaries); ready = true; el('silent').checked = !speaks; offerSources(); },
  failed({ why }) {
    release();
    if (!ready) return closed('This browser can’t show the page', why + '. It needs WebAssembly with SIMD: use a browser of the last three years.');
    wait([why, 'Start again']);
  },
  events({ events, took, over }) {
    busy = false;
    if (took !== undefined) { stats.judged++; stats.looks.push(took); if (stats.looks.length > 2000) stats.looks.shift(); }
    for (const [name, value] of events) receive(name, value);
    if (live && live.stage === 'ended') release();
    paint();
    // Every picture counts for a judgement.
    if (over && !(source && source.given)) end();
    if (source && source.next) source.next();
  },
  judged({ judged }) { wait([judged.message, judged.action.replace(/\.$/, ''), ...judged.doubts]); },
  file({ bytes, type, name }) { deliver(new Blob([bytes], { type }), name); },
};
worker.onmessage = e => answers[e.data.what](e.data);
function tell(what, message, moved) { worker.postMessage(Object.assign({ what }, message), moved || []); }

// ---- Sources: cameras, and files.
async function offerSources(trouble) {
  const media = navigator.mediaDevices;
  const devices = media && media.enumerateDevices ? (await media.enumerateDevices().catch(() => [])).filter(d => d.kind === 'videoinput') : [];
  const cameras = devices.map((d, n) => ({ source: 'camera:' + d.deviceId, name: d.label || 'Camera ' + (n + 1) }));
  if (!cameras.length && !trouble) trouble = media ? ['No camera found', 'Plug one in and load the page again, or choose pictures or a video'] : ['The browser gives this page no camera', 'Open it from this computer: boresight web, or the file itself'];
  cameras.push({ source: FILES, name: 'Pictures, a video, or a calibration …' });
  const last = JSON.parse(store.getItem('request') || 'null') || { board: [9, 6], square_m: .025, plan: 'adaptive' };
  wait(trouble || null, { cameras, dictionaries: DICTIONARIES, last });
}
let offering = null;
function wait(trouble, offer) {
  offering = Object.assign({}, offer || offering, { trouble });
  plan = ended = told = null; missed = 0;
  live = { stage: 'waiting', offer: offering, sentence: ['', ''], sign: [null, null], views: 0, taken: 0 };
  paint();
}
async function start(chosen) {
  request = chosen;
  store.setItem('request', JSON.stringify(chosen));
  if (chosen.source !== FILES) return camera();
  el('chosen').value = '';
  el('chosen').onchange = () => files([...el('chosen').files]);
  el('chosen').click();
}
async function camera() {
  const [width, height] = el('size').value.split('x').map(Number), deviceId = request.source.slice(7);
  try {
    const stream = await navigator.mediaDevices.getUserMedia({ audio: false, video: Object.assign({ width: { ideal: width }, height: { ideal: height }, frameRate: { ideal: 30 }, resizeMode: 'none' }, deviceId ? { deviceId: { exact: deviceId } } : {}) });
    const [track] = stream.getVideoTracks();
    track.onended = () => end('ended');
    video.srcObject = stream;
    await stream_of(track.label || 'camera');
  } catch (e) { release(); wait([e.name === 'NotAllowedError' ? 'The browser may not use the camera' : 'The camera can’t be opened (' + e.message + ')', e.name === 'NotAllowedError' ? 'Allow it beside the address, then start again' : 'Close other programs that use it, then start again']); }
}
async function files(list) {
  const film = list.find(file => file.type.startsWith('video/')), file = list.find(file => CALIBRATION.test(file.name));
  const given = file && { name: file.name, text: await file.text() }, pictures = list.filter(other => other !== file);
  if (given && !pictures.length) return tell('judge', given);
  if (!film) return photographs(pictures.sort((a, b) => a.name.localeCompare(b.name, 'en', { numeric: true })), given);
  video.srcObject = null;
  video.src = URL.createObjectURL(film);
  video.onended = () => end('ended');
  try { await stream_of(film.name, given); } catch (e) { release(); wait(['The browser can’t play ' + film.name, 'Convert it to MP4 (H.264) or WebM']); }
}
const asked = () => Object.assign({}, request, { source: 'browser:' + source.name });
async function stream_of(name, given) {
  source = { name, given };
  await video.play();
  begun({ width: video.videoWidth, height: video.videoHeight, photographs: false });
  bitmap = video;
  each();
}
function begun(size) {
  const again = live && live.stage === 'ended';
  live = Object.assign(live || {}, { stage: 'starting' });
  if (again) tell('command', { command: { command: 'more' } });
  else tell('start', Object.assign({ request: asked(), all: el('all').checked, given: source.given }, size));
  el('stale').hidden = true;
  paint();
}
// Each picture is shown; the newest is judged whenever the worker waits.
let last = -1;
function each(_, picture) {
  if (!source) return;
  if (video.requestVideoFrameCallback) video.requestVideoFrameCallback(each); else requestAnimationFrame(() => each(0, { mediaTime: video.currentTime }));
  if (!picture || picture.mediaTime === last) return;
  stats.shown++;
  drawSoon();
  if (busy || source.ending) return;
  last = picture.mediaTime;
  judge(picture.mediaTime);
}
async function judge(seconds) {
  busy = true;
  const frame = window.VideoFrame ? new VideoFrame(video) : await createImageBitmap(video);
  tell('look', { frame, seconds }, [frame]);
}
async function photographs(list, given) {
  if (!list.length) return;
  source = { name: list.length + ' pictures', next: null, given };
  let at = 0;
  const bytes = async () => new Uint8Array(await list[at].arrayBuffer());
  tell('size', { bytes: await bytes() });
  answers.size = ({ width, height }) => { begun({ width, height, photographs: true }); };
  source.next = async () => {
    if (at >= list.length) return end('ended');
    const name = list[at].name, file = await bytes();
    forget();
    bitmap = await createImageBitmap(list[at]).catch(() => null);
    at++;
    tell('look', { file, name });
  };
}
function release() {
  if (video.srcObject) for (const track of video.srcObject.getTracks()) { track.onended = null; track.stop(); }
  if (video.src) URL.revokeObjectURL(video.src);
  video.onended = null;
  video.srcObject = null; video.removeAttribute('src');
  bitmap = source = null; busy = false; last = -1;
}

// ---- What the buttons ask for.
async function command(body, path) {
  if (path === '/api/start') { start(body); return true; }
  switch (body.command) {
    case 'end': end(); break;
    case 'leave': offerSources(); break;
    case 'more': start(request); break;
    default: tell('command', { command: body });
  }
  return true;
}
function end(how) {
  if (!source || source.ending) return;
  Object.assign(source, { ending: true, next: null });
  tell(how || 'end');
}
function fetchFile(file, number) { tell('file', { number, name: file.name }); }
setInterval(() => {
  const since = stats.since || { at: now(), shown: 0, judged: 0 }, secs = (now() - since.at) / 1000;
  if (secs < 1) { stats.since = since; return; }
  stats.rate = [(stats.shown - since.shown) / secs, (stats.judged - since.judged) / secs];
  stats.since = { at: now(), shown: stats.shown, judged: stats.judged };
  say(el('age'), source ? Math.round(stats.rate[1]) + ' pictures judged a second' : '');
}, 250);
el('ask').firstElementChild.append(el('promise'));
el('start').before(el('about'));
say(el('kept'), 'This page keeps nothing: download what you need before you close it. The browser couldn’t lock the focus. If the camera has autofocus, calibrate again with it switched off.');
say(el('closedwhat'), 'Getting ready …'); say(el('closedwhy'), '');
const packed = el('engine').textContent.trim();
tell('load', { packed });
