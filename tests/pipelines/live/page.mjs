// The live page in headless Chromium: it computes, its numbers answer to the sliders, it fits 400 px, and it is silent.
// usage: node page.mjs CHROMIUM PAGE SHAKEBED FOLDER [PICTURES]
import { execFileSync } from "node:child_process";
import { mkdirSync, writeFileSync } from "node:fs";
import { pathToFileURL } from "node:url";
import { Chromium } from "./chromium.mjs";

const [program, file, shakebed, folder, pictures] = process.argv.slice(2);
const url = pathToFileURL(file).href;
let bad = 0;
const complain = (text) => { console.log(`BAD: ${text}`); bad = 1; };
const chromium = new Chromium(program, `${folder}/profile`);
process.on("exit", () => chromium.process.kill());
const facts = "({...document.documentElement.dataset})";
const measuredFor = (periods) => `Number(document.documentElement.dataset.periods) >= ${periods}`;
const set = (id, value) => `{ const c = document.getElementById("${id}"); c.value = "${value}"; c.dispatchEvent(new Event("input")); }`;
const silent = (page, name) => page.said.forEach((text) => complain(`${name}: ${text}`));

async function answersSliders() {
  const page = await chromium.open(url, { width: 1300 });
  await page.until(measuredFor(100), 600);
  const cold = await page.value(facts);
  if (!(Number(cold.collisions) > 10000)) complain(`${cold.collisions} collisions`);
  console.log(`${(cold.rate / 1e6).toFixed(2)} million collisions a second in Chromium`);
  const change = async (id, value) => {
    const before = (await page.value(facts)).bed;
    await page.value(set(id, value));
    await page.until(`Number(document.documentElement.dataset.bed) > ${before} && ${measuredFor(100)}`, 600);
    return page.value(facts);
  };
  // Hotter by a stronger shaking, colder by more loss: 6 standard errors and more.
  const hot = await change("gamma", 8), lossy = await change("restitution", 0.7);
  const away = (one, other) => (one.temperatureX - other.temperatureX) / Math.hypot(one.temperatureXError, other.temperatureXError);
  console.log(`T_x ${cold.temperatureX} at Gamma 4, ${hot.temperatureX} at 8 (${away(hot, cold).toFixed(1)} standard errors), ` +
    `${lossy.temperatureX} with e = 0.7 (${away(lossy, hot).toFixed(1)})`);
  if (!(away(hot, cold) > 6)) complain("a stronger shaking does not heat");
  if (!(away(lossy, hot) < -6)) complain("more loss does not cool");
  // The recipe is the bed's.
  const recipe = await page.value("document.getElementById('recipe').textContent");
  writeFileSync(`${folder}/live-bed.json`, recipe);
  execFileSync(shakebed, ["validate", `${folder}/live-bed.json`], { stdio: "ignore" });
  const { gamma, restitution } = JSON.parse(recipe).stages[0].floor;
  if (gamma !== 8 || restitution !== 0.7) complain(`the recipe has Gamma ${gamma} and e ${restitution}`);
  await page.value("document.getElementById('start').click()");
  await page.until("document.getElementById('state').textContent === 'Paused.'");
  const still = await page.value(facts);
  await new Promise((resolve) => setTimeout(resolve, 1500));
  if ((await page.value(facts)).collisions !== still.collisions) complain("it goes on while it is paused");
  // Keys: an arrow moves a slider, a space presses the button.
  await page.value("document.getElementById('gamma').focus()");
  await page.press("ArrowRight");
  if ((await page.value("document.getElementById('gamma').value")) !== "8.1") complain("an arrow key does not move the slider");
  // A bed that cannot be is refused in words.
  await page.value(set("diameter", 0));
  await page.until("document.getElementById('state').textContent.startsWith('This bed cannot be simulated: ')");
  silent(page, "sliders");
  await page.close();
}

// Text of at least 11 px, contrast of WCAG 2.1 AA, no sideways scroll.
const looks = `(() => {
  const rgb = (text) => (text.match(/[\\d.]+/g) || []).map(Number);
  const light = ([r, g, b]) => { const f = (v) => ((v /= 255) <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4); return 0.2126 * f(r) + 0.7152 * f(g) + 0.0722 * f(b); };
  const ground = (e) => { for (; e; e = e.parentElement) { const c = rgb(getComputedStyle(e).backgroundColor); if (c.length && c[3] !== 0) return c; } return [255, 255, 255]; };
  let smallest = 99, contrast = 21;
  for (const e of document.querySelectorAll("h1,h2,p,label,output,button,select,input,dt,dd,figcaption,pre,footer,.legend span,svg text")) {
    const shown = e.tagName === "INPUT" ? e.type !== "range" : e.textContent.trim();  // a slider shows no text
    if (!e.getClientRects().length || !shown) continue;
    const style = getComputedStyle(e), svg = e.tagName === "text";
    smallest = Math.min(smallest, parseFloat(style.fontSize));
    const a = light(rgb(svg ? style.fill : style.color)), b = light(ground(svg ? e.closest("figure") : e));
    contrast = Math.min(contrast, (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05));
  }
  const nameless = [...document.querySelectorAll("input,select,button")].filter((e) => !(e.labels?.length || e.textContent.trim())).length;
  return { smallest, contrast, nameless, wide: document.documentElement.scrollWidth,
    texts: [...document.querySelectorAll("figure svg")].map((chart) => chart.querySelectorAll("text").length) };
})()`;

async function fits(width, dark) {
  const name = `${width}-${dark ? "dark" : "light"}`, page = await chromium.open(url, { width, dark });
  await page.until(measuredFor(20), 300);
  const { smallest, contrast, nameless, wide, texts } = await page.value(looks);
  if (smallest < 11) complain(`${name}: text of ${smallest} px`);
  if (contrast < 4.5) complain(`${name}: contrast ${contrast}`);
  if (nameless > 0) complain(`${name}: ${nameless} controls without a name`);
  if (wide > width) complain(`${name}: ${wide} px wide`);
  // Each chart has the names of its axes and at least three numbers at each.
  if (texts.length !== 2 || Math.min(...texts) < 8) complain(`${name}: charts with ${texts} texts`);
  if (pictures) {
    mkdirSync(pictures, { recursive: true });
    writeFileSync(`${pictures}/live-${name}.png`, await page.picture());
  }
  silent(page, name);
  await page.close();
}

async function keepsCalm() {
  const page = await chromium.open(url, { width: 1300, calm: true });
  await page.until("document.getElementById('start').textContent === 'Start'");
  await new Promise((resolve) => setTimeout(resolve, 1500));
  if (Number((await page.value(facts)).collisions ?? 0) > 0) complain("it moves where less motion is asked for");
  silent(page, "calm");
  await page.close();
}

try {
  await answersSliders();
  for (const width of [1300, 400]) for (const dark of [false, true]) await fits(width, dark);
  await keepsCalm();
} catch (error) {
  complain(error.stack);
}
await chromium.close();
process.exit(bad);
