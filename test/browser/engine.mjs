/* engine.mjs PAGE MOTION.js NUMBERS.js: runs the scene of a live page with the engine of the page, and compares the frames with those that
 * the command has put into the page. Prints JSON: for each part of the frames the hashes of both, and the number of values that differ. */
/* SPDX-License-Identifier: Apache-2.0 */
import {createHash} from "crypto";
import {readFileSync} from "fs";
import vm from "vm";
import {gunzipSync} from "zlib";

const [page, ...scripts] = process.argv.slice(2), html = readFileSync(page, "utf8");
const part = (id) => html.split(`id="${id}">`)[1].split("</script>")[0];
const context = vm.createContext({WebAssembly, TextDecoder, TextEncoder, atob, performance, postMessage: () => {}});
vm.runInContext([...scripts.map((path) => readFileSync(path, "utf8")), part("worker"),
    "globalThis.kit = {Engine, read_motion, NOTE};"].join("\n"), context);
const {Engine, read_motion, NOTE} = context.kit;

const {scene, engine_size} = JSON.parse(part("scene")), data = JSON.parse(part("data"));
const packed = Buffer.from(part("engine"), "base64").subarray(0, engine_size), said = {notes: [], faults: []};
let progress = 0;
const engine = new Engine(await WebAssembly.compile(gunzipSync(packed)), {message: (rank, text) => (rank === NOTE ? said.notes : said.faults).push(text), progress: () => progress++});
const start = performance.now(), handle = engine.open(scene, []), opened = performance.now();
const is_run = handle !== 0 && engine.run(handle), ended = performance.now();

const hash = (array) => createHash("sha256").update(Buffer.from(array.buffer, array.byteOffset, array.byteLength)).digest("hex").slice(0, 16);
const columns_of = (all, motion, names) => Float32Array.from(names.flatMap((name) => {
    const column = all.columns.findIndex((one) => one.name === name);
    return Array.from({length: motion.frames}, (_, i) => motion.values[i * motion.columns + column]);
}));

/* Numbers whose bits differ; NaN is equal to NaN. */
const differing = (a, b) => (a.length !== b.length ? Math.max(a.length, b.length) : [...a].filter((x, i) => !Object.is(x, b[i])).length);

/* The largest distance of two places of a body at a time, as a share of the mechanism's size. */
const worst_of = (a, b, size) => (a.length !== b.length ? null : a.reduce((worst, x, i) => Math.max(worst, Math.abs(x - b[i]) / size), 0));

const parts = {};
let state = null, worst = null;
if (is_run) {
    const own = engine.result(handle), decode = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
    context.decode = (text) => (typeof text === "string" ? decode(text) : text);
    const native = read_motion(data, part("motion")), other = read_motion(own.data, {trim: () => own.frames});
    /* The change of the energy is that of a balance in the engine, if forces dissipate. */
    const names = data.columns.map(({name}) => name).filter((name) => name !== "energy.total less its start").filter((name) => own.data.columns.some((one) => one.name === name));
    const compare = (name, a, b) => { parts[name] = {native: hash(a), engine: hash(b), count: a.length, differing: differing(a, b)}; };
    for (const name of ["times", "places", "turns", "forces", "lines"])
        compare(name, native[name], other[name]);
    compare("values", columns_of(data, native, names), columns_of(own.data, other, names));
    state = engine.state(handle);
    worst = worst_of(native.places, other.places, data.size);
    parts.columns = {count: data.columns.length, differing: data.columns.filter(({name}) => name !== "energy.total less its start").length - names.length};
    parts.failure = {count: 1, differing: (data.failed?.message ?? "") === (own.data.failed?.message ?? "") ? 0 : 1};
}
/* Functions of the C library at k / 64, which the caller compares with its own. */
const functions = Object.fromEntries(["sin", "cos", "exp"].map((name) => [name, Array.from({length: 4000}, (_, k) => engine.calls[name](k / 64))]));

/* FMI: the values of parameters as the importer of an FMU sees them. */
const parameters = (state?.parameters ?? []).map(({reference, value}) => ({value, read: engine.get(handle, [reference])?.[0]}));
console.log(JSON.stringify({...said, is_run, parts, worst, functions, parameters, progress, state, open_ms: opened - start, run_ms: ended - opened}));
