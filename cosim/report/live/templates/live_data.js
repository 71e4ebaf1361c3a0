// Columns of the page: decoded when they are first drawn, thinned to what a screen can show.

/** Bytes of a packed column: base64, then inflated. */
async function inflated(block) {
  const text = document.getElementById(`block-${block}`).textContent;
  const binary = atob(text), packed = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; i++) packed[i] = binary.charCodeAt(i);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Values of a packed column; see cosim/report/live/packed_column.py. */
async function decoded(column) {
  const planes = await inflated(column.block), n = column.count, integers = new Int32Array(n);
  for (let i = 0; i < n; i++) {
    const z = planes[i] | planes[n + i] << 8 | planes[2 * n + i] << 16 | planes[3 * n + i] << 24;
    integers[i] = z >>> 1 ^ -(z & 1);
  }
  for (let order = 0; order < column.order; order++) {
    for (let i = 1; i < n; i++) integers[i] = integers[i] + integers[i - 1] | 0;
  }
  const values = new Float64Array(n);
  if (column.kind === "grid") {
    const {low, high, steps} = column, step = (high - low) / steps;
    for (let i = 0; i < n; i++) {
      const place = integers[i] >>> 0;
      values[i] = place === steps ? high : low + place * step;
    }
  } else {
    const halves = new Int32Array(values.buffer);
    for (let i = 0; i < n; i++) halves[2 * i + 1] = integers[i];
  }
  if (document.getElementById(`block-${column.block + 1}`).textContent) {
    const odd = await inflated(column.block + 1), meanings = [0, NaN, -Infinity, Infinity];
    for (let i = 0; i < n; i++) if (odd[i]) values[i] = meanings[odd[i]];
  }
  return values;
}

/** Makes an abscissa increase strictly: two rows of an event have the same time. */
function separated(x) {
  const apart = 1e-12 * (x[x.length - 1] - x[0]) || 1e-12, found = Float64Array.from(x);
  for (let i = 1; i < found.length; i++) if (!(found[i] > found[i - 1])) found[i] = found[i - 1] + apart;
  return found;
}

/** First row at or behind a place. */
function rowAt(x, place) {
  let low = 0, high = x.length;
  while (low < high) {
    const middle = low + high >> 1;
    if (x[middle] < place) low = middle + 1; else high = middle;
  }
  return low;
}

/** A curve of a recording, its values and its abscissa once they are decoded. */
class LiveCurve {
  constructor(recording, index, entry) {
    Object.assign(this, entry);
    this.recording = recording;
    this.run = index;
    this.text = entry.label || entry.name;
    this.whole = !entry.rows;
    this.shown ??= {unit: this.unit, factor: 1, offset: 0};
  }

  /** Its values in the unit in which it is shown, or in the one in which it is kept. */
  inUnit(isShown) {
    const {factor, offset} = this.shown;
    if (!isShown || (factor === 1 && offset === 0)) return this.y;
    if (this.convertedOf !== this.y) Object.assign(this, {convertedOf: this.y, converted: this.y.map((v) => (v - offset) / factor)});
    return this.converted;
  }

  /** Decode it: of a long curve its extremes first, see `refine`. */
  async load() {
    await (this.loading ||= this.overview ? this.take(this.overview, this.overview.rows) : this.take(this, this.rows));
  }

  /** Decode every row that the page holds; whether there are more than before. */
  async refine() {
    if (!this.overview) return false;
    this.overview = null;
    await (this.loading = this.take(this, this.rows));
    return true;
  }

  async take(column, rows) {
    const [y, kept] = [await decoded(column), rows ? await decoded(rows) : null];
    Object.assign(this, {y, kept, keptOf: null});
  }

  /** Abscissa of this curve, of those of its recording. */
  over(abscissa) {
    if (!this.kept) return abscissa;
    if (this.keptOf !== abscissa) {
      this.keptOf = abscissa;
      this.keptX = Float64Array.from(this.kept, (row) => abscissa[Math.round(row)]);
    }
    return this.keptX;
  }

  /** Value at a place: that of the row before where values hold, else on the line between the rows. */
  at(x, place) {
    const next = rowAt(x, place);
    if (next >= x.length) return place > x[x.length - 1] ? NaN : this.y[x.length - 1];
    if (x[next] === place) return this.y[next];
    if (!next) return NaN;
    if (this.held) return this.y[next - 1];
    const share = (place - x[next - 1]) / (x[next] - x[next - 1]);
    return this.y[next - 1] + share * (this.y[next] - this.y[next - 1]);
  }
}

/** One curve of a recording minus another one of it. */
class Difference extends LiveCurve {
  constructor(first, second, ownAbscissa) {
    const name = `${first.name} − ${second.name}`;
    super(first.recording, first.run, {name, unit: first.unit, held: first.held && second.held, look: "", label: "", ascends: false, description: `Difference of ${first.name} and ${second.name}`});
    if (first.shown.unit === second.shown.unit) this.shown = {...first.shown, offset: 0};
    Object.assign(this, {first, second, ownAbscissa, whole: first.whole && second.whole});
  }

  async load() { await (this.loading ||= this.subtract()); }

  async subtract() {
    for (const curve of [this.first, this.second]) {
      await curve.load();
      await curve.refine();
    }
    const {first, second} = this, own = await this.ownAbscissa();
    const other = this.whole ? (_, row) => second.y[row] : (place) => second.at(second.over(own), place);
    this.kept = first.kept;
    this.y = Float64Array.from(first.over(own), (place, row) => first.y[row] - other(place, row));
  }
}

/** What is drawn of curves between two places: every row, or of each piece the smallest and the largest value.
 *  parts: [{x, y}]. Returns [x, y1, y2, ...]; null is a gap, undefined no row there. */
function drawn(parts, from, to, pieces) {
  const rows = parts.map(({x}) => [Math.max(rowAt(x, from) - 1, 0), Math.min(rowAt(x, to) + 1, x.length)]);
  const value = (v) => Number.isFinite(v) ? v : null;
  if (rows.every(([a, b]) => b - a <= 2 * pieces)) {
    const tables = parts.map(({x, y}, i) => [Array.from(x.subarray(...rows[i])), Array.from(y.subarray(...rows[i]), value)]);
    const same = tables.every((t) => t[0].length === tables[0][0].length && t[0].every((v, k) => v === tables[0][0][k]));
    return same ? [tables[0]?.[0] ?? [], ...tables.map((t) => t[1])] : uPlot.join(tables);
  }
  const edges = Array.from({length: pieces + 1}, (_, k) => from + (to - from) * k / pieces);
  const places = edges.slice(0, -1).flatMap((edge, k) => [edge + 0.25 * (edges[k + 1] - edge), edge + 0.75 * (edges[k + 1] - edge)]);
  return [places, ...parts.map((part, i) => extremes(part, rows[i], edges))];
}

/** Of each piece the two extremes in their order: of one curve. A piece without a row is no gap; one of NaN alone is. */
function extremes({x, y}, [first, last], edges) {
  const found = [];
  let row = first;
  for (let k = 0; k + 1 < edges.length; k++) {
    let low = -1, high = -1, empty = true;
    for (; row < last && (x[row] < edges[k + 1] || k + 2 === edges.length); row++) {
      empty = false;
      if (!Number.isFinite(y[row])) continue;
      if (low < 0 || y[row] < y[low]) low = row;
      if (high < 0 || y[row] > y[high]) high = row;
    }
    if (low < 0) found.push(...(empty ? [undefined, undefined] : [null, null]));
    else found.push(y[Math.min(low, high)], y[Math.max(low, high)]);
  }
  return found;
}
