/* The motion: frames of times, poses, columns and arrows, as the program wrote them.
 *
 * One block of bytes, little-endian, in this order: times, float64 [frame]; places of the bodies but the world, less
 * `centre`, float32 [frame][body][3]; their quaternions times 32767, int16 [frame][body][4], whose signs are such that
 * neighbouring frames may be interpolated; columns, float32 [frame][column]; arrows, float32 [frame][arrow][3]; lines of
 * the paths of effects, less `centre`, float32 [frame][line][2][3]; of each solid that is a mesh its points, three a
 * triangle, and their normals, in shares of the box, int16 [point][6]. */
/* SPDX-License-Identifier: Apache-2.0 */

function decode(text) {
    if (Uint8Array.fromBase64)
        return Uint8Array.fromBase64(text).buffer;
    const bytes = new Uint8Array(Math.floor(text.length / 4) * 3), chunk = 1 << 16;
    let used = 0;
    for (let i = 0; i < text.length; i += chunk) {
        const part = atob(text.slice(i, i + chunk));
        for (let k = 0; k < part.length; k++)
            bytes[used++] = part.charCodeAt(k);
    }
    return bytes.buffer;
}

function read_motion(data, text) {
    const bytes = decode(text.trim()), frames = data.frames, bodies = data.bodies.length - 1;
    const columns = data.columns.length, arrows = data.arrows.length;
    let used = 0;
    const take = (Type, count) => {
        const part = new Type(bytes, used, count);
        used += part.byteLength;
        return part;
    };
    return {
        frames, bodies, columns, arrows, centre: data.centre,
        times: take(Float64Array, frames),
        places: take(Float32Array, 3 * frames * bodies),
        turns: take(Int16Array, 4 * frames * bodies),
        values: take(Float32Array, frames * columns),
        forces: take(Float32Array, 3 * frames * arrows),
        line_count: data.lines, lines: take(Float32Array, 6 * frames * data.lines),
        meshes: data.solids.map(({points}) => (points === undefined ? null : take(Int16Array, 6 * points))),
    };
}

/* The last frame that is not after t. */
function frame_at(motion, t) {
    let low = 0, high = motion.frames - 1;
    while (low < high) {
        const middle = (low + high + 1) >> 1;
        if (motion.times[middle] <= t)
            low = middle;
        else
            high = middle - 1;
    }
    return low;
}

/* Poses at time t, interpolated between frames, into `poses`: eight numbers a body (place, 0, quaternion), the world
 * first; places are less `centre`. */
function pose_bodies(motion, t, poses) {
    const i = frame_at(motion, t), j = Math.min(i + 1, motion.frames - 1), n = motion.bodies;
    const gap = motion.times[j] - motion.times[i], s = gap > 0 ? clamp((t - motion.times[i]) / gap, 0, 1) : 0;
    poses.set([...scale(-1, motion.centre), 0, 1, 0, 0, 0]);
    for (let b = 0; b < n; b++) {
        const p = 3 * (i * n + b), q = 3 * (j * n + b), u = 4 * (i * n + b), v = 4 * (j * n + b), to = 8 * (b + 1);
        for (let k = 0; k < 3; k++)
            poses[to + k] = (1 - s) * motion.places[p + k] + s * motion.places[q + k];
        let square = 0;
        for (let k = 0; k < 4; k++) {
            const x = (1 - s) * motion.turns[u + k] + s * motion.turns[v + k];
            poses[to + 4 + k] = x;
            square += x * x;
        }
        const inverse = 1 / Math.sqrt(square);
        for (let k = 4; k < 8; k++)
            poses[to + k] *= inverse;
    }
}

/* A point of a body in the world, less `centre`. */
function point_of(poses, body, at) {
    const k = 8 * body, q = poses.subarray(k + 4, k + 8);
    return add([poses[k], poses[k + 1], poses[k + 2]], turn(q, at));
}

const turn_of = (poses, body, q) => product(poses.subarray(8 * body + 4, 8 * body + 8), q);

/* An arrow's vector at time t. */
function force_at(motion, t, arrow) {
    const i = frame_at(motion, t), j = Math.min(i + 1, motion.frames - 1), n = motion.arrows;
    const gap = motion.times[j] - motion.times[i], s = gap > 0 ? clamp((t - motion.times[i]) / gap, 0, 1) : 0;
    const a = 3 * (i * n + arrow), b = 3 * (j * n + arrow), f = motion.forces;
    return [0, 1, 2].map((k) => (1 - s) * f[a + k] + s * f[b + k]);
}

/* The two ends of a line of a path at time t, less `centre`. */
function line_at(motion, t, line) {
    const i = frame_at(motion, t), j = Math.min(i + 1, motion.frames - 1), n = motion.line_count;
    const gap = motion.times[j] - motion.times[i], s = gap > 0 ? clamp((t - motion.times[i]) / gap, 0, 1) : 0;
    const a = 6 * (i * n + line), b = 6 * (j * n + line), x = motion.lines;
    return [0, 3].map((end) => [0, 1, 2].map((k) => (1 - s) * x[a + end + k] + s * x[b + end + k]));
}

/* The way of a point over the whole motion, at most `most` points. */
function path_of(motion, body, at, most) {
    const stride = Math.max(1, Math.ceil(motion.frames / most)), points = [];
    for (let i = 0; i < motion.frames; i += stride) {
        const k = i * motion.bodies + body - 1, q = [...motion.turns.subarray(4 * k, 4 * k + 4)].map((x) => x / 32767);
        points.push(add([...motion.places.subarray(3 * k, 3 * k + 3)], turn(q, at)));
    }
    return {points, stride};
}
