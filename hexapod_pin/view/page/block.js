// The page's data: inflated, and samples unpacked into typed arrays that scene and plots share.
// Samples are inflated in two parts: what the first picture needs, and behind it all others.

const $ = (id) => document.getElementById(id);

if (typeof DecompressionStream === "undefined") {
  throw new Error("the browser is too old: it cannot inflate data (Chrome 103, Firefox 113 or Safari 16.4 can)");
}

function bytesOf(id) {
  const {textContent} = $(id);
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(textContent);
  const text = atob(textContent), packed = new Uint8Array(text.length);
  for (let k = 0; k < text.length; k++) packed[k] = text.charCodeAt(k);
  return packed;
}

// A stream that inflates no more than what is read from it, a piece of so many bytes at a time.
function inflating(id, piece = Infinity) {
  const packed = bytesOf(id);
  let at = 0;
  const source = new ReadableStream({pull(stream) {
    if (at < packed.length) stream.enqueue(packed.subarray(at, at += piece)); else stream.close();
  }}, {highWaterMark: 0});
  return source.pipeThrough(new DecompressionStream("deflate-raw"));
}

const inflated = async (id) => new Uint8Array(await new Response(inflating(id)).arrayBuffer());

const began = performance.now();
const [viewerCode, plainData] = await Promise.all(["viewer", "data"].map(inflated));
const D = JSON.parse(new TextDecoder().decode(plainData));

const samples = {bytes: new Uint8Array(D.table.reduce((sum, {n, columns, wide}) => sum + n * columns * wide, 0)),
  reader: inflating("block", 16384).getReader(), filled: 0};
// Inflate the first so many bytes of the samples.
async function fill(until) {
  while (samples.filled < until) {
    const {value, done} = await samples.reader.read();
    if (done) throw new Error("its samples are cut off");
    samples.bytes.set(value, samples.filled);
    samples.filled += value.length;
  }
}
await fill(D.early);
const inflatedAt = performance.now();

// Rows of numbers, each made when it is first read, whole or up to a sample.
function rowsWhenRead(count, make) {
  const rows = new Array(count), whole = {configurable: true, enumerable: true};
  for (let k = 0; k < count; k++) {
    Object.defineProperty(rows, k, {...whole, get() {
      const row = make(k);
      Object.defineProperty(rows, k, {...whole, value: row});
      return row;
    }});
  }
  return rows;
}

// Differences of whole numbers, their bytes of equal weight together, their signs in the lowest bit.
function unpackedRow(bytes, at, count, {n, wide, order, resolution, missing}) {
  const row = new Float64Array(n);
  let value = 0, change = 0;
  for (let i = 0, k = at; i < n; i++, k++) {
    let z = bytes[k];
    if (wide > 1) z += bytes[k + count] * 256;
    if (wide > 2) z += bytes[k + 2 * count] * 65536 + bytes[k + 3 * count] * 16777216;
    const whole = z % 2 ? -(z + 1) / 2 : z / 2;
    if (order === 2) change += whole; else change = whole;
    value += change;
    row[i] = value === missing ? NaN : value * resolution;
  }
  return row;
}

function unpackedArrays(bytes, table) {
  let at = 0;
  return table.map((entry) => {
    const from = at, count = entry.n * entry.columns;
    at += count * entry.wide;
    const row = (c, n) => unpackedRow(bytes, from + c * entry.n, count, {...entry, n});
    return Object.assign(rowsWhenRead(entry.columns, (c) => row(c, entry.n)), {upTo: (i) =>
      rowsWhenRead(entry.columns, (c) => row(c, Math.min(entry.n, i + 1)))});
  });
}

const arrays = unpackedArrays(samples.bytes, D.table);

{
  const element = document.createElement("script");
  element.textContent = new TextDecoder().decode(viewerCode);
  document.head.append(element);
}
const viewerAt = performance.now();
