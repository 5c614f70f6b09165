// Small line charts as SVG, drawn in pixels of the page so that their text never shrinks.
const margin = { left: 46, right: 10, top: 10, bottom: 36 };
const fontSize = 12;

// Round values from `low` to `high`, about `count` of them and at least three; one where there is no range yet.
function ticks(low, high, count) {
  if (!(high > low)) return [low];
  const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough));
  const coarse = [1, 2, 5, 10].findIndex((k) => k >= rough / power * (1 - 1e-9));
  const multiples = (step) => {
    const list = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k) list.push(k * step);
    return list;
  };
  const steps = [10, 5, 2, 1, 0.5, 0.2, 0.1].map((k) => k * power).slice(3 - coarse);
  return steps.map(multiples).find((list) => list.length >= 3);
}
const label = (value) => String(Number(value.toPrecision(6)));

export class Chart {
  // lines: [{name, className}], also the legend; x and y: titles of the axes.
  constructor(figure, { x, y, lines }) {
    this.figure = figure;
    this.svg = figure.querySelector("svg");
    Object.assign(this, { xTitle: x, yTitle: y, lines });
    const legend = figure.querySelector(".legend");
    legend.replaceChildren(...lines.map(({ name, className }) => {
      const item = document.createElement("span");
      const sign = document.createElement("i");
      sign.className = className;
      item.append(sign, name);
      return item;
    }));
    new ResizeObserver(() => this.draw()).observe(figure);
  }
  // One list of [x, y] a line; `band`: [x, low, high] about the first.
  show(data, band = []) {
    this.data = data;
    this.band = band;
    this.draw();
  }
  draw() {
    const width = Math.floor(this.figure.clientWidth), height = 240;
    if (width < 100) return;
    this.svg.setAttribute("width", width);
    this.svg.setAttribute("height", height);
    this.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    const points = (this.data ?? []).flat().filter(([x, y]) => Number.isFinite(x) && Number.isFinite(y));
    if (points.length < 2) {
      this.svg.innerHTML = `<text x="${width / 2}" y="${height / 2}" text-anchor="middle">shown when the bed has settled</text>`;
      return;
    }
    const xs = points.map(([x]) => x), ys = points.map(([, y]) => y);
    const lowX = Math.min(0, ...xs), highX = Math.max(...xs), highY = 1.08 * Math.max(...ys, 1e-9);
    const toX = (x) => margin.left + ((x - lowX) / (highX - lowX || 1)) * (width - margin.left - margin.right);
    const toY = (y) => height - margin.bottom - (y / highY) * (height - margin.top - margin.bottom);
    const path = (list) => list.map(([x, y], k) => `${k ? "L" : "M"}${toX(x).toFixed(1)} ${toY(y).toFixed(1)}`).join("");
    const band = this.band.length < 2 ? "" : `<path class="band" d="${path([
      ...this.band.map(([x, , high]) => [x, high]), ...this.band.map(([x, low]) => [x, Math.max(low, 0)]).reverse()])}Z"/>`;
    this.svg.innerHTML = this.axes(width, height, { lowX, highX, highY, toX, toY }) + band +
      this.data.map((list, k) => {
        const known = list.filter(([, y]) => Number.isFinite(y));
        return known.length < 2 ? "" : `<path class="line ${this.lines[k].className}" d="${path(known)}"/>`;
      }).join("");
  }
  axes(width, height, { lowX, highX, highY, toX, toY }) {
    const bottom = height - margin.bottom;
    let out = "";
    for (const x of ticks(lowX, highX, width / 80)) {
      out += `<line class="grid" x1="${toX(x)}" x2="${toX(x)}" y1="${margin.top}" y2="${bottom}"/>` +
        `<text x="${toX(x)}" y="${bottom + fontSize + 4}" text-anchor="middle">${label(x)}</text>`;
    }
    for (const y of ticks(0, highY, 5)) {
      out += `<line class="grid" x1="${margin.left}" x2="${width - margin.right}" y1="${toY(y)}" y2="${toY(y)}"/>` +
        `<text x="${margin.left - 5}" y="${toY(y) + 4}" text-anchor="end">${label(y)}</text>`;
    }
    return out + `<text x="${(margin.left + width - margin.right) / 2}" y="${height - 4}" text-anchor="middle">${this.xTitle}</text>` +
      `<text transform="translate(12 ${(margin.top + bottom) / 2}) rotate(-90)" text-anchor="middle">${this.yTitle}</text>`;
  }
}
