// The explorer: what the panels share (range, cursor, abscissa, difference), the lists of signals and marks.

const QUIET = ["slip", "detection", "message"];  // kinds of marks that are not drawn at first: what observers say, not what is

class Explorer {
  constructor(node, data) {
    this.node = node;
    this.data = data;
    this.minus = null;
    this.cursor = null;
    this.axis = null;  // name of the curve over which is drawn; null for the abscissa of the recordings
    this.curves = data.recordings.flatMap((recording, run) => {
      recording.curves = recording.curves.map((entry) => new LiveCurve(recording, run, entry));
      return recording.curves;
    });
    this.names = [...new Set(this.curves.map((curve) => curve.name))];
    this.kinds = new Map([...new Set(data.marks.map((mark) => mark.kind))].map((kind) => [kind, !QUIET.includes(kind)]));
    this.charts = data.panels.filter((panel) => panel.shown).map((panel) => new Chart(this, {...panel}));
  }

  async start() {
    this.range = await this.ends();
    this.frame();
    await this.rebuild();
    new ResizeObserver(() => { if (this.panels.clientWidth !== this.width) this.redraw(); }).observe(this.panels);
    for (const query of ["(prefers-color-scheme: dark)", "print"]) matchMedia(query).addEventListener("change", () => this.rebuild());
    this.node.dataset.ready = "yes";
    setTimeout(() => this.refine());
  }

  /** Replace the extremes of long curves, which are drawn first, by all their rows. */
  async refine() {
    for (const chart of this.charts) {
      const found = [];
      for (const {curve} of chart.all ?? []) found.push(await curve.refine());
      if (found.some(Boolean)) await chart.build();
    }
    this.node.dataset.refined = "yes";
  }

  // -- what is drawn over -------------------------------------------------------------------------------------------

  /** Abscissa of a recording: its own, or a curve of it that ascends. */
  abscissa(recording) { return this.abscissaOf(recording, this.axis); }

  async abscissaOf(recording, axis) {
    recording.abscissas ||= {};
    return recording.abscissas[axis] ??= await (async () => {
      if (axis === null) return separated(await decoded(recording.x));
      const curve = recording.curves.find((c) => c.name === axis);
      if (!curve?.ascends || !curve.whole) return null;
      await curve.load();
      await curve.refine();
      return separated(curve.inUnit(true));
    })();
  }

  async ends() {
    const found = (await Promise.all(this.data.recordings.map((r) => this.abscissa(r)))).filter((x) => x?.length);
    const low = Math.min(...found.map((x) => x[0])), high = Math.max(...found.map((x) => x[x.length - 1]));
    this.limits = low < high ? [low, high] : found.length ? [low - 0.5, low + 0.5] : [0, 1];
    return this.limits;
  }

  whole() { return this.limits; }

  axisName() {
    const curve = this.curves.find((c) => c.name === this.axis), x = curve?.shown ?? this.data.recordings[0]?.x ?? {name: "time", unit: "s"};
    const name = curve ? curve.text : x.name;
    const begun = /^[a-z ]+$/.test(name) ? `${name.charAt(0).toUpperCase()}${name.slice(1)}` : name;  // a word, not a signal
    return `${begun}${x.unit && x.unit !== "1" ? ` [${x.unit}]` : ""}`;
  }

  height() { return this.charts.length > 1 ? 180 : 260; }

  curvesOf(name) { return this.curves.filter((curve) => curve.name === name); }

  /** Marks of the kinds that are shown, placed on the abscissa. */
  marks() {
    if (this.placed?.axis !== this.axis) this.placed = {axis: this.axis, marks: this.data.marks.map((mark) => this.place(mark))};
    return this.placed.marks.filter((mark) => this.kinds.get(mark.kind));
  }

  place(mark) {
    const recording = this.data.recordings[0], x = recording?.abscissas?.[this.axis], own = recording?.abscissas?.[null];
    if (this.axis === null || !x) return mark;
    const moved = (t) => t === null ? null : x[Math.min(rowAt(own, t), x.length - 1)];
    return {...mark, start: moved(mark.start), end: moved(mark.end)};
  }

  // -- moving -------------------------------------------------------------------------------------------------------

  zoom(from, to) {
    const [low, high] = this.limits, least = 1e-9 * (high - low);
    if (!(to - from > least)) return;
    this.range = [Math.max(from, low), Math.min(to, high)];
    if (this.range[0] >= this.range[1]) this.range = [low, high];
    this.redraw();
  }

  scale(factor, about = this.cursor ?? 0.5 * (this.range[0] + this.range[1])) {
    const [a, b] = this.range;
    this.zoom(about - (about - a) * factor, about + (b - about) * factor);
  }

  shift(by) {
    const [a, b] = this.range, [low, high] = this.limits, kept = Math.min(Math.max(by, low - a), high - b);
    this.zoom(a + kept, b + kept);
  }

  pan(share) { this.shift(share * (this.range[1] - this.range[0])); }

  point(place) {
    this.cursor = place;
    this.place_.textContent = place === null ? "" : `${this.axisName()}: ${shown(place, 8)}`;
    for (const chart of this.charts) chart.point(place);
  }

  /** Zoom to a mark, with the panels that it is about. */
  async jump(mark) {
    const [low, high] = this.limits, end = mark.end ?? mark.start, width = mark.end === null ? (high - low) / 40 : Math.max(0.3 * (end - mark.start), (high - low) / 1000);
    const about = (title) => mark.panel && (title === mark.panel || title.startsWith(`${mark.panel}: `));
    const absent = this.data.panels.filter((panel) => about(panel.title) && !this.charts.some((chart) => chart.panel.title === panel.title));
    for (const panel of absent.reverse()) await this.add(panel, true);
    this.cursor = mark.start;
    this.zoom(mark.start - width, end + width);
    this.point(mark.start);
    const chart = this.charts.find((c) => c.panel.title === mark.panel);
    (chart?.node ?? this.node).scrollIntoView({block: "nearest"});
    this.note.textContent = mark.text;
  }

  /** Jump to the next mark in this direction. */
  step(direction) {
    const marks = this.marks().filter((mark) => mark.kind !== "phase").sort((a, b) => a.start - b.start);
    const here = this.cursor ?? (direction > 0 ? -Infinity : Infinity);
    const found = direction > 0 ? marks.find((m) => m.start > here) : marks.filter((m) => m.start < here).at(-1);
    if (found) this.jump(found);
  }

  async rebuild() {
    this.width = this.panels.clientWidth;
    await Promise.all(this.charts.map((chart) => chart.build()));
  }

  redraw() {
    this.width = this.panels.clientWidth;
    for (const chart of this.charts) chart.draw(false);
  }

  // -- panels -------------------------------------------------------------------------------------------------------

  async add(panel, isFirst = false) {
    const chart = new Chart(this, {bands: [], log: false, ...panel});
    this.charts[isFirst ? "unshift" : "push"](chart);
    this.panels[isFirst ? "prepend" : "append"](chart.node);
    await chart.build();
    await this.refine();
    this.listSignals();
    this.listPanels();
  }

  remove(chart) {
    chart.plot?.destroy();
    chart.node.remove();
    this.charts = this.charts.filter((other) => other !== chart);
    this.listSignals();
    this.listPanels();
  }

  /** Put a signal into a panel, or take it out of all. */
  async toggle(name) {
    const holding = this.charts.filter((chart) => chart.panel.curves.includes(name));
    for (const chart of holding) {
      chart.panel.curves = chart.panel.curves.filter((other) => other !== name);
      if (chart.panel.curves.length) await chart.build(); else this.remove(chart);
    }
    if (!holding.length) {
      const {unit} = this.curvesOf(name)[0].shown, goal = this.goal.value;
      const chart = goal === "new" ? null : goal === "unit" ? this.charts.find((c) => c.isOwn && c.unit === unit) : this.charts[Number(goal)];
      if (chart) { chart.panel.curves = [...chart.panel.curves, name]; await chart.build(); await this.refine(); } else {
        await this.add({title: goal === "new" ? name : `Signals [${unit}]`, curves: [name]});
        Object.assign(this.charts.at(-1), {isOwn: true, unit});
      }
    }
    this.listSignals();
    this.listPanels();
  }

  /** Draw one signal minus another one; what is wrong with that, in words, or nothing. */
  async subtract(first, second) {
    const unknown = [first, second].find((name) => !this.names.includes(name));
    if (unknown !== undefined) return unknown ? `No signal is named ${unknown}.` : "Choose two signals.";
    const pairs = this.curvesOf(first).flatMap((a) => this.curvesOf(second).filter((b) => b.recording === a.recording).map((b) => [a, b]));
    if (!pairs.length) return `No run holds both ${first} and ${second}.`;
    const odd = pairs.find(([a, b]) => a.unit !== b.unit);
    if (odd) return `${first} is in ${odd[0].unit}, ${second} in ${odd[1].unit}: a difference needs two signals of one unit.`;
    const found = pairs.map(([a, b]) => new Difference(a, b, () => this.abscissaOf(a.recording, null))), {name} = found[0];
    if (!this.names.includes(name)) {
      this.curves.push(...found);
      this.names.push(name);
    }
    if (!this.charts.some((chart) => chart.panel.curves.includes(name))) await this.add({title: name, curves: [name]}, true);
    this.charts.find((chart) => chart.panel.curves.includes(name)).node.scrollIntoView({block: "nearest"});
    return "";
  }

  // -- the frame ----------------------------------------------------------------------------------------------------

  frame() {
    const button = (text, title, act) => element("button", {type: "button", textContent: text, title, ariaLabel: title, onclick: act});
    this.place_ = element("output", {className: "place"});
    this.note = element("p", {className: "note", role: "status"});
    this.panels = element("div", {className: "panels"}, ...this.charts.map((chart) => chart.node));
    const choices = [this.choice("Over", [[null, this.data.recordings[0].x.name], ...this.ascending()], async (value) => {
      this.axis = value;
      this.point(null);
      this.range = await this.ends();
      await this.rebuild();
    })];
    const shared = this.data.recordings.map((_, i) => i).filter((i) => this.curves.some((c) => c.run === i && this.curvesOf(c.name).length > 1));
    if (shared.length) {
      choices.push(this.choice("Show", [[null, "values"], ...shared.map((i) => [i, `difference to ${this.data.recordings[i].label}`])], (value) => {
        this.minus = value;
        return this.rebuild();
      }));
    }
    const first = this.data.marks.find((mark) => mark.kind === "worst");
    const worst = first ? [button("worst", "The worst point", () => this.jump(this.place(first)))] : [];
    const bar = element("div", {className: "bar screen-only", role: "toolbar", ariaLabel: "Range"},
      button("+", "Zoom in", () => this.scale(0.5)), button("−", "Zoom out", () => this.scale(2)),
      button("◀", "Earlier", () => this.pan(-0.4)), button("▶", "Later", () => this.pan(0.4)), button("all", "The whole range", () => this.zoom(...this.limits)),
      button("⇤", "Mark before", () => this.step(-1)), button("⇥", "Next mark", () => this.step(1)), ...worst, ...choices, this.place_);
    const more = this.data.panels.filter((panel) => !panel.shown);
    if (more.length) {
      const add = this.choice("Add", [[null, "a panel"], ...more.map((panel) => [panel, panel.title])], (panel) => {
        add.querySelector("select").selectedIndex = 0;
        return panel && this.add(panel);
      });
      bar.insertBefore(add, this.place_);
    }
    this.node.replaceChildren(bar, this.note, element("div", {className: "columns"}, this.panels, this.lists()));
    this.panels.addEventListener("keydown", (e) => this.key(e));
    this.panels.addEventListener("mouseleave", () => this.point(null));
  }

  ascending() {
    return this.names.filter((name) => this.curvesOf(name).every((c) => c.ascends && c.whole)).map((name) => [name, name]);
  }

  choice(text, options, act) {
    const list = element("select", {}, ...options.map(([, label], i) => element("option", {value: i, textContent: label})));
    list.onchange = () => act(options[list.value][0]);
    return element("label", {className: "choice"}, `${text} `, list);
  }

  key(event) {
    const [a, b] = this.range, here = this.cursor ?? 0.5 * (a + b);
    const acts = {
      "+": () => this.scale(0.5), "=": () => this.scale(0.5), "-": () => this.scale(2), Home: () => this.zoom(...this.limits), n: () => this.step(1), p: () => this.step(-1),
      ArrowLeft: () => event.shiftKey ? this.pan(-0.2) : this.point(Math.max(here - 0.01 * (b - a), a)),
      ArrowRight: () => event.shiftKey ? this.pan(0.2) : this.point(Math.min(here + 0.01 * (b - a), b)),
    };
    if (!acts[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    acts[event.key]();
  }

  // -- lists --------------------------------------------------------------------------------------------------------

  lists() {
    const search = element("input", {type: "search", placeholder: `search ${this.names.length} signals`, ariaLabel: "Search signals", oninput: () => this.listSignals()});
    this.search = search;
    this.goal = element("select", {ariaLabel: "Panel that a signal is added to"});
    this.signals = element("div", {className: "signals"});
    const signals = element("details", {open: innerWidth >= 900}, element("summary", {textContent: "Signals"}), search,
      element("label", {className: "choice"}, "add to ", this.goal), this.signals);
    const lists = element("aside", {className: "lists screen-only"}, signals, this.differences());
    if (this.data.marks.length) {
      this.markSearch = element("input", {type: "search", placeholder: `search ${this.data.marks.length} marks`, ariaLabel: "Search marks", oninput: () => this.listMarks()});
      this.markKinds = element("div", {className: "kinds"}, ...[...this.kinds].map(([kind]) => {
        const entry = element("button", {type: "button", textContent: kind, onclick: () => {
          this.kinds.set(kind, !this.kinds.get(kind));
          entry.setAttribute("aria-pressed", String(this.kinds.get(kind)));
          this.listMarks();
          this.redraw();
        }});
        entry.setAttribute("aria-pressed", String(this.kinds.get(kind)));
        return entry;
      }));
      this.markList = element("ol", {className: "marks"});
      lists.append(element("details", {open: innerWidth >= 900}, element("summary", {textContent: "Marks"}), this.markKinds, this.markSearch, this.markList));
      this.listMarks();
    }
    this.listSignals();
    this.listPanels();
    return lists;
  }

  /** The form that asks for the difference of two signals. */
  differences() {
    const names = element("datalist", {id: "signal-names"}, ...this.names.map((name) => element("option", {value: name, label: `[${this.curvesOf(name)[0].shown.unit}]`})));
    const [first, second] = ["first signal", "minus second signal"].map((text) => {
      const field = element("input", {type: "search", placeholder: text, ariaLabel: text});
      field.setAttribute("list", names.id);
      return field;
    });
    const said = element("p", {className: "note", role: "status"});
    const draw = async (event) => {
      event.preventDefault();
      said.textContent = await this.subtract(first.value.trim(), second.value.trim());
    };
    const form = element("form", {className: "difference", onsubmit: draw}, first, second, element("button", {textContent: "draw"}), said, names);
    return element("details", {}, element("summary", {textContent: "Difference of two signals"}), form);
  }

  listPanels() {
    const before = this.goal.value;
    const options = [["unit", "a panel of its unit"], ["new", "a new panel"], ...this.charts.map((chart, i) => [String(i), chart.panel.title])];
    this.goal.replaceChildren(...options.map(([value, textContent]) => element("option", {value, textContent})));
    this.goal.value = options.some(([value]) => value === before) ? before : "unit";
  }

  listSignals() {
    const words = this.search.value.toLowerCase().split(/\s+/).filter(Boolean), groups = new Map();
    for (const name of this.names) {
      const [curve] = this.curvesOf(name);
      if (curve.look === "allowed") continue;  // the edge of a band
      const text = `${name} ${curve.unit} ${curve.shown.unit} ${curve.label} ${curve.description}`.toLowerCase();
      if (!words.every((word) => text.includes(word))) continue;
      const component = name.includes(".") ? name.slice(0, name.indexOf(".")) : "";
      groups.set(component, [...(groups.get(component) ?? []), curve]);
    }
    const entry = (curve) => {
      const units = [...new Set(this.curvesOf(curve.name).map((c) => c.shown.unit))];
      const made = element("button", {type: "button", className: "signal", title: curve.description, onclick: () => this.toggle(curve.name)},
        element("span", {textContent: curve.name.slice(curve.name.indexOf(".") + 1)}), element("span", {className: "unit", textContent: units.map((u) => u === "1" ? "" : u).join(" / ")}));
      made.dataset.name = curve.name;
      made.setAttribute("aria-pressed", String(this.charts.some((chart) => chart.panel.curves.includes(curve.name))));
      return made;
    };
    this.signals.replaceChildren(...[...groups].map(([component, curves]) => element("details", {open: groups.size < 4 || words.length > 0},
      element("summary", {textContent: `${component || "signals"} (${curves.length})`}), ...curves.map(entry))));
    if (!groups.size) this.signals.append("No signal has this in its name, unit or description.");
  }

  listMarks() {
    const words = this.markSearch.value.toLowerCase().split(/\s+/).filter(Boolean), most = 200;
    const found = this.data.marks.filter((mark) => this.kinds.get(mark.kind) && words.every((word) => `${mark.kind} ${mark.text}`.toLowerCase().includes(word)));
    this.markList.replaceChildren(...found.slice(0, most).map((mark) => element("li", {}, element("button", {type: "button", onclick: () => this.jump(this.place(mark))},
      element("b", {textContent: shown(mark.start, 6)}), ` ${mark.text}`))));
    if (found.length > most) this.markList.append(element("li", {textContent: `and ${found.length - most} more: search`}));
  }
}

const liveNode = document.getElementById("explorer");
if (liveNode) {
  liveNode.explorer = new Explorer(liveNode, JSON.parse(document.getElementById("live-data").textContent));
  liveNode.explorer.start();
}
