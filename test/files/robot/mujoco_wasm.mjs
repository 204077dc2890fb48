/* SPDX-License-Identifier: Apache-2.0 */
// What MuJoCo, as WebAssembly (npm's @mujoco/mujoco), computes of models, without contacts and constraints.
//
//     node mujoco_wasm.mjs PACKAGE STATES FILE...
//
// Words apart by blanks. Of each file: its path, then `rejected` and the reason on a line, or `read` and
//     nbody njnt nq nv neq na;  of each body its name (`.`: it has none) and mass;  of each joint its name, type, dofs and body;
//     of each equality its name and the factor of its last three numbers (a weld's torquescale);
// and of each random state
//     (with the controls of the only keyframe, if its name is `k`) qpos, qvel, mass matrix, bias force, forces of springs, dampers and actuators, qacc, xpos, xmat, residuals of
//     equalities, six numbers each, activations.
// With STATES `rest=3` of each file `read`, nq and the positions after 3 s from the first keyframe, with contacts and all else.
// Blanks in names are written as `_`.
import fs from "node:fs";
import path from "node:path";
import { pathToFileURL } from "node:url";

const [folder, states, ...files] = process.argv.slice(2);
const load = (await import(pathToFileURL(path.join(folder, "mujoco.js")))).default;
const mujoco = await load({ print() {}, printErr() {} });

// The generator of Numerical Recipes for 32 bits: the states are the same in each run.
let seed = 1;
function uniform(size) {
    seed = (Math.imul(seed, 1664525) + 1013904223) >>> 0;
    return size * (2 * (seed / 2 ** 32) - 1);
}

// MuJoCo reads from a file system of its own, in memory: it has one folder of models at a time. Files that refer to
// folders above their own need KT_ROBOT_ROOT, a folder that contains all of them.
const root = process.env.KT_ROBOT_ROOT;
let copied = [];
function copy(from) {
    mujoco.FS.mkdirTree(from);
    for (const entry of fs.readdirSync(from, { withFileTypes: true })) {
        const name = path.join(from, entry.name);
        if (entry.isDirectory())
            copy(name);
        else {
            mujoco.FS.writeFile(name, fs.readFileSync(name));
            copied.push(name);
        }
    }
}

let folder_of_models = "";
function copy_folder_of(file) {
    const folder = root && file.startsWith(root + "/") ? root : path.dirname(file);
    if (folder === folder_of_models)
        return;
    copied.forEach((name) => mujoco.FS.unlink(name));
    copied = [];
    folder_of_models = folder;
    copy(folder_of_models);
}

// Exports refer to meshes elsewhere.
function copy_files_of(file) {
    for (const [, name] of fs.readFileSync(file, "utf8").matchAll(/<mesh [^>]*file="([^"]*)"/g)) {
        const from = path.resolve(path.dirname(file), name.replaceAll("&amp;", "&"));
        if (!fs.existsSync(from) || mujoco.FS.analyzePath(from).exists)
            continue;
        mujoco.FS.mkdirTree(path.dirname(from));
        mujoco.FS.writeFile(from, fs.readFileSync(from));
        copied.push(from);
    }
}

function say(...rows) {
    process.stdout.write(rows.map((row) => Array.from(row ?? []).join(" ") + "\n").join(""));
}

const name_of = (thing) => thing.name.replace(/\s/g, "_") || ".";

function set_random_state(model, data) {
    for (let i = 0; i < model.nq; i++)
        data.qpos[i] = uniform(1);
    for (let i = 0; i < model.nv; i++)
        data.qvel[i] = uniform(2);
    mujoco.mj_normalizeQuat(model, data.qpos);
    for (let i = 0; i < model.nu; i++)
        for (let k = 0; k < model.actuator_actnum[i]; k++) {
            const [low, high] = model.actuator_actrange.slice(2 * i, 2 * i + 2), share = 0.5 + uniform(0.5);
            data.act[model.actuator_actadr[i] + k] = low < high ? low + (high - low) * share : share;
        }
}

// After all else of the state, which is without constraints.
function residuals(model, data) {
    const constraint = mujoco.mjtDisableBit.mjDSBL_CONSTRAINT.value, count = new Array(model.neq).fill(0);
    const rows = new Array(6 * model.neq).fill(0);
    model.opt.disableflags &= ~constraint;
    mujoco.mj_fwdPosition(model, data);
    for (let row = 0; row < data.ne; row++)
        if (count[data.efc_id[row]] < 6) // a flex has more
            rows[6 * data.efc_id[row] + count[data.efc_id[row]]++] = data.efc_pos[row];
    model.opt.disableflags |= constraint;
    return rows;
}

function describe(file) {
    const model = mujoco.MjModel.from_xml_path(file);
    const data = new mujoco.MjData(model), matrix = new mujoco.DoubleBuffer(model.nv ** 2 || 1);
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT.value | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT.value;
    say(["read", model.nbody, model.njnt, model.nq, model.nv, model.neq, model.na]);
    for (let i = 0; i < model.nbody; i++)
        say([name_of(model.body(i)), model.body_mass[i]]);
    for (let i = 0; i < model.njnt; i++)
        say([name_of(model.jnt(i)), model.jnt_type[i], model.jnt_qposadr[i], model.jnt_dofadr[i], model.jnt_bodyid[i]]);
    for (let i = 0; i < model.neq; i++)
        say([name_of(model.eq(i)), model.eq_type[i] === mujoco.mjtEq.mjEQ_WELD.value ? model.eq_data[11 * i + 10] : 1]);
    const controls = model.nkey === 1 && model.nu > 0 && name_of(model.key(0)) === "k" ? model.key_ctrl : [];
    controls.forEach((u, i) => (data.ctrl[i] = u));
    for (let n = 0; n < states; n++) {
        set_random_state(model, data);
        mujoco.mj_forward(model, data);
        if (model.nv > 0)
            mujoco.mj_fullM(model, data, matrix);
        say(data.qpos, data.qvel, matrix.GetView().subarray(0, model.nv ** 2), data.qfrc_bias,
            data.qfrc_passive?.map((x, i) => x + data.qfrc_actuator[i]), data.qacc, data.xpos, data.xmat);
        say(residuals(model, data), data.act);
    }
    for (const thing of [matrix, data, model])
        thing.delete();
}

function rest(file, seconds) {
    const model = mujoco.MjModel.from_xml_path(file), data = new mujoco.MjData(model);
    mujoco.mj_resetDataKeyframe(model, data, 0);
    for (let before = 0; data.time < seconds; before = data.time) {
        mujoco.mj_step(model, data);
        if (data.time <= before)
            throw new Error("the motion is unstable, and was reset");
    }
    say(["read", model.nq], data.qpos);
    for (const thing of [data, model])
        thing.delete();
}

for (const file of files) {
    say([file]);
    try {
        copy_folder_of(file);
        copy_files_of(file);
        if (states.startsWith("rest="))
            rest(file, Number(states.slice(5)));
        else
            describe(file);
    } catch (error) {
        say(["rejected", String(error.message ?? error).replace(/\s+/g, " ")]);
    }
}
