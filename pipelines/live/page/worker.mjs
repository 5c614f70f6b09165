// Runs the bed and says what it does, so that the page stays smooth. Messages in: begin, pace, run. Messages out: frame,
// numbers, problem.
import { Engine } from "./engine.mjs";

const sliceMilliseconds = 12; // of work between two looks at the messages
const eventsAtOnce = 4000; // between two looks at the clock
const frameMilliseconds = 33; // the drawing takes time from the bed where cores share a unit
const numbersMilliseconds = 700; // a fit takes some tens of milliseconds
const mostPeriods = 20000; // then it is known well enough

let engine = null;
let waiting = null; // a bed that is asked for before the engine is there
let bed = 0; // its number: what comes of an earlier one is dropped by the page
let running = false;
let pace = 1; // seconds of the bed a second; 0: as fast as it can
let goal = 0; // where the bed goes now [sqrt(D/g)]
let lastSlice = 0, lastFrame = 0, lastNumbers = 0, busy = 0, collisionsBefore = 0, rate = 0;
let numbers = null;

function begin(message) {
  bed = message.bed;
  try {
    engine.begin(message.settings);
  } catch (error) {
    numbers = null;
    postMessage({ kind: "problem", bed, text: error.message });
    return;
  }
  numbers = engine.numbers();
  goal = 0;
  busy = rate = collisionsBefore = 0;
  lastSlice = performance.now();
  lastNumbers = lastSlice;
  sayFrame();
}

function sayFrame() {
  numbers = engine.numbers();
  const [x, z, vx, vz] = ["x", "z", "vx", "vz"].map((name) => Float32Array.from(engine.column(name)));
  numbers = engine.numbers(); // with the floor of these places
  postMessage({ kind: "frame", bed, numbers, x, z, vx, vz }, [x.buffer, z.buffer, vx.buffer, vz.buffer]);
}

function sayNumbers() {
  engine.measure();
  numbers = engine.numbers();
  if (busy > 0) rate = (1000 * (numbers.collisions - collisionsBefore)) / busy;
  collisionsBefore = numbers.collisions;
  busy = 0;
  postMessage({ kind: "numbers", bed, numbers, rate, profile: engine.profile() });
}

// Where it should be by now. What could not be done in time is left out: the bed is slower then.
function nextGoal(now) {
  const settling = numbers.time < numbers.settled;
  if (pace === 0 || settling) return goal + numbers.period / 4;
  return goal + (pace * Math.min(now - lastSlice, 50)) / 1000 / numbers.timeUnit;
}

function slice() {
  const start = performance.now();
  if (running && numbers) {
    let arrived = true;
    do {
      if (arrived) {
        numbers = engine.numbers();
        goal = nextGoal(performance.now());
        lastSlice = performance.now();
      }
      arrived = engine.advance(goal, eventsAtOnce);
    } while (performance.now() - start < sliceMilliseconds && (pace === 0 || !arrived || numbers.time < numbers.settled));
    while (!arrived && performance.now() - start < 4 * sliceMilliseconds) arrived = engine.advance(goal, eventsAtOnce);
    busy += performance.now() - start;
    if (arrived) afterSlice(performance.now());
  }
  const rest = running && numbers && pace > 0 ? Math.max(0, 4 - (performance.now() - start)) : running ? 0 : 30;
  setTimeout(slice, rest);
}

function afterSlice(now) {
  if (now - lastFrame >= frameMilliseconds) {
    lastFrame = now;
    sayFrame();
  }
  if (now - lastNumbers >= numbersMilliseconds) {
    sayNumbers();
    lastNumbers = performance.now();
    lastSlice = lastNumbers;
  }
  if (numbers.periods >= mostPeriods) {
    running = false;
    sayNumbers();
    postMessage({ kind: "enough", bed });
  }
}

addEventListener("message", async ({ data }) => {
  if (data.kind === "engine") {
    engine = await Engine.load(data.bytes);
    if (waiting) begin(waiting);
    slice();
  } else if (data.kind === "begin") {
    if (engine) begin(data);
    else waiting = data;
  } else if (data.kind === "pace") {
    pace = data.pace;
  } else if (data.kind === "run") {
    running = data.running;
    lastSlice = performance.now();
  }
});
