// The engine: WebAssembly as plain functions and arrays. Runs in a worker, and in node for tests.

// The order of Settings and of Numbers in live_bed.hpp.
export const settingNames = ["count", "diameter", "width", "gamma", "frequency", "restitution", "friction", "periodic",
  "hexagonal", "seed", "settle"];
const numberNames = ["time", "timeUnit", "period", "settled", "amplitude", "collisions", "periods", "floor",
  "temperatureX", "temperatureXError", "temperatureZ", "temperatureZError", "rise", "riseError", "columnNumber",
  "curveTemperature", "curveMisfit"];

export class Engine {
  static async load(bytes) {
    const module = await WebAssembly.compile(bytes);
    const imports = {};
    // What the runtime of C++ asks of a system: there is no environment, and nothing ends.
    for (const { module: from, name } of WebAssembly.Module.imports(module)) (imports[from] ??= {})[name] = () => 0;
    const { exports } = await WebAssembly.instantiate(module, imports);
    exports._initialize?.();
    return new Engine(exports);
  }
  constructor(exports) {
    this.call = exports;
  }
  doubles(place, count) {
    return new Float64Array(this.call.memory.buffer, place, count);
  }
  // A new bed; throws an Error with what is wrong with the settings.
  begin(settings) {
    this.count = settings.count;
    this.doubles(this.call.live_settings(), settingNames.length).set(settingNames.map((name) => Number(settings[name])));
    const problem = this.call.live_begin();
    if (!problem) return;
    const text = new Uint8Array(this.call.memory.buffer, problem);
    throw new Error(new TextDecoder().decode(text.slice(0, text.indexOf(0))).trim());
  }
  // Towards a time [sqrt(D/g)], but about so many events at most: whether it arrived.
  advance(time, events) {
    return this.call.live_advance(time, events) === 1;
  }
  column(name) {
    return Float64Array.from(this.doubles(this.call[`live_${name}`](), this.count));
  }
  measure() {
    this.call.live_measure();
  }
  numbers() {
    const values = this.doubles(this.call.live_numbers(), numberNames.length);
    return Object.fromEntries(numberNames.map((name, k) => [name, values[k]]));
  }
  profile() {
    const points = this.call.live_profile_points();
    const column = (name) => Array.from(this.doubles(this.call[`live_${name}`](), points));
    return { height: column("heights"), density: column("density"), error: column("density_error"), curve: column("curve") };
  }
}
