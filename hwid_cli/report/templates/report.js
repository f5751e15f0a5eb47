"use strict";
(() => {
const root = document.documentElement;
const all = (selector, within = document) => [...within.querySelectorAll(selector)];
const colour = name => getComputedStyle(root).getPropertyValue("--" + name).trim();
const make = (tag, attributes = {}, ...inside) => {
  const found = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) found.setAttribute(name, value);
  found.append(...inside);
  return found;
};
const button = (text, label, act) => {
  const found = make("button", { type: "button", "aria-label": label, title: label }, text);
  found.addEventListener("click", act);
  return found;
};

// ---- numbers -------------------------------------------------------------------
// Curves travel as steps between rounded values: {o: offset, s: size of a step, d: steps}.
const decoded = packed => {
  if (Array.isArray(packed)) return packed;
  let sum = 0;
  return packed.d.map(step => (step === null ? null : packed.o + packed.s * (sum += step)));
};
// Times travel as runs of equal steps: [first, step, count].
const unrolled = runs => runs.flatMap(([first, step, count]) =>
  Array.from({ length: count }, (_, place) => first + place * step));
const shown = value => {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size === 0) return "0";
  const short = Number(value.toPrecision(4));
  return size < 1e-3 || size >= 1e5 ? short.toExponential() : String(short);
};

// ---- how the curves look -----------------------------------------------------------
// Colours differ in brightness too, and dashes tell curves apart without any colour.
const LOOKS = {
  measured: { colour: "measured", width: 3 },
  simulated: { colour: "blue", width: 1.6, dash: [7, 3] },
  taken: { colour: "green", width: 1.6, dash: [10, 3, 2, 3] },
  linear: { colour: "red", width: 1.4, dash: [3, 3] },
  given: { colour: "quiet", width: 1.3, dash: [3, 3] },
  refitted: { colour: "red", width: 1.4, dash: [3, 3] },
  extended: { colour: "blue", width: 1.8, dash: [7, 3] },
  input: { colour: "ink", width: 1.2 },
  estimate: { colour: "ink", width: 1.2 },
  law: { colour: "blue", width: 2.2, dash: [7, 3] },
  map: { colour: "blue", width: 2 },
  corner: { colour: "red", width: 1 },
  pole: { colour: "blue", width: 1 },
  zero: { colour: "red", width: 1 },
  chance: { colour: "blue", width: 1, dash: [5, 4] },
  beyond: { colour: "red", width: 1 },
  noise: { colour: "band", width: 0 },
  frame: { colour: "quiet", width: 1 },
};
const look = role => LOOKS[role] || LOOKS.input;
const cross = (u, seriesIdx) => {
  // A cross for poles, drawn by hand: points are circles otherwise.
  const path = new Path2D(), size = 5 * devicePixelRatio;
  const [xs, ys] = [u.data[0], u.data[seriesIdx]];
  xs.forEach((x, place) => {
    if (ys[place] === null || ys[place] === undefined) return;
    const left = u.valToPos(x, "x", true), top = u.valToPos(ys[place], "y", true);
    path.moveTo(left - size, top - size); path.lineTo(left + size, top + size);
    path.moveTo(left - size, top + size); path.lineTo(left + size, top - size);
  });
  return { stroke: path };
};
const stems = (u, seriesIdx) => {
  const path = new Path2D(), foot = u.valToPos(0, "y", true);
  u.data[0].forEach((x, place) => {
    const y = u.data[seriesIdx][place];
    if (y === null || y === undefined) return;
    const left = u.valToPos(x, "x", true);
    path.moveTo(left, foot); path.lineTo(left, u.valToPos(y, "y", true));
  });
  return { stroke: path };
};

// ---- one chart: panels above each other that share their horizontal axis --------------
const charts = new Map();
let numbered = 0;

// The label of an axis with a font that fits into so many pixels; words at its beginning go
// where none does: the symbol and the unit stay, the caption has the words.
const fitted = (label, room) => {
  if (!label) return {};
  const ctx = make("canvas", {}).getContext("2d");
  for (let words = label.split(" "), bracket; ; words = words.slice(1)) {
    bracket = words.findIndex(one => one.startsWith("["));
    for (const px of [12, 11, 10]) {
      const labelFont = `${px}px system-ui, sans-serif`;
      ctx.font = labelFont;
      const text = words.join(" ");
      if (ctx.measureText(text).width <= room || (px === 10 && (bracket < 2 || words.length < 2)))
        return { label: text, labelFont };
    }
  }
};

class Chart {
  constructor(figure) {
    this.figure = figure;
    this.spec = JSON.parse(figure.querySelector("script.data").textContent);
    this.x = this.spec.runs ? unrolled(this.spec.runs) : decoded(this.spec.x);
    this.place = figure.querySelector(".plot");
    this.place.textContent = "";
    this.sync = uPlot.sync("chart" + numbered++);
    this.isMoving = false;
    this.hidden = new Set(this.spec.panels.flatMap(panel => panel.curves)
      .filter(curve => curve.off).map(curve => this.key(curve)));
    this.values = new Map();
    this.full = this.spec.full || this.extent();
    this.toolbar();
    this.legend();
    this.plots = this.spec.panels.map((panel, place) => this.panel(panel, place));
    this.limit(...(this.spec.window || this.full));
    this.place.tabIndex = 0;
    this.place.setAttribute("role", "group");
    this.place.setAttribute("aria-label", figure.dataset.alt +
      ". Arrow keys move the view, plus and minus zoom, 0 shows all, Shift and arrows move the cursor.");
    this.place.addEventListener("keydown", event => this.press(event));
    new ResizeObserver(() => this.fit()).observe(this.place);
  }

  key(curve) { return curve.g || curve.l; }

  extent() {
    const known = this.x.filter(Number.isFinite);
    const low = Math.min(...known), high = Math.max(...known);
    return low === high ? [low - 1, high + 1] : [low, high];
  }

  toolbar() {
    const bar = make("div", { class: "tools" });
    bar.append(
      button("+", "Zoom in", () => this.zoom(0.5)),
      button("−", "Zoom out", () => this.zoom(2)),
      button("All", "Show everything", () => this.limit(...this.full)));
    if (this.spec.detail)
      bar.append(button("Detail", "Show the transient", () => this.limit(...this.spec.detail)));
    bar.append(button("PNG", "Save this view as a picture", () => this.save()));
    const models = [...new Set(this.spec.panels.flatMap(panel => panel.curves)
      .filter(curve => curve.g).map(curve => curve.g))];
    if (models.length > 1 && this.spec.models) {
      const choice = make("select", { "aria-label": "Model", class: "model" },
        make("option", { value: "" }, "all models"),
        ...models.map(name => make("option", { value: name }, name)));
      choice.addEventListener("change", () => {
        models.forEach(name => this.show(name, !choice.value || choice.value === name));
      });
      bar.append(make("label", {}, "Model ", choice));
    }
    this.figure.insertBefore(bar, this.place);
  }

  legend() {
    const list = make("div", { class: "legend", role: "group", "aria-label": "Curves: press to hide or show" });
    this.at = make("span", { class: "at" });
    const seen = new Set();
    for (const panel of this.spec.panels) for (const curve of panel.curves) {
      const key = this.key(curve);
      if (seen.has(key) || !key) continue;
      seen.add(key);
      const value = make("span", { class: "value" });
      const one = button("", `${key}: hide or show`, () => this.show(key, this.hidden.has(key)));
      one.classList.add("curve");
      one.dataset.key = key;
      one.setAttribute("aria-pressed", String(!this.hidden.has(key)));
      one.append(this.swatch(curve), make("span", {}, key), value);
      this.values.set(key, value);
      list.append(one);
    }
    list.append(this.at);
    this.figure.insertBefore(list, this.place);
  }

  swatch(curve) {
    const style = look(curve.r), space = "http://www.w3.org/2000/svg";
    const svg = document.createElementNS(space, "svg");
    svg.setAttribute("class", `swatch r-${style.colour}`);
    svg.setAttribute("viewBox", "0 0 24 10");
    svg.setAttribute("aria-hidden", "true");
    const tag = curve.k === "points" ? "circle" : curve.k === "cross" ? "path" : "line";
    const line = document.createElementNS(space, tag);
    const shape = tag === "circle" ? { cx: 12, cy: 5, r: 3.5 }
      : tag === "path" ? { d: "M8 1L16 9M8 9L16 1", "stroke-width": 2 }
      : { x1: 0, x2: 24, y1: 5, y2: 5, "stroke-width": curve.k === "band" ? 9 : style.width + 0.6 };
    if (style.dash && tag === "line") shape["stroke-dasharray"] = style.dash.join(" ");
    if (curve.k === "band") shape.class = "faint";
    for (const [name, value] of Object.entries(shape)) line.setAttribute(name, value);
    svg.append(line);
    return svg;
  }

  panel(panel, place) {
    const isLast = place === this.spec.panels.length - 1;
    const box = make("div", { class: "panel" });
    this.place.append(box);
    const data = [this.x], series = [{}], bands = [];
    panel.keys = [];
    for (const curve of panel.curves) {
      const style = look(curve.r), shared = {
        show: !this.hidden.has(this.key(curve)), spanGaps: Boolean(this.spec.gaps),
        stroke: () => colour(style.colour), width: style.width, dash: style.dash,
        points: { show: false },
      };
      if (curve.k === "band") {
        const fill = () => colour("band");
        for (const side of ["high", "low"]) {
          data.push(decoded(curve[side]));
          series.push({ ...shared, stroke: "transparent", width: 0 });
          panel.keys.push({ curve, side });
        }
        bands.push({ series: [data.length - 2, data.length - 1], fill });
        continue;
      }
      data.push(decoded(curve.y));
      if (curve.k === "points") Object.assign(shared, { paths: () => null,
        points: { show: true, size: 7, stroke: shared.stroke, fill: () => colour("back"), width: 1.6 } });
      if (curve.k === "line+points")
        shared.points = { show: true, size: 5, stroke: shared.stroke, fill: shared.stroke };
      if (curve.k === "cross") Object.assign(shared, { paths: cross, width: 1.8 });
      if (curve.k === "stems") Object.assign(shared, { paths: stems,
        points: { show: true, size: 5, stroke: shared.stroke, fill: shared.stroke } });
      series.push(shared);
      panel.keys.push({ curve, side: "y" });
    }
    const size = this.size(panel, isLast);
    const axis = { stroke: () => colour("quiet"), grid: { stroke: () => colour("grid"), width: 1 },
      ticks: { stroke: () => colour("grid"), width: 1, size: 5 }, font: "11px system-ui, sans-serif",
      labelFont: "12px system-ui, sans-serif" };
    const range = panel.range;
    const plot = new uPlot({
      ...size, series, bands,
      padding: [8, 16, isLast ? 0 : 4, 0],
      legend: { show: false },
      cursor: {
        sync: { key: this.sync.key, setSeries: false, scales: ["x", null] },
        drag: { x: true, y: false, setScale: true }, points: { size: 7 }, y: false,
      },
      select: { show: true },
      scales: {
        x: { time: false, distr: this.spec.log ? 3 : 1 },
        y: { distr: panel.log ? 3 : 1, ...(range ? { range: () => range } : {}) },
      },
      axes: [
        { ...axis, size: isLast ? 24 : 8, label: isLast ? this.spec.xl : undefined, labelSize: 16,
          values: isLast ? this.numbers : (u, splits) => splits.map(() => ""), space: 60 },
        { ...axis, size: 62, ...fitted(panel.yl, size.height - (isLast ? 52 : 20)), labelSize: 18, values: this.numbers, space: 26 },
      ],
      hooks: {
        setScale: [(u, key) => {
          if (key !== "x") return;
          // For those who look at the page with a program: what is shown.
          Object.assign(box.dataset, { from: u.scales.x.min, to: u.scales.x.max });
          this.follow(u);
        }],
        setCursor: [u => this.read(u)],
        drawClear: [u => this.frame(u, panel)],
      },
    }, data, box);
    plot.root.setAttribute("aria-hidden", "true");
    this.listen(plot);
    return plot;
  }

  numbers = (u, splits) => splits.map(value => value === null ? "" : shown(value));

  // Lines that belong to the axes: zero, a limit, what was visited.
  frame(u, panel) {
    const { ctx, bbox } = u, fine = devicePixelRatio;
    ctx.save();
    for (const [low, high] of panel.spans || []) {
      const left = u.valToPos(low, "x", true), right = u.valToPos(high, "x", true);
      const from = Math.max(left, bbox.left), to = Math.min(right, bbox.left + bbox.width);
      ctx.fillStyle = colour("visited");
      if (to > from) ctx.fillRect(from, bbox.top, to - from, bbox.height);
    }
    for (const value of panel.lines || []) {
      const top = u.valToPos(value, "y", true);
      if (top < bbox.top || top > bbox.top + bbox.height) continue;
      ctx.strokeStyle = colour("quiet");
      ctx.lineWidth = fine;
      ctx.beginPath();
      ctx.moveTo(bbox.left, top);
      ctx.lineTo(bbox.left + bbox.width, top);
      ctx.stroke();
    }
    ctx.restore();
  }

  size(panel, isLast) {
    const width = Math.max(200, this.place.clientWidth || 600);
    // What the axes and the padding below take from a square.
    if (this.spec.square) return { width: Math.min(width, 420), height: Math.min(width, 420) - 42 };
    // Two answers share the first screen.
    const height = this.figure.closest(".answer.small") ? Math.min(panel.h, 108) : panel.h;
    return { width, height: height + (isLast ? 40 : 0) };
  }

  fit() {
    this.plots.forEach((plot, place) => {
      const size = this.size(this.spec.panels[place], place === this.plots.length - 1);
      if (size.width !== plot.width || size.height !== plot.height) plot.setSize(size);
    });
  }

  redraw() { this.plots.forEach(plot => plot.redraw(false, true)); }

  limit(min, max) {
    const [low, high] = this.full;
    const least = (high - low) * 1e-5;
    if (!(max - min > least)) return;
    this.plots.forEach(plot => plot.setScale("x", { min, max }));
  }

  get view() {
    const { min, max } = this.plots[0].scales.x;
    return [min, max];
  }

  // Logarithmic axes zoom and move by factors.
  warp(value) { return this.spec.log ? Math.log(value) : value; }
  unwarp(value) { return this.spec.log ? Math.exp(value) : value; }

  zoom(factor, centre = null) {
    const [min, max] = this.view.map(one => this.warp(one));
    const at = centre === null ? (min + max) / 2 : this.warp(centre);
    const [low, high] = this.full.map(one => this.warp(one));
    const left = Math.max(low, at - (at - min) * factor), right = Math.min(high, at + (max - at) * factor);
    this.limit(this.unwarp(left), this.unwarp(right));
  }

  pan(share) {
    const [min, max] = this.view.map(one => this.warp(one));
    const [low, high] = this.full.map(one => this.warp(one));
    let by = share * (max - min);
    by = Math.min(Math.max(by, low - min), high - max);
    if (by) this.limit(this.unwarp(min + by), this.unwarp(max + by));
  }

  follow(changed) {
    if (this.isMoving || !this.plots) return;
    this.isMoving = true;
    const { min, max } = changed.scales.x;
    this.plots.forEach(plot => {
      if (plot !== changed && (plot.scales.x.min !== min || plot.scales.x.max !== max))
        plot.setScale("x", { min, max });
    });
    this.isMoving = false;
  }

  listen(plot) {
    plot.over.addEventListener("wheel", event => {
      if (!event.ctrlKey && !event.metaKey) return;
      event.preventDefault();
      this.zoom(event.deltaY < 0 ? 0.8 : 1.25, plot.posToVal(event.offsetX, "x"));
    }, { passive: false });
    // Dragging with Shift moves the view; without it uPlot zooms into what is dragged over.
    plot.root.addEventListener("mousedown", event => {
      if (!event.shiftKey) return;
      event.stopPropagation();
      event.preventDefault();
      let before = event.clientX;
      const move = moved => {
        this.pan((before - moved.clientX) / plot.over.clientWidth);
        before = moved.clientX;
      };
      const stop = () => { removeEventListener("mousemove", move); removeEventListener("mouseup", stop); };
      addEventListener("mousemove", move);
      addEventListener("mouseup", stop);
    }, true);
    plot.root.addEventListener("dblclick", event => {
      event.stopPropagation();
      this.limit(...this.full);
    }, true);
  }

  press(event) {
    if (event.target !== this.place) return;
    const plot = this.plots[0];
    const acts = {
      ArrowLeft: () => this.pan(-0.2), ArrowRight: () => this.pan(0.2),
      "+": () => this.zoom(0.5), "=": () => this.zoom(0.5), "-": () => this.zoom(2),
      0: () => this.limit(...this.full),
    };
    if (event.shiftKey && event.key.startsWith("Arrow")) {
      const step = event.key === "ArrowRight" ? 4 : event.key === "ArrowLeft" ? -4 : 0;
      const left = Math.min(Math.max((plot.cursor.left < 0 ? 0 : plot.cursor.left) + step, 0), plot.over.clientWidth);
      plot.setCursor({ left, top: 10 });
    } else if (acts[event.key]) acts[event.key]();
    else return;
    event.preventDefault();
  }

  show(key, isShown) {
    this.hidden[isShown ? "delete" : "add"](key);
    all("button.curve", this.figure).filter(one => one.dataset.key === key)
      .forEach(one => one.setAttribute("aria-pressed", String(isShown)));
    this.plots.forEach((plot, place) => {
      this.spec.panels[place].keys.forEach((one, number) => {
        if (this.key(one.curve) === key) plot.setSeries(number + 1, { show: isShown });
      });
    });
  }

  read(u) {
    if (!this.plots || u.cursor.left < 0 || u.cursor.idx === null || u.cursor.idx === undefined) {
      this.values.forEach(value => { value.textContent = ""; });
      this.at.textContent = "";
      return;
    }
    const place = u.cursor.idx;
    this.at.textContent = `at ${this.spec.xl.replace(/\s*\[.*/, "")} = ${shown(this.x[place])}${this.unit}`;
    const told = new Map();
    this.plots.forEach((plot, number) => {
      this.spec.panels[number].keys.forEach(({ curve }, series) => {
        const value = plot.data[series + 1][place];
        const key = this.key(curve);
        if (value === null || value === undefined) return;
        told.set(key, [...(told.get(key) || []), shown(value)]);
      });
    });
    this.values.forEach((element, key) => {
      element.textContent = told.has(key) ? told.get(key).join(" | ") : "–";
    });
  }

  get unit() {
    const unit = (this.spec.xl.match(/\[(.*)\]/) || [])[1];
    return unit && unit !== "-" ? ` ${unit}` : "";
  }

  save() {
    const fine = devicePixelRatio, canvases = this.plots.map(plot => plot.ctx.canvas);
    const line = 18 * fine, pad = 8 * fine;
    const names = this.spec.panels.flatMap(panel => panel.curves)
      .filter((curve, place, every) => this.key(curve) && !this.hidden.has(this.key(curve)) &&
        every.findIndex(one => this.key(one) === this.key(curve)) === place);
    const picture = make("canvas");
    picture.width = Math.max(...canvases.map(one => one.width));
    picture.height = line * 2 + canvases.reduce((sum, one) => sum + one.height, 0);
    const ctx = picture.getContext("2d");
    ctx.fillStyle = colour("back");
    ctx.fillRect(0, 0, picture.width, picture.height);
    ctx.font = `${12 * fine}px system-ui, sans-serif`;
    ctx.fillStyle = colour("ink");
    ctx.fillText(this.figure.dataset.name, pad, line);
    let left = pad;
    for (const curve of names) {
      ctx.fillStyle = colour(look(curve.r).colour);
      ctx.fillRect(left, line * 1.55, 16 * fine, 4 * fine);
      ctx.fillStyle = colour("ink");
      ctx.fillText(this.key(curve), left + 20 * fine, line * 1.85);
      left += 36 * fine + ctx.measureText(this.key(curve)).width;
    }
    let top = line * 2;
    for (const one of canvases) { ctx.drawImage(one, 0, top); top += one.height; }
    picture.toBlob(blob => {
      const link = make("a", { download: `${this.figure.dataset.name.replace(/[^\w.+-]+/g, "_")}.png` });
      link.href = URL.createObjectURL(blob);
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    });
  }
}

const build = figure => {
  if (!charts.has(figure)) charts.set(figure, new Chart(figure));
  return charts.get(figure);
};
// A chart is drawn when it comes near the window: a page of many opens as fast as one of few.
const near = new IntersectionObserver(seen => {
  for (const one of seen) if (one.isIntersecting) { near.unobserve(one.target); build(one.target); }
}, { rootMargin: "400px" });
all("figure.chart").forEach(figure => near.observe(figure));

// ---- pickers: one of several recordings or models at a time ----------------------------
const pickers = all(".picker");
const pick = (picker, name, isLead = true) => {
  const items = all(":scope > .item", picker);
  const chosen = items.find(item => item.dataset.name === name);
  if (!chosen) return;
  items.forEach(item => { item.hidden = item !== chosen; });
  picker.querySelector("select").value = name;
  if (isLead) pickers.filter(other => other !== picker && other.dataset.kind === picker.dataset.kind)
    .forEach(other => pick(other, name, false));
};
pickers.forEach(picker => {
  const choice = picker.querySelector("select");
  choice.addEventListener("change", () => pick(picker, choice.value));
  const step = by => () => {
    const names = [...choice.options].map(one => one.value);
    pick(picker, names[(names.indexOf(choice.value) + by + names.length) % names.length]);
  };
  choice.closest("label").after(
    button("‹", `Previous ${picker.dataset.kind}`, step(-1)),
    button("›", `Next ${picker.dataset.kind}`, step(1)));
});

// ---- tables: sorted by a press on a head, searched, and a hint where they are wide -------
const number = text => {
  const found = text.replace(/[\u2212\u2013]/g, "-").match(/^[^\d-]{0,2}(-?\d[\d.]*(?:e[+-]?\d+)?)/i);
  return found ? Number(found[1]) : NaN;
};
const order = (first, second) => {
  const a = number(first), b = number(second);
  if (!Number.isNaN(a) && !Number.isNaN(b)) return a - b;
  if (Number.isNaN(a) !== Number.isNaN(b)) return Number.isNaN(a) ? 1 : -1;
  return first.localeCompare(second, "en", { numeric: true });
};
all("table.sortable").forEach(table => {
  const body = table.tBodies[0], heads = [...table.tHead.rows[0].cells];
  const first = [...body.rows];
  heads.forEach((head, column) => {
    if (!head.textContent.trim()) return;
    const sort = make("button", { type: "button", class: "sort", title: "Sort by this column" });
    sort.append(...head.childNodes);
    head.append(sort);
    sort.addEventListener("click", () => {
      const was = head.getAttribute("aria-sort");
      heads.forEach(one => one.removeAttribute("aria-sort"));
      const text = row => row.cells[column].textContent.trim();
      if (was === "descending") { body.append(...first); return; }
      const sign = was === "ascending" ? -1 : 1;
      head.setAttribute("aria-sort", sign > 0 ? "ascending" : "descending");
      body.append(...[...first].sort((a, b) => sign * order(text(a), text(b))));
    });
  });
  if (first.length < 8) return;
  const search = make("input", { type: "search", placeholder: `search ${first.length} rows`,
    "aria-label": "Search the table below" });
  const count = make("span", { class: "count", role: "status" });
  search.addEventListener("input", () => {
    const wanted = search.value.toLowerCase();
    first.forEach(row => { row.hidden = !row.textContent.toLowerCase().includes(wanted); });
    const left = first.filter(row => !row.hidden).length;
    count.textContent = wanted ? `${left} of ${first.length}` : "";
  });
  table.closest(".scroll").before(make("div", { class: "search" }, search, count));
});
const hint = box => {
  const rest = box.scrollWidth - box.clientWidth - box.scrollLeft;
  box.parentElement.classList.toggle("more", rest > 4);
};
const wide = new ResizeObserver(seen => seen.forEach(one => hint(one.target)));
all(".scroll, .dots .image").forEach(box => {
  box.addEventListener("scroll", () => hint(box), { passive: true });
  wide.observe(box);
});
// What a cell of a matrix says, in a line that stays in sight.
all("table.matrix").forEach(table => {
  const told = table.closest(".wide").nextElementSibling;
  const rest = told.textContent;
  const heads = [...table.tHead.rows[0].cells];
  const tell = cell => {
    if (!cell || cell.tagName !== "TD") { told.textContent = rest; return; }
    const row = cell.parentElement;
    const value = cell.title || cell.textContent.trim();
    told.textContent = `${row.cells[0].textContent.trim()}, ${heads[cell.cellIndex].textContent.trim()}: ${value}`;
  };
  table.addEventListener("mouseover", event => tell(event.target.closest("td")));
  table.addEventListener("mouseleave", () => tell(null));
});

// ---- paper and darkness ----------------------------------------------------------------
const redraw = () => charts.forEach(chart => chart.redraw());
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
// Paper is white and cannot unfold: what is worth printing is opened, drawn and closed again.
let opened = [];
addEventListener("beforeprint", () => {
  opened = all("details.printed:not([open])");
  opened.forEach(one => { one.open = true; });
  root.dataset.print = "yes";
  all("figure.chart").filter(one => one.offsetParent !== null).forEach(one => build(one).fit());
  redraw();
});
addEventListener("afterprint", () => {
  opened.forEach(one => { one.open = false; });
  delete root.dataset.print;
  redraw();
});
root.classList.add("alive");
})();
