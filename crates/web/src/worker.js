'use strict';
// The worker: it holds the session, and answers every message with one of its own.
let guide = null, memory = null, canvas = null;
const answer = (what, message, moved) => postMessage(Object.assign({ what }, message), moved || []);
async function unpacked(text) {
  const bytes = Uint8Array.from(atob(text), c => c.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'))).arrayBuffer();
}
function events(text, took) {
  answer('events', { events: JSON.parse(text), took, over: guide.is_over() && took !== undefined });
}
// Room for a picture's bytes. Asking for it may grow the memory, and then its old buffer is gone.
function room(size) { const at = guide.room(size); return new Uint8Array(memory.buffer, at, size); }
// The first plane of these is the brightness, without gaps between its rows.
const PLANES = /^(I4\d\d|NV12)/, COLOURS = /^(RGB|BGR)[AX]$/;
async function look({ frame, seconds }) {
  const began = performance.now(), width = frame.displayWidth || frame.width, height = frame.displayHeight || frame.height;
  try {
    const format = frame.format || '';
    if (PLANES.test(format) || COLOURS.test(format)) {
      const size = frame.allocationSize();
      await frame.copyTo(room(size));
      return [COLOURS.test(format) ? guide.look_coloured(seconds, format.startsWith('B')) : guide.look(seconds), performance.now() - began];
    }
    if (!canvas) canvas = new OffscreenCanvas(width, height).getContext('2d', { willReadFrequently: true });
    Object.assign(canvas.canvas, { width, height });
    canvas.drawImage(frame, 0, 0);
    const { data } = canvas.getImageData(0, 0, width, height);
    room(data.length).set(data);
    return [guide.look_coloured(seconds, false), performance.now() - began];
  } finally { frame.close(); }
}
const does = {
  async load({ packed }) {
    memory = (await wasm_bindgen({ module_or_path: await unpacked(packed) })).memory;
    answer('ready', { dictionaries: JSON.parse(wasm_bindgen.dictionaries()) });
  },
  size({ bytes }) { const [width, height] = wasm_bindgen.size_of(bytes); answer('size', { width, height }); },
  judge({ name, text }) { answer('judged', { judged: JSON.parse(wasm_bindgen.judged_alone(name, text)) }); },
  start({ request, width, height, photographs, all, given }) {
    if (guide) guide.free();
    guide = new wasm_bindgen.Guide(JSON.stringify(request), width, height, photographs, all);
    if (given) guide.judges(given.name, given.text);
    answer('events', { events: [['live', JSON.parse(guide.begin())]] });
  },
  async look(message) {
    if (!message.file) return events(...await look(message));
    const began = performance.now(), text = guide.look_at_file(message.file, message.name);
    events(text, performance.now() - began);
  },
  command({ command }) { events(guide.command(JSON.stringify(command))); },
  ended() { events(guide.source_ended()); does.end(); },
  end() { events(guide.end()); },
  file({ number, name }) { const bytes = guide.file(number); answer('file', { bytes, type: guide.media_type(number), name }, [bytes.buffer]); },
};
// One after the other: a picture is judged before the next message is read.
let turn = Promise.resolve();
onmessage = e => { turn = turn.then(() => does[e.data.what](e.data)).catch(err => answer('failed', { why: err && err.message || String(err) })); };
