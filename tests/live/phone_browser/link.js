// The page's link, played in the page: what boresight answers, over a network that's slow, cut, or somebody else's.
(() => {
  const net = window.net = {
    /// One way, in milliseconds.
    delay: 0, cut: false, portal: false, status: 0, pictures: true, clockLate: 0,
    /// Messages of which only the news arrives.
    halves: 0,
    requests: 0, streams: [], commands: [], news: [], number: 0, ended: null,
    live: { stage: 'guiding', frame: 1, sentence: ['Come closer', 'Come closer'], tone: 'plain', hold: null, moment: null, sign: [null, null], card: false, close: null,
      board: null, views: 1, taken: 1, simulated: true, paused: false,
      trouble: null, doubt: null, say: null, removed: null, led: null, offer: null, push: null },
    plan: { size: [640, 360], ghost: null, views: [], wheel: [], pairs: [], refused: [], outline: [], map: null,
      board: '', reached: '' },
    /// A view is taken now.
    take() {
      net.live = { ...net.live, views: net.live.views + 1, taken: net.live.taken + 1 };
      net.news.push({ number: ++net.number, came: performance.now(), view: net.live.taken, rank: 'taken', text: 'Taken', mirrored: 'Taken' });
    },
    /// boresight is started again, and counts its news from one.
    restart() { net.news = []; net.number = 0; net.break(); },
    break() { for (const stream of net.streams.splice(0)) stream.fail(); },
  };
  const wait = ms => new Promise(done => setTimeout(done, ms));
  const event = (name, value) => 'event: ' + name + '\ndata: ' + JSON.stringify(value) + '\n\n';
  const answer = (body, type, headers) => new Response(body, { headers: { 'content-type': type, ...headers } });
  function follow(heard, signal) {
    let seen = heard === null ? net.number : heard, timer = 0;
    const body = new ReadableStream({
      start(controller) {
        const stream = { fail() { clearInterval(timer); try { controller.error(new TypeError('cut')); } catch (e) { /* It's over. */ } } };
        if (signal) signal.addEventListener('abort', () => stream.fail());
        net.streams.push(stream);
        timer = setInterval(async () => {
          if (net.cut || net.portal) return;
          const news = net.news.filter(n => n.number > seen).map(n => ({ ...n, age_ms: performance.now() - n.came }));
          const told = news.map(n => event('news', n)).join('');
          seen = net.number;
          const text = told + event('plan', net.plan) + event('ended', net.ended) + event('heard', seen) + event('clock', performance.now() - net.clockLate) + event('live', net.live);
          const half = told && net.halves > 0 && net.halves-- > 0;
          await wait(net.delay);
          try { controller.enqueue(new TextEncoder().encode(half ? told : text)); } catch (e) { return; }
          if (half) { await wait(50); stream.fail(); }
        }, 150);
      },
    });
    return answer(body, 'text/event-stream');
  }
  async function picture() {
    const canvas = Object.assign(document.createElement('canvas'), { width: 64, height: 36 });
    canvas.getContext('2d').fillRect(0, 0, 30, 20);
    const blob = await new Promise(done => canvas.toBlob(done, 'image/jpeg'));
    return answer(blob, 'image/jpeg', { 'x-number': String(net.requests), 'x-age-ms': '30', 'x-held-ms': '60' });
  }
  window.fetch = async (path, { signal, body } = {}) => {
    net.requests++;
    const aborted = new Promise((_, no) => { if (signal) signal.addEventListener('abort', () => no(new DOMException('aborted', 'AbortError'))); });
    const over = ms => Promise.race([wait(ms), aborted]);
    const isNew = path.startsWith('/api/events');
    await over((isNew ? 4 : 2) * net.delay);
    if (net.cut) await over(1e9);
    if (net.portal) return answer('<html>Please log in</html>', 'text/html');
    if (net.status) return new Response('no', { status: net.status });
    if (path === '/api/enter') return answer(JSON.stringify({ key: 'k'.repeat(43), role: 'owner' }), 'application/json');
    if (isNew) return follow(path.includes('heard=') ? Number(path.split('heard=')[1]) : null, signal);
    if (path.startsWith('/api/picture')) { await over(60); return net.pictures ? picture() : new Response(null, { status: 204 }); }
    net.commands.push(JSON.parse(body || '{}'));
    return new Response(null, { status: 204 });
  };
})();
