// Runs the engine beside the page. It is told {engine, file, read} once, and says what it does, then what it found.
'use strict';
onmessage = async ({ data: { engine, file, read } }) => {
  let memory, why = '';
  const text = (from, length) => new TextDecoder().decode(new Uint8Array(memory.buffer, from, length));
  const number = (at, value) => new DataView(memory.buffer).setUint32(at, value, true);
  // Of what a system offers (WASI, preview 1) the engine has no files, no clock and no arguments: all is refused, but for what
  // the library of Rust asks for. What is written is a panic, before the engine stops. Random are the seeds of hash tables alone.
  const REFUSED = 52;
  const system = {
    environ_sizes_get: (count, size) => { number(count, 0); number(size, 0); return 0; },
    environ_get: () => 0,
    random_get: (at, length) => { crypto.getRandomValues(new Uint8Array(memory.buffer, at, length)); return 0; },
    fd_write: (_, pieces, count, written) => {
      const view = new DataView(memory.buffer);
      let length = 0;
      for (let k = 0; k < count; k += 1) {
        const [from, size] = [0, 4].map((offset) => view.getUint32(pieces + 8 * k + offset, true));
        why += text(from, size);
        length += size;
      }
      number(written, length);
      return 0;
    },
    proc_exit: () => { throw new Error(why); },
  };
  const wasi_snapshot_preview1 = new Proxy(system, { get: (known, name) => known[name] ?? (() => REFUSED) });
  try {
    const { instance } = await WebAssembly.instantiate(engine, { wasi_snapshot_preview1 });
    const { _initialize, file_room, request_room, call, answer } = instance.exports;
    memory = instance.exports.memory;
    _initialize?.();
    // Room may move the memory: the view on it is made afterwards.
    const write = (room, bytes) => {
      const at = room(bytes.length);
      new Uint8Array(memory.buffer, at, bytes.length).set(bytes);
    };
    write(file_room, new Uint8Array(file));
    const ask = (says, request) => {
      postMessage({ says });
      write(request_room, new TextEncoder().encode(JSON.stringify(request)));
      const length = call();
      const { ok, failed } = JSON.parse(text(answer(), length));
      if (failed) throw failed;
      return ok;
    };
    const found = ask('reading the file', { do: 'read', ...read });
    const what = `${found.samples} samples of ${found.channels.join(', ')}`;
    const analysis = ask(`${what}: Allan deviations and noise`, { do: 'analyze' });
    const diagnosis = ask(`${what}: looking for causes, and simulating each model`, { do: 'diagnose' });
    const report = ask(`${what}: drawing the report`, { do: 'report' });
    postMessage({ done: { what, analysis: analysis.json, ...diagnosis, html: report.html } });
  } catch (error) {
    const failed = error.what ? error : { what: `the engine stopped: ${why || error}`, help: 'this is a defect: report it with the file' };
    postMessage({ failed });
  }
};
