#!/usr/bin/env bash
# The schema that the program prints, by an independent draft-07 validator (ajv): it is a good schema itself, every shipped
# recipe and the starter keep to it, and damaged recipes do not.
# usage: schema.sh SHAKEBED RECIPES   (exit 77: no validator here)
set -eu
shakebed=$(realpath "$1")
recipes=$(realpath "$2")
command -v node >/dev/null || { echo "SKIPPED: node is not installed (Debian: node-ajv)"; exit 77; }
export NODE_PATH="${NODE_PATH:-}:/usr/share/nodejs:/usr/lib/nodejs"
node -e 'require("ajv")' 2>/dev/null || { echo "SKIPPED: ajv is not installed (Debian: node-ajv)"; exit 77; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
"$shakebed" schema >schema.json
"$shakebed" init starter.json >/dev/null
"$shakebed" run starter.json --out o --preset quick --until bed --quiet --set /stages/bed/replicas=1 >/dev/null
cat >check.js <<'JS'
const fs = require("fs"), path = require("path"), Ajv = require("ajv");
const read = name => JSON.parse(fs.readFileSync(name, "utf8"));
const ajv = new Ajv({ schemaId: "auto", allErrors: true });
const schema = read("schema.json");
if (schema.$schema !== "http://json-schema.org/draft-07/schema#") throw new Error("not draft-07: " + schema.$schema);
if (!ajv.validateSchema(schema)) { console.log("the schema is no good schema", ajv.errors); process.exit(1); }
const good = ajv.compile(schema);
const find = folder => fs.readdirSync(folder, { withFileTypes: true }).flatMap(entry => entry.isDirectory()
  ? find(path.join(folder, entry.name)) : entry.name.endsWith(".json") ? [path.join(folder, entry.name)] : []);
const recipes = [...find(process.argv[2]), "starter.json", "o/resolved.json"];
let bad = 0;
for (const name of recipes) {
  if (!good(read(name))) { console.log(name, JSON.stringify(good.errors.slice(0, 3))); ++bad; }
}
// What must be refused: each a change of the starter.
const damage = {
  "no stages": r => { delete r.stages; },
  "no name": r => { delete r.name; },
  "a kind there is not": r => { r.stages[0].stage = "simulte"; },
  "a mistyped option": r => { r.stages[0].mesure = r.stages[0].measure; },
  "an option of the wrong type": r => { r.stages[0].disks.count = "many"; },
  "a number out of range": r => { r.stages[0].disks.restitution = 2; },
  "a choice there is not": r => { r.stages[0].box.lid = "ajar"; },
};
for (const [what, change] of Object.entries(damage)) {
  const recipe = read("starter.json");
  change(recipe);
  if (good(recipe)) { console.log("not refused:", what); ++bad; }
}
console.log(`${recipes.length} recipes keep to the schema, ${Object.keys(damage).length} damaged ones do not` + (bad ? `; ${bad} WRONG` : ""));
process.exit(bad ? 1 : 0);
JS
node check.js "$recipes"
