// Figures that can be asked: each figure.plot holds a drawing for paper and the numbers it was drawn from. This script
// draws these numbers again beside it, for the screen: values under the pointer and by keyboard, series on and off,
// zoom, copy as CSV. No library: the figures are SVG, so their text is text, keys and touch work, colours follow the page.
(() => {
  "use strict";
  const { make, minus } = shakebed;
  // T_c, D^2, m^{-1} as the axes of the drawings write them: [text, shift] pieces.
  const pieces = text => {
    const out = [];
    const pattern = /([_^])(?:\{([^}]*)\}|(.))/gu;
    let end = 0;
    for (const found of text.matchAll(pattern)) {
      if (found.index > end) out.push([text.slice(end, found.index), 0]);
      out.push([found[2] ?? found[3], found[1] === "_" ? 1 : -1]);
      end = found.index + found[0].length;
    }
    out.push([text.slice(end), 0]);
    return out;
  };
  const plain = (text, markup) => (markup ? pieces(text).map(piece => piece[0]).join("") : text);
  const svgText = (text, markup, attributes, parent) => {
    const element = make("text", attributes, parent);
    let shift = 0;
    for (const [part, level] of markup ? pieces(text) : [[text, 0]]) {
      if (!part) continue;
      const span = make("tspan", { dy: `${(level - shift) * 0.3}em`, ...(level ? { "font-size": "85%" } : {}) }, element);
      span.textContent = part;
      shift = level;
    }
    return element;
  };
  const htmlText = (text, markup, parent) => {
    for (const [part, level] of markup ? pieces(text) : [[text, 0]]) {
      if (!part) continue;
      const node = level ? document.createElement(level > 0 ? "sub" : "sup") : document.createTextNode("");
      node.textContent = part;
      parent.append(node);
    }
  };
  const number = v => (v === 0 ? "0" : Math.abs(v) < 1e-3 || Math.abs(v) >= 1e5 ? v.toExponential(3) : String(Number(v.toPrecision(5))));
  // At an axis: no zeros behind the last digit.
  const tickLabel = v => minus(Math.abs(v) < 1e-3 || Math.abs(v) >= 1e5 ? (v === 0 ? "0" : Number(v.toPrecision(4)).toExponential()) : number(v));
  const ticks = (low, high, most) => {
    const least = (high - low) / most, power = 10 ** Math.floor(Math.log10(least));
    const step = [1, 2, 5, 10].map(k => k * power).find(s => s >= least * 0.999) || 10 * power;
    const out = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k) out.push(Number((k * step).toPrecision(12)));
    return out;
  };
  // Powers of ten; within a few decades also 2 and 5 times these.
  const decades = (low, high, most) => {
    const first = Math.floor(low), last = Math.ceil(high), all = [];
    const digits = high - low > 3 ? [1] : high - low > 1 ? [1, 2, 5] : [1, 1.5, 2, 3, 4, 5, 6, 8];
    for (let p = first; p <= last; ++p) for (const d of digits) {
      const v = p + Math.log10(d);
      if (v >= low - 1e-9 && v <= high + 1e-9) all.push([v, d * 10 ** p]);
    }
    const every = Math.max(1, Math.ceil(all.length / most));
    return all.filter((_, i) => i % every === 0);
  };
  // Filled or open circle, square, triangle up and down, diamond.
  const marker = (shape, x, y, r) => {
    const p = (...at) => "M" + at.map(([a, b]) => `${(x + r * a).toFixed(1)} ${(y + r * b).toFixed(1)}`).join("L") + "Z";
    switch (shape % 5) {
      case 0: return `M${(x - r).toFixed(1)} ${y.toFixed(1)}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0Z`;
      case 1: return p([-0.9, -0.9], [0.9, -0.9], [0.9, 0.9], [-0.9, 0.9]);
      case 2: return p([0, -1.2], [1.2, 0], [0, 1.2], [-1.2, 0]);
      case 3: return p([0, -1.15], [1.05, 0.8], [-1.05, 0.8]);
      default: return p([0, 1.15], [1.05, -0.8], [-1.05, -0.8]);
    }
  };
  const dashes = { dashed: "8 5", dotted: "2 4" };

  class Plot {
    constructor(figure) {
      this.figure = figure;
      this.data = JSON.parse(figure.querySelector("script.plot-data").textContent);
      let shape = -1;
      this.series = [...this.data.series.map(s => ({ ...s, panel: 0 })), ...(this.data.lower || []).map(s => ({ ...s, panel: 1 }))];
      const shapes = new Map();
      for (const s of this.series) {
        s.name = plain(s.label, s.markup);
        if (s.style === "points") s.shape = s.panel ? shapes.get(s.label) ?? ++shape : s.hollow && shape >= 0 ? shape : ++shape;
        shapes.set(s.label, s.shape);
        s.on = true;
      }
      this.box = figure.querySelector(".asked");
      this.key = document.createElement("ul");
      this.key.className = "key";
      this.says = Object.assign(document.createElement("div"), { className: "says", hidden: true });
      this.says.setAttribute("role", "status");
      this.holder = document.createElement("div");
      this.holder.style.position = "relative";
      this.box.append(this.key, this.holder);
      this.view = null;
      this.at = null;
      this.buildKey();
      this.buildTools();
      figure.classList.add("answers");
      this.width = 0;
      // In the next frame: a drawing changes the box's height, which the observer must not see at once.
      new ResizeObserver(() => requestAnimationFrame(() => {
        const width = Math.round(this.box.clientWidth);
        if (width && width !== this.width) { this.width = width; this.draw(); }
      })).observe(this.box);
    }
    buildKey() {
      const named = new Set();
      for (const s of this.series) {
        if (s.panel || !s.label || named.has(s.label)) continue;  // points and the line through them share a name
        named.add(s.label);
        const button = document.createElement("button");
        button.type = "button";
        button.setAttribute("aria-pressed", "true");
        const icon = make("svg", { viewBox: "0 0 26 14", "aria-hidden": "true" }, button);
        const color = `var(--series-${s.color % 7})`;
        if (s.style === "points") make("path", { d: marker(s.shape, 13, 7, 4.5), fill: s.hollow ? "none" : color, stroke: color, "stroke-width": 1.5 }, icon);
        else make("path", { d: "M1 7H25", stroke: color, "stroke-width": 2.5, "stroke-dasharray": dashes[s.style] || "none" }, icon);
        const text = document.createElement("span");
        htmlText(s.label, s.markup, text);
        button.append(text);
        button.onclick = () => {
          const on = !s.on;
          for (const other of this.series) if (other.label === s.label) other.on = on;
          button.setAttribute("aria-pressed", String(on));
          this.at = null;
          this.draw();
        };
        const item = document.createElement("li");
        item.append(button);
        this.key.append(item);
      }
    }
    buildTools() {
      const tools = this.figure.querySelector(".tools");
      const add = (text, title, act) => {
        const button = Object.assign(document.createElement("button"), { type: "button", textContent: text, title });
        button.onclick = () => act(button);
        tools.prepend(button);
        return button;
      };
      add("SVG", "Download the drawing for paper", () => this.download());
      add("Copy CSV", "Copy the numbers of the series shown", button => this.copy(button));
      this.all = add("Whole", "Show the whole figure again (Escape)", () => this.zoomTo(null));
      add("−", "Zoom out (-)", () => this.zoomBy(1.6)).setAttribute("aria-label", "Zoom out");
      add("+", "Zoom in (+); or draw over a part of the figure", () => this.zoomBy(1 / 1.6)).setAttribute("aria-label", "Zoom in");
    }
    csv() {
      const rows = ["panel,series,x,y,std_error"];
      const cell = text => (/[",\n]/.test(text) ? `"${text.replace(/"/g, '""')}"` : text);
      for (const s of this.series) if (s.on) s.x.forEach((x, i) => rows.push([s.panel ? "lower" : "upper", cell(s.name), x, s.y[i], s.e ? s.e[i] : ""].join(",")));
      return rows.join("\n") + "\n";
    }
    async copy(button) {
      const text = this.csv(), before = button.textContent;
      let done = true;
      try { await navigator.clipboard.writeText(text); } catch {
        const area = Object.assign(document.createElement("textarea"), { value: text });
        document.body.append(area);
        area.select();
        done = document.execCommand("copy");
        area.remove();
      }
      button.textContent = done ? "Copied" : "Not allowed here";
      setTimeout(() => { button.textContent = before; }, 1500);
    }
    download() {
      const svg = this.figure.querySelector(".drawn svg");
      const text = '<?xml version="1.0" encoding="utf-8"?>\n' + new XMLSerializer().serializeToString(svg);
      const link = document.createElement("a");
      link.href = URL.createObjectURL(new Blob([text], { type: "image/svg+xml" }));
      link.download = `${this.figure.dataset.name || "figure"}.svg`;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 5000);
    }
    // --- scales
    u(x) { return this.data.log[0] ? Math.log10(x) : x; }
    v(y, panel) { return this.data.log[1] && !panel ? Math.log10(y) : y; }
    extent(panel) {
      let low = Infinity, high = -Infinity, left = Infinity, right = -Infinity;
      for (const s of this.series) {
        if (!s.on || s.panel !== panel) continue;
        for (let i = 0; i < s.x.length; ++i) {
          const x = this.u(s.x[i]), y = this.v(s.y[i], panel), e = s.e ? s.e[i] : 0;
          if (!Number.isFinite(x) || !Number.isFinite(y)) continue;
          left = Math.min(left, x); right = Math.max(right, x);
          const inside = (this.data.xlim[0] === null || s.x[i] >= this.data.xlim[0]) && (this.data.xlim[1] === null || s.x[i] <= this.data.xlim[1]);
          if (!inside) continue;
          const down = this.v(s.y[i] - e, panel), up = this.v(s.y[i] + e, panel);
          low = Math.min(low, Number.isFinite(down) ? down : y); high = Math.max(high, Number.isFinite(up) ? up : y);
        }
      }
      if (!(low <= high)) { low = 0; high = 1; }
      if (!(left <= right)) { left = 0; right = 1; }
      const pad = (a, b) => (b > a ? 0.04 * (b - a) : Math.abs(a) * 0.1 || 0.5);
      const y = pad(low, high), x = pad(left, right);
      return { x: [left - x, right + x], y: [low - y, high + y] };
    }
    whole() {
      const upper = this.extent(0), lower = this.extent(1), d = this.data;
      const given = (limits, found, f) => limits.map((value, i) => (value === null || !Number.isFinite(f(value)) ? found[i] : f(value)));
      return { x: given(d.xlim, upper.x, x => this.u(x)), y: given(d.ylim, upper.y, y => this.v(y, 0)), lower: lower.y };
    }
    zoomTo(view) { this.view = view; this.draw(); }
    zoomBy(factor) {
      const now = this.view || this.whole(), centre = this.at ? this.u(this.series[this.at.s].x[this.at.i]) : (now.x[0] + now.x[1]) / 2;
      const half = factor * (now.x[1] - now.x[0]) / 2, whole = this.whole();
      if (half * 2 >= whole.x[1] - whole.x[0]) return this.zoomTo(null);
      this.zoomTo({ ...now, x: [centre - half, centre + half], y: factor > 1 ? now.y : this.fit(centre - half, centre + half, now.y) });
    }
    // Heights of what is seen between two x.
    fit(left, right, otherwise) {
      let low = Infinity, high = -Infinity;
      for (const s of this.series) {
        if (!s.on || s.panel) continue;
        s.x.forEach((x, i) => {
          const u = this.u(x), y = this.v(s.y[i], 0);
          if (u >= left && u <= right && Number.isFinite(y)) { low = Math.min(low, y); high = Math.max(high, y); }
        });
      }
      return low < high ? [low - 0.06 * (high - low), high + 0.06 * (high - low)] : otherwise;
    }
    // --- drawing
    // A label in as many lines as its axis is short: a letter is about 7 px wide.
    static lines(label, length) {
      const out = [""];
      for (const word of (label || "").split(" ")) {
        if (out.at(-1) && 7 * (plain(out.at(-1), true).length + 1 + plain(word, true).length) > length) out.push("");
        out.push(`${out.pop()} ${word}`.trim());
      }
      return out;
    }
    draw() {
      const d = this.data, view = this.view || this.whole(), two = this.series.some(s => s.panel === 1);
      const width = this.width, narrow = width < 560, right = 12, top = 8, bottom = 46;
      const upper = Math.round(Math.min(420, Math.max(230, width * (narrow ? 0.72 : 0.5)))), lowerHeight = two ? Math.round(upper * 0.42) : 0, gap = two ? 16 : 0;
      const lines = [Plot.lines(d.y, upper), two ? Plot.lines(d.lowerLabel, lowerHeight) : [""]];
      const height = top + upper + gap + lowerHeight + bottom;
      const svg = make("svg", { viewBox: `0 0 ${width} ${height}`, width, height, tabindex: 0, role: "application", "aria-roledescription": "interactive figure",
        "aria-label": `${plain(d.y, true)} against ${plain(d.x, true)}: arrow keys go from point to point and from series to series, plus and minus zoom, Escape shows the whole` });
      const frames = [{ y0: top, h: upper, range: view.y, label: d.y, log: d.log[1], panel: 0 }];
      if (two) frames.push({ y0: top + upper + gap, h: lowerHeight, range: view.lower, label: d.lowerLabel, log: false, panel: 1 });
      for (const f of frames) f.ticks = f.log ? decades(f.range[0], f.range[1], 7) : ticks(f.range[0], f.range[1], f.panel ? 4 : 7).map(t => [t, t]);
      const longest = Math.max(...frames.flatMap(f => f.ticks.map(([, value]) => tickLabel(value).length)));
      const left = Math.max(narrow ? 50 : 66, 7 * longest + 26) + 15 * (Math.max(lines[0].length, lines[1].length) - 1);
      const px = u => left + (u - view.x[0]) / (view.x[1] - view.x[0]) * (width - left - right);
      this.px = px;
      this.geometry = { left, right: width - right, frames, width, height };
      const clip = `clip-${(Plot.count = (Plot.count || 0) + 1)}`;
      const xTicks = d.log[0] ? decades(view.x[0], view.x[1], narrow ? 5 : 9) : ticks(view.x[0], view.x[1], narrow ? 5 : 9).map(t => [t, t]);
      for (const f of frames) {
        const py = v => f.y0 + f.h - (v - f.range[0]) / (f.range[1] - f.range[0]) * f.h;
        f.py = py;
        const id = `${clip}-${f.panel}`;
        make("rect", { x: left, y: f.y0, width: width - left - right, height: f.h }, make("clipPath", { id }, make("defs", {}, svg)));
        const inside = make("g", { "clip-path": `url(#${id})` }, svg);
        if (!f.panel) for (const [a, b] of d.bands || []) make("rect", { class: "band", x: px(this.u(a)), y: f.y0, width: Math.max(0, px(this.u(b)) - px(this.u(a))), height: f.h }, inside);
        for (const [u] of xTicks) make("path", { class: "grid", d: `M${px(u).toFixed(1)} ${f.y0}v${f.h}` }, inside);
        for (const [v, value] of f.ticks) {
          make("path", { class: "grid", d: `M${left} ${py(v).toFixed(1)}H${width - right}` }, inside);
          make("text", { class: "tick", x: left - 6, y: py(v) + 4, "text-anchor": "end" }, svg).textContent = tickLabel(value);
        }
        make("rect", { class: "axis", x: left, y: f.y0, width: width - left - right, height: f.h }, svg);
        lines[f.panel].forEach((line, i) => svgText(line, true, { transform: `translate(${(narrow ? 11 : 14) + 15 * i} ${f.y0 + f.h / 2}) rotate(-90)`, "text-anchor": "middle" }, svg));
        for (const s of this.series) if (s.on && s.panel === f.panel) this.drawSeries(s, f, inside);
      }
      const base = top + upper + gap + lowerHeight;
      for (const [u, value] of xTicks) make("text", { class: "tick", x: px(u), y: base + 16, "text-anchor": "middle" }, svg).textContent = tickLabel(value);
      svgText(d.x, true, { x: (left + width - right) / 2, y: base + 38, "text-anchor": "middle" }, svg);
      this.mark = make("g", {}, svg);
      const focused = this.svg && this.svg === document.activeElement;
      this.svg = svg;
      this.listen(svg);
      this.holder.replaceChildren(svg, this.says);
      if (focused) svg.focus();
      this.all.disabled = !this.view;
      this.show();
    }
    drawSeries(s, f, parent) {
      const color = `var(--series-${s.color % 7})`, at = s.x.map((x, i) => [this.px(this.u(x)), f.py(this.v(s.y[i], f.panel))]);
      if (s.style !== "points") {
        let path = "", pen = "M";
        for (const [x, y] of at) {
          if (!Number.isFinite(x) || !Number.isFinite(y)) { pen = "M"; continue; }
          path += `${pen}${x.toFixed(1)} ${Math.max(-1e4, Math.min(1e4, y)).toFixed(1)}`;
          pen = "L";
        }
        make("path", { d: path, fill: "none", stroke: color, "stroke-width": 2, "stroke-dasharray": dashes[s.style] || "none" }, parent);
        return;
      }
      let bars = "", marks = "";
      at.forEach(([x, y], i) => {
        if (!Number.isFinite(x) || !Number.isFinite(y)) return;
        if (s.e && s.e[i] > 0) {
          const up = f.py(this.v(s.y[i] + s.e[i], f.panel)), down = f.py(this.v(s.y[i] - s.e[i], f.panel));
          bars += `M${x.toFixed(1)} ${up.toFixed(1)}V${(Number.isFinite(down) ? down : f.y0 + f.h).toFixed(1)}`;
        }
        marks += marker(s.shape, x, y, at.length > 150 ? 2.2 : 3.4);
      });
      if (bars) make("path", { d: bars, fill: "none", stroke: color, "stroke-width": 1.3 }, parent);
      make("path", { d: marks, fill: s.hollow ? "var(--page)" : color, stroke: color, "stroke-width": 1.3 }, parent);
    }
    // --- asking
    visible(s, i) {
      const u = this.px(this.u(s.x[i])), f = this.geometry.frames[s.panel], y = f && f.py(this.v(s.y[i], s.panel));
      return f && u >= this.geometry.left - 1 && u <= this.geometry.right + 1 && y >= f.y0 - 1 && y <= f.y0 + f.h + 1 ? [u, y] : null;
    }
    nearest(x, y) {
      let best = null, distance = Infinity;
      this.series.forEach((s, k) => {
        if (!s.on || !s.label && s.style !== "points") return;
        for (let i = 0; i < s.x.length; ++i) {
          const at = this.visible(s, i);
          if (!at) continue;
          const d = (at[0] - x) ** 2 + (at[1] - y) ** 2 / 2;
          if (d < distance) { distance = d; best = { s: k, i }; }
        }
      });
      return best;
    }
    show() {
      this.mark.replaceChildren();
      const s = this.at && this.series[this.at.s], at = s && s.on && this.visible(s, this.at.i);
      this.says.hidden = !at;
      if (!at) return;
      const i = this.at.i, f = this.geometry.frames[s.panel];
      make("path", { class: "cross", d: `M${at[0]} ${f.y0}v${f.h}M${this.geometry.left} ${at[1]}H${this.geometry.right}` }, this.mark);
      make("circle", { class: "here", cx: at[0], cy: at[1], r: 6 }, this.mark);
      const name = document.createElement("strong"), values = document.createElement("div");
      htmlText(s.label || "points", s.markup, name);
      values.textContent = `x = ${number(s.x[i])}, y = ${number(s.y[i])}${s.e && s.e[i] > 0 ? ` ± ${Number(s.e[i].toPrecision(2))}` : ""}`;
      this.says.replaceChildren(name, values);
      const wide = this.says.offsetWidth, tall = this.says.offsetHeight;
      this.says.style.left = `${Math.max(0, Math.min(this.geometry.width - wide, at[0] + (at[0] > this.geometry.width / 2 ? -wide - 14 : 14)))}px`;
      this.says.style.top = `${Math.max(0, at[1] - tall - 10)}px`;
    }
    listen(svg) {
      const place = event => {
        const box = svg.getBoundingClientRect();
        return [event.clientX - box.left, event.clientY - box.top];
      };
      let start = null, area = null;
      svg.addEventListener("pointerdown", event => {
        if (event.button) return;
        start = place(event);
        if (event.pointerType === "mouse") svg.setPointerCapture(event.pointerId);
      });
      svg.addEventListener("pointermove", event => {
        const now = place(event);
        if (start && Math.abs(now[0] - start[0]) > 8) {
          const f = this.geometry.frames[0];
          area ||= make("rect", { class: "zoom", y: f.y0, height: f.h }, svg);
          area.setAttribute("x", Math.min(start[0], now[0]));
          area.setAttribute("width", Math.abs(now[0] - start[0]));
          return;
        }
        this.at = this.nearest(...now);
        this.show();
      });
      svg.addEventListener("pointerup", event => {
        const now = place(event), from = start;
        start = null;
        if (!area) { this.at = this.nearest(...now); return this.show(); }
        area.remove();
        area = null;
        const view = this.view || this.whole(), inverse = x => view.x[0] + (x - this.geometry.left) / (this.geometry.right - this.geometry.left) * (view.x[1] - view.x[0]);
        const [a, b] = [inverse(Math.min(from[0], now[0])), inverse(Math.max(from[0], now[0]))];
        this.at = null;
        this.zoomTo({ ...view, x: [a, b], y: this.fit(a, b, view.y) });
      });
      svg.addEventListener("pointercancel", () => { start = null; if (area) area.remove(); area = null; });
      svg.addEventListener("pointerleave", event => { if (!start && event.pointerType === "mouse") { this.at = null; this.show(); } });
      svg.addEventListener("dblclick", () => this.zoomTo(null));
      svg.addEventListener("keydown", event => this.press(event));
    }
    press(event) {
      const shown = this.series.map((s, k) => k).filter(k => this.series[k].on && this.series[k].x.length && (this.series[k].label || this.series[k].style === "points"));
      if (!shown.length) return;
      const key = event.key;
      if (key === "+" || key === "=") this.zoomBy(1 / 1.6);
      else if (key === "-") this.zoomBy(1.6);
      else if (key === "Escape" || key === "0") { this.at = null; this.zoomTo(null); }
      else if (key.startsWith("Arrow") || key === "Home" || key === "End") {
        // Along the points that are seen.
        const seen = k => this.series[k].x.map((_, i) => i).filter(i => this.visible(this.series[k], i));
        const first = shown.find(k => seen(k).length);
        if (first === undefined) return;
        if (!this.at) this.at = { s: first, i: seen(first)[0] };
        else if (key === "ArrowUp" || key === "ArrowDown") {
          const others = shown.filter(k => seen(k).length), k = others.indexOf(this.at.s);
          const next = others[(k + (key === "ArrowDown" ? 1 : others.length - 1)) % others.length];
          const x = this.u(this.series[this.at.s].x[this.at.i]), xs = this.series[next].x;
          this.at = { s: next, i: seen(next).reduce((best, i) => (Math.abs(this.u(xs[i]) - x) < Math.abs(this.u(xs[best]) - x) ? i : best)) };
        } else {
          const all = seen(this.at.s), at = Math.max(0, all.indexOf(this.at.i));
          const to = key === "Home" ? 0 : key === "End" ? all.length - 1 : at + (key === "ArrowRight" ? 1 : -1);
          this.at = { s: this.at.s, i: all[Math.max(0, Math.min(all.length - 1, to))] };
        }
        this.show();
      } else return;
      event.preventDefault();
    }
  }
  for (const figure of document.querySelectorAll("figure.plot")) {
    if (figure.querySelector("script.plot-data")) new Plot(figure);
  }
})();
