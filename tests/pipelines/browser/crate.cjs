// ro-crate-metadata.json of a folder of results by the validator of the npm package ro-crate: every rule of the root, and
// that every file named is there. Files of times and logs are not named, of which it warns. Its vocabulary is the
// package's own, since the page of the specification cannot be asked without a network.
// usage: node crate.cjs NODE_MODULES REPORT-FOLDER...
const { readFileSync, readdirSync, statSync } = require("fs");
const { join, relative, resolve } = require("path");

const [modules, ...folders] = process.argv.slice(2);
const { ROCrate } = require(resolve(modules, "ro-crate"));
const { Validator } = require(resolve(modules, "ro-crate/lib/validator.js"));
const vocabulary = JSON.parse(readFileSync(resolve(modules, "ro-crate/lib/context.json"), "utf8"))["@context"];

function filesOf(root, folder = root, found = {}) {
  for (const name of readdirSync(folder)) {
    const path = join(folder, name), isFolder = statSync(path).isDirectory();
    found[relative(root, path) + (isFolder ? "/" : "")] = { exists: true };
    if (isFolder) filesOf(root, path, found);
  }
  return found;
}

async function errorsOf(root) {
  const json = JSON.parse(readFileSync(join(root, "ro-crate-metadata.json"), "utf8"));
  json["@context"] = [vocabulary, ...[json["@context"]].flat().slice(1)];
  const crate = new ROCrate(json, { array: true, link: true });
  await crate.resolveContext();
  const validator = new Validator(crate);
  validator.isCrate();
  validator.rootDataEntity();
  validator.checkFiles(filesOf(root));
  return validator.results.filter(result => result.status === "error");
}

(async () => {
  let bad = 0;
  for (const folder of folders) {
    const errors = await errorsOf(folder);
    for (const { id, entity, message } of errors) console.log(`FAILED: ${folder}: ${id} ${entity || ""} ${message}`);
    bad += errors.length;
  }
  if (!bad) console.log(`the metadata of ${folders.join(" and ")} are a valid RO-Crate`);
  process.exit(bad ? 1 : 0);
})();
