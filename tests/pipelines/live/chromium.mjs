// Headless Chromium, driven by its own protocol through pipes: no library is needed.
import { spawn } from "node:child_process";

export class Chromium {
  constructor(program, profile, flags = []) {
    this.process = spawn(program, ["--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run",
      "--disable-background-networking", "--disable-component-update", "--host-resolver-rules=MAP * ~NOTFOUND",
      `--user-data-dir=${profile}`, "--remote-debugging-pipe", ...flags, "about:blank"],
    { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"] });
    this.waiting = new Map();
    this.listeners = [];
    this.last = 0;
    let text = "";
    this.process.stdio[4].on("data", (data) => {
      text += data;
      for (let end = text.indexOf("\0"); end >= 0; end = text.indexOf("\0")) {
        this.receive(JSON.parse(text.slice(0, end)));
        text = text.slice(end + 1);
      }
    });
  }
  receive(message) {
    if (message.id) {
      const { resolve, reject } = this.waiting.get(message.id);
      this.waiting.delete(message.id);
      if (message.error) reject(new Error(message.error.message));
      else resolve(message.result);
    } else {
      for (const listener of this.listeners) listener(message);
    }
  }
  send(method, params = {}, sessionId = undefined) {
    const id = ++this.last;
    this.process.stdio[3].write(JSON.stringify({ id, method, params, sessionId }) + "\0");
    return new Promise((resolve, reject) => this.waiting.set(id, { resolve, reject }));
  }
  close() {
    const gone = new Promise((resolve) => this.process.on("exit", resolve));
    this.process.kill();
    return gone;
  }
  // A page of this size; console messages, errors and requests to hosts go into page.said.
  async open(url, { width, height = 900, dark = false, calm = false }) {
    const { targetId } = await this.send("Target.createTarget", { url: "about:blank" });
    const { sessionId } = await this.send("Target.attachToTarget", { targetId, flatten: true });
    const page = { said: [], send: (method, params) => this.send(method, params, sessionId) };
    this.listeners.push(({ method, params, sessionId: from }) => {
      if (from !== sessionId) return;
      if (method === "Runtime.consoleAPICalled") page.said.push(params.args.map((a) => a.value ?? a.description).join(" "));
      if (method === "Runtime.exceptionThrown") page.said.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
      if (method === "Log.entryAdded") page.said.push(params.entry.text);
      if (method === "Network.requestWillBeSent" && /^(https?|wss?):/.test(params.request.url)) page.said.push(`asks for ${params.request.url}`);
    });
    for (const domain of ["Page", "Runtime", "Log", "Network"]) await page.send(`${domain}.enable`);
    await page.send("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor: 1, mobile: width < 600 });
    await page.send("Emulation.setEmulatedMedia", { features: [
      { name: "prefers-color-scheme", value: dark ? "dark" : "light" },
      { name: "prefers-reduced-motion", value: calm ? "reduce" : "no-preference" }] });
    await page.send("Page.navigate", { url });
    page.value = async (expression) => {
      const { result, exceptionDetails } = await page.send("Runtime.evaluate", { expression, awaitPromise: true, returnByValue: true });
      if (exceptionDetails) throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
      return result.value;
    };
    page.until = async (expression, seconds = 60) => {
      for (const end = Date.now() + 1000 * seconds; Date.now() < end; await new Promise((resolve) => setTimeout(resolve, 100)))
        if (await page.value(`document.documentElement && (${expression})`)) return;
      throw new Error(`not so after ${seconds} s: ${expression}`);
    };
    page.press = async (key) => {
      for (const type of ["keyDown", "keyUp"])
        await page.send("Input.dispatchKeyEvent", { type, key, code: key, windowsVirtualKeyCode: { ArrowRight: 39, Tab: 9, " ": 32 }[key] });
    };
    page.picture = async (whole = true) =>
      Buffer.from((await page.send("Page.captureScreenshot", { format: "png", captureBeyondViewport: whole })).data, "base64");
    page.close = () => this.send("Target.closeTarget", { targetId });
    return page;
  }
}
