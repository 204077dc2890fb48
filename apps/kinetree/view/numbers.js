/* Vectors are arrays of three numbers, quaternions [w, x, y, z]; matrices have 16 numbers, by columns, as WebGL takes
 * them. */
/* SPDX-License-Identifier: Apache-2.0 */

const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const scale = (s, a) => [s * a[0], s * a[1], s * a[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const norm = (a) => Math.hypot(a[0], a[1], a[2]);
const unit = (a, otherwise = [0, 0, 1]) => (norm(a) > 0 ? scale(1 / norm(a), a) : otherwise);
const clamp = (x, low, high) => Math.min(Math.max(x, low), high);

/* A unit vector normal to a. */
function normal_to(a) {
    const k = Math.abs(a[0]) < 0.6 ? [1, 0, 0] : [0, 1, 0];
    return unit(cross(a, k));
}

/* u turned by the quaternion q: u + 2 v x (v x u + w u). */
function turn(q, u) {
    const v = [q[1], q[2], q[3]];
    return add(u, scale(2, cross(v, add(cross(v, u), scale(q[0], u)))));
}

function product(p, q) {
    return [
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    ];
}

/* The quaternion that turns z onto the unit vector n. */
function from_z(n) {
    if (n[2] < -0.999999)
        return [0, 1, 0, 0];
    const q = [1 + n[2], -n[1], n[0], 0], s = Math.hypot(...q);
    return q.map((x) => x / s);
}

function multiply(a, b) {
    const c = new Float64Array(16);
    for (let j = 0; j < 4; j++)
        for (let i = 0; i < 4; i++)
            for (let k = 0; k < 4; k++)
                c[4 * j + i] += a[4 * k + i] * b[4 * j + k];
    return c;
}

/* Eye coordinates of an observer at `eye`: x to the right, y up, z towards the observer. */
function look(eye, right, up, back) {
    return new Float64Array([
        right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
        -dot(right, eye), -dot(up, eye), -dot(back, eye), 1,
    ]);
}

/* Perspective with `slope` = tan of half the vertical angle, or parallel with `slope` half of the height. */
function project(is_parallel, slope, aspect, near, far) {
    const m = new Float64Array(16);
    m[0] = 1 / (slope * aspect);
    m[5] = 1 / slope;
    if (is_parallel) {
        m[10] = -2 / (far - near);
        m[14] = -(far + near) / (far - near);
        m[15] = 1;
    } else {
        m[10] = -(far + near) / (far - near);
        m[11] = -1;
        m[14] = (-2 * far * near) / (far - near);
    }
    return m;
}

/* Few digits, but enough to tell neighbouring values apart. */
function show_number(x) {
    if (!Number.isFinite(x))
        return "\u2013";
    const text = x !== 0 && (Math.abs(x) < 1e-3 || Math.abs(x) >= 1e5) ? x.toExponential(3) : x.toPrecision(5);
    return text.replace(/(\.\d*?)0+(e|$)/, "$1$2").replace(/\.(e|$)/, "$1").replace("-", "\u2212").replace("e+", "e");
}

/* The labels of ticks. If those of neighbours are equal, they are differences from the offset. */
function label_ticks(values) {
    const texts = values.map(show_number), step = values[1] - values[0];
    if (new Set(texts).size === values.length)
        return {texts, offset: 0};
    const offset = 10 * step * Math.floor(values[0] / (10 * step) + 1e-9);
    return {texts: values.map((v) => show_number(step * Math.round((v - offset) / step))), offset};
}

/* A text of at most this width, cut in its middle. */
function shorten(text, width, measure) {
    const letters = [...text];
    let short = text;
    for (let kept = letters.length; kept > 0 && measure(short) > width; kept--)
        short = [...letters.slice(0, Math.ceil(kept / 2)), "\u2026", ...letters.slice(letters.length - (kept >> 1))].join("");
    return short;
}
