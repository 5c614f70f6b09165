// usage: node fused.mjs WASM   (of fused_test.cpp)
import { readFileSync } from "node:fs";
const module = await WebAssembly.compile(readFileSync(process.argv[2]));
const imports = {};
for (const { module: from, name } of WebAssembly.Module.imports(module)) (imports[from] ??= {})[name] = () => 0;
const { exports } = await WebAssembly.instantiate(module, imports);
exports._initialize?.();
const found = { special: exports.special_differences() };
for (const span of [0, 3, 20, 60, 400, 520, 1020]) found[`up to 2^${span}`] = exports.random_differences(20000, span, 7 + span);
console.log(found);
process.exit(Object.values(found).some((count) => count !== 0) ? 1 : 0);
