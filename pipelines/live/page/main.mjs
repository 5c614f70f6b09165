// The page: controls to settings, settings to a bed in the worker, what the worker says to canvas, charts and numbers.
import { BedCanvas } from "./bed_canvas.mjs";
import { Chart } from "./charts.mjs";
import { recipeOf } from "./recipe.mjs";

const element = (id) => document.getElementById(id);
const calm = matchMedia("(prefers-reduced-motion: reduce)");
const calmFrameMilliseconds = 1000; // between two pictures for those who ask for less motion
const changeMilliseconds = 250; // a slider that moves makes one new bed, not dozens

const controls = [...document.querySelectorAll("[data-setting]")];
const canvas = new BedCanvas(element("bed"));
const profileChart = new Chart(element("profile"), {
  x: "height above the floor's mean position (D)",
  y: "density (1/D²)",
  lines: [{ name: "measured density, band: 95 %", className: "measured" },
    { name: "equilibrium fluid over a rectangle", className: "curve" }],
});
const temperatureChart = new Chart(element("temperatures"), {
  x: "time measured (s)",
  y: "T (m g D)",
  lines: [{ name: "T_z", className: "vertical" }, { name: "T_x", className: "measured" },
    { name: "T of the curve", className: "curve" }],
});

let settings = null;
let bed = 0;
let running = !calm.matches;
let history = [];
let lastPicture = 0;
let problem = false;

const worker = new Worker(URL.createObjectURL(new Blob([element("worker-source").textContent], { type: "text/javascript" })));
{
  const bytes = Uint8Array.from(atob(element("engine").textContent.trim()), (sign) => sign.charCodeAt(0));
  worker.postMessage({ kind: "engine", bytes }, [bytes.buffer]);
}

function readSettings() {
  const read = Object.fromEntries(controls.map((control) => [control.dataset.setting, Number(control.value)]));
  const millimetres = (value) => Number((value / 1000).toPrecision(12));
  const { diameter, columns, ...others } = read;
  return { ...others, diameter: millimetres(diameter), width: millimetres(Number((diameter * columns).toPrecision(12))),
    settle: Number((40 / read.frequency).toPrecision(6)) };
}

function showValues() {
  for (const control of controls) {
    const output = document.querySelector(`output[for="${control.id}"]`);
    if (output) output.textContent = control.value;
  }
  const omega = 2 * Math.PI * settings.frequency;
  element("amplitude").textContent = `${((1000 * settings.gamma * 9.81) / omega ** 2).toPrecision(3)} mm`;
  element("recipe").textContent = JSON.stringify(recipeOf(settings), null, 2);
}

function begin() {
  settings = readSettings();
  history = [];
  problem = false;
  showValues();
  profileChart.show([[], []]);
  temperatureChart.show([[], [], []]);
  for (const name of ["tx", "tz", "curve", "rise", "periods", "rate"]) element(name).textContent = "…";
  document.documentElement.dataset.periods = 0;
  worker.postMessage({ kind: "begin", bed: ++bed, settings });
  tellState();
}

let timer = 0;
function changed() {
  settings = readSettings();
  showValues();
  clearTimeout(timer);
  timer = setTimeout(begin, changeMilliseconds);
}

function setRunning(value) {
  running = value;
  worker.postMessage({ kind: "run", running });
  tellState();
}

function tellState(text) {
  element("start").textContent = running ? "Pause" : "Start";
  if (text !== undefined) element("state").textContent = text;
  else if (!running && !problem) element("state").textContent = "Paused.";
}

const digits = (value, error) => {
  if (!Number.isFinite(error) || error <= 0) return value.toPrecision(3);
  const places = Math.min(6, Math.max(0, 1 - Math.floor(Math.log10(error))));
  return `${value.toFixed(places)} ± ${error.toFixed(places)}`;
};

function showNumbers({ numbers, rate, profile }) {
  const millimetre = 1000 * settings.diameter;
  const temperature = (value, error) =>
    `${digits(value, error)} m g D = ${digits(value * millimetre, error * millimetre)} mm × m g`;
  if (running) {
    const seconds = (time) => (time * numbers.timeUnit).toFixed(1);
    tellState(numbers.time < numbers.settled ? `Settling: ${seconds(numbers.time)} of ${seconds(numbers.settled)} s.`
      : `Measuring: ${seconds(numbers.time - numbers.settled)} s of the bed.`);
  }
  element("rate").textContent = `${(rate / 1e6).toFixed(2)} million collisions a second, ${numbers.collisions.toLocaleString("en")} in all`;
  Object.assign(document.documentElement.dataset, { collisions: numbers.collisions, rate, periods: numbers.periods,
    temperatureX: numbers.temperatureX, temperatureXError: numbers.temperatureXError, bed });
  if (numbers.periods < 1) return;
  element("tx").textContent = temperature(numbers.temperatureX, numbers.temperatureXError);
  element("tz").textContent = temperature(numbers.temperatureZ, numbers.temperatureZError);
  element("curve").textContent = temperature(numbers.curveTemperature, NaN);
  element("rise").textContent = `${digits(numbers.rise, numbers.riseError)} D`;
  element("periods").textContent = numbers.periods.toLocaleString("en");
  profileChart.show([profile.height.map((h, k) => [h, profile.density[k]]), profile.height.map((h, k) => [h, profile.curve[k]])],
    profile.height.map((h, k) => [h, profile.density[k] - 2 * (profile.error[k] || 0), profile.density[k] + 2 * (profile.error[k] || 0)]));
  const time = (numbers.time - numbers.settled) * numbers.timeUnit;
  history.push([time, numbers.temperatureZ, numbers.temperatureX, numbers.curveTemperature]);
  if (history.length > 600) history = history.filter((_, k) => k % 2 === 1);
  temperatureChart.show([1, 2, 3].map((column) => history.map((row) => [row[0], row[column]])));
}

worker.addEventListener("message", ({ data }) => {
  if (data.bed !== bed) return; // of an earlier bed
  if (data.kind === "frame") {
    const now = performance.now();
    if (calm.matches && now - lastPicture < calmFrameMilliseconds) return;
    lastPicture = now;
    requestAnimationFrame(() => canvas.show(data, settings));
  } else if (data.kind === "numbers") {
    showNumbers(data);
  } else if (data.kind === "enough") {
    running = false;
    tellState("Paused: measured over 20,000 periods.");
  } else if (data.kind === "problem") {
    problem = true;
    tellState(`This bed cannot be simulated: ${data.text}`);
  }
});

for (const control of controls) control.addEventListener("input", changed);
element("start").addEventListener("click", () => setRunning(!running));
element("reset").addEventListener("click", begin);
element("pace").addEventListener("change", () => worker.postMessage({ kind: "pace", pace: Number(element("pace").value) }));
element("copy").addEventListener("click", async () => {
  const text = element("recipe").textContent;
  try {
    await navigator.clipboard.writeText(text);
    element("copied").textContent = "Copied.";
  } catch {
    getSelection().selectAllChildren(element("recipe"));
    element("copied").textContent = "Selected: copy with Ctrl+C.";
  }
});
element("save").addEventListener("click", () => {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([element("recipe").textContent + "\n"], { type: "application/json" }));
  link.download = "live-bed.json";
  link.click();
});

worker.postMessage({ kind: "pace", pace: Number(element("pace").value) });
begin();
setRunning(running);
