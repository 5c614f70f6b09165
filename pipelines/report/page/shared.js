// What figures and the viewers of films and of simulated beds share.
const shakebed = (() => {
  "use strict";
  const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0));
  // Dark blue to yellow: rises in lightness alone [cividis; Nunez, Anderton and Renslow 2018].
  const stops = [[0, 34, 78], [59, 73, 108], [123, 123, 120], [188, 174, 108], [254, 232, 56]];
  const color = share => {
    const at = Math.max(0, Math.min(1, share)) * (stops.length - 1), k = Math.min(stops.length - 2, Math.floor(at));
    return `rgb(${stops[k].map((v, i) => Math.round(v + (at - k) * (stops[k + 1][i] - v))).join(" ")})`;
  };
  const ns = "http://www.w3.org/2000/svg";
  const make = (name, attributes, parent) => {
    const element = document.createElementNS(ns, name);
    for (const key in attributes) element.setAttribute(key, attributes[key]);
    if (parent) parent.append(element);
    return element;
  };
  // With the sign of typography.
  const minus = text => String(text).replace("-", "−");

  // The density of one frame beside the mean, heights upwards. `of`: lowest height, spacing and number of the heights,
  // largest density, the mean, and the densities of all frames as bytes (255: the largest).
  class Profile {
    constructor(holder, of) {
      Object.assign(this, { of, now: bytes(of.now) });
      const width = 250, height = 300, left = 40, bottom = 42, top = 8, right = 8;
      const highest = of.low + of.step * (of.n - 1);
      this.x = v => left + v / of.largest * (width - left - right);
      this.y = z => height - bottom - (z - of.low) / (highest - of.low) * (height - bottom - top);
      const svg = make("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": "density profile of this frame beside the mean", class: "profile" }, holder);
      const nice = (range, most) => [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100].find(s => range / s <= most) || 200;
      const dx = nice(of.largest, 4), dz = nice(highest - of.low, 7);
      for (let v = 0; v <= of.largest + 1e-9; v += dx) {
        make("path", { class: "grid", d: `M${this.x(v)} ${top}V${height - bottom}` }, svg);
        make("text", { class: "tick", x: this.x(v), y: height - bottom + 15, "text-anchor": "middle" }, svg).textContent = Number(v.toFixed(2));
      }
      for (let z = Math.ceil(of.low / dz) * dz; z <= highest; z += dz) {
        make("path", { class: "grid", d: `M${left} ${this.y(z)}H${width - right}` }, svg);
        make("text", { class: "tick", x: left - 5, y: this.y(z) + 4, "text-anchor": "end" }, svg).textContent = minus(Number(z.toFixed(2)));
      }
      make("text", { x: (left + width - right) / 2, y: height - 8, "text-anchor": "middle" }, svg).textContent = "density n D²";
      make("text", { transform: `translate(12 ${(top + height - bottom) / 2}) rotate(-90)`, "text-anchor": "middle" }, svg).textContent = "height z/D";
      make("path", { d: this.path(of.mean), fill: "none", stroke: "var(--series-1)", "stroke-width": 2.5 }, svg);
      this.line = make("path", { fill: "none", stroke: "var(--series-2)", "stroke-width": 1.6 }, svg);
      this.floor = make("path", { fill: "none", stroke: "var(--text)", "stroke-width": 1.5, "stroke-dasharray": "5 3" }, svg);
      Object.assign(this, { left, right: width - right });
    }
    path(values) {
      return values.map((v, i) => `${i ? "L" : "M"}${this.x(v).toFixed(1)} ${this.y(this.of.low + i * this.of.step).toFixed(1)}`).join("");
    }
    show(frame, floor) {
      const { n, largest } = this.of;
      this.line.setAttribute("d", this.path(Array.from(this.now.subarray(frame * n, (frame + 1) * n), v => v / 255 * largest)));
      if (floor !== undefined) this.floor.setAttribute("d", `M${this.left} ${this.y(floor).toFixed(1)}H${this.right}`);
    }
  }
  return { bytes, color, make, minus, Profile };
})();
