/* The observer, who turns about a target: azimuth about the upward direction, elevation above the horizon. */
/* SPDX-License-Identifier: Apache-2.0 */

class Camera {
    constructor(data) {
        this.data = data;
        this.up = data.up;
        this.east = data.east; /* to the right as seen from the front */
        this.north = cross(this.up, this.east); /* away from the observer in the front view */
        this.is_parallel = data.normal !== null;
        this.slope = Math.tan((14 * Math.PI) / 180);
        this.target = [0, 0, 0];
        this.distance = 4 * data.size;
        this.aspect = 0; /* of the points that were fitted */
        this.height = data.size;
        this.reset();
    }

    /* Azimuth and elevation of the direction from the target to the observer. */
    aim(to_eye) {
        const e = clamp(dot(to_eye, this.up), -1, 1);
        this.elevation = Math.asin(e);
        if (Math.abs(e) < 0.9999)
            this.azimuth = Math.atan2(dot(to_eye, this.east), -dot(to_eye, this.north));
    }

    /* Planar mechanisms are seen along their normal, others from the front, the right and above. */
    reset() {
        this.azimuth = 0;
        this.aim(this.data.normal ?? unit(add(add(scale(0.75, this.east), scale(-1, this.north)), scale(0.55, this.up))));
    }

    axes() {
        const ca = Math.cos(this.azimuth), sa = Math.sin(this.azimuth);
        const ce = Math.cos(this.elevation), se = Math.sin(this.elevation);
        const level = add(scale(sa, this.east), scale(-ca, this.north));
        const back = add(scale(ce, level), scale(se, this.up));
        const right = add(scale(ca, this.east), scale(sa, this.north));
        return {right, back, up: cross(back, right)};
    }

    turn_by(x, y) {
        this.azimuth -= x;
        this.elevation = clamp(this.elevation + y, -Math.PI / 2, Math.PI / 2);
    }

    /* x, y in heights of the picture. */
    pan_by(x, y) {
        const {right, up} = this.axes(), height = 2 * this.slope * this.distance;
        this.target = add(this.target, add(scale(-x * height, right), scale(y * height, up)));
    }

    zoom_by(factor) { this.distance = clamp(this.distance * factor, 1e-3 * this.data.size, 1e5 * this.data.size); }

    /* So that all these points are in the picture. */
    fit(points, aspect) {
        if (points.length === 0)
            return;
        const {right, up, back} = this.axes(), margin = 2 * this.data.radius;
        const range = (n) => points.reduce(([low, high], p) => [Math.min(low, dot(p, n)), Math.max(high, dot(p, n))], [Infinity, -Infinity]);
        const [x, y, z] = [range(right), range(up), range(back)];
        const middle = ([low, high]) => 0.5 * (low + high), half = ([low, high]) => 0.5 * (high - low) + margin;
        this.target = add(add(scale(middle(x), right), scale(middle(y), up)), scale(middle(z), back));
        const height = Math.max(half(y), 0.05 * this.data.size);
        this.aspect = half(x) / height;
        this.height = height; /* half of what the points take of the picture */
        this.distance = (1.12 * height * this.shrink(aspect)) / this.slope + (this.is_parallel ? 0 : half(z));
    }

    /* Whether a point is among those that were fitted, as the observer sees them. */
    covers(point) {
        const {right, up} = this.axes(), apart = sub(point, this.target);
        return Math.abs(dot(apart, right)) <= this.aspect * this.height && Math.abs(dot(apart, up)) <= this.height;
    }

    /* By how much the points are smaller in a picture that is too narrow for them. */
    shrink(aspect) { return Math.max(1, this.aspect / aspect); }

    reshape(before, aspect) { this.zoom_by(this.shrink(aspect) / this.shrink(before)); }

    /* What shaders need for a picture of that many pixels; shift: what the target has moved by following. */
    look(width, height, shift) {
        const {right, up, back} = this.axes(), d = this.distance, target = add(this.target, shift);
        const far = d + 60 * this.data.size, near = this.is_parallel ? -far : Math.max(0.01 * d, d - 60 * this.data.size);
        const eye = add(target, scale(d, back));
        const view = multiply(
            project(this.is_parallel, this.is_parallel ? this.slope * d : this.slope, width / height, near, far), look(eye, right, up, back));
        const light = unit(add(add(scale(0.9, back), scale(-0.45, right)), scale(0.75, up)));
        return {view: new Float32Array(view), matrix: view, scale: height / (2 * this.slope * d), eye: this.is_parallel ? [...back, 0] : [...eye, 1], light};
    }
}

/* Where a point is in the picture, in shares of its width and height from the top left; null behind the observer. */
function to_page({matrix: m}, p) {
    const w = m[3] * p[0] + m[7] * p[1] + m[11] * p[2] + m[15];
    if (w <= 0)
        return null;
    return [0.5 + (0.5 * (m[0] * p[0] + m[4] * p[1] + m[8] * p[2] + m[12])) / w,
        0.5 - (0.5 * (m[1] * p[0] + m[5] * p[1] + m[9] * p[2] + m[13])) / w];
}

/* Pointers on the canvas: one turns, with shift or another button it shifts; two shift and zoom; the wheel zooms. */
function listen_to_pointers(canvas, camera, changed) {
    const pointers = new Map();
    const middle = () => {
        const all = [...pointers.values()], n = all.length;
        const x = all.reduce((s, p) => s + p[0], 0) / n, y = all.reduce((s, p) => s + p[1], 0) / n;
        return {x, y, spread: n > 1 ? Math.hypot(all[0][0] - all[1][0], all[0][1] - all[1][1]) : 0};
    };
    canvas.addEventListener("pointerdown", (event) => {
        canvas.setPointerCapture(event.pointerId);
        pointers.set(event.pointerId, [event.clientX, event.clientY]);
    });
    for (const kind of ["pointerup", "pointercancel"])
        canvas.addEventListener(kind, (event) => pointers.delete(event.pointerId));
    canvas.addEventListener("pointermove", (event) => {
        if (!pointers.has(event.pointerId))
            return;
        const before = middle();
        pointers.set(event.pointerId, [event.clientX, event.clientY]);
        const after = middle(), x = (after.x - before.x) / canvas.clientHeight, y = (after.y - before.y) / canvas.clientHeight;
        if (pointers.size > 1 || event.shiftKey || event.buttons > 1)
            camera.pan_by(x, y);
        else
            camera.turn_by(Math.PI * x, Math.PI * y);
        if (before.spread > 0 && after.spread > 0)
            camera.zoom_by(before.spread / after.spread);
        changed();
    });
    canvas.addEventListener("wheel", (event) => {
        event.preventDefault();
        camera.zoom_by(Math.exp(clamp(event.deltaY * (event.deltaMode === 1 ? 16 : 1), -240, 240) * 0.0015));
        changed();
    }, {passive: false});
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    return () => pointers.size > 0;
}
