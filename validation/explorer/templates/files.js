// FRF files of crosscheck, read in the browser: .npz and .csv. Nothing leaves the page.

/**
 * @typedef {{name: string, frequency: Float64Array,
 *   frfs: {response: string, excitation: string, quantity: string, curve: Curve}[]}} FrfFile
 */

const QUANTITIES = ["receptance", "mobility", "accelerance"];
const LARGEST_FILE = 256e6; // bytes, also of what is packed in it
const ARRAYS = ["frequency", "values", "responses", "excitations", "quantity", "unit"]; // that are read
const CSV_UNITS = [["m/N"], ["m/s/N"], ["m/s^2/N", "m/s²/N"]]; // by quantity

/** @param {File} file @returns {Promise<FrfFile>} */
async function readFrfs(file) {
  if (file.size > LARGEST_FILE) throw new Error(`has ${file.size} bytes; at most ${LARGEST_FILE} are read`);
  if (/\.npz$/i.test(file.name)) return checked(await readNpz(file.name, await file.arrayBuffer()));
  if (/\.csv$/i.test(file.name)) return checked(readCsv(file.name, await file.text()));
  throw new Error("is no .npz and no .csv file");
}

/** A file whose lines rise from 0 Hz on and whose FRFs are numbers. @param {FrfFile} file */
function checked(file) {
  const { frequency, frfs } = file;
  if (!frequency.length || !frfs.length) throw new Error("has no FRF");
  const wrong = frequency.findIndex((f, line) => !(f >= 0 && f < Infinity && (line === 0 || f > frequency[line - 1])));
  if (wrong >= 0) throw new Error(`its line ${wrong + 1} is ${frequency[wrong]} Hz; lines must rise, from 0 Hz on`);
  for (const { curve: { re, im }, response, excitation } of frfs) {
    const line = re.findIndex((value, k) => !(Number.isFinite(value) && Number.isFinite(im[k])));
    if (line >= 0) throw new Error(`${response} ← ${excitation} is no number at ${frequency[line]} Hz`);
  }
  return file;
}

/** @param {string} name @param {ArrayBuffer} buffer @returns {Promise<FrfFile>} */
async function readNpz(name, buffer) {
  const arrays = await unzipped(buffer).catch((error) => {
    throw error instanceof RangeError || error instanceof TypeError ? new Error("is damaged") : error;
  });
  /** @param {string} key */
  const needed = (key) => {
    const found = arrays.get(key);
    if (!found) throw new Error(`has no array ${key}`);
    return found;
  };
  const frequency = numbers(needed("frequency")), { values, shape } = needed("values");
  const responses = words(needed("responses")), excitations = words(needed("excitations"));
  const expected = [frequency.length, responses.length, excitations.length];
  if (!values || !needed("values").complex || `${shape}` !== `${expected}`) {
    throw new Error(`its array values must be complex of shape ${expected.join(" × ")}`);
  }
  const unit = arrays.get("unit");
  if (unit && words(unit)[0]) throw new Error(`is in ${words(unit)[0]}; write it in SI`);
  const given = arrays.get("quantity"), quantity = known(given ? words(given)[0] : "receptance");
  const [byLine, byResponse, byExcitation] = strides(needed("values"));
  const frfs = responses.flatMap((response, i) => excitations.map((excitation, j) => {
    const re = new Float64Array(frequency.length), im = new Float64Array(frequency.length);
    for (let line = 0, at = 2 * (i * byResponse + j * byExcitation); line < re.length; line++, at += 2 * byLine) {
      re[line] = values[at];
      im[line] = values[at + 1];
    }
    return { response, excitation, quantity, curve: { re, im } };
  }));
  return { name, frequency, frfs };
}

/**
 * @typedef {{values: Float64Array|null, texts: string[], shape: number[], complex: boolean,
 *   fortran: boolean}} NpyArray
 */

/** Elements from one to the next along each axis. @param {NpyArray} array */
function strides({ shape, fortran }) {
  return shape.map((_, axis) =>
    (fortran ? shape.slice(0, axis) : shape.slice(axis + 1)).reduce((product, n) => product * n, 1));
}

/** @param {NpyArray} array */
function numbers(array) {
  if (!array.values || array.complex || array.shape.length !== 1) throw new Error("its array frequency must be real numbers (Hz), one a line");
  return array.values;
}

/** @param {NpyArray} array */
function words(array) {
  if (array.values) throw new Error("its arrays responses and excitations must be text");
  return array.texts;
}

/** @param {string|undefined} quantity */
function known(quantity) {
  const found = (quantity ?? "").toLowerCase();
  if (!QUANTITIES.includes(found)) throw new Error(`is of quantity '${quantity}'; must be one of ${QUANTITIES.join(", ")}`);
  return found;
}

/** The arrays that are read, of a zip archive (APPNOTE 6.3, sec. 4.3), stored or deflated. @param {ArrayBuffer} buffer */
async function unzipped(buffer) {
  const view = new DataView(buffer);
  let end = buffer.byteLength - 22;
  while (end >= 0 && view.getUint32(end, true) !== 0x06054b50) end--;
  if (end < 0) throw new Error("is no npz file");
  /** @type {Map<string, NpyArray>} */
  const arrays = new Map();
  let at = view.getUint32(end + 16, true);
  for (let member = view.getUint16(end + 10, true); member > 0; member--) {
    const method = view.getUint16(at + 10, true), packed = view.getUint32(at + 20, true);
    const size = view.getUint32(at + 24, true), local = view.getUint32(at + 42, true);
    const length = view.getUint16(at + 28, true);
    const name = new TextDecoder().decode(new Uint8Array(buffer, at + 46, length)).replace(/\.npy$/, "");
    const sum = view.getUint32(at + 16, true);
    at += 46 + length + view.getUint16(at + 30, true) + view.getUint16(at + 32, true);
    if (!ARRAYS.includes(name)) continue;
    if (size > LARGEST_FILE) throw new Error(`its array ${name} is too large`);
    const start = local + 30 + view.getUint16(local + 26, true) + view.getUint16(local + 28, true);
    const bytes = new Uint8Array(buffer, start, packed);
    const whole = method === 8 ? await inflated(bytes, size) : bytes.slice();
    if (crc32(whole) !== sum) throw new Error(`is damaged: its array ${name} does not have its check sum`);
    arrays.set(name, npy(whole.buffer));
  }
  return arrays;
}

/** The check sum of a zip archive's members (ISO 3309). @param {Uint8Array} bytes */
function crc32(bytes) {
  const table = Int32Array.from({ length: 256 }, (_, byte) => {
    let rest = byte;
    for (let bit = 0; bit < 8; bit++) rest = rest & 1 ? (rest >>> 1) ^ 0xedb88320 : rest >>> 1;
    return rest;
  });
  let sum = -1;
  for (let k = 0; k < bytes.length; k++) sum = (sum >>> 8) ^ table[(sum ^ bytes[k]) & 255];
  return ~sum >>> 0;
}

/** What is packed, as long as it says. @param {Uint8Array} bytes @param {number} size */
async function inflated(bytes, size) {
  const reader = new Blob([/** @type {BlobPart} */ (bytes)]).stream().pipeThrough(new DecompressionStream("deflate-raw")).getReader();
  const whole = new Uint8Array(size);
  for (let at = 0; ;) {
    const { done, value } = await reader.read();
    if (done && at < size) throw new Error("unpacks to less than it says");
    if (done) return whole;
    if (at + value.length > size) throw new Error("unpacks to more than it says");
    whole.set(value, at);
    at += value.length;
  }
}

/** An array of NumPy's format (NEP 1). @param {ArrayBuffer} buffer @returns {NpyArray} */
function npy(buffer) {
  const view = new DataView(buffer);
  const long = view.getUint8(6) > 1, start = long ? 12 : 10;
  const length = long ? view.getUint32(8, true) : view.getUint16(8, true);
  const header = new TextDecoder("latin1").decode(new Uint8Array(buffer, start, length));
  const descr = /'descr':\s*'([<>|=]?)([a-zA-Z])(\d+)'/.exec(header);
  const shape = (/'shape':\s*\(([^)]*)\)/.exec(header)?.[1] ?? "").split(",").map((s) => s.trim()).filter(Boolean).map(Number);
  const fortran = /'fortran_order':\s*True/.test(header);
  if (!descr) throw new Error("holds an array that is not plain numbers or text");
  const [, order, kind, digits] = descr, size = Number(digits), little = order !== ">";
  const count = shape.reduce((product, n) => product * n, 1), first = start + length;
  const bytes = count * Math.max(1, kind === "U" ? 4 * size : size);
  if (!(bytes <= buffer.byteLength - first)) throw new RangeError("has less than it says");
  if (kind === "U") {
    const texts = Array.from({ length: count }, (_, k) => Array.from({ length: size }, (_, c) =>
      String.fromCodePoint(view.getUint32(first + 4 * (k * size + c), little))).join("").replace(/\0+$/, ""));
    return { values: null, texts, shape, complex: false, fortran };
  }
  const complex = kind === "c", width = complex ? size / 2 : size;
  /** @type {Object<string, (at: number) => number>} */
  const readers = {
    f8: (at) => view.getFloat64(at, little), f4: (at) => view.getFloat32(at, little),
    i8: (at) => Number(view.getBigInt64(at, little)), i4: (at) => view.getInt32(at, little),
  };
  const read = readers[`${complex ? "f" : kind}${width}`];
  if (!read) throw new Error(`holds an array of a kind that is not read here (${kind}${size})`);
  const values = new Float64Array(count * (complex ? 2 : 1));
  for (let k = 0; k < values.length; k++) values[k] = read(first + width * k);
  return { values, texts: [], shape, complex, fortran };
}

/** frequency_hz, then "re QUANTITY RESPONSE <- EXCITATION (UNIT)" and "im …". @param {string} name @param {string} text @returns {FrfFile} */
function readCsv(name, text) {
  const lines = text.replace(/^\uFEFF/, "").split(/\r?\n/).filter((line) => line.trim() && !line.startsWith("#"));
  const separator = lines[0]?.includes(";") ? ";" : ",";
  const names = (lines[0] ?? "").split(separator).map((cell) => cell.trim().replace(/^"(.*)"$/, "$1"));
  if (!/^f(requency)?(_hz)?$/i.test(names[0])) throw new Error(`its first column is '${names[0]}'; it must be frequency_hz`);
  const columns = names.map(() => new Float64Array(lines.length - 1).fill(NaN));
  lines.slice(1).forEach((line, row) => {
    line.split(separator).slice(0, names.length).forEach((cell, column) => {
      if (cell.trim()) columns[column][row] = Number(separator === ";" ? cell.replace(",", ".") : cell);
    });
  });
  const places = new Map(names.map((title, column) => [title.toLowerCase(), column]));
  const frfs = names.flatMap((title, column) => {
    const found = /^re(?:al)?\s+(\S+)\s+(.+?)\s*<-\s*(.+?)\s*(?:\((.*)\))?$/i.exec(title);
    if (!found) return [];
    if (names.indexOf(title) < column) throw new Error(`has the column '${title}' more than once`);
    const other = places.get(title.replace(/^re(al)?/i, "im").toLowerCase());
    if (other === undefined) throw new Error(`has '${title}' but no imaginary part of it`);
    const quantity = known(found[1]), units = CSV_UNITS[derivatives(quantity)];
    if (found[4] && !units.includes(found[4])) throw new Error(`its ${quantity} is in ${found[4]}; must be ${units[0]}`);
    return [{ quantity, response: found[2], excitation: found[3], curve: { re: columns[column], im: columns[other] } }];
  });
  if (!frfs.length) throw new Error('has no column "re QUANTITY RESPONSE <- EXCITATION (UNIT)"');
  if (columns.some((column) => column.some(Number.isNaN))) throw new Error("has cells that are no numbers");
  return { name, frequency: columns[0], frfs };
}
