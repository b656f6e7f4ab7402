// The page's data: inflated, and samples unpacked into typed arrays that scene and plots share.

const $ = (id) => document.getElementById(id);

if (typeof DecompressionStream === "undefined") {
  throw new Error("the browser is too old: it cannot inflate data (Chrome 103, Firefox 113 or Safari 16.4 can)");
}

async function inflated(id) {
  const text = atob($(id).textContent), packed = new Uint8Array(text.length);
  for (let k = 0; k < text.length; k++) packed[k] = text.charCodeAt(k);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

const began = performance.now();
const [viewerCode, plainData, packedSamples] =
  await Promise.all(["viewer", "data", "block"].map(inflated));
const D = JSON.parse(new TextDecoder().decode(plainData));
const inflatedAt = performance.now();

// Rows of numbers, each made when it is first read.
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
    return rowsWhenRead(entry.columns, (c) => unpackedRow(bytes, from + c * entry.n, count, entry));
  });
}

const arrays = unpackedArrays(packedSamples, D.table);
const unpackedAt = performance.now();

{
  const element = document.createElement("script");
  element.textContent = new TextDecoder().decode(viewerCode);
  document.head.append(element);
}
const viewerAt = performance.now();
