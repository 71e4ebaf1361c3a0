// One panel: its plot, its legend with the values at the cursor, its marks.

const COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"];  // Okabe and Ito
const ON_DARK = ["#56B4E9", "#E69F00", "#009E73", "#CC79A7", "#D55E00", "#F0E442"];
const DASHES = [[], [8, 3], [3, 2], [7, 2, 2, 2], [12, 4], [6, 2, 2, 2, 2, 2]];
const AREAS = {zone: "#56B4E9", fault: "#D55E00", phase: "#999999", detection: "#CC79A7", slip: "#E69F00"};
const FAR = 50;  // a curve that is so much larger than the next smaller one leaves the scale
const LINES = 60;  // more marks of a kind than these are ticks

const element = (tag, properties = {}, ...children) => {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
};
const themed = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

/** A number as people read it. */
function shown(value, digits = 5) {
  if (Number.isNaN(value) || value == null) return "–";
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "−∞";
  const size = Math.abs(value);
  const text = size && (size < 1e-4 || size >= 1e6) ? Number(value.toExponential(digits - 2)).toExponential().replace("+", "") : String(Number(value.toPrecision(digits)));
  return text.replace("-", "−");
}

class Chart {
  constructor(explorer, panel) {
    this.explorer = explorer;
    this.panel = panel;
    this.hidden = new Set();
    this.log = panel.log;
    this.wide = panel.whole;
    this.legend = element("div", {className: "legend"});
    this.room = element("div", {className: "plot", tabIndex: 0, role: "img"});
    this.logButton = this.button("log", "Logarithmic axis, of absolute values", () => { this.log = !this.log; this.build(); });
    this.scaleButton = this.button("all values", "Scale that shows every value, however far off", () => { this.wide = !this.wide; this.build(); });
    this.node = element("figure", {className: "panel"},
      element("figcaption", {}, element("b", {textContent: panel.title}),
        element("span", {className: "screen-only"}, this.logButton, this.scaleButton,
          this.button("×", "Remove this panel", () => explorer.remove(this)))), this.legend, this.room);
  }

  button(text, title, act) {
    const made = element("button", {type: "button", textContent: text, title, onclick: act});
    made.setAttribute("aria-label", `${title}: ${this.panel.title}`);
    return made;
  }

  /** The curves that are drawn, with the values that are: those of the run, or their difference to another run. Curves
      that are kept in one unit have one axis: in the unit in which all of them are shown, else in that one. */
  async parts() {
    const {explorer} = this, wanted = this.panel.curves.flatMap((name) => explorer.curvesOf(name));
    await Promise.all(wanted.map((curve) => curve.load()));
    const minus = explorer.minus, found = [];
    const isShown = (curve) => wanted.every((other) => other.unit !== curve.unit || other.shown.unit === curve.shown.unit);
    for (const curve of wanted) {
      const base = minus === null ? null : explorer.curvesOf(curve.name).find((c) => c.run === minus);
      const abscissa = await explorer.abscissa(curve.recording);
      if (!abscissa) continue;
      const unit = isShown(curve) ? curve.shown : {unit: curve.unit, factor: 1, offset: 0};
      const part = {curve, x: curve.over(abscissa), y: curve.inUnit(isShown(curve)), ...unit};
      if (minus !== null) {
        if (!base || base === curve || base.unit !== curve.unit) continue;
        await base.load();
        const other = base.over(await explorer.abscissa(base.recording));
        part.y = Float64Array.from(part.x, (place, row) => (curve.y[row] - base.at(other, place)) / part.factor);
      }
      found.push(part);
    }
    return found;
  }

  /** What distinguishes a curve: its role, else its colour says which name, or which run where it is the only name. */
  look(curve, place, names) {
    const holding = this.explorer.curvesOf(curve.name), run = holding.indexOf(curve), n = COLOURS.length;
    const dash = DASHES[holding.length > 1 ? run % n : (place + Math.floor(place / n)) % n];
    if (curve.look === "allowed") return {stroke: "#E69F00", width: 1};
    if (curve.look === "true") return {stroke: themed("ink"), width: 2.6, alpha: 0.55, dash: DASHES[run % n]};
    if (curve.look === "measured") return {stroke: themed("soft"), width: 0.9, dash: DASHES[run % n]};
    if (curve.look === "wanted") return {stroke: themed("ink"), width: 1.1, dash: [2, 5]};
    const colours = themed("dark") ? ON_DARK : COLOURS;
    return {stroke: colours[(names === 1 ? run : place) % n], width: 1.6, dash};
  }

  text(part) {
    const several = this.explorer.data.recordings.filter((r) => r.curves.some((c) => c.name === part.curve.name)).length > 1;
    const run = part.curve.recording.label, minus = this.explorer.minus;
    if (minus !== null) return `${part.curve.text}: ${run} − ${this.explorer.data.recordings[minus].label}`;
    if (several && part.curve.name === this.panel.title) return run;
    return several ? `${part.curve.text}: ${run}` : part.curve.text;
  }

  async build() {
    this.all = await this.parts();
    const names = [...new Set(this.all.filter((part) => !["allowed", "measured", "wanted"].includes(part.curve.look)).map((part) => part.curve.name))];
    const estimates = names.filter((name) => this.all.some((part) => part.curve.name === name && !part.curve.look));
    for (const part of this.all) part.style = this.look(part.curve, Math.max(estimates.indexOf(part.curve.name), 0), names.length);
    this.list();
    this.draw(true);
  }

  list() {
    this.legend.replaceChildren(...this.all.map((part) => {
      part.value = element("output", {className: "value"});
      const sample = element("span", {className: "sample"});
      sample.style.cssText = `border-top: ${Math.max(part.style.width, 2)}px ${part.style.dash?.length ? "dashed" : "solid"} ${part.style.stroke}`;
      const entry = element("button", {type: "button", className: "entry", title: part.curve.description || part.curve.name},
        sample, element("span", {className: "name", textContent: this.text(part)}), part.value);
      entry.onclick = () => { this.hidden[this.hidden.has(part.curve) ? "delete" : "add"](part.curve); this.list(); this.draw(true); };
      entry.setAttribute("aria-pressed", String(!this.hidden.has(part.curve)));
      if (!part.curve.whole) entry.append(element("small", {textContent: "extremes only"}));
      part.entry = entry;
      return entry;
    }));
    this.logButton.setAttribute("aria-pressed", String(this.log));
    this.scaleButton.setAttribute("aria-pressed", String(!!this.wide));
    const legible = this.all.map((part) => `${this.text(part)} [${part.unit}]`).join(", ");
    this.room.setAttribute("aria-label", `${this.panel.title} against ${this.explorer.axisName()}: ${legible}. Arrow keys move the cursor, plus and minus zoom.`);
  }

  /** Draw what the range shows. isNew: whether other curves are drawn than before, or on other axes. */
  draw(isNew) {
    if (!this.all) return;
    const {explorer} = this, [from, to] = explorer.range;
    this.visible = this.all.filter((part) => !this.hidden.has(part.curve));
    const width = Math.max(this.room.clientWidth, 120), pieces = Math.max(width, 200);
    const values = (part) => this.log ? part.y.map((v) => v === 0 ? NaN : Math.abs(v)) : part.y;
    this.plotted = drawn(this.visible.map((part) => ({x: part.x, y: values(part)})), from, to, pieces);
    const units = [...new Set(this.visible.map((part) => part.unit))];
    this.limits = Object.fromEntries(units.map((unit) => [unit, this.limitsOf(unit)]));
    const data = this.plotted.length > 1 ? this.plotted : [[from, to]];
    if (isNew || !this.plot) {
      this.plot?.destroy();
      this.plot = new uPlot(this.options(width, units), data, this.room);
      this.react(this.plot.over);
    } else {
      if (this.plot.width !== width) this.plot.setSize({width, height: this.plot.height});
      this.plot.setSelect({left: 0, width: 0, top: 0, height: 0}, false);
      this.plot.setData(data);
    }
  }

  /** Ends of the axis of a unit; a curve that is far larger than the others does not set them, nor does an estimate
      before it is evaluated. What has a look of its own (the truth, a reading, what is allowed) is seen whole. */
  limitsOf(unit) {
    const [x, ...columns] = this.plotted, from = Math.max(this.explorer.data.settled ?? -Infinity, this.explorer.range[0]);
    const sizes = this.visible.flatMap((part, i) => {
      if (part.unit !== unit) return [];
      let low = Infinity, high = -Infinity;
      for (const late of [true, false]) {
        for (let k = 0; k < x.length; k++) {
          const v = columns[i][k];
          if (v == null || x[k] > this.explorer.range[1] || x[k] < (late && !part.curve.look ? from : this.explorer.range[0])) continue;
          low = Math.min(low, v); high = Math.max(high, v);
        }
        if (low <= high) break;
      }
      return low <= high ? [{part, low, high}] : [];
    });
    for (const {part} of sizes) part.off = false;
    if (!sizes.length) return this.log ? [0.1, 1] : [0, 1];
    let kept = sizes;
    if (!this.wide && !this.log && sizes.length > 1) {
      const middles = sizes.map((s) => 0.5 * (s.low + s.high)).sort((a, b) => a - b), middle = middles[middles.length >> 1];
      for (const s of sizes) s.size = Math.max(Math.abs(s.high - middle), Math.abs(s.low - middle));
      const sorted = sizes.filter((s) => s.size > 0 && s.part.curve.look !== "allowed").sort((a, b) => a.size - b.size);
      const cut = sorted.findIndex((s, i) => i > 0 && s.size > FAR * sorted[i - 1].size && sorted.slice(i).every((t) => !t.part.curve.look));
      if (cut > 0) for (const s of sorted.slice(cut)) s.part.off = true;
      kept = sizes.filter((s) => !s.part.off);
    }
    let low = Math.min(...kept.map((s) => s.low)), high = Math.max(...kept.map((s) => s.high));
    if (this.log) return [low * 0.8, high * 1.25];
    if (high - low <= 1e-9 * Math.max(Math.abs(low), Math.abs(high))) { const r = Math.abs(high) || 1; low -= 0.5 * r; high += 0.5 * r; }
    const room = 0.06 * (high - low);
    return [low - room, high + room];
  }

  options(width, units) {
    const {explorer} = this, grid = {stroke: themed("grid"), width: 1}, stroke = themed("soft"), font = "12px system-ui, sans-serif";
    const axis = {stroke, font, grid, ticks: grid};
    const scales = {x: {time: false, range: () => explorer.range}};
    for (const unit of units) scales[`y ${unit}`] = {distr: this.log ? 3 : 1, range: () => this.limits[unit]};
    const sides = units.slice(0, 3).map((unit, i) => ({...axis, scale: `y ${unit}`, side: i ? 1 : 3, size: 62, labelFont: font, labelSize: 18,
      label: `[${unit}]`, grid: i ? {show: false} : grid, values: (_, splits) => splits.map((v) => v == null ? "" : shown(v, 6))}));
    const bands = this.panel.bands.flatMap(([low, high]) => explorer.data.recordings.flatMap((recording) => {
      const [a, b] = [high, low].map((name) => this.visible.findIndex((p) => p.curve.name === name && p.curve.recording === recording));
      return a < 0 || b < 0 || this.log ? [] : [{series: [a + 1, b + 1], fill: "#E69F0040"}];
    }));
    return {
      width, height: explorer.height(), legend: {show: false}, scales, bands, padding: [8, 30, 0, 0],
      axes: [{...axis, label: explorer.axisName(), labelFont: font, labelSize: 18, size: 34, space: 76, values: (_, splits) => splits.map((v) => shown(v, 7))}, ...sides],
      cursor: {y: false, points: {show: false}, drag: {x: true, y: false, setScale: false}, bind: {dblclick: () => () => explorer.zoom(...explorer.whole())}},
      series: [{}, ...this.visible.map((part) => ({
        ...part.style, scale: `y ${part.unit}`, points: {show: (u) => u.data[0].length <= 2 * LINES, size: 5},
        ...(part.curve.held ? {paths: uPlot.paths.stepped({align: 1})} : {}),
      }))],
      hooks: {
        setSelect: [(u) => { if (u.select.width > 4) explorer.zoom(u.posToVal(u.select.left, "x"), u.posToVal(u.select.left + u.select.width, "x")); }],
        drawClear: [(u) => this.areas(u)],
        draw: [(u) => { this.marks(u); queueMicrotask(() => this.point(explorer.cursor)); }],  // whose place has moved
      },
    };
  }

  /** Marks of this panel in sight, by kind. */
  inSight() {
    const [from, to] = this.explorer.range, kinds = new Map();
    for (const mark of this.explorer.marks()) {
      if ((mark.end ?? mark.start) < from || mark.start > to || (mark.panel && mark.panel !== this.panel.title)) continue;
      kinds.set(mark.kind, [...(kinds.get(mark.kind) ?? []), mark]);
    }
    return kinds;
  }

  areas(u) {
    const {ctx, bbox} = u;
    ctx.save();
    for (const [kind, marks] of this.inSight()) {
      ctx.fillStyle = (AREAS[kind] ?? "#999999") + (kind === "phase" ? "14" : "30");
      marks.filter((mark) => mark.end !== null).forEach((mark, i) => {
        if (kind === "phase" && i % 2) return;  // neighbours differ
        const [a, b] = [mark.start, mark.end].map((place) => Math.min(Math.max(u.valToPos(place, "x", true), bbox.left), bbox.left + bbox.width));
        ctx.fillRect(a, bbox.top, Math.max(b - a, 1), bbox.height);
      });
    }
    ctx.restore();
  }

  marks(u) {
    const {ctx, bbox} = u, ratio = devicePixelRatio;
    ctx.save();
    for (const [kind, marks] of this.inSight()) {
      const instants = marks.filter((mark) => mark.end === null), bottom = bbox.top + bbox.height;
      ctx.strokeStyle = kind === "balise" ? themed("mark") : kind === "worst" || kind === "outside" ? themed("bad") : themed("doubt");
      ctx.setLineDash(kind === "balise" ? [] : [5 * ratio, 4 * ratio]);
      ctx.lineWidth = ratio;
      ctx.beginPath();
      for (const mark of instants) {
        const place = u.valToPos(mark.start, "x", true);
        ctx.moveTo(place, kind === "balise" && instants.length > 8 || instants.length > LINES ? bottom - 6 * ratio : bbox.top);
        ctx.lineTo(place, bottom);
      }
      ctx.stroke();
      ctx.setLineDash([]);
      for (const mark of marks.filter((m) => m.value !== null && m.panel === this.panel.title && this.visible.length)) {
        ctx.lineWidth = 2.5 * ratio;
        ctx.strokeStyle = themed("bad");
        ctx.beginPath();
        const [{unit, factor, offset}] = this.visible;
        ctx.arc(u.valToPos(mark.start, "x", true), u.valToPos((mark.value - offset) / factor, `y ${unit}`, true), 7 * ratio, 0, 2 * Math.PI);
        ctx.stroke();
      }
    }
    ctx.restore();
  }

  /** Show the cursor at a place, and the values there. */
  point(place) {
    if (!this.plot) return;
    this.plot.setCursor(place === null ? {left: -10, top: -10} : {left: this.plot.valToPos(place, "x"), top: 0});
    for (const part of this.all) {
      const value = place === null ? NaN : this.valueAt(part, place);
      part.value.textContent = place === null ? "" : `${shown(value)}${part.unit === "1" ? "" : ` ${part.unit}`}`;
      part.entry.classList.toggle("off-scale", !!part.off);
    }
  }

  valueAt(part, place) {
    const {x, y} = part, next = rowAt(x, place);
    if (part.curve.held && next > 0 && !(x[next] === place)) return y[next - 1];
    return y[next > 0 && (next >= x.length || place - x[next - 1] < x[next] - place) ? next - 1 : next];
  }

  /** Wheel, fingers: zoom about where they are, pan. */
  react(over) {
    const {explorer} = this, place = (e) => this.plot.posToVal(e.clientX - over.getBoundingClientRect().left, "x");
    for (const kind of ["mousemove", "pointerdown"]) over.addEventListener(kind, (e) => explorer.point(place(e)));
    over.addEventListener("wheel", (e) => {
      if (!e.ctrlKey && !e.shiftKey) return;  // the page scrolls
      e.preventDefault();
      if (e.shiftKey) explorer.pan(Math.sign(e.deltaY || e.deltaX) * 0.1);
      else explorer.scale(e.deltaY > 0 ? 1.25 : 0.8, place(e));
    }, {passive: false});
    over.addEventListener("mousedown", (e) => {
      if (!e.shiftKey) return;
      e.stopImmediatePropagation();
      const grip = place(e), move = (m) => explorer.shift(grip - place(m));
      addEventListener("mousemove", move);
      addEventListener("mouseup", () => removeEventListener("mousemove", move), {once: true});
    }, {capture: true});
    const fingers = new Map();
    over.addEventListener("pointerdown", (e) => { if (e.pointerType === "touch") fingers.set(e.pointerId, place(e)); });
    over.addEventListener("pointermove", (e) => {
      if (!fingers.has(e.pointerId)) return;
      if (fingers.size === 1) { explorer.shift(fingers.get(e.pointerId) - place(e)); return; }
      const [other] = [...fingers].filter(([id]) => id !== e.pointerId).map(([, held]) => held), held = fingers.get(e.pointerId);
      const factor = (held - other) / (place(e) - other);
      if (Number.isFinite(factor) && factor > 0.2 && factor < 5) explorer.scale(factor, other);
    });
    for (const end of ["pointerup", "pointercancel", "pointerleave"]) over.addEventListener(end, (e) => fingers.delete(e.pointerId));
  }
}
