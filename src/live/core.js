// The compiled core (core.cpp). It shares arrays of doubles with the page, by number.
const ARRAYS = ["points", "weights", "corners", "offsets", "places", "bias", "position", "share", "kind", "excess"];

const decoded = (base64) => Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
const numbers = (base64) => new Float64Array(decoded(base64).buffer);

async function loadCore(base64) {
  const refuse = () => 8; // WASI's "bad file descriptor": the core neither reads nor prints
  const wasi_snapshot_preview1 = { fd_close: refuse, fd_seek: refuse, fd_write: refuse };
  const { instance } = await WebAssembly.instantiate(decoded(base64), { wasi_snapshot_preview1 });
  const calls = instance.exports;
  calls._initialize();
  const view = (at, size) => new Float64Array(calls.memory.buffer, at, size); // memory may have grown: never kept
  return {
    ...calls,
    put(name, values) {
      const at = calls.room(ARRAYS.indexOf(name), values.length);
      view(at, values.length).set(values);
    },
    get(name) {
      const array = ARRAYS.indexOf(name);
      return view(calls.address(array), calls.size(array)).slice();
    },
  };
}
