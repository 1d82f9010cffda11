// Reads files as NumPy writes them (format 1.0 to 3.0): numbers of 8 bytes, and short texts, one array after another.
const MAGIC = "\x93NUMPY";

// All arrays of a file: { shape, values }, values being a Float64Array or a list of texts, row by row.
function arraysOf(buffer) {
  const arrays = [];
  for (let at = 0; at < buffer.byteLength; ) {
    const { kind, size, shape, start } = headAt(buffer, at);
    const count = shape.reduce((product, length) => product * length, 1);
    const end = start + count * size;
    if (end > buffer.byteLength) throw new Error("an array that was cut off");
    const bytes = buffer.slice(start, end);
    arrays.push({ shape, values: kind === "f" ? new Float64Array(bytes) : texts(bytes, size, count) });
    at = end;
  }
  return arrays;
}

// A matrix of the station's and the robots that its rows and columns are of.
export function matrixOf(buffer) {
  const [matrix, names] = arraysOf(buffer);
  if (!names || matrix.shape.length !== 2 || names.values.length !== matrix.shape[0]) throw new Error("no matrix with names");
  return { robots: names.values, values: matrix.values };
}

function headAt(buffer, at) {
  const bytes = new Uint8Array(buffer, at);
  const latin = (from, to) => String.fromCharCode(...bytes.subarray(from, to));
  if (latin(0, 6) !== MAGIC) throw new Error("no array of NumPy's");
  const view = new DataView(buffer, at);
  const [first, length] = bytes[6] === 1 ? [10, view.getUint16(8, true)] : [12, view.getUint32(8, true)];
  const words = latin(first, first + length);
  const [, kind, size] = /'descr':\s*'[<|=]([fS])(\d+)'/.exec(words) ?? [];
  const [, shape] = /'shape':\s*\(([^)]*)\)/.exec(words) ?? [];
  if (!kind || shape === undefined || words.includes("'fortran_order': True") || (kind === "f" && size !== "8")) {
    throw new Error(`an array of a kind that is not read here: ${words.trim()}`);
  }
  const lengths = shape.split(",").map((each) => each.trim()).filter(Boolean).map(Number);
  return { kind, size: Number(size), shape: lengths, start: at + first + length };
}

function texts(buffer, size, count) {
  const decoder = new TextDecoder();
  const bytes = new Uint8Array(buffer);
  return Array.from({ length: count }, (_, k) => decoder.decode(bytes.subarray(k * size, (k + 1) * size)).replace(/\0+$/, ""));
}
