// What the page holds, its columns as typed arrays.

const KINDS = { f32: Float32Array, f64: Float64Array, u32: Uint32Array, u8: Uint8Array };
const NONE = 0xffffffff;

function unpacked(text) {
  const at = text.indexOf(":");
  const binary = atob(text.slice(at + 1));
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < bytes.length; i++) bytes[i] = binary.charCodeAt(i);
  return new KINDS[text.slice(0, at)](bytes.buffer);
}

// An object with its packed columns as arrays; everything else stays.
function unpackedAll(packed) {
  const out = {};
  for (const [key, value] of Object.entries(packed)) {
    out[key] = typeof value === "string" ? unpacked(value) : value;
  }
  return out;
}

const DATA = JSON.parse(document.getElementById("data").textContent);
const ROCKS = unpackedAll(DATA.rocks);
const DETECTIONS = unpackedAll(DATA.detections);
const VIEWS = unpackedAll(DATA.views);
const WAYS = DATA.ways.map(unpacked);
const COVERAGE = DATA.coverage && unpackedAll(DATA.coverage);
const N_ROCKS = ROCKS.id.length;
