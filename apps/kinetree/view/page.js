/* The page: reads the data, paints when something has changed, and listens to keys, buttons and the slider. */
/* SPDX-License-Identifier: Apache-2.0 */

const NAMES_MAX = 60;

/* The place next to (x, y) where a name of this size lies over none of `placed`: above or below, by as many lines as it takes. */
function free_place(x, y, [width, height], placed) {
    const is_free = (v) => placed.every((p) => Math.abs(p.x - x) >= 0.5 * (p.size[0] + width) || Math.abs(p.y - v) >= 0.5 * (p.size[1] + height));
    for (let k = 0; k < 2 * NAMES_MAX; k++) {
        const v = y + (k % 2 ? 1 : -1) * Math.ceil(k / 2) * height;
        if (is_free(v))
            return [x, v];
    }
    return [x, y];
}

class Page extends Panel {
    constructor() {
        super();
        this.data = JSON.parse(find("data").textContent);
        this.motion = read_motion(this.data, find("motion").textContent);
        find("motion").remove();
        complete(this.data);
        this.modes = this.data.modes === undefined ? null : new Modes(this.data, this.motion);
        this.poses = new Float32Array(8 * POSES_A_ROW * Math.ceil(this.data.bodies.length / POSES_A_ROW));
        this.shown = layers_at_first(this.data);
        this.times = this.modes !== null ? [0, this.modes.duration] : [this.motion.times[0], this.motion.times[this.motion.frames - 1]];
        this.repeats = this.modes !== null;
        this.time = this.data.failed || this.data.overlay ? this.times[1] : this.times[0];
        this.speed = this.choose_speed();
        this.is_playing = false;
        this.quality = this.data.bodies.length > 300 ? 1 : 0;
        this.spent = [];
        this.rested = 0;
        this.notes = (this.data.notes ?? []).map(({what, remedy}) => `${as_sentence(what)}.${remedy ? ` ${remedy}.` : ""}`);
        this.survey();
        this.describe();
        this.camera = new Camera(this.data);
        this.chart = new Chart({canvas: find("chart"), legend: find("legend"), cursor: find("cursor"), list: find("columns"),
            filter: find("filter")}, this.data, this.motion, (t) => this.seek(t));
        this.start_picture();
        this.set_theme(window.matchMedia("(prefers-color-scheme: dark)").matches);
        this.build_panel();
        this.listen();
        this.resize();
        this.fit();
        if (!this.data.failed && !window.matchMedia("(prefers-reduced-motion: reduce)").matches)
            this.play();
        this.loop = (now) => {
            this.advance(now);
            requestAnimationFrame(this.loop);
        };
        requestAnimationFrame(this.loop);
    }

    /* Without WebGL the chart is still of use. */
    start_picture() {
        try {
            this.painter = new Painter(find("picture"), this.data.bodies.length);
            this.figure = new Figure(this.painter, this.data, this.motion);
        } catch (error) {
            this.painter = this.figure = null;
            this.notes.push(`The mechanism cannot be drawn: ${error.message}. The chart below does not need it.`);
        }
        if ((this.data.overlay || this.modes !== null) && this.painter !== null)
            this.start_overlay();
    }

    /* The poses at a time. */
    pose_at(t, poses) {
        if (this.modes !== null)
            this.modes.pose(t, poses);
        else
            pose_bodies(this.motion, t, poses);
    }

    /* The first frame, pale, under the last: what assembly has moved; under a mode the state about which it is. */
    start_overlay() {
        this.ghost = this.painter.make_texture();
        const poses = new Float32Array(this.poses.length);
        pose_bodies(this.motion, this.times[0], poses);
        this.painter.set_poses(this.ghost, poses);
        this.time = this.modes !== null ? this.times[0] : this.times[1];
    }

    /* ---- words --------------------------------------------------------------------------------------------------- */

    describe() {
        const {data} = this, count = (n, one) => `${n} ${one}${n === 1 ? "" : "s"}`;
        const bodies = data.bodies.length - 1;
        document.title = `${data.name} \u2013 Kinetree`;
        find("title").textContent = data.name;
        find("method").textContent = data.method;
        find("picture").setAttribute("aria-label", `Picture of the mechanism ${data.name}: ${count(bodies, "body").replace("bodys", "bodies")}, ` +
            `${count(data.loops.length, "loop")}. Shift and arrow keys turn it, plus and minus zoom.`);
        if (data.overlay) {
            find("method").textContent += ": the given positions pale, the assembled ones in colour";
            find("transport").hidden = find("curves").hidden = true;
        }
        if (this.modes !== null)
            find("curves").hidden = true;
        if (data.failed) {
            find("failed").hidden = false;
            find("failed").textContent = data.failed.message;
        }
    }

    say(words) { find("spoken").textContent = words; }

    /* The first note on a line; the others are listed when the line is opened. */
    show_notes() {
        const [first, ...others] = this.notes, box = find("notes"), list = find("others");
        box.hidden = first === undefined;
        find("note").textContent = others.length > 0 ? `${this.notes.length} notes: ${first}` : first ?? "";
        list.replaceChildren(...(others.length > 0 ? this.notes : []).map((text) => element("li", {text})));
        box.classList.toggle("single", others.length === 0);
    }

    /* ---- painting ------------------------------------------------------------------------------------------------ */

    resize() {
        this.set_resolution(this.quality);
        this.chart.paint(this.theme);
        this.chart.move(this.time);
        this.is_stale = true;
    }

    set_resolution(quality) {
        const canvas = find("picture"), ratio = Math.min(window.devicePixelRatio || 1, QUALITIES[quality][1]);
        const size = [canvas.clientWidth, canvas.clientHeight].map((pixels) => Math.max(1, Math.round(pixels * ratio)));
        const before = this.aspect;
        this.ratio = ratio;
        if (canvas.width !== size[0] || canvas.height !== size[1])
            [canvas.width, canvas.height] = size;
        this.camera.reshape(before, this.aspect);
    }

    get aspect() { return find("picture").width / find("picture").height; }

    /* How far the mechanism has moved since the first frame: the mean place of the bodies that the picture follows. */
    shift(poses = this.poses) {
        if (!this.follows || this.motion.bodies === 0)
            return [0, 0, 0];
        const all = this.data.followed.map((i) => sub([...poses.subarray(8 * i, 8 * i + 3)], this.start_place(i)));
        return all.length > 0 ? scale(1 / all.length, all.reduce(add, [0, 0, 0])) : [0, 0, 0];
    }

    /* Bodies that move and can be seen: a slider that stands for the length of a tendon may go anywhere. */
    moving() { return this.data.bodies.map((body, i) => i).filter((i) => i > 0 && this.data.bodies[i].colour >= 0 && this.data.seen.has(i)); }

    start_place(body) {
        const k = 3 * (body - 1);
        return [...this.motion.places.subarray(k, k + 3)];
    }

    pose() {
        this.pose_at(this.time, this.poses);
        this.painter.set_poses(this.painter.texture, this.poses);
        return this.camera.look(find("picture").width, find("picture").height, this.shift());
    }

    /* is_fine: as well as can be, whatever it costs: of a picture that has rested for some frames. */
    paint(is_fine = false) {
        this.is_stale = false;
        this.is_fine = is_fine;
        this.rested = 0;
        if (this.figure === null)
            return;
        const quality = is_fine ? 0 : this.quality, canvas = find("picture");
        this.set_resolution(quality);
        const view = this.pose(), p = this.painter;
        this.figure.update(this.time, this.poses, this.shown);
        p.begin(canvas.width, canvas.height, this.theme.paper);
        const pixels = [canvas.width / this.ratio, canvas.height / this.ratio];
        const [sides, , has_joints] = QUALITIES[quality];
        this.figure.paint(view, {...this.shown, joints: this.shown.joints && has_joints}, sides, pixels);
        if (this.ghost !== undefined && this.has_ghost !== false)
            p.paint_solids(this.figure.static.bodies, view, this.ghost, sides, 0.3);
        this.place_names(view);
        this.pictures = (this.pictures ?? 0) + 1;
    }

    /* Points of the mechanism at up to `count` frames, for the camera: centres of solids and their ends, in the world;
     * where the picture follows, less what the followed bodies have moved, and after the first frame of these alone. */
    points(count) {
        const poses = new Float32Array(this.poses.length), all = [], followed = new Set(this.data.followed);
        const frames = this.data.overlay ? [0, 1] : this.modes !== null ? [...Array(8).keys()]
            : [...Array(count).keys()].map((k) => Math.round((k * (this.motion.frames - 1)) / Math.max(1, count - 1)));
        for (const i of new Set(frames)) {
            this.pose_at(this.modes !== null ? (i / 8) * this.times[1] : this.motion.times[i], poses);
            const shift = this.shift(poses), is_shown = (body) => i === 0 || !this.follows || followed.has(body);
            const put = (...points) => points.forEach((p) => all.push(sub(p, shift)));
            for (const {body, at, turn: turned, half} of this.data.solids.filter((one) => is_shown(one.body)))
                for (const s of [-1, 1]) {
                    const end = turn(turned, [0, 0, s * half[2]]), r = Math.max(half[0], half[1]);
                    const p = point_of(poses, body, add(at, end));
                    put(add(p, [r, r, r]), sub(p, [r, r, r]));
                }
            [...this.data.loops, ...this.data.effects.filter(({type}) => type !== "contact")].forEach(({type, ends}) =>
                ends.filter((end) => end.body > 0 || type !== "attraction") /* whose centre may be far away */
                    .filter((end) => is_shown(end.body)).forEach((end) => put(point_of(poses, end.body, end.at))));
            if (this.follows && i === 0)
                put(...this.under(poses));
            this.data.joints.filter(({type, on, body}) => type !== "free" && is_shown(on) && is_shown(body)).forEach(({on, at}) => put(point_of(poses, on, at)));
        }
        return all.filter((p) => p.every(Number.isFinite));
    }

    /* The feet of the moving bodies on the planes. */
    under(poses) {
        return this.data.planes.flatMap(({body, at, turn: turned}) => {
            const n = turn(turn_of(poses, body, turned), [0, 0, 1]), o = point_of(poses, body, at);
            return this.moving().map((i) => [...poses.subarray(8 * i, 8 * i + 3)]).map((p) => sub(p, scale(dot(sub(p, o), n), n)));
        });
    }

    /* Planes that rest extend under all of the motion; a motion much longer than the mechanism is followed. */
    survey() {
        this.data.axis = 0.12 * this.data.size;
        const {motion, data} = this, poses = new Float32Array(this.poses.length), box = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
        const ranges = data.planes.map(() => [[Infinity, Infinity], [-Infinity, -Infinity]]);
        for (let k = 0; k < 40; k++) {
            this.pose_at(this.times[0] + (k / 39) * (this.times[1] - this.times[0]), poses);
            for (const i of this.moving()) {
                const p = [...poses.subarray(8 * i, 8 * i + 3)];
                if (this.data.followed.includes(i))
                    widen(box, p);
                data.planes.forEach(({body, at, turn: turned}, n) => {
                    const [w, x, y, z] = turn_of(poses, body, turned);
                    widen(ranges[n], turn([w, -x, -y, -z], sub(p, point_of(poses, body, at))).slice(0, 2));
                });
            }
        }
        data.planes.forEach((plane, n) => {
            const room = plane.half;
            if (Number.isFinite(ranges[n][0][0]))
                plane.range = [ranges[n][0].map((x) => Math.min(x, 0) - room), ranges[n][1].map((x) => Math.max(x, 0) + room)];
        });
        this.follows = !data.overlay && norm(sub(box[1], box[0])) > 8 * data.size;
    }

    /* Origin and ends of the axes of the world, whose length suits what the camera sees. */
    world_axes() {
        const poses = new Float32Array(this.poses.length), l = this.data.axis;
        this.pose_at(this.times[0], poses);
        const o = point_of(poses, 0, [0, 0, 0]);
        return [o, ...[[l, 0, 0], [0, l, 0], [0, 0, l]].map((end) => add(o, end))];
    }

    /* The axes of the world are seen as a whole if the mechanism is around their origin. */
    fit() {
        const points = this.points(this.data.bodies.length > 300 ? 5 : 40);
        this.camera.fit(points, this.aspect);
        this.data.axis = Math.min(0.12 * this.data.size, 0.4 * this.camera.height);
        const axes = this.world_axes();
        if (this.shown.frame && this.camera.covers(axes[0]))
            this.camera.fit([...points, ...axes], this.aspect);
        this.is_stale = true;
    }

    look_from(to_eye) {
        this.camera.aim(to_eye);
        this.fit();
    }

    /* ---- names --------------------------------------------------------------------------------------------------- */

    place_names(view) {
        const layer = find("names"), {data} = this;
        layer.hidden = !this.shown.names;
        if (!this.shown.names)
            return;
        if (layer.childElementCount === 0)
            this.named = data.bodies.map((body, i) => i).filter((i) => i > 0).slice(0, NAMES_MAX)
                .map((i) => ({body: i, at: data.solids.find((s) => s.body === i)?.at ?? [0, 0, 0], label: element("span", {text: data.bodies[i].name}, layer)}));
        const placed = [];
        for (const one of this.named) {
            const {body, at, label} = one, xy = to_page(view, point_of(this.poses, body, at));
            label.hidden = xy === null || this.figure.hidden.has(body);
            if (label.hidden)
                continue;
            one.size ??= [label.offsetWidth, label.offsetHeight];
            const [x, y] = free_place(xy[0] * layer.clientWidth, xy[1] * layer.clientHeight, one.size, placed);
            placed.push({x, y, size: one.size});
            label.style.transform = `translate(${x}px, ${y}px) translate(-50%, -50%)`;
        }
    }

    thing_at(x, y) {
        if (this.figure === null)
            return null;
        const canvas = find("picture"), box = canvas.getBoundingClientRect(), share = [(x - box.left) / box.width, (y - box.top) / box.height];
        const column = clamp(Math.floor(share[0] * canvas.width), 0, canvas.width - 1);
        const row = clamp(Math.floor((1 - share[1]) * canvas.height), 0, canvas.height - 1);
        const n = this.figure.pick(this.pose(), this.shown, canvas.width, canvas.height, column, row, 1, 1)[0];
        this.is_stale = true;
        return n > 0 ? this.figure.things[n - 1] : null;
    }

    hover(event) {
        const tip = find("tip"), thing = event.buttons === 0 && event.pointerType !== "touch" ? this.thing_at(event.clientX, event.clientY) : null;
        tip.hidden = thing === null;
        if (thing === null)
            return;
        const box = find("stage").getBoundingClientRect();
        tip.textContent = thing.text;
        const x = clamp(event.clientX - box.left + 14, 0, Math.max(0, box.width - tip.offsetWidth - 4));
        const y = clamp(event.clientY - box.top + 14, 0, Math.max(0, box.height - tip.offsetHeight - 4));
        tip.style.transform = `translate(${x}px, ${y}px)`;
    }

    /* ---- the panel ----------------------------------------------------------------------------------------------- */

    set_theme(is_dark) {
        this.is_dark = is_dark;
        this.theme = THEMES[is_dark ? "dark" : "light"];
        document.documentElement.dataset.theme = is_dark ? "dark" : "light";
        this.figure?.build(this.theme);
        document.querySelectorAll("[data-body]").forEach((one) => { one.style.background = css(this.figure?.colour_of(Number(one.dataset.body)) ?? this.theme.quiet); });
    }

    /* ---- input --------------------------------------------------------------------------------------------------- */

    listen() {
        const on = (id, kind, act) => find(id).addEventListener(kind, act), slider = find("slider");
        slider.max = this.modes !== null ? MODE_STEPS : Math.max(1, this.motion.frames - 1);
        this.list_speeds();
        on("play", "click", () => (this.is_playing ? this.pause() : this.play()));
        on("back", "click", () => this.step(-1));
        on("forth", "click", () => this.step(1));
        on("slider", "input", () => this.seek(this.modes !== null ? (Number(slider.value) / MODE_STEPS) * this.times[1] : this.motion.times[Number(slider.value)]));
        on("speed", "change", () => { this.speed = Number(find("speed").value); });
        on("repeat", "change", () => { this.repeats = find("repeat").checked; });
        on("follow", "change", () => {
            this.follows = find("follow").checked;
            this.fit();
        });
        on("parallel", "change", () => {
            this.camera.is_parallel = find("parallel").checked;
            this.fit();
        });
        find("parallel").checked = this.camera.is_parallel;
        find("follow").checked = this.follows;
        on("length", "input", () => {
            if (this.figure !== null)
                this.figure.force_scale = 2 ** Number(find("length").value);
            this.is_stale = true;
        });
        on("theme", "click", () => {
            this.set_theme(!this.is_dark);
            this.resize();
        });
        on("help", "click", () => find("keys").showModal());
        document.querySelectorAll("[data-view]").forEach((one) => one.addEventListener("click", () => this.view_named(one.dataset.view)));
        this.listen_to_canvas();
        document.addEventListener("keydown", (event) => this.press(event));
        window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", (event) => {
            this.set_theme(event.matches);
            this.resize();
        });
        new ResizeObserver(() => this.resize()).observe(find("stage"));
        new ResizeObserver(() => this.resize()).observe(find("chart"));
        this.set_time(this.time);
    }

    /* Of a mode: in how many seconds the page shows a period. */
    list_speeds() {
        const speeds = this.modes !== null ? [0.5, 1, 2, 5, 10].map((s) => [this.modes.duration / s, `period: ${s} s`])
            : SPEEDS.map((s) => [s, `\u00d7\u202f${s}`]);
        find("speed").replaceChildren();
        for (const [value, text] of speeds)
            element("option", {value, text, ...(value === this.speed ? {selected: ""} : {})}, find("speed"));
    }

    listen_to_canvas() {
        const canvas = find("picture");
        listen_to_pointers(canvas, this.camera, () => { this.is_stale = true; });
        canvas.addEventListener("pointermove", (event) => this.hover(event));
        canvas.addEventListener("pointerleave", () => { find("tip").hidden = true; });
        canvas.addEventListener("dblclick", (event) => this.turn_about(event));
        canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
        canvas.addEventListener("webglcontextrestored", () => {
            this.painter.start();
            this.figure.make_buffers();
            this.figure.build(this.theme);
            if (this.ghost !== undefined)
                this.start_overlay();
            this.is_stale = true;
        });
    }

    /* A double click makes a body the point about which the picture turns. */
    turn_about(event) {
        const thing = this.thing_at(event.clientX, event.clientY);
        if (thing === null)
            return;
        const solid = this.data.solids.find((one) => one.body === thing.body);
        this.camera.target = sub(point_of(this.poses, thing.body, solid?.at ?? [0, 0, 0]), this.shift());
        this.is_stale = true;
    }

    view_named(name) {
        const {camera} = this, plus = {x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1]}[name];
        if (name === "iso")
            camera.aim(unit(add(add(scale(0.75, camera.east), scale(-1, camera.north)), scale(0.55, camera.up))));
        else if (name === "start")
            camera.reset();
        else if (plus !== undefined)
            camera.aim(plus);
        this.fit();
    }

    /* Keys of the whole page; not while a text or a list has the focus. */
    press(event) {
        if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest("input:not([type=checkbox]), select, dialog[open]") !== null)
            return;
        const {camera} = this, on_picture = event.target === find("picture"), shifted = event.shiftKey, key = event.key;
        const arrows = {ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}[key];
        if (key === " " && event.target.closest("button, summary, input") === null)
            find("play").click();
        else if (arrows && shifted && on_picture)
            camera.turn_by(0.1 * arrows[0], 0.1 * arrows[1]);
        else if (key === "ArrowLeft" || key === "ArrowRight")
            this.step((key === "ArrowLeft" ? -1 : 1) * (shifted ? 10 : 1));
        else if (key === "Home" || key === "End")
            this.step(key === "Home" ? -this.motion.frames : this.motion.frames);
        else if ("+=".includes(key) || key === "-")
            camera.zoom_by(key === "-" ? 1.15 : 1 / 1.15);
        else if ("xyz".includes(key))
            this.view_named(key);
        else if (key === "i" || key === "f")
            this.view_named(key === "i" ? "iso" : "fit");
        else if (key === "?")
            find("keys").showModal();
        else
            return;
        event.preventDefault();
        this.is_stale = true;
    }
}

window.kinetree = new Page();
