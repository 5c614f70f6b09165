// Reports as people use them, in headless Chromium: the film's slider, values under the pointer and by keyboard, series
// on and off, zoom, sorting and filtering, print to PDF, JavaScript off, sizes of text and no sideways scrolling at 400 px,
// contrast (axe-core, where it is at hand). Numbers shown are compared with the files they come from.
// usage: node report.mjs CHROMIUM REPORT-FOLDER SWEEP-FOLDER AXE.js|none [PAGE.html ...]   (pages: looked at, not used)
import { readFileSync } from "node:fs";
import { resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { Browser } from "./devtools.mjs";

const [program, report, sweep, axeFile, ...others] = process.argv.slice(2);
const axe = axeFile === "none" ? null : axeFile;
const page = place => pathToFileURL(resolve(place.endsWith(".html") ? place : resolve(place, "report.html"))).href;
const json = (...path) => JSON.parse(readFileSync(resolve(...path), "utf8"));
let failures = 0, checks = 0;
const check = (what, good, found = "") => {
  ++checks;
  if (good) return;
  ++failures;
  console.log(`FAILED: ${what}${found === "" ? "" : `: ${JSON.stringify(found)}`}`);
};
const near = (a, b, relative = 1e-6) => Math.abs(a - b) <= relative * Math.max(Math.abs(a), Math.abs(b));
const box = selector => `(() => { const e = document.querySelector(${JSON.stringify(selector)}); e.scrollIntoView({ block: "center" }); const b = e.getBoundingClientRect(); return [b.left, b.top, b.width, b.height]; })()`;

const browser = await Browser.start(program);
try {
  await numbersAgainstFiles();
  await film();
  await figures();
  await tables();
  await print();
  await withoutScripts();
  // What a width shows does not depend on the colours: each page is seen in both widths and in both schemes.
  for (const [k, place] of [report, sweep, ...others].entries()) for (const width of [400, 1300]) await looks(place, width, (width === 400) === (k % 2 === 0));
  await times();
  for (const place of others) await firstPaint(place);
  check("no console message and no request", browser.complaints.length === 0, browser.complaints);
  console.log(failures ? `${failures} of ${checks} checks failed` : `${checks} checks of the pages in the browser hold`);
} finally { await browser.stop(); }
process.exit(failures ? 1 : 0);

// The headline of the page and the first lines of summary.json are one number.
async function numbersAgainstFiles() {
  await browser.show({});
  await browser.open(page(report));
  const { answer } = json(report, "summary.json");
  const shown = await browser.ask(`[...document.querySelectorAll(".answer .headline data")].map(d => [Number(d.value), Number(d.textContent)])`);
  const scale = answer.temperature_over_mg ? 1e3 * answer.temperature_over_mg.value / answer.temperature.value : 1;
  const range = answer.verdict === "no single temperature";
  const expected = !answer.temperature ? [] : range ? [answer.interval.low.value, answer.interval.high.value] : [answer.temperature.value];
  check("as many numbers as the answer has", shown.length === expected.length, shown);
  shown.forEach(([value, text], i) => {
    check("the number of the headline is that of summary.json", near(value, scale * expected[i]), [value, scale * expected[i]]);
    check("its digits are rounded from it", near(value, text, 6e-3), [value, text]);
  });
  const verdict = await browser.ask(`document.querySelector(".answer .verdict").textContent.toLowerCase()`);
  check("the verdict is that of summary.json", verdict === answer.verdict, verdict);
  const top = await browser.ask(`[".answer", "figure.plot", ".bed", ".film"].map(s => document.querySelector(s)?.getBoundingClientRect().top ?? 0)`);
  check("answer, then figure, then bed", top[0] > 0 && top[0] < top[1] && top[1] < top[2], top);
}

async function film() {
  const of = json(report, "extract/film.json"), rows = readFileSync(resolve(report, "extract/disks.csv"), "utf8").trim().split("\n");
  const header = rows[0].split(","), column = name => header.indexOf(name);
  const last = of.frames.length - 1, disks = rows.slice(1).map(r => r.split(",").map(Number)).filter(r => r[0] === of.frames[last]);
  await browser.ask(`(() => { const s = document.querySelector(".film input[type=range]"); s.value = s.max; s.dispatchEvent(new Event("input")); })()`);
  await browser.ask(`new Promise(done => { const f = document.querySelector(".film"); const wait = () => f.dataset.shown === "${last}" ? done() : setTimeout(wait, 10); wait(); })`);
  const says = await browser.ask(`document.querySelector(".film output").textContent`);
  check("the slider shows the last frame and its disks", says.startsWith(`frame ${of.frames[last]}, ${disks.length} disks`), says);
  // The pointer over a disk of the table.
  const disk = disks[Math.floor(disks.length / 2)], [left, top, width] = await browser.ask(box(".film canvas")), scale = width / of.width;
  await browser.mouse("mouseMoved", left + (disk[column("x_px")] + 0.5) * scale, top + (disk[column("y_px")] + 0.5) * scale);
  const told = await browser.ask(`document.querySelector(".film .says").innerText`);
  check("the disk under the pointer is that of disks.csv", told.includes(`disk ${Math.floor(disks.length / 2)}\n`), told);
  const radius = Number(/radius ([\d.]+) px/.exec(told)?.[1]), quality = Number(/quality ([\d.]+)/.exec(told)?.[1]);
  check("its radius is that of disks.csv", Math.abs(radius - disk[column("radius_px")]) < 0.05 + disk[column("radius_px")] / 255, [radius, disk[column("radius_px")]]);
  check("its quality is that of disks.csv", Math.abs(quality - disk[column("quality")]) < 0.01, [quality, disk[column("quality")]]);
  const colours = await browser.ask(`(() => { const f = document.querySelector(".film"), s = f.querySelector("select"), c = f.querySelector("canvas"), seen = new Set();
    for (const option of s.options) { s.value = option.value; s.onchange(); seen.add(c.toDataURL()); } return [s.options.length, seen.size]; })()`);
  check("every choice of colours is another picture", colours[0] >= 4 && colours[1] === colours[0], colours);
  const moved = await browser.ask(`(() => { const b = document.querySelector(".bed"), c = b.querySelector("canvas"), s = b.querySelector("input"), was = [c.toDataURL(), b.querySelector("output").textContent, b.querySelector(".side").innerHTML];
    s.value = 1; s.dispatchEvent(new Event("input")); return [c.toDataURL() !== was[0], b.querySelector("output").textContent !== was[1], b.querySelector(".side").innerHTML !== was[2]]; })()`);
  check("the bed, its label and its profile move together", moved.every(Boolean), moved);
}

async function figures() {
  const data = json(report, "figure/profile.plot.json");
  const selector = "figure.plot[data-name=profile]";
  const [left, top, width, height] = await browser.ask(box(`${selector} .asked svg[role=application]`));
  await browser.mouse("mouseMoved", left + width / 2, top + height / 2);
  const told = await browser.ask(`document.querySelector("${selector} .says").innerText`);
  const [, x, y] = /x = ([-\d.e+]+), y = ([-\d.e+]+)/.exec(told) || [];
  check("the value under the pointer is one of the series'", data.series.some(s => s.x.some((v, i) => near(v, Number(x), 1e-3) && Math.abs(s.y[i] - Number(y)) < 1e-3 + 1e-3 * Math.abs(s.y[i]))), told);
  // By keyboard: the second point of the first series.
  await browser.ask(`document.querySelector("${selector} .asked svg[role=application]").focus()`);
  await browser.mouse("mouseMoved", 1, 1);
  for (const key of ["Escape", "Home", "Home", "ArrowRight"]) await browser.key(key);
  const keyed = await browser.ask(`document.querySelector("${selector} .says").innerText`);
  const seen = data.series[0].x.filter((v, i) => v >= data.xlim[0] && data.series[0].y[i] >= (data.ylim[0] ?? -Infinity));
  check("the arrow keys show the second point", near(Number(/x = ([-\d.e+]+)/.exec(keyed)?.[1]), seen[1], 1e-3), [keyed, seen[1]]);
  const paths = `document.querySelector("${selector} .asked svg[role=application]").innerHTML.length`;
  const before = await browser.ask(paths);
  await browser.ask(`document.querySelector("${selector} .key button").click()`);
  const off = await browser.ask(`[${paths}, document.querySelector("${selector} .key button").getAttribute("aria-pressed")]`);
  check("a series can be switched off", off[0] < before && off[1] === "false", off);
  await browser.ask(`document.querySelector("${selector} .key button").click()`);
  // Zoom: by drawing over the middle, back by Escape.
  const ticks = `[...document.querySelectorAll("${selector} .tick")].map(t => t.textContent).join(" ")`, whole = await browser.ask(ticks);
  await browser.mouse("mouseMoved", left + 0.4 * width, top + height / 3);
  await browser.mouse("mousePressed", left + 0.4 * width, top + height / 3, { button: "left", buttons: 1, clickCount: 1 });
  await browser.mouse("mouseMoved", left + 0.6 * width, top + height / 3, { button: "left", buttons: 1 });
  await browser.mouse("mouseReleased", left + 0.6 * width, top + height / 3, { button: "left", clickCount: 1 });
  const zoomed = await browser.ask(ticks);
  check("drawing over a part shows it larger", zoomed !== whole, zoomed);
  await browser.ask(`document.querySelector("${selector} .asked svg[role=application]").focus()`);
  await browser.key("Escape");
  check("Escape shows the whole again", await browser.ask(ticks) === whole);
  // What is copied holds every number of the drawing.
  const csv = await browser.ask(`(async () => { let text = ""; Object.defineProperty(navigator, "clipboard", { value: { writeText: async t => { text = t; } }, configurable: true });
    [...document.querySelectorAll("${selector} .tools button")].find(b => b.textContent === "Copy CSV").click(); await new Promise(done => setTimeout(done, 50)); return text; })()`);
  const points = [...data.series, ...data.lower].reduce((sum, s) => sum + s.x.length, 0);
  check("the copy has a line a point", csv.trim().split("\n").length === points + 1, csv.slice(0, 100));
  check("its first point is the figure's", near(Number(csv.split("\n")[1].split(",").at(-3)), data.series[0].x[0]), csv.split("\n")[1]);
  const pdf = await browser.ask(`atob(document.querySelector("${selector} a[download$='.pdf']").href.split("base64,")[1]).slice(0, 5)`);
  check("the PDF of the drawing can be downloaded", pdf === "%PDF-", pdf);
}

async function tables() {
  await browser.open(page(sweep));
  const rows = readFileSync(resolve(sweep, "sweep.csv"), "utf8").trim().split("\n").length - 1;
  const cells = `[...document.querySelectorAll("table.sortable tr")].slice(1).filter(r => !r.hidden).map(r => r.cells[0].textContent)`;
  const all = await browser.ask(cells);
  check("the table has every point of sweep.csv", all.length === rows, all);
  await browser.ask(`document.querySelector("table.sortable th button").click()`);
  await browser.ask(`document.querySelector("table.sortable th button").click()`);
  check("a second click sorts downwards", (await browser.ask(cells)).join() === [...all].sort().reverse().join());
  await browser.ask(`(() => { const f = document.querySelector(".filter input"); f.value = ${JSON.stringify(all[0])}; f.oninput(); })()`);
  check("the filter leaves the rows with its words", (await browser.ask(cells)).length === 1);
  const link = await browser.ask(`document.querySelector("table.sortable a")?.getAttribute("href") || ""`);
  check("a point has a page of its own", link.startsWith("points/") && readFileSync(resolve(sweep, link), "utf8").includes("</html>"), link);
}

async function print() {
  await browser.open(page(report));
  const { data } = await browser.send("Page.printToPDF", { printBackground: true });
  const bytes = Buffer.from(data, "base64");
  check("the page prints to PDF", bytes.subarray(0, 5).toString() === "%PDF-" && bytes.length > 30000, bytes.length);
  await browser.show({ media: "print" });
  const [drawn, asked] = await browser.ask(`["drawn", "asked"].map(c => getComputedStyle(document.querySelector("figure.plot ." + c)).display)`);
  check("on paper the drawing stands, not the figure of the screen", drawn !== "none" && asked === "none", [drawn, asked]);
}

async function withoutScripts() {
  await browser.show({ scripts: false });
  await browser.open(page(report));
  await browser.show({ scripts: true });  // to look at what is there; the scripts of the page did not run
  const seen = await browser.ask(`[".answer .headline", "figure.plot .drawn svg", ".film .still svg", ".bed .still svg", "table"].map(s => { const e = document.querySelector(s), b = e && e.getBoundingClientRect(); return b ? b.width * b.height : 0; })`);
  check("without scripts answer, figure, film, bed and tables are there", seen.every(area => area > 1000), seen);
  const controls = await browser.ask(`[...document.querySelectorAll(".controls, .asked, .filter")].filter(e => e.offsetParent !== null && e.getBoundingClientRect().height > 0).length`);
  check("and no control that does nothing", controls === 0, controls);
}

async function looks(place, width, dark) {
  const name = `${place} at ${width} px, ${dark ? "dark" : "light"}`;
  await browser.show({ width, dark });
  await browser.open(page(place));
  check(`${name}: no sideways scrolling`, await browser.ask("document.documentElement.scrollWidth") <= width, await browser.ask("document.documentElement.scrollWidth"));
  if (width === 400) {
    const small = await browser.ask(`(() => {
      const out = new Set(), walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
      for (let node; (node = walk.nextNode());) {
        const e = node.parentElement, text = node.textContent.trim();
        if (!text || ["SCRIPT", "STYLE", "OPTION", "TITLE"].includes(e.tagName) || !e.getClientRects().length) continue;
        let size = parseFloat(getComputedStyle(e).fontSize);
        const svg = e.closest("svg");
        if (svg && svg.viewBox.baseVal && svg.viewBox.baseVal.width) size *= svg.getBoundingClientRect().width / svg.viewBox.baseVal.width;
        if (!["SUB", "SUP"].includes(e.tagName) && e.tagName !== "tspan" && size < 10.95) out.add(size.toFixed(1) + " px: " + text.slice(0, 30));
      }
      return [...out].slice(0, 8);
    })()`);
    check(`${name}: all text is 11 px or larger`, small.length === 0, small);
  }
  if (!axe) return;
  await browser.ask(readFileSync(axe, "utf8") + "; 0");
  const bad = await browser.ask(`axe.run(document, { runOnly: ["wcag2a", "wcag2aa"] }).then(r => r.violations.map(v => v.id + ": " + v.nodes.slice(0, 2).map(n => n.target.join(" ") + " " + (n.any[0]?.message || n.all[0]?.message || "")).join("; ")))`);
  check(`${name}: axe-core finds nothing against WCAG 2 A and AA`, bad.length === 0, bad);
}

// Said, not asserted: times depend on the machine.
async function firstPaint(place) {
  await browser.show({});
  await browser.open(page(place));
  const paint = await browser.ask(`performance.getEntriesByName("first-contentful-paint")[0]?.startTime ?? NaN`);
  console.log(`${place}: first paint ${paint.toFixed(0)} ms`);
}
// Of the film in view, a second after the page was opened: until the picture is drawn, and until the page is painted.
async function times() {
  await firstPaint(report);
  const step = await browser.ask(`(async () => {
    const f = document.querySelector(".film"), s = f.querySelector("input"), n = Math.min(100, Number(s.max)), drawn = [], painted = [];
    f.querySelector("canvas").scrollIntoView({ block: "center" });
    await new Promise(done => setTimeout(done, 1000));
    for (let k = 0; k < n; ++k) {
      const was = f.dataset.drawn, start = performance.now();
      s.value = (Number(s.value) + 1) % (Number(s.max) + 1); s.dispatchEvent(new Event("input"));
      while (f.dataset.drawn === was) await new Promise(done => setTimeout(done, 0));
      drawn.push(performance.now() - start);
      await new Promise(done => requestAnimationFrame(() => setTimeout(done, 0)));
      painted.push(performance.now() - start);
    }
    return [drawn, painted].map(all => all.sort((a, b) => a - b));
  })()`);
  const text = all => `${all[all.length >> 1].toFixed(1)} ms (median), ${all.at(-1).toFixed(1)} ms (largest of ${all.length})`;
  console.log(`a step of the film's slider: drawn in ${text(step[0])}, painted in ${text(step[1])}`);
}
