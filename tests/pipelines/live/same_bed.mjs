// The bed of the page against the bed that the program makes of the page's recipe.
// usage: node same_bed.mjs PAGE SHAKEBED FOLDER
// Beds that start at random: every number of every frame the same to the last bit, temperatures and rise too. A bed that
// starts in rows: its means agree within 5 of their standard errors (one test in two million fails by chance).
import { execFileSync } from "node:child_process";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { Engine } from "../../../pipelines/live/page/engine.mjs";
import { recipeOf } from "../../../pipelines/live/page/recipe.mjs";

const [page, shakebed, folder] = process.argv.slice(2);
const periods = 25;
const base = { count: 300, diameter: 0.003, width: 0.09, gamma: 4, frequency: 20, restitution: 0.92, friction: 0.2,
  periodic: 0, hexagonal: 0, seed: 1, settle: 2 };
const exact = [
  base,
  { ...base, seed: 12345678901, gamma: 7.3, diameter: 0.00299, width: 0.0897 },
  { ...base, friction: 0, restitution: 0.85, count: 120 },
  { ...base, periodic: 1, width: 0.063, count: 210, frequency: 33 },
  { ...base, periodic: 1, friction: 0, gamma: 11.1, restitution: 0.97 },
  { ...base, gamma: 0.9, count: 80, width: 0.045 }, // comes to rest
  { ...base, gamma: 2.5, restitution: 0.7, friction: 0.9, frequency: 60, count: 90, width: 0.0303, settle: 0.5 },
];
const similar = { ...base, hexagonal: 1, seed: 3 };

const bytes = Buffer.from(readFileSync(page, "utf8").match(/<script type="text\/plain" id="engine">([^<]*)</)[1], "base64");
const engine = await Engine.load(bytes);
let bad = 0;
const complain = (text) => { console.log(`BAD: ${text}`); bad = 1; };

function runProgram(settings, number, measured) {
  const recipe = recipeOf(settings);
  recipe.stages = recipe.stages.slice(0, 1);
  Object.assign(recipe.stages[0], { measure: `${measured / settings.frequency} s`, replicas: 1, compress: false,
    frames: { count: periods, phases: 32 } });
  const place = `${folder}/${number}`;
  mkdirSync(place, { recursive: true });
  writeFileSync(`${place}/bed.json`, JSON.stringify(recipe));
  execFileSync(shakebed, ["run", `${place}/bed.json`, "--out", `${place}/o`, "--quiet"], { stdio: ["ignore", "ignore", "pipe"] });
  return { observed: JSON.parse(readFileSync(`${place}/o/bed/observables.json`, "utf8")),
    frames: framesOf(readFileSync(`${place}/o/bed/trajectory.extxyz`, "utf8")) };
}

function framesOf(text) {
  const lines = text.split("\n"), frames = [];
  for (let k = 0; k + 1 < lines.length;) {
    const count = Number(lines[k]), value = (name) => Number(lines[k + 1].match(new RegExp(`\\b${name}=(\\S+)`))[1]);
    const rows = lines.slice(k + 2, k + 2 + count).map((line) => line.split(" ").slice(1).map(Number));
    frames.push({ time: value("Time"), floor: value("Floor"), columns: { x: rows.map((r) => r[0]), z: rows.map((r) => r[2]),
      vx: rows.map((r) => r[3]), vz: rows.map((r) => r[5]) } });
    k += 2 + count;
  }
  return frames;
}

const go = (time) => { while (!engine.advance(time, 20000)); };

function compareFrames(settings, frames) {
  let numbers = 0;
  for (const frame of frames) {
    go(frame.time);
    for (const name of ["x", "z", "vx", "vz"]) {
      const mine = engine.column(name), theirs = frame.columns[name];
      const other = theirs.findIndex((value, i) => value !== mine[i]);
      if (mine.length !== theirs.length || other >= 0) {
        complain(`${JSON.stringify(settings)}: at ${frame.time} ${name} of disk ${other} is ${mine[other]}, the program's ${theirs[other]}`);
        return;
      }
      numbers += mine.length;
    }
    if (engine.numbers().floor !== frame.floor) complain(`the floor at ${frame.time}`);
  }
  return numbers;
}

// Until the last period that the program measures is over. A look begins the next period: the page takes it, and no more.
function measured(periodCount) {
  const { settled, period } = engine.numbers();
  go(settled + (periodCount - 1 / 64) * period);
  engine.measure();
  return engine.numbers();
}
const pairs = (mine, observed) => [
  ["T_x", mine.temperatureX, mine.temperatureXError, observed.temperature_x],
  ["T_z", mine.temperatureZ, mine.temperatureZError, observed.temperature_z],
  ["rise", mine.rise, mine.riseError, observed.center_of_mass_rise],
];

exact.forEach((settings, number) => {
  const { frames, observed } = runProgram(settings, number, periods);
  engine.begin(settings);
  const numbers = compareFrames(settings, frames);
  if (!numbers) return;
  const mine = measured(periods);
  if (mine.collisions < 1000) complain(`only ${mine.collisions} collisions`);
  if (mine.periods !== observed.periods) complain(`${mine.periods} periods, the program ${observed.periods}`);
  for (const [name, value, , theirs] of pairs(mine, observed))
    if (!(Math.abs(value - theirs.value) <= 1e-12 * Math.abs(theirs.value) + 1e-14)) complain(`${name}: ${value}, the program ${theirs.value}`);
  console.log(`${number}: ${frames.length} frames, ${numbers} numbers the same, ${mine.collisions} collisions`);
});

{
  const long = 400, { observed } = runProgram(similar, "rows", long);
  engine.begin(similar);
  for (const [name, value, error, theirs] of pairs(measured(long), observed)) {
    const away = Math.abs(value - theirs.value) / Math.hypot(error, theirs.std_error);
    console.log(`in rows: ${name} ${value} ± ${error}, the program ${theirs.value} ± ${theirs.std_error}: ${away.toFixed(2)} standard errors`);
    if (!(away < 5)) complain(`${name} of a bed that starts in rows`);
  }
}

// What cannot be is said, and the next bed is there.
try {
  engine.begin({ ...base, width: 0.001 });
  complain("a box narrower than a disk was taken");
} catch (error) {
  if (!/narrower than a disk/.test(error.message)) complain(error.message);
}
engine.begin(base);
process.exit(bad);
