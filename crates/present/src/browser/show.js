'use strict';
// What every page has. A page's own script follows and defines: `entered()`, whether there's something to show;
// `lacks()`, what keeps the newest state away, or null; `command(body, path)`; and `fetchFile(file, number)`.
const el = id => document.getElementById(id);
const now = () => performance.now();
const store = (() => { try { return window.localStorage; } catch (e) { return { getItem() { return null; }, setItem() {}, removeItem() {} }; } })();

// ---- What is seen.
let role = 'watcher';
let live = null, plan = null, ended = null, told = null, started = false, sheetOpen = false;
let stands = store.getItem('mirrored'), mirrored = stands !== 'no', speaks = store.getItem('silent') !== 'yes', big = store.getItem('big') === 'yes';
const pages = ['guide', 'ask', 'sheet', 'result', 'wait', 'closed'];
let shown = 'closed';
function show(page) {
  if (page === shown) return;
  shown = page;
  for (const id of pages) el(id).hidden = id !== page;
  if (page === 'guide') { fit.last = null; drawSoon(); }
}
function choosePage() {
  if (!entered()) return;
  if (!started) { ask(); return show('ask'); }
  if (!live) return show('guide');
  if (live.stage === 'waiting') return show('wait');
  if (live.stage === 'ended' && ended) return show('result');
  show(sheetOpen ? 'sheet' : 'guide');
}
// Where the person stands is asked once; a browser wants a tap for the voice each time.
function ask() {
  const known = stands !== null;
  say(el('askwhat'), known ? 'Tap to go on' : 'Where do you stand?');
  say(el('askwhy'), known ? 'Turns on the voice.' : 'So that left and right are yours. Turns on the voice, too.');
  for (const [id, is, text] of [['facing', mirrored, 'I face the camera'], ['behind', !mirrored, 'I’m behind the camera']]) {
    el(id).classList.toggle('main', known ? is : id === 'facing');
    say(el(id), known && is ? 'Go on: ' + text : text);
  }
}
const side = pair => pair[mirrored ? 1 : 0];
function say(where, text) { if (where.textContent !== text) where.textContent = text; }
function paint() {
  choosePage();
  document.body.classList.toggle('watcher', role !== 'owner');
  const pushing = !!live && live.stage === 'adjusting';
  document.body.classList.toggle('big', big && !pushing);
  document.body.classList.toggle('adjust', pushing);
  document.body.classList.toggle('led', !!live && !!live.led);
  if (!live) return;
  const lack = lacks(), lost = !!lack && lack.lost;
  const elsewhere = lost && (shown === 'wait' || shown === 'result' || shown === 'sheet');
  el('gone').hidden = !elsewhere;
  if (elsewhere) say(el('gone'), shown === 'result' ? lack.result : lack.why);
  if (shown === 'guide') {
    el('words').dataset.tone = lack ? 'bad' : live.tone;
    say(el('sentence'), lack ? lack.what : side(live.sentence));
    say(el('arrow'), pushing && !lost ? side(live.push[0]) : '');
    say(el('number'), pushing && !lost ? live.push[1] : '');
    // The board in the air shows the tip.
    const wanted = side(live.sign);
    sign(lack || pushing || (wanted && wanted.kind === 'tip' && live.card && !big) ? null : wanted);
    fit();
    say(el('views'), String(live.views));
    say(el('counted'), live.led ? 'Places' : 'Views');
    say(el('pause'), live.paused ? 'Resume' : 'Pause');
    el('undo').disabled = !live.views;
    const guiding = live.stage === 'guiding' && !lost;
    for (const id of ['pause', 'take', 'end']) el(id).disabled = !guiding;
    if (!guiding) el('undo').disabled = true;
    const doubt = !lack && live.stage === 'guiding' && live.doubt;
    el('doubt').hidden = !doubt;
    say(el('doubt'), doubt ? doubt[0] : '');
    const trouble = lack ? lack.why : live.trouble ? live.trouble.filter(Boolean).join('. ') : '';
    el('trouble').hidden = !trouble;
    say(el('trouble'), trouble);
    const tag = [live.led, live.simulated ? 'SIMULATED' : null].filter(Boolean).join(' · ');
    say(el('tag'), tag);
    el('tag').hidden = !tag;
    el('sound').setAttribute('aria-pressed', speaks);
    drawSoon();
  }
  if (shown === 'sheet') views();
  if (shown === 'wait') offer();
}
function fit() {
  const box = el('words'), text = el('sentence'), beside = el('sign').hidden ? 0 : el('sign').offsetWidth + 10, is = text.textContent + box.clientWidth + 'x' + box.clientHeight + '+' + beside, room = box.clientHeight - 12 - el('push').offsetHeight;
  if (fit.last === is) return;
  fit.last = is;
  let low = 18, high = live && live.push ? 56 : 240;
  while (high - low > 1) {
    const size = (low + high) >> 1;
    text.style.fontSize = size + 'px';
    if (text.scrollWidth <= box.clientWidth - 20 - beside && text.offsetHeight <= room) low = size; else high = size;
  }
  text.style.fontSize = low + 'px';
}

// The sign of the movement: a card and the way of its far edge, an arrow, or a square that grows or shrinks.
function sign(movement) {
  const canvas = el('sign');
  canvas.hidden = !movement;
  if (!movement) return;
  const px = Math.round(canvas.clientWidth * (window.devicePixelRatio || 1)), half = px / 2, width = .07 * px;
  canvas.width = canvas.height = px;
  const c = canvas.getContext('2d');
  c.translate(half, half); c.lineWidth = width; c.lineJoin = 'round';
  c.strokeStyle = c.fillStyle = getComputedStyle(document.documentElement).getPropertyValue('--ink');
  const line = points => { c.beginPath(); for (const [x, y] of points) c.lineTo(x * half, y * half); };
  const arrow = (from, to) => {
    const way = Math.atan2(to[1] - from[1], to[0] - from[0]), head = 3.2 * width / half, wide = 1.9 * width / half;
    const base = [to[0] - head * Math.cos(way), to[1] - head * Math.sin(way)], across = [-wide * Math.sin(way), wide * Math.cos(way)];
    line([from, base]); c.stroke();
    line([to, [base[0] + across[0], base[1] + across[1]], [base[0] - across[0], base[1] - across[1]]]); c.fill();
  };
  if (movement.kind === 'tip' || movement.kind === 'shift') c.rotate(movement.towards_rad);
  if (movement.kind === 'tip') {
    line([[-.9, -.85], [.25, -.5], [.25, .5], [-.9, .85]]); c.closePath(); c.globalAlpha = .25; c.fill(); c.globalAlpha = 1; c.stroke();
    arrow([-.35, 0], [1, 0]);
  } else if (movement.kind === 'shift') arrow([-.9, 0], [.95, 0]);
  else {
    line([[-.25, -.25], [.25, -.25], [.25, .25], [-.25, .25]]); c.closePath(); c.stroke();
    for (const [x, y] of [[1, 1], [1, -1], [-1, 1], [-1, -1]]) {
      const way = [[.35 * x, .35 * y], [.85 * x, .85 * y]];
      arrow(...(movement.kind === 'nearer' ? way : way.reverse()));
    }
  }
}

// ---- The live picture with the pose to show.
let bitmap = null, drawing = false;
function drawSoon() { if (!drawing) { drawing = true; requestAnimationFrame(() => { drawing = false; draw(); }); } }
function mix(a, b, t) { return a.map((v, i) => Math.round(v + (b[i] - v) * t)); }
const GREY = [150, 150, 150], AMBER = [255, 185, 46], GREEN = [67, 209, 124];
function approach(share) { return mix(AMBER, GREEN, share); }
const css = (rgb, a) => 'rgba(' + rgb.join(',') + ',' + (a === undefined ? 1 : a) + ')';
function draw() {
  if (shown !== 'guide') return;
  const canvas = el('canvas'), size = plan ? plan.size : bitmap ? [bitmap.width, bitmap.height] : [1280, 720];
  const ratio = Math.min(2, window.devicePixelRatio || 1);
  const box = el('live').getBoundingClientRect();
  const tiny = window.matchMedia('(max-height: 280px), (max-width: 240px)').matches;
  const room = tiny ? box.width : window.matchMedia('(orientation: landscape)').matches ? Math.min(box.width, box.height * size[0] / size[1]) : Math.min(box.width, .3 * innerHeight * size[0] / size[1]);
  const width = Math.max(160, Math.round(room)), height = Math.round(width * size[1] / size[0]);
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio);
    canvas.style.width = width + 'px'; canvas.style.height = height + 'px';
    fit(); // What the picture takes, the sentence loses.
  }
  const c = canvas.getContext('2d'), k = canvas.width / size[0];
  c.setTransform(mirrored ? -1 : 1, 0, 0, 1, mirrored ? canvas.width : 0, 0);
  c.fillStyle = '#000'; c.fillRect(0, 0, canvas.width, canvas.height);
  if (bitmap) c.drawImage(bitmap, 0, 0, canvas.width, canvas.height);
  if (live && live.stage === 'adjusting' && plan) outline(c, k);
  if (!live || live.stage !== 'guiding') return;
  const path = (points, close) => { c.beginPath(); points.forEach((p, i) => i ? c.lineTo(p[0] * k, p[1] * k) : c.moveTo(p[0] * k, p[1] * k)); if (close) c.closePath(); };
  const unit = Math.max(1, canvas.height / 360);
  const close = live.close || 0, ghost = plan && plan.ghost;
  const around = points => points.map((p, i) => [p, points[(i + 1) % points.length]]);
  if (ghost && live.card) {
    // The card's rim, thick where it's near; its face leaves the picture clear.
    const near = Math.pow(close, 3), rgb = live.moment === 'match' ? approach(near) : AMBER;
    c.lineCap = c.lineJoin = 'round';
    for (const [wider, style] of [[2 * unit, 'rgba(0,0,0,.7)'], [0, css(rgb)]]) {
      for (const [a, b] of around(ghost.rim)) {
        const nearness = (a[2] + b[2]) / 2;
        c.lineWidth = unit * (1.5 + 4.5 * nearness * nearness) + wider; c.strokeStyle = style;
        path([a, b]); c.stroke();
      }
    }
  }
  if (live.board) {
    const trace = live.hold === null ? [] : traced(live.board, live.hold);
    for (const [points, width, style] of [[live.board, 1.5, '#fff'], [trace, 5, css(GREEN)]]) {
      for (const [wider, colour] of [[2 * unit, 'rgba(0,0,0,.7)'], [0, style]]) {
        c.lineWidth = unit * width + wider; c.strokeStyle = colour; path(points, points !== trace); c.stroke();
      }
    }
  }
  air();
}
// The first part of the way around `rim`, as long as the share of the hold that has passed.
function traced(rim, share) {
  const ends = rim.concat([rim[0]]), far = ends.slice(1).map((p, i) => Math.hypot(p[0] - ends[i][0], p[1] - ends[i][1]));
  let left = share * far.reduce((a, b) => a + b, 0);
  const points = [ends[0]];
  for (let i = 0; i < far.length && left > 0; left -= far[i++]) {
    const t = Math.min(1, left / (far[i] || 1));
    points.push([0, 1].map(j => ends[i][j] + t * (ends[i + 1][j] - ends[i][j])));
  }
  return points;
}
// The board in the air: it swings from the present pose to the wanted one, in the ring of the eight directions.
const still = window.matchMedia('(prefers-reduced-motion: reduce)'), SWING = [.9, 1.1, .3];
function swing(at) {
  const [there, stay, back] = SWING, ease = t => t * t * (3 - 2 * t);
  at %= there + stay + back;
  return at < there ? ease(at / there) : at < there + stay ? 1 : 1 - ease((at - there - stay) / back);
}
function air() {
  const box = el('air').getBoundingClientRect(), canvas = el('board3d'), ratio = Math.min(2, window.devicePixelRatio || 1);
  const side = Math.round(Math.min(box.width, box.height)), px = Math.round(side * ratio);
  if (!px || !plan) return;
  if (canvas.width !== px) { canvas.width = canvas.height = px; canvas.style.width = canvas.style.height = side + 'px'; }
  const c = canvas.getContext('2d'), r = .46 * px, flip = mirrored ? -1 : 1, unit = r / 165;
  const ink = name => getComputedStyle(document.documentElement).getPropertyValue(name);
  c.setTransform(1, 0, 0, 1, px / 2, px / 2); c.clearRect(-px, -px, 2 * px, 2 * px); c.lineCap = 'round';
  c.lineWidth = 2 * unit; c.strokeStyle = ink('--green');
  const at = a => [flip * .95 * r * Math.cos(a), .95 * r * Math.sin(a)];
  for (const pair of plan.pairs) { c.beginPath(); for (const a of pair) c.lineTo(...at(a)); c.stroke(); }
  for (const slot of plan.wheel) {
    const middle = mirrored ? Math.PI - slot.slot_rad : slot.slot_rad;
    c.lineWidth = (slot.wanted ? 8 : slot.view !== null ? 5 : 2.5) * unit;
    c.strokeStyle = ink(slot.wanted ? '--amber' : slot.view !== null ? '--green' : '--dim');
    c.beginPath(); c.arc(0, 0, r, middle - Math.PI / 10, middle + Math.PI / 10); c.stroke();
  }
  const ghost = plan.ghost;
  if (!ghost || !live.card) return;
  const corners = rim => [0, 1, 2, 3].map(i => rim[i * rim.length / 4]).map(p => [flip * p[0], p[1], p[2]]);
  const bounds = quad => [0, 1].map(j => [Math.min(...quad.map(p => p[j])), Math.max(...quad.map(p => p[j]))]);
  const longest = quad => Math.max(1e-3, ...bounds(quad).map(([low, high]) => high - low));
  const sized = (quad, reach) => { const k = reach / longest(quad), m = bounds(quad).map(([low, high]) => (low + high) / 2); return widened(quad.map(p => [k * (p[0] - m[0]), k * (p[1] - m[1]), p[2]])); };
  // A steep board is no sliver: it's stretched across its narrowest direction.
  const widened = quad => {
    const extent = ([x, y]) => { const all = quad.map(p => x * p[0] + y * p[1]); return Math.max(...all) - Math.min(...all); };
    const across = (a, b) => { const [x, y] = [a[1] - b[1], b[0] - a[0]], far = Math.hypot(x, y) || 1; return [x / far, y / far]; };
    const way = quad.flatMap((a, i) => quad.slice(i + 1).map(b => across(a, b))).reduce((a, b) => extent(b) < extent(a) ? b : a);
    const more = Math.max(0, 60 / 165 * r / Math.max(1e-3, extent(way)) - 1), off = p => more * (way[0] * p[0] + way[1] * p[1]);
    return quad.map(p => [p[0] + off(p) * way[0], p[1] + off(p) * way[1], p[2]]);
  };
  let wanted = corners(ghost.rim), now3 = live.board && corners(live.board);
  // Attitudes are compared at one size, unless the size is what's wrong.
  const sign = (live.sign || [])[mirrored ? 1 : 0], sizes = now3 && sign && (sign.kind === 'nearer' || sign.kind === 'farther');
  const share = sizes ? Math.min(1, Math.max(.45, longest(now3) / longest(wanted))) : 1;
  now3 = now3 && sized(now3, 1.5 * r * share); wanted = sized(wanted, 1.5 * r);
  const t = still.matches || !now3 ? 1 : swing(now() / 1000);
  const quad = now3 ? now3.map((p, i) => p.map((v, j) => v + t * (wanted[i][j] - v))) : wanted;
  const to = projection(quad), [columns, rows] = ghost.squares;
  const light = (x, y) => { const [a, b, d, e] = quad.map(p => p[2]); return .54 + .46 * Math.min(1, Math.max(0, (a + x * (b - a)) * (1 - y) + (e + x * (d - e)) * y)); };
  const patch = (x0, y0, x1, y1, rgb) => {
    c.fillStyle = css(rgb.map(v => Math.round(v * light((x0 + x1) / 2, (y0 + y1) / 2))));
    c.beginPath(); for (const p of [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]) c.lineTo(...to(...p)); c.closePath(); c.fill();
  };
  // The paper in strips: its light falls towards the far edge.
  for (let i = 0; i < 8; i++) for (let j = 0; j < 8; j++) patch(i / 8, j / 8, Math.min(1, (i + 1.05) / 8), Math.min(1, (j + 1.05) / 8), [244, 246, 248]);
  const place = (index, count) => (index + .4) / (count + .8);
  for (let y = 0; y < rows; y++) for (let x = y % 2; x < columns; x += 2) patch(place(x, columns), place(y, rows), place(x + 1, columns), place(y + 1, rows), [17, 22, 26]);
  for (const [rim, width, style] of [[quad, 4, css(AMBER)], [now3, 1.5, ink('--ink')]]) {
    if (!rim) continue;
    c.lineWidth = width * unit; c.lineJoin = 'round'; c.strokeStyle = style;
    c.beginPath(); for (const p of rim) c.lineTo(p[0], p[1]); c.closePath(); c.stroke();
  }
}
// From the unit square to a quadrilateral, as a camera does. Heckbert 1989, section 2.2.3.
function projection([p0, p1, p2, p3]) {
  const of = f => [0, 1].map(f), sum = of(j => p0[j] - p1[j] + p2[j] - p3[j]), d1 = of(j => p1[j] - p2[j]), d2 = of(j => p3[j] - p2[j]);
  const cross = (a, b) => a[0] * b[1] - b[0] * a[1], determinant = cross(d1, d2);
  const [g, h] = Math.abs(determinant) < 1e-6 ? [0, 0] : [cross(sum, d2) / determinant, cross(d1, sum) / determinant];
  const x = of(j => p1[j] - p0[j] + g * p1[j]), y = of(j => p3[j] - p0[j] + h * p3[j]);
  return (u, v) => of(j => (p0[j] + u * x[j] + v * y[j]) / (1 + g * u + h * v));
}
// The scene's edges where they should be: where they meet those of the picture, the camera points where it should.
function outline(c, k) {
  const dot = Math.max(1.5, 1.2 * k);
  for (const [wider, style] of [[1, 'rgba(0,0,0,.55)'], [0, css(live.close === null ? GREY : approach(live.close))]]) {
    c.fillStyle = style;
    for (const [x, y] of plan.outline) c.fillRect((x + .5) * k - dot / 2 - wider, (y + .5) * k - dot / 2 - wider, dot + 2 * wider, dot + 2 * wider);
  }
}
// ---- What is told.
function receive(name, value) {
  if (name === 'live') { if (value.stage === 'starting') forget(); live = value; tellTaken(); if (live.say && started && !lacks()) queue.offer(now() / 1000, live.say); }
  if (name === 'plan') {
    if (value.board && (!plan || plan.board !== value.board)) toast(value.board);
    plan = value;
  }
  if (name === 'ended') { ended = value; result(); if (ended && started && live && live.stage !== 'ended') news({ rank: 'taken', text: ended.aloud, mirrored: ended.aloud, age_ms: 0 }); }
  // Noted before all else: whatever is cut off from here on, this isn't told again.
  if (name === 'news') { if (value.view) told = value.view; news(value); }
}
// A view that no news told of was taken while the page was away, perhaps by an earlier start of boresight.
function tellTaken() {
  if (told !== null && live.taken > told) missed += live.taken - told;
  told = live.taken;
}
// What was seen before an absence isn't the picture now, and nobody has lost it.
function forget() {
  if (bitmap && bitmap.close) bitmap.close();
  bitmap = null;
}
setInterval(() => { if (started) voice(); }, 100);

// ---- Speech. The same rules as speech/queue.rs.
const RANKS = { guidance: 0, hold: 1, back: 2, lost: 3, taken: 4 }, STALE = 1, GAP = 2, REPEAT = 8;
const queue = {
  news: [], request: null, speaking: null, said: null, guided: -1e9,
  isNews: word => RANKS[word.rank] >= RANKS.back,
  offer(at, word) {
    if (this.isNews(word)) {
      this.request = this.said = null;
      if (word.rank !== 'taken') {
        const isUnheard = this.news.some(n => n.word.rank === 'lost');
        this.news = this.news.filter(n => n.word.rank === 'taken');
        if (word.rank === 'back' && isUnheard) return;
      }
      this.news.push({ at, word });
    }
    else if (this.said && this.said.word.text === word.text && at - this.said.at < REPEAT) this.request = null;
    else if (!this.request || this.request.word.text !== word.text || at - this.request.at > .4) this.request = { at, word };
  },
  next(at) {
    if (this.request && at - this.request.at > STALE) this.request = null;
    const cuts = this.speaking !== null;
    if (this.news.length) {
      if (cuts && this.isNews(this.speaking)) return null;
      const highest = Math.max(...this.news.map(n => RANKS[n.word.rank]));
      const first = this.news.findIndex(n => RANKS[n.word.rank] === highest);
      const [item] = this.news.splice(first, 1);
      this.speaking = item.word;
      return { word: item.word, waited: at - item.at, cuts };
    }
    if (!this.request) return null;
    const { at: since, word } = this.request;
    if (word.rank === 'guidance' && at - this.guided < GAP) return null;
    if (cuts && RANKS[this.speaking.rank] >= RANKS[word.rank]) return null;
    this.request = null;
    if (word.rank === 'guidance') this.guided = at;
    this.speaking = word; this.said = { at, word };
    return { word, waited: at - since, cuts };
  },
  finished(word) { if (this.speaking === word) this.speaking = null; }
};
const spoken = [];
let missed = 0;
function news(item) {
  if (!started) return;
  // One sentence sums up what happened while the link was down; the counts are right at once.
  if (item.view && item.age_ms > 1500) { missed++; return; }
  if (item.rank === 'taken') { buzz(80); click(); } else if (item.rank === 'lost') buzz([200, 100, 200]);
  queue.offer(now() / 1000, item);
}
function tellMissed() {
  if (!missed || !started) return;
  const text = missed === 1 ? 'A view was taken meanwhile' : 'Views were taken meanwhile';
  missed = 0;
  queue.offer(now() / 1000, { rank: 'taken', text, mirrored: text });
}
function voice() {
  const step = queue.next(now() / 1000);
  if (!step) return;
  const text = mirrored ? step.word.mirrored : step.word.text;
  spoken.push({ at: now() / 1000, rank: step.word.rank, text, waited: step.waited, cuts: step.cuts });
  if (spoken.length > 2000) spoken.shift();
  const done = () => { queue.finished(step.word); hush(false); };
  if (!speaks || !window.speechSynthesis) { setTimeout(done, 350 + 65 * text.length); return; }
  if (step.cuts) speechSynthesis.cancel();
  hush(true);
  const utter = () => {
    const saying = new SpeechSynthesisUtterance(text);
    saying.lang = 'en-US'; saying.rate = 1.1;
    saying.onstart = () => { saying.began = true; };
    saying.onend = saying.onerror = done;
    queue.utterance = saying; // Some browsers forget it otherwise, and its end with it.
    speechSynthesis.speak(saying);
    return saying;
  };
  const first = utter();
  // A voice that didn't begin is asked once more for news; one that doesn't end mustn't block the next.
  setTimeout(() => { if (!first.began && queue.isNews(step.word) && queue.speaking === step.word) { speechSynthesis.cancel(); first.onend = first.onerror = null; utter(); } }, 700);
  setTimeout(done, 1500 + 110 * text.length);
}

// ---- Tone, click, vibration, and a screen that stays on.
let audio = null, tone = null, gain = null, quiet = false, lock = null;
function wake() {
  if (audio && audio.state === 'suspended') audio.resume();
  if (navigator.wakeLock && document.visibilityState === 'visible') navigator.wakeLock.request('screen').then(l => { lock = l; }, () => {});
}
function begin() {
  const Audio = window.AudioContext || window.webkitAudioContext;
  if (speaks && Audio && !audio) {
    audio = new Audio();
    tone = audio.createOscillator(); gain = audio.createGain();
    gain.gain.value = 0; tone.connect(gain); gain.connect(audio.destination); tone.start();
  }
  // The first words must come from a tap, or the browser keeps the voice shut.
  aloud('Ready');
  setTimeout(() => { const trouble = speaks && noVoice(); if (trouble) toast(trouble); }, 1500);
  wake();
}
function aloud(text) { if (speaks && window.speechSynthesis) speechSynthesis.speak(new SpeechSynthesisUtterance(text)); }
function noVoice() {
  if (!window.speechSynthesis) return 'This browser has no voice.';
  return speechSynthesis.getVoices().length ? '' : 'No voice is installed: look for text-to-speech in the device’s settings.';
}
function hush(is) { quiet = is; }
setInterval(() => {
  if (!audio) return;
  const close = live && (live.stage === 'guiding' || live.stage === 'adjusting') && !live.paused && live.close !== null && !lacks() ? live.close : 0;
  const loud = speaks && !quiet && close > .25 ? .05 : 0;
  gain.gain.setTargetAtTime(loud, audio.currentTime, .06);
  if (close) tone.frequency.setTargetAtTime(200 * Math.pow(4, close), audio.currentTime, .08);
}, 120);
function click() {
  if (!audio || !speaks) return;
  const o = audio.createOscillator(), g = audio.createGain(), t = audio.currentTime;
  o.type = 'square'; o.frequency.value = 1600;
  g.gain.setValueAtTime(.3, t); g.gain.exponentialRampToValueAtTime(.001, t + .07);
  o.connect(g); g.connect(audio.destination); o.start(t); o.stop(t + .08);
}
function buzz(pattern) { if (navigator.vibrate) navigator.vibrate(pattern); }
document.addEventListener('visibilitychange', () => { if (!document.hidden && started) wake(); });
el('awake').textContent = navigator.wakeLock ? '' : 'Without a certificate, this page can’t keep the screen on: set your phone’s screen time-out to its longest.';

// ---- What is asked for.
let toastOver = 0;
// A note has its own place above the page: it covers nothing.
function noted(text) {
  el('toast').hidden = !text; el('toast').textContent = text;
  document.documentElement.style.setProperty('--note', text ? el('toast').offsetHeight + 'px' : '0px');
  fit.last = null; paint();
}
function toast(text) { noted(text); clearTimeout(toastOver); toastOver = setTimeout(() => noted(''), 3500); }
const tap = (id, act) => el(id).addEventListener('click', act);
function stand(facing) {
  mirrored = facing; stands = facing ? 'yes' : 'no'; speaks = !el('silent').checked; started = true;
  store.setItem('mirrored', stands); store.setItem('silent', speaks ? 'no' : 'yes');
  begin(); fit.last = null; paint();
}
tap('doubt', () => toast(live.doubt.filter(Boolean).join('. ')));
tap('facing', () => stand(true));
tap('behind', () => stand(false));
tap('pause', () => command({ command: live && live.paused ? 'resume' : 'pause' }));
tap('undo', () => command({ command: 'undo' }));
tap('take', () => command({ command: 'take_now' }));
let sure = 0;
tap('end', () => {
  if (now() - sure < 4000) { sure = 0; el('end').textContent = 'End'; command({ command: 'end' }); return; }
  sure = now(); el('end').textContent = 'End? Tap again';
  setTimeout(() => { if (now() - sure >= 3900) el('end').textContent = 'End'; }, 4000);
});
tap('sound', () => { speaks = !speaks; store.setItem('silent', speaks ? 'no' : 'yes'); if (speaks) begin(); else if (window.speechSynthesis) speechSynthesis.cancel(); paint(); });
tap('list', () => { sheetOpen = true; paint(); });
tap('close', () => { sheetOpen = false; paint(); });
tap('mirror', () => { sheetOpen = false; started = false; stands = null; paint(); });
tap('bigger', () => { big = !big; store.setItem('big', big ? 'yes' : 'no'); sheetOpen = false; fit.last = null; paint(); });
tap('restore', () => command({ command: 'restore' }));
tap('try', () => {
  say(el('voice'), noVoice());
  if (window.speechSynthesis) speechSynthesis.speak(new SpeechSynthesisUtterance('This is how I sound'));
  click(); buzz(80);
});
tap('again', () => command({ command: 'leave' }));
tap('more', () => command({ command: 'more' }));
// Light or dark as the phone is, unless somebody has chosen.
const sun = window.matchMedia('(prefers-color-scheme: light)');
function colours() {
  const chosen = store.getItem('light'), light = chosen === null ? sun.matches : chosen === 'yes';
  document.documentElement.classList.toggle('light', light);
  say(el('light'), light ? 'Dark page' : 'Bright page, for the sun');
}
if (sun.addEventListener) sun.addEventListener('change', colours);
tap('light', () => { store.setItem('light', document.documentElement.classList.contains('light') ? 'no' : 'yes'); colours(); paint(); });
colours();
// How boards are counted: by their inner corners, by squares or by tags, of which each has two corners in a row.
const BOARDS = {
  '': { what: 'Inner corners', side: 'a square', counted: points => points, points: n => n, counts: [3, 99] },
  charuco: { what: 'Squares', side: 'a square', counted: points => points + 1, points: n => n - 1, counts: [4, 100] },
  aprilgrid: { what: 'Tags', side: 'a tag', counted: points => Math.max(2, Math.round(points / 2)), points: n => 2 * n, counts: [2, 49] },
  circles: { what: 'Circles', side: 'a step from row to row', counted: points => points, points: n => n, counts: [3, 99] },
  acircles: { what: 'Circles', side: 'a step from row to row', counted: points => points, points: n => n, counts: [3, 99] },
};
const ROWS = { circles: 'symmetric', acircles: 'asymmetric' };
let offered = null, countedAs = '';
function offer() {
  say(el('waitwhat'), role === 'owner' ? 'Start a session' : 'Waiting for a session to start');
  const is = JSON.stringify(live.offer);
  if (!live.offer || is === offered) return;
  offered = is;
  const { cameras, last, trouble } = live.offer, chosen = el('camera').value || (last && last.source);
  el('camera').replaceChildren(...cameras.map(camera => { const o = document.createElement('option'); o.value = camera.source; o.textContent = camera.name; return o; }));
  if (cameras.some(camera => camera.source === chosen)) el('camera').value = chosen;
  const known = el('dictionary').value || (last && last.markers && last.markers.dictionary);
  el('dictionary').replaceChildren(...live.offer.dictionaries.map(([name, count]) => { const o = document.createElement('option'); o.value = name; o.textContent = name.replace('DICT_', ''); o.dataset.count = count; return o; }));
  if (known) el('dictionary').value = known;
  if (last && !el('columns').value) {
    const { board, markers, square_m } = last, mm = length => +(1000 * length).toFixed(3);
    el('kind').value = !markers ? '' : markers.tags ? 'aprilgrid' : markers.circles ? Object.keys(ROWS).find(is => ROWS[is] === markers.circles) : 'charuco';
    const { counted } = BOARDS[el('kind').value];
    el('columns').value = counted(board[0]); el('rows').value = counted(board[1]); el('square').value = mm(square_m); el('plan').value = last.plan;
    if (markers && markers.side_m) el('marker').value = mm(markers.side_m);
    if (markers && markers.tags) { el('spacing').value = markers.tags.spacing; el('first').value = markers.tags.first || ''; }
    kind();
  }
  el('trouble2').hidden = !trouble;
  if (trouble) el('trouble2').textContent = trouble.filter(Boolean).join('. ');
}
tap('start', () => {
  const value = id => Number(el(id).value);
  const is = el('kind').value, board = BOARDS[is], [least, most] = board.counts, counts = [value('columns'), value('rows')], square = value('square'), side = value('marker');
  if (!el('camera').value || counts.some(n => !(n >= least && n <= most)) || !(square > 0)) return toast(`Choose a camera, ${least} to ${most} ${board.what.toLowerCase()} each way, and the side of ${board.side}.`);
  const request = { source: el('camera').value, board: counts.map(board.points), square_m: square / 1000, plan: el('plan').value };
  if (is === 'aprilgrid') {
    const spacing = value('spacing') || 0.3, first = value('first');
    if (!(spacing >= 0.1 && spacing <= 0.6)) return toast('Tags are 0.1 to 0.6 of their side apart. Measure both again.');
    if (!(first >= 0 && first + counts[0] * counts[1] <= 587)) return toast('There are tags 0 to 586. Choose fewer, or another first one.');
    request.markers = { dictionary: 'DICT_APRILTAG_36h11', tags: { spacing, first } };
  }
  if (ROWS[is]) request.markers = { dictionary: 'DICT_4X4_50', circles: ROWS[is] };
  if (is === 'charuco') {
    const chosen = el('dictionary').selectedOptions[0], needed = Math.floor(counts[0] * counts[1] / 2);
    if (!chosen) return toast('Choose a dictionary.');
    if (needed > chosen.dataset.count) return toast(`This board has ${needed} markers, and ${chosen.textContent} has ${chosen.dataset.count}. Choose a larger dictionary, or fewer squares.`);
    if (side && !(side >= 0.3 * square && side <= 0.95 * square)) return toast('A marker’s side is 0.3 to 0.95 of a square’s. Measure both again.');
    request.markers = { dictionary: chosen.value };
    if (side) request.markers.side_m = side / 1000;
  }
  command(request, '/api/start');
});
function kind() {
  countedAs = el('kind').value;
  const { what, side } = BOARDS[countedAs];
  el('markers').hidden = countedAs !== 'charuco';
  el('tags').hidden = countedAs !== 'aprilgrid';
  say(el('across'), what + ' across');
  say(el('down'), what + ' down');
  say(el('side'), `Side of ${side}, in mm`);
}
el('kind').addEventListener('change', () => {
  // The same board, counted in the other way.
  const { points } = BOARDS[countedAs], { counted } = BOARDS[el('kind').value];
  for (const id of ['columns', 'rows']) if (el(id).value) el(id).value = counted(points(Number(el(id).value)));
  kind();
});
function item(text, button) { const li = document.createElement('li'), span = document.createElement('span'); span.textContent = text; li.append(span); if (button) li.append(button); return li; }
let listed = null;
function views() {
  const is = JSON.stringify([plan && plan.views, plan && plan.reached, live.led, plan && plan.refused, plan && plan.map, mirrored, role]);
  el('restore').hidden = live.removed === null;
  if (is === listed || !plan) return;
  listed = is;
  el('taken').replaceChildren(...plan.views.map(view => {
    let button = null;
    if (role === 'owner') { button = document.createElement('button'); button.textContent = 'Remove'; button.addEventListener('click', () => command({ command: 'remove', view: view.number })); }
    return item('View ' + view.name + ': ' + side(view.edge) + ' away' + (view.partner ? ', opposite of view ' + view.partner : ', no partner yet'), button);
  }));
  say(el('listing'), live.led ? 'Places' : 'Views');
  if (!plan.views.length && !live.led) el('taken').append(item('No view yet'));
  say(el('board'), [plan.board, plan.reached].filter(Boolean).join(' · '));
  map(plan.map, plan.size, ['sofar', 'sofarhead', 'sofarlegend']);
  el('refused').replaceChildren(...plan.refused.map(([what, share]) => item(what + ': ' + share + ' %')));
}
function result() {
  if (!ended) return;
  sheetOpen = false;
  el('verdict').dataset.verdict = ended.verdict;
  el('what').textContent = ended.what; el('action').textContent = ended.action;
  el('again').hidden = !ended.can_restart;
  // More photos can't mend what isn't trustworthy, and are the way on for what is unfinished.
  el('more').hidden = !ended.can_go_on || ended.verdict === 'bad';
  el('more').classList.toggle('main', ended.verdict === 'unfinished');
  el('again').classList.toggle('main', ended.verdict !== 'unfinished');
  el('lines').replaceChildren(...ended.lines.map(line => { const tr = document.createElement('tr'); for (const text of line) { const td = document.createElement('td'); td.textContent = text; tr.append(td); } return tr; }));
  // A drawing of ours, with its text escaped.
  el('cause').hidden = !ended.cause;
  if (ended.cause) { const [svg, caption] = ended.cause, said = document.createElement('figcaption'); el('cause').innerHTML = svg; said.textContent = caption; el('cause').append(said); }
  el('findings').replaceChildren();
  if (ended.findings.length) { const h = document.createElement('h2'); h.textContent = 'What to know'; el('findings').append(h); }
  for (const [what, action] of ended.findings) { const p = document.createElement('p'), b = document.createElement('b'); b.textContent = what + '. '; p.append(b, action); el('findings').append(p); }
  el('files').replaceChildren(...ended.files.map((file, n) => { const b = document.createElement('button'); b.textContent = file.label; b.addEventListener('click', () => fetchFile(file, n)); return b; }));
  map(ended.map, ended.image_size_px, ['map', 'maphead', 'legend']);
}
// Green cells meet the goal. The ids are of canvas, heading and legend.
function map(map, [w, h], ids) {
  for (const id of ids) el(id).hidden = !map;
  if (!map) return;
  say(el(ids[2]), map.legend);
  const canvas = el(ids[0]), c = canvas.getContext('2d');
  canvas.width = 960; canvas.height = Math.round(960 * h / w);
  const xs = [...new Set(map.cells.map(m => m[0]))].sort((a, b) => a - b), ys = [...new Set(map.cells.map(m => m[1]))].sort((a, b) => a - b);
  const k = 960 / w, stepX = xs.length > 1 ? xs[1] - xs[0] : w, stepY = ys.length > 1 ? ys[1] - ys[0] : h;
  const most = Math.max(...map.cells.map(m => m[2]));
  for (const [x, y, sd, met] of map.cells) {
    // The brighter, the surer.
    c.fillStyle = css(mix([20, 20, 20], met ? GREEN : AMBER, 1 - .3 * sd / most));
    c.fillRect((x - stepX / 2) * k, (y - stepY / 2) * k, stepX * k + 1, stepY * k + 1);
    c.fillStyle = '#111'; c.font = Math.min(28, stepX * k / 3.2) + 'px system-ui, sans-serif'; c.textAlign = 'center'; c.textBaseline = 'middle';
    c.fillText(sd < 9.95 ? sd.toFixed(most < .1 ? 3 : 2).replace(/^0/, '') : sd.toFixed(0), x * k, y * k);
  }
}
addEventListener('resize', () => { fit.last = null; paint(); });
// Hands a file over: to another program where the device can share, or as a download.
async function deliver(blob, name) {
  const whole = typeof File === 'function' ? new File([blob], name, { type: blob.type }) : null;
  if (whole && navigator.canShare && navigator.canShare({ files: [whole] })) { try { await navigator.share({ files: [whole] }); return; } catch (e) { if (e && e.name === 'AbortError') return; } }
  const a = document.createElement('a');
  a.href = URL.createObjectURL(blob); a.download = name;
  document.body.append(a); a.click(); a.remove();
  setTimeout(() => URL.revokeObjectURL(a.href), 60000);
}
