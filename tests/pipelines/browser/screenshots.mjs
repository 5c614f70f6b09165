// Pictures of pages at 1300 and 400 px, light and dark, the first at half their size: those of docs/pictures.
// usage: node screenshots.mjs CHROMIUM FOLDER HEIGHT NAME=REPORT.html ...
import { writeFileSync } from "node:fs";
import { resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { Browser } from "./devtools.mjs";

const [program, folder, height, ...pages] = process.argv.slice(2);
const browser = await Browser.start(program);
try {
  for (const page of pages) {
    const [name, path] = page.split("=");
    for (const width of [1300, 400]) for (const dark of [false, true]) {
      await browser.show({ width, height: width === 400 ? 850 : 1000, dark });
      await browser.open(pathToFileURL(resolve(path)).href);
      await new Promise(done => setTimeout(done, 400));
      writeFileSync(`${folder}/${name}-${width}-${dark ? "dark" : "light"}.png`, await browser.picture(Number(height), width === 400 ? 0.8 : 0.5));
    }
  }
} finally { await browser.stop(); }
