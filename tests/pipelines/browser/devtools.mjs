// Headless Chromium driven by its DevTools protocol over a pipe: no package, no port. One browser, one page at a time.
import { spawn } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

export class Browser {
  static async start(program) {
    const self = new Browser();
    self.profile = mkdtempSync(join(tmpdir(), "shakebed-browser-"));
    self.process = spawn(program, ["--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--disable-quic", "--no-first-run",
      "--disable-background-networking", "--disable-component-update", "--disable-sync", "--host-resolver-rules=MAP * ~NOTFOUND",
      "--remote-debugging-pipe", `--user-data-dir=${self.profile}`, "about:blank"], { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"], detached: true });
    const kill = self.kill = () => { try { process.kill(-self.process.pid, "SIGKILL"); } catch { /* it is gone already */ } };
    process.on("exit", kill);
    for (const signal of ["SIGTERM", "SIGINT"]) process.on(signal, () => process.exit(1));
    self.waiting = new Map();
    self.listeners = new Set();
    self.number = 0;
    let text = "";
    self.process.stdio[4].on("data", bytes => {
      text += bytes.toString("utf8");
      let end;
      while ((end = text.indexOf("\0")) >= 0) {
        self.take(JSON.parse(text.slice(0, end)));
        text = text.slice(end + 1);
      }
    });
    self.process.on("exit", () => { for (const { reject } of self.waiting.values()) reject(new Error("Chromium ended")); });
    const { targetId } = await self.send("Target.createTarget", { url: "about:blank" }, null);
    self.session = (await self.send("Target.attachToTarget", { targetId, flatten: true }, null)).sessionId;
    for (const domain of ["Page", "Runtime", "Log", "Network"]) await self.send(`${domain}.enable`);
    self.complaints = [];
    self.listeners.add(message => {
      const p = message.params;
      if (message.method === "Runtime.exceptionThrown") self.complaints.push(p.exceptionDetails.exception?.description || p.exceptionDetails.text);
      if (message.method === "Runtime.consoleAPICalled" && ["error", "warning", "assert"].includes(p.type)) self.complaints.push(p.args.map(a => a.value ?? a.description).join(" "));
      if (message.method === "Log.entryAdded" && ["error", "warning"].includes(p.entry.level)) self.complaints.push(p.entry.text);
      if (message.method === "Network.requestWillBeSent" && !/^(file|data|blob):/.test(p.request.url)) self.complaints.push(`asked for ${p.request.url}`);
    });
    return self;
  }
  take(message) {
    if (message.id) {
      const { resolve, reject, method } = this.waiting.get(message.id);
      this.waiting.delete(message.id);
      if (message.error) reject(new Error(`${method}: ${message.error.message}`)); else resolve(message.result);
    } else for (const listener of [...this.listeners]) listener(message);
  }
  send(method, params = {}, session = this.session) {
    const id = ++this.number;
    this.process.stdio[3].write(JSON.stringify({ id, method, params, ...(session ? { sessionId: session } : {}) }) + "\0");
    return new Promise((resolve, reject) => this.waiting.set(id, { resolve, reject, method }));
  }
  once(method) {
    return new Promise(resolve => {
      const listener = message => { if (message.method === method) { this.listeners.delete(listener); resolve(message.params); } };
      this.listeners.add(listener);
    });
  }
  async show({ width = 1300, height = 900, dark = false, scripts = true, media = "" }) {
    await this.send("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor: 1, mobile: false });
    await this.send("Emulation.setEmulatedMedia", { media, features: [{ name: "prefers-color-scheme", value: dark ? "dark" : "light" }, { name: "prefers-reduced-motion", value: "reduce" }] });
    await this.send("Emulation.setScriptExecutionDisabled", { value: !scripts });
  }
  async open(url) {
    const loaded = this.once("Page.loadEventFired");
    await this.send("Page.navigate", { url });
    await loaded;
    await new Promise(done => setTimeout(done, 250));
  }
  // The value of an expression in the page; promises are waited for.
  async ask(expression) {
    const answer = await this.send("Runtime.evaluate", { expression, awaitPromise: true, returnByValue: true });
    if (answer.exceptionDetails) throw new Error(answer.exceptionDetails.exception?.description || answer.exceptionDetails.text);
    return answer.result.value;
  }
  mouse(type, x, y, more = {}) { return this.send("Input.dispatchMouseEvent", { type, x, y, ...more }); }
  key(key, code = key) { return this.send("Input.dispatchKeyEvent", { type: "keyDown", key, code }).then(() => this.send("Input.dispatchKeyEvent", { type: "keyUp", key, code })); }
  async picture(full, scale = 1) {
    let clip;
    if (full) {
      const { cssContentSize: size } = await this.send("Page.getLayoutMetrics");
      clip = { x: 0, y: 0, width: size.width, height: Math.min(size.height, full), scale };
    }
    const { data } = await this.send("Page.captureScreenshot", { format: "png", captureBeyondViewport: true, ...(clip ? { clip } : {}) });
    return Buffer.from(data, "base64");
  }
  async stop() {
    try { await Promise.race([this.send("Browser.close", {}, null), new Promise(done => setTimeout(done, 2000))]); } catch { /* it is gone already */ }
    const ended = this.process.exitCode !== null ? Promise.resolve() : new Promise(done => this.process.once("exit", done));
    this.kill();  // with its children, which would go on writing into the profile
    await Promise.race([ended, new Promise(done => setTimeout(done, 5000))]);
    // A profile that cannot be removed is no fault of the page. The waits add up to 3 s.
    try { rmSync(this.profile, { recursive: true, force: true, maxRetries: 7, retryDelay: 100 }); } catch (error) { console.log(`left behind: ${error.message}`); }
  }
}
