// Tables that are explored: sorted by a click, filtered, with distributions and parallel coordinates of their numbers.

const SVG = "http://www.w3.org/2000/svg";
const MOST_AXES = 12, BINS = 24;

const vector = (tag, attributes = {}, ...children) => {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
};

/** Number in a cell, NaN without one. What diverged is the largest of all. isNumber: whether the column holds numbers;
    in any other a sentence may begin with one. */
function cellNumber(text, isNumber = true) {
  const plain = text.trim().replace("−", "-");
  if (isNumber && /^(∞|diverged)/.test(plain)) return Infinity;
  return (isNumber ? /^[-+]?[\d.]/ : /^[-+]?[\d.]+(e[-+]?\d+)?$/i).test(plain) ? parseFloat(plain) : NaN;
}

class ExploredTable {
  constructor(node) {
    this.node = node;
    this.table = node.querySelector("table");
    this.heads = [...this.table.tHead.rows[0].cells];
    this.names = this.heads.map((head) => head.textContent.trim());
    this.rows = [...this.table.tBodies].flatMap((body) => [...body.rows]).map((row) => {
      const texts = [...row.cells].map((cell) => (cell.firstChild?.textContent ?? "").trim());
      const numbers = texts.map((text, column) => cellNumber(text, this.heads[column]?.classList.contains("number")));
      return {row, texts, numbers, link: row.querySelector("a")?.href};
    });
    this.brushes = new Map();
    this.heads.forEach((head, column) => {
      const button = element("button", {type: "button", className: "sort", title: "Sort", onclick: () => this.sort(column)}, ...head.childNodes);
      head.replaceChildren(button);
    });
    this.filter = element("input", {type: "search", ariaLabel: "Filter rows", placeholder: "filter: a word, or column < 0.5", oninput: () => this.show()});
    this.count = element("output", {});
    node.prepend(element("div", {className: "bar screen-only"}, this.filter, this.count));
    if (node.hasAttribute("data-plots")) this.plot();
    this.show();
  }

  sort(column) {
    const down = this.heads[column].getAttribute("aria-sort") === "ascending";
    for (const head of this.heads) head.removeAttribute("aria-sort");
    this.heads[column].setAttribute("aria-sort", down ? "descending" : "ascending");
    const isNumber = this.rows.some(({numbers}) => !Number.isNaN(numbers[column]));
    const compare = (a, b) => {
      if (!isNumber) return a.texts[column].localeCompare(b.texts[column], undefined, {numeric: true});
      const [x, y] = [a.numbers[column], b.numbers[column]];
      return Number.isNaN(x) || Number.isNaN(y) ? Number.isNaN(x) - Number.isNaN(y) : (x === y ? 0 : x - y) * (down ? -1 : 1);
    };
    this.rows.sort(isNumber ? compare : (a, b) => compare(a, b) * (down ? -1 : 1));
    this.table.tBodies[0].append(...this.rows.map(({row}) => row));
  }

  /** Whether a row has what the filter asks for: words, or a comparison of a column. */
  fits({texts, numbers, row}) {
    const asked = this.filter.value.trim().toLowerCase(), [, name, sign, bound] = asked.match(/^(.+?)\s*(<=|>=|<|>|=)\s*(\S.*)$/) ?? [];
    const column = name === undefined ? -1 : this.names.findIndex((text) => text.toLowerCase().includes(name));
    if (column < 0) return asked.split(/\s+/).every((word) => row.textContent.toLowerCase().includes(word));
    const value = numbers[column], limit = cellNumber(bound);
    if (Number.isNaN(limit)) return sign === "=" && texts[column].toLowerCase() === bound;
    return {"<": value < limit, ">": value > limit, "<=": value <= limit, ">=": value >= limit, "=": value === limit}[sign];
  }

  show() {
    let count = 0;
    for (const entry of this.rows) {
      const brushed = [...this.brushes].every(([column, [low, high]]) => entry.numbers[column] >= low && entry.numbers[column] <= high);
      entry.shown = brushed && this.fits(entry);
      entry.row.hidden = !entry.shown;
      entry.line?.classList.toggle("out", !entry.shown);
      count += entry.shown;
    }
    this.count.textContent = count === this.rows.length ? `${count} rows` : `${count} of ${this.rows.length} rows`;
    this.bars?.();
  }

  // -- plots --------------------------------------------------------------------------------------------------------

  plot() {
    const finite = (column) => this.rows.map(({numbers}) => numbers[column]).filter(Number.isFinite);
    const columns = this.names.map((_, column) => column).filter((column) => column && new Set(finite(column)).size > 1).slice(0, MOST_AXES);
    if (!columns.length || this.rows.length < 3) return;
    this.axes = columns.map((column) => {
      const values = finite(column);
      return {column, low: Math.min(...values), high: Math.max(...values), values};
    });
    const plots = element("div", {className: "plots"});
    if (this.axes.length > 1) plots.append(this.parallel());
    plots.append(element("details", {}, element("summary", {textContent: "Distributions"}), this.distributions()));
    this.node.prepend(plots);
  }

  parallel() {
    const gap = 110, height = 230, top = 34, bottom = height - 22, width = Math.max(gap * (this.axes.length - 1) + 120, 300);
    const svg = vector("svg", {viewBox: `0 0 ${width} ${height}`, width, height, class: "parallel", role: "img", "aria-label": "Parallel coordinates: a line for each row; drag on an axis to choose rows"});
    const place = (axis, value) => bottom - (bottom - top) * (Math.min(Math.max(value, axis.low), axis.high) - axis.low) / (axis.high - axis.low);
    const last = this.axes.at(-1);
    for (const entry of this.rows) {
      const points = this.axes.flatMap((axis, i) => Number.isNaN(entry.numbers[axis.column]) ? [] : [`${60 + gap * i},${place(axis, entry.numbers[axis.column])}`]);
      entry.line = vector("polyline", {points: points.join(" "), class: "run"}, vector("title", {}, entry.texts.join(", ")));
      const share = (Math.min(entry.numbers[last.column], last.high) - last.low) / (last.high - last.low);
      entry.line.style.stroke = Number.isNaN(share) ? "#999999" : `color-mix(in oklab, #E69F00 ${Math.round(100 * share)}%, #0072B2)`;
      entry.line.addEventListener("click", () => this.open(entry));
      entry.line.addEventListener("mouseenter", () => entry.row.classList.add("lit"));
      entry.line.addEventListener("mouseleave", () => entry.row.classList.remove("lit"));
      entry.row.addEventListener("mouseenter", () => { entry.line.classList.add("lit"); svg.insertBefore(entry.line, svg.querySelector(".axis")); });
      entry.row.addEventListener("mouseleave", () => entry.line.classList.remove("lit"));
      svg.append(entry.line);
    }
    this.axes.forEach((axis, i) => svg.append(this.axis(svg, axis, 60 + gap * i, top, bottom, i)));
    return element("div", {className: "wide", tabIndex: 0, role: "region", ariaLabel: "Parallel coordinates"}, svg);
  }

  /** What stands at an axis: without the component where no other axis is named so, and not too long. */
  shortName(axis) {
    const own = ({column}) => this.names[column].replace(/^[^. ]+\./, ""), name = this.names[axis.column];
    const plain = this.axes.filter((other) => own(other) === own(axis)).length > 1 ? name : own(axis);
    return plain.length > 24 ? `…${plain.slice(-23)}` : plain;
  }

  /** An axis on which rows are chosen by dragging; a click takes the choice back. */
  axis(svg, axis, x, top, bottom, i) {
    const brush = vector("rect", {x: x - 8, width: 16, y: top, height: 0, class: "brush"});
    const strip = vector("rect", {x: x - 14, width: 28, y: top - 4, height: bottom - top + 8, class: "strip"});
    const name = this.names[axis.column], short = this.shortName(axis);
    const text = (y, content, style = "middle") => vector("text", {x, y, "text-anchor": style}, content);
    const group = vector("g", {class: "axis"}, vector("line", {x1: x, x2: x, y1: top, y2: bottom}), text(i % 2 ? 11 : 22, short), text(bottom + 14, shown(axis.low, 3)),
      vector("text", {x: x + 4, y: top + 10}, shown(axis.high, 3)), brush, strip, vector("title", {}, `${name}: drag to choose`));
    strip.addEventListener("pointerdown", (down) => {
      down.preventDefault();
      strip.setPointerCapture(down.pointerId);
      const box = svg.getBoundingClientRect();  // as it is now: a shorter table may move the page while the mouse stays
      const at = (e) => Math.min(Math.max((e.clientY - box.top) * svg.viewBox.baseVal.height / box.height, top), bottom);
      const from = at(down), value = (y) => axis.low + (axis.high - axis.low) * (bottom - y) / (bottom - top);
      const move = (e) => {
        const [a, b] = [from, at(e)].sort((p, q) => p - q);
        brush.setAttribute("y", a);
        brush.setAttribute("height", b - a);
        if (b - a > 3) this.brushes.set(axis.column, [value(b), value(a)]); else this.brushes.delete(axis.column);
        this.show();
      };
      strip.addEventListener("pointermove", move);
      strip.addEventListener("pointerup", (e) => { move(e); strip.removeEventListener("pointermove", move); }, {once: true});
    });
    return group;
  }

  distributions() {
    const node = element("div", {className: "distributions"}), width = 150, height = 60;
    const drawings = this.axes.map((axis) => {
      const svg = vector("svg", {viewBox: `0 0 ${width} ${height + 14}`, width, height: height + 14, role: "img", "aria-label": `Distribution of ${this.names[axis.column]}`});
      node.append(element("figure", {}, svg, element("figcaption", {textContent: this.names[axis.column]})));
      return svg;
    });
    this.bars = () => this.axes.forEach((axis, i) => {
      const bins = new Array(BINS).fill(0), bin = (v) => Math.min(Math.floor(BINS * (v - axis.low) / (axis.high - axis.low)), BINS - 1);
      for (const {numbers, shown: isShown} of this.rows) if (isShown && Number.isFinite(numbers[axis.column])) bins[bin(numbers[axis.column])]++;
      const most = Math.max(...bins, 1), step = width / BINS;
      drawings[i].replaceChildren(...bins.map((n, k) => vector("rect", {x: k * step, width: step - 1, y: height - height * n / most, height: height * n / most})),
        vector("text", {x: 0, y: height + 12}, shown(axis.low, 3)), vector("text", {x: width, y: height + 12, "text-anchor": "end"}, shown(axis.high, 3)));
    });
    return node;
  }

  open(entry) {
    if (entry.link) location.href = entry.link;
    else entry.row.scrollIntoView({block: "center"});
  }
}

for (const node of document.querySelectorAll(".explored")) new ExploredTable(node);
