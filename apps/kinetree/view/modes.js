/* The modes of a mechanism: the motion of a page that shows them, in place of frames.
 *
 * A mode moves each body relative to its parent by a screw, linear in the amplitude: in the parent's axes, about the parent's origin, a
 * rotation vector and a velocity of the point at that origin, the real and the imaginary part of each. Its exponential keeps the parts of every
 * pivot and slide together at any amplitude; loops open in second order of the amplitude. */
/* SPDX-License-Identifier: Apache-2.0 */

const PERIOD = 2, CONSTANTS = 3; /* seconds in which the page shows a period; time constants of a mode that does not oscillate */

/* The pose after a screw motion: rotation vector w, velocity v of the point at the origin. */
function move_by_screw(w, v, place, turned) {
    const angle = norm(w);
    if (angle < 1e-9)
        return [add(place, v), turned];
    const axis = scale(1 / angle, w), half = 0.5 * angle, q = [Math.cos(half), ...scale(Math.sin(half), axis)];
    const centre = scale(1 / (angle * angle), cross(w, v)), along = scale(dot(axis, v), axis);
    return [add(add(centre, turn(q, sub(place, centre))), along), product(q, turned)];
}

class Modes {
    constructor(data, motion) {
        Object.assign(this, {data, motion});
        this.list = data.modes.map((mode, i) => ({...mode, short: mode.frequency > 0 ? `${i + 1}: ${show_number(mode.frequency)} Hz, \u03b6 ${mode.damping.toFixed(3)}`
            : `${i + 1}: ${show_number(1 / Math.abs(mode.rate))} s, ${mode.rate > 0 ? "growth" : "decay"}`}));
        this.size = data.loops.length > 0 ? 0.4 : 1; /* loops open by the square of it */
        this.rest = new Float32Array(8 * data.bodies.length);
        pose_bodies(motion, motion.times[0], this.rest);
        this.relative = data.bodies.map(({parent}, i) => {
            const [w, ...v] = this.rest.subarray(8 * parent + 4, 8 * parent + 8), back = [w, ...v.map((x) => -x)];
            const apart = sub([...this.rest.subarray(8 * i, 8 * i + 3)], [...this.rest.subarray(8 * parent, 8 * parent + 3)]);
            return {at: turn(back, apart), turn: product(back, [...this.rest.subarray(8 * i + 4, 8 * i + 8)])};
        });
        this.choose(0);
    }

    choose(k) {
        this.mode = this.list[k];
        const {frequency, rate} = this.mode;
        this.duration = frequency > 0 ? 1 / frequency : CONSTANTS / Math.abs(rate);
    }

    /* What the shape is multiplied by at a time: a complex number. Oscillations keep their amplitude, so that the shape can be seen. */
    factor(t) {
        const {frequency, rate, amplitude, phase} = this.mode, a = this.size * amplitude;
        const angle = phase + 2 * Math.PI * frequency * t;
        const decay = frequency > 0 ? 1 : Math.exp(rate > 0 ? rate * (t - this.duration) : rate * t);
        return [a * decay * Math.cos(angle), a * decay * Math.sin(angle)];
    }

    pose(t, poses) {
        const [c, s] = this.factor(t), {screws} = this.mode;
        poses.set(this.rest);
        this.relative.forEach(({at, turn: turned}, i) => {
            if (i === 0)
                return;
            const part = (k) => [0, 1, 2].map((n) => c * screws[12 * i + k + n] - s * screws[12 * i + 6 + k + n]);
            const [place, q] = move_by_screw(part(0), part(3), at, turned), parent = 8 * this.data.bodies[i].parent;
            const on = [...poses.subarray(parent + 4, parent + 8)];
            poses.set(add([...poses.subarray(parent, parent + 3)], turn(on, place)), 8 * i);
            poses.set(product(on, q), 8 * i + 4);
        });
    }
}
