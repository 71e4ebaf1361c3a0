// Tables that are explored: sorted by a click, filtered, with distributions and parallel coordinates of their numbers.

const SVG = "http://www.w3.org/2000/svg";
const MOST_AXES = 12, BINS = 24, MOST_LETTERS = 24;

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

/** A name as nodes, so that it may be broken behind its dots and underlines. */
const breakable = (name) => name.split(/(?<=[._])/).flatMap((part, i) => i ? [element("wbr"), part] : [part]);

/** Folder of this page as a shell wants it, with what ends it. */
function ownFolder() {
  const path = decodeURIComponent(location.pathname).replace(/^\/([A-Za-z]:)/, "$1");
  return location.protocol === "file:" ? path.slice(0, path.lastIndexOf("/") + 1) : "";
}

/** A word of a command, quoted where a shell would part it. */
const quoted = (word) => /^[\w.\/:-]+$/.test(word) ? word : `"${word.replace(/["$`\\]/g, "\\$&")}"`;

class ExploredTable {
  constructor(node) {
    this.node = node;
    this.table = node.querySelector("table");
    this.heads = [...this.table.tHead.rows[0].cells];
    this.names = this.heads.map((head) => head.textContent.trim());
    this.rows = [...this.table.tBodies].flatMap((body) => [...body.rows]).map((row) => {
      const texts = [...row.cells].map((cell) => (cell.firstChild?.textContent ?? "").trim());
      const numbers = texts.map((text, column) => cellNumber(text, this.heads[column]?.classList.contains("number")));
      const entry = {row, texts, numbers, link: row.querySelector("a")?.href, folder: row.dataset.folder};
      if (entry.folder && !entry.link) {
        const cell = row.cells[0], button = element("button", {type: "button", className: "link", title: "How its page is made", onclick: () => this.open(entry)}, ...cell.childNodes);
        cell.replaceChildren(button);
      }
      return entry;
    });
    this.offer = element("p", {className: "note offer screen-only", role: "status", hidden: true});
    this.brushes = new Map();
    this.heads.forEach((head, column) => {
      const button = element("button", {type: "button", className: "sort", title: "Sort", onclick: () => this.sort(column)}, ...breakable(this.names[column]));
      head.replaceChildren(button);
    });
    this.filter = element("input", {type: "search", ariaLabel: "Filter rows", placeholder: "filter: a word, or column < 0.5", oninput: () => this.show()});
    this.count = element("output", {});
    node.prepend(element("div", {className: "bar screen-only"}, this.filter, this.count), this.offer);
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
    const gap = 136, edge = 72, height = 230, top = 34, bottom = height - 22, width = Math.max(gap * (this.axes.length - 1) + 2 * edge, 300);
    const svg = vector("svg", {viewBox: `0 0 ${width} ${height}`, width, height, class: "parallel", role: "img", "aria-label": "Parallel coordinates: a line for each row; drag on an axis to choose rows"});
    const place = (axis, value) => bottom - (bottom - top) * (Math.min(Math.max(value, axis.low), axis.high) - axis.low) / (axis.high - axis.low);
    const last = this.axes.at(-1);
    for (const entry of this.rows) {
      const points = this.axes.flatMap((axis, i) => Number.isNaN(entry.numbers[axis.column]) ? [] : [`${edge + gap * i},${place(axis, entry.numbers[axis.column])}`]);
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
    this.axes.forEach((axis, i) => svg.append(this.axis(svg, axis, edge + gap * i, top, bottom)));
    return element("div", {className: "wide", tabIndex: 0, role: "region", ariaLabel: "Parallel coordinates"}, svg);
  }

  /** What stands at an axis, in one or two lines: the component only where another axis is named so, neither too long. */
  axisTitle(axis) {
    const parts = ({column}) => this.names[column].match(/^(?:([^. ]+)\.)?(.*)$/).slice(1), [component, own] = parts(axis);
    const isShared = component && this.axes.filter((other) => parts(other)[1] === own).length > 1;
    return (isShared ? [component, own] : [own]).map((line) => line.length > MOST_LETTERS ? `${line.slice(0, MOST_LETTERS - 1)}…` : line);
  }

  /** An axis on which rows are chosen by dragging; a click takes the choice back. */
  axis(svg, axis, x, top, bottom) {
    const brush = vector("rect", {x: x - 8, width: 16, y: top, height: 0, class: "brush"});
    const strip = vector("rect", {x: x - 14, width: 28, y: top - 4, height: bottom - top + 8, class: "strip"});
    const name = this.names[axis.column], title = this.axisTitle(axis);
    const text = (y, content, style = "middle") => vector("text", {x, y, "text-anchor": style}, content);
    const lines = title.map((line, k) => text(top - 11 - 12 * (title.length - 1 - k), line));
    const group = vector("g", {class: "axis"}, vector("line", {x1: x, x2: x, y1: top, y2: bottom}), ...lines, text(bottom + 14, shown(axis.low, 3)),
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
      node.append(element("figure", {}, svg, element("figcaption", {}, ...breakable(this.names[axis.column]))));
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

  /** Show the page of a row, or the command that makes it. */
  open(entry) {
    if (entry.link) location.href = entry.link;
    else if (entry.folder) this.showCommand(entry);
    else entry.row.scrollIntoView({block: "center"});
  }

  showCommand({row, texts, folder}) {
    const command = `cosim open ${quoted(`${ownFolder()}${folder}`)}`, code = element("code", {textContent: command});
    const copy = element("button", {type: "button", textContent: "copy", onclick: () => navigator.clipboard?.writeText(command).then(() => { copy.textContent = "copied"; })});
    this.offer.replaceChildren(`The page of ${this.names[0].toLowerCase()} ${texts[0]} is made and opened by `, code, " ", copy, " — once it is there: ",
      element("a", {href: `${folder}/report.html`, textContent: `${folder}/report.html`}));
    this.offer.hidden = false;
    for (const {row: other} of this.rows) other.classList.toggle("lit", other === row);
    this.offer.scrollIntoView({block: "nearest"});
  }
}

for (const node of document.querySelectorAll(".explored")) new ExploredTable(node);
