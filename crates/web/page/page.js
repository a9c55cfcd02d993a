'use strict';
const part = (id) => document.getElementById(id);
// Decoded once: 4 characters hold 3 bytes.
const engine = Uint8Array.from(atob(part('engine').textContent), (c) => c.charCodeAt(0));
const script = URL.createObjectURL(new Blob([part('worker').textContent], { type: 'text/javascript' }));
let file, worker, ticking, links = [];

const show = (id, is) => { part(id).hidden = !is; };

function end() {
  worker?.terminate();
  clearInterval(ticking);
  worker = undefined;
}

async function start() {
  if (!file) return;
  end();
  links.splice(0).forEach((link) => URL.revokeObjectURL(link));
  ['failed', 'downloads', 'report'].forEach((id) => show(id, false));
  const rate = part('rate').value.trim().replace(',', '.');
  const read = { name: file.name, columns: part('columns').value, units: part('units').value, rate_hz: rate ? Number(rate) : null, span: part('span').value };
  if (rate && !(read.rate_hz > 0)) return fail({ what: `the sample rate is \`${rate}\``, help: 'it has to be a number above 0, in Hz' });
  const began = Date.now();
  let says = 'starting';
  const tell = () => { part('said').textContent = `${file.name}: ${says}, ${((Date.now() - began) / 1000).toFixed(0)} s`; };
  ticking = setInterval(tell, 250);
  tell();
  const own = worker = new Worker(script);
  own.onmessage = ({ data }) => {
    if (own !== worker) return;
    if (data.says) { says = data.says; return tell(); }
    end();
    if (data.failed) return fail(data.failed);
    finish(data.done, (Date.now() - began) / 1000);
  };
  own.onerror = (event) => { end(); fail({ what: `the engine did not start: ${event.message}`, help: 'it takes a browser of 2021 or later' }); };
  try {
    const bytes = await file.arrayBuffer();
    own.postMessage({ engine, file: bytes, read }, [bytes]);
  } catch (error) {
    end();
    fail({ what: `${file.name} cannot be read: ${error.message}`, help: 'is it a file, and no folder?' });
  }
}

function fail({ what, help, proposal, span }) {
  part('said').textContent = '';
  part('failed').textContent = help ? `${what}\n\n${help}` : what;
  show('failed', true);
  if (proposal) {
    [part('columns').value, part('units').value] = proposal;
  }
  if (span) part('span').value = span;
  if (proposal || span) part('mapping').open = true;
  dispatchEvent(new CustomEvent('failed', { detail: { what, help, proposal, span } }));
}

function finish(done, seconds) {
  part('said').textContent = `${file.name}: ${done.what}; done in ${seconds.toFixed(1)} s`;
  const stem = file.name.replace(/\.(csv|txt|gz|mcap|bag|ulg|zst|bz2)\b/g, '') || 'record';
  const files = [
    [`${stem}.html`, 'text/html', done.html, 'report'],
    [`${stem}-diagnosis.json`, 'application/json', done.json, 'diagnosis (JSON)'],
    [`${stem}-analysis.json`, 'application/json', done.analysis, 'analysis (JSON)'],
    [`${stem}.toml`, 'text/plain', done.model, 'extended model'],
  ];
  part('downloads').replaceChildren('Keep: ', ...files.map(([name, type, text, words]) => {
    const link = document.createElement('a');
    link.href = URL.createObjectURL(new Blob([text], { type }));
    links.push(link.href);
    link.download = name;
    link.textContent = words;
    return link;
  }));
  show('downloads', true);
  part('report').srcdoc = done.html;
  show('report', true);
  dispatchEvent(new CustomEvent('finished', { detail: done }));
}

part('file').onchange = (event) => { file = event.target.files[0]; start(); };
part('again').onclick = start;
for (const kind of ['dragenter', 'dragover']) {
  addEventListener(kind, (event) => { event.preventDefault(); part('drop').classList.add('over'); });
}
addEventListener('dragleave', (event) => { if (!event.relatedTarget) part('drop').classList.remove('over'); });
addEventListener('drop', (event) => {
  event.preventDefault();
  part('drop').classList.remove('over');
  if (event.dataTransfer.files.length) { file = event.dataTransfer.files[0]; start(); }
});
// `imu-stand monitor --web` has this page at /engine and opens it with what was recorded so far.
addEventListener('message', (event) => {
  if (!opener || event.source !== opener || event.origin !== location.origin || !(event.data?.bytes instanceof ArrayBuffer)) return;
  file = new File([event.data.bytes], String(event.data.name));
  start();
});
if (opener && location.protocol.startsWith('http')) opener.postMessage('ready', location.origin);
