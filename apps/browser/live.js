/* A live page: its controls, the worker with the engine, and what takes the place of the recorded motion.
 *
 * The viewer's own scripts stand before this one, unchanged. `window.kinetree` is its page.
 */
/* SPDX-License-Identifier: Apache-2.0 */

const RUNS_MAX = 12;
const DRIFT = "energy.total less its start";

const log10 = (x) => Math.log10(Math.max(x, 1e-300));
const short = (x) => (Number.isFinite(x) ? (x !== 0 && (Math.abs(x) < 0.01 || Math.abs(x) >= 1e4) ? x.toExponential(1).replace("e+", "e") : Number(x.toPrecision(3)).toString()) : "\u2013");

/* ---- the page --------------------------------------------------------------------------------------------------- */

class Live {
    constructor(page) {
        Object.assign(this, {page, state: null, controls: {}, runs: [], last: null, is_gesture: false, held: null});
        find("live").hidden = false;
        this.listen();
        this.report("The engine starts.", true);
        this.begin().catch((error) => this.report(`The engine cannot start: ${error.message}. The recorded motion does not need it.`));
    }

    async begin() {
        const packed = globalThis.kinetree_engine ?? find("engine").textContent, {scene, engine_size} = JSON.parse(find("scene").textContent);
        const module = await WebAssembly.compile(await unpack(packed, engine_size));
        this.bench = new Bench(module, scene, (answer) => this.answer(answer));
        this.bench.request(this.values());
    }

    report(words, is_busy = false) {
        find("status").textContent = words;
        find("status").classList.toggle("busy", is_busy);
        find("cancel").hidden = !is_busy || this.bench === undefined;
    }

    /* ---- values ------------------------------------------------------------------------------------------------- */

    list_controls(state) {
        const changed = (is_last) => this.change(is_last), {page} = this;
        this.state = state;
        find("parameters").closest("details").hidden = state.parameters.length === 0;
        this.controls.parameters = state.parameters.map(({name, value, reference}) => {
            const [low, high] = around(value);
            return {reference, control: new Control(find("parameters"), {label: name, value, low, high}, changed)};
        });
        this.controls.joints = state.joints.filter(({name}) => is_plain_name(name)).map(({body, name, value, slides}) => {
            const reach = slides ? Math.max(page.data.size, 2 * Math.abs(value)) : Math.PI;
            const control = new Control(find("starts"), {label: name, title: `Position of joint ${name} at the start`, value, low: Math.min(-reach, value), high: Math.max(reach, value),
                unit: slides ? "m" : "\u00b0", factor: slides ? 1 : 180 / Math.PI}, (is_last) => {
                this.held = name;
                changed(is_last);
            });
            return {body, name, control};
        });
        const g = Math.max(20, 2 * Math.hypot(...state.gravity));
        this.controls.gravity = state.gravity.map((value, k) => new Control(find("gravity"), {label: "xyz"[k], title: `Gravity along ${"xyz"[k]}`, value, low: -g, high: g, unit: "m/s\u00b2"}, changed));
        this.list_methods(state, changed);
        find("starts").closest("details").hidden = this.controls.joints.length === 0;
        find("projects").hidden = find("reduces").hidden = find("gaps").hidden = state.loops === 0;
    }

    list_methods(state, changed) {
        state.methods.forEach(({name, title}) => element("option", {value: name, text: name, title}, find("integrator")));
        find("integrator").value = state.method;
        find("stepping").value = state.step > 0 ? "step" : "tolerance";
        const step = state.step > 0 ? state.step : 10 ** Math.round(log10(state.duration / 1000)), {duration} = state;
        this.controls.tolerance = new Control(find("precision"), {label: "Tolerance", value: state.tolerance, low: 1e-13, high: 0.1, log: true}, changed);
        this.controls.step = new Control(find("precision"), {label: "Step", value: step, low: Math.min(step, duration * 1e-5), high: Math.max(step, duration / 10), unit: "s", log: true}, changed);
        this.controls.duration = new Control(find("precision"), {label: "Duration", value: duration, low: 0, high: 4 * duration, unit: "s", has_slider: false}, changed);
        this.choose_stepping();
    }

    /* Methods without an error estimate take fixed steps alone. */
    choose_stepping() {
        const method = this.state.methods.find(({name}) => name === find("integrator").value), is_adaptive = method.adaptive;
        find("stepping").options[0].disabled = !is_adaptive;
        if (!is_adaptive)
            find("stepping").value = "step";
        find("integrator").title = method.title;
        const has_step = find("stepping").value === "step";
        this.controls.step.number.closest("label").hidden = !has_step;
        this.controls.tolerance.number.closest("label").hidden = has_step;
    }

    /* Values that the address of the page gives, as a figure of a text does: #method=rk4&step=0.01&unprojected=1&reduction=partition&start.crank=1.2&compare=1. */
    take_address() {
        const {parameters, joints, tolerance, step, duration} = this.controls, given = new URLSearchParams(location.hash.slice(1)), number = (key) => Number(given.get(key));
        const put = (control, key) => { if (given.has(key) && Number.isFinite(number(key))) { control.value = number(key); control.show(); } };
        if (this.state.methods.some(({name}) => name === given.get("method")))
            find("integrator").value = given.get("method");
        if (given.has("step") || given.has("tolerance"))
            find("stepping").value = given.has("step") ? "step" : "tolerance";
        [[tolerance, "tolerance"], [step, "step"], [duration, "duration"]].forEach(([control, key]) => put(control, key));
        this.state.parameters.filter(({name}) => given.has(`parameter.${name}`)).forEach(({name, reference}) =>
            put(parameters.find((one) => one.reference === reference).control, `parameter.${name}`));
        joints.filter(({name}) => given.has(`start.${name}`)).forEach(({name, control}) => { this.held = name; put(control, `start.${name}`); });
        find("unprojected").checked = number("unprojected") === 1;
        if (given.get("reduction") === "partition")
            find("reduction").value = "partition";
        find("compare").checked = number("compare") === 1;
        this.choose_stepping();
        if ([...given].length > 0)
            this.change(true);
    }

    get has_own_method() {
        const {state, controls: {step, tolerance}} = this, stepping = find("stepping").value;
        return find("integrator").value !== state.method || stepping !== (state.step > 0 ? "step" : "tolerance") || (stepping === "step" ? step : tolerance).is_changed;
    }

    method() {
        const {duration, step, tolerance} = this.controls, stepping = find("stepping").value, own = this.has_own_method;
        return {integrator: own ? find("integrator").value : "", duration: duration.is_changed ? duration.value : NaN,
            step: own && stepping === "step" ? step.value : NaN, tolerance: own && stepping === "tolerance" ? tolerance.value : NaN,
            unprojected: find("unprojected").checked, partition: find("reduction").value === "partition"};
    }

    /* All values for a request: settings in the words of `--set`, parameters by their references. A joint that was moved is held, so that the
     * others close the loops. */
    values() {
        if (this.state === null)
            return {settings: [], parameters: [], method: {}};
        const {parameters, joints, gravity} = this.controls, moved = joints.filter(({control}) => control.is_changed);
        const settings = moved.map(({name, control}) => `bodies.${name}.joint.position=${control.value}`);
        if (this.state.loops > 0 && moved.some(({name}) => name === this.held))
            settings.push(`initial.hold=[${this.held}]`);
        if (gravity.some((one) => one.is_changed))
            settings.push(`gravity=[${gravity.map(({value}) => value).join(", ")}]`);
        return {settings, parameters: parameters.map(({reference, control}) => [reference, control.value]), method: this.method()};
    }

    /* A gesture is one run of the list, however many values it passes. */
    change(is_last) {
        if (!this.is_gesture)
            this.runs.push({});
        this.is_gesture = !is_last;
        this.request();
    }

    request() {
        if (this.state === null)
            return;
        this.report("The run goes on.", true);
        this.bench.request(this.values());
    }

    /* ---- answers ------------------------------------------------------------------------------------------------ */

    answer(answer) {
        if (answer.time !== undefined) {
            this.report(`The run is at ${show_number(answer.time)} s.`, true);
            return;
        }
        const {page} = this, {data, frames, state, faults, notes, ms} = answer;
        const is_first = this.state === null && state !== undefined;
        if (is_first)
            this.list_controls(state);
        page.notes = notes.map(as_sentence);
        page.show_notes();
        if (state !== undefined)
            this.show_start(state);
        this.show_faults(data, faults);
        if (data === undefined)
            this.report("There is no motion.", this.bench.next !== null);
        else
            this.take(data, frames, state, ms);
        if (is_first)
            this.take_address();
    }

    /* The positions of joints that were not moved: assembly may have moved them. */
    show_start({joints}) {
        for (const {body, control} of this.controls.joints.filter((one) => !one.control.is_changed)) {
            control.value = control.start = joints.find((one) => one.body === body).value;
            control.show();
        }
    }

    show_faults(data, faults) {
        const words = [...faults, ...(data?.failed ? [data.failed.message] : [])];
        find("failed").textContent = words.join("\n");
        find("failed").hidden = words.length === 0;
    }

    take(data, frames, state, ms) {
        const {page} = this, run = this.current_run();
        this.show(data, frames);
        Object.assign(run, {method: data.method, evaluations: state.evaluations, ms, drift: this.largest_drift(), gap: state.gap, label: `${state.used}${state.partition ? ", partitioning" : ""}`, data, motion: page.motion});
        this.runs = this.runs.filter(({method}) => method !== undefined).slice(-RUNS_MAX);
        this.report(`${state.steps} steps${state.rejected > 0 ? ` (${state.rejected} rejected)` : ""}, ${state.evaluations} evaluations, ${short(ms)} ms`, this.bench.next !== null);
        this.list_runs();
        this.paint();
        this.answered = (this.answered ?? 0) + 1;
    }

    /* The entry of the list that this answer fills. The entry before it is the shadow. */
    current_run() {
        if (this.runs.length === 0)
            this.runs.push({});
        const run = this.runs.at(-1);
        this.last = this.runs.slice(0, -1).filter(({motion}) => motion !== undefined).at(-1) ?? null;
        return run;
    }

    /* The motion in place of the one before it: the camera, what is hidden and the time stay. */
    show(data, frames) {
        const {page} = this, {time, follows} = page, was_at_end = time >= page.times[1];
        complete(data);
        const motion = read_motion(data, {trim: () => frames}), is_alike = data.bodies.length === page.data.bodies.length;
        Object.assign(page, {data, motion, poses: new Float32Array(8 * POSES_A_ROW * Math.ceil(data.bodies.length / POSES_A_ROW)), times: [motion.times[0], motion.times[motion.frames - 1]]});
        page.survey();
        page.follows = follows;
        page.describe();
        page.camera.data = data;
        this.show_chart(data, motion);
        if (page.figure !== null)
            this.show_figure(data, motion, is_alike);
        find("slider").max = Math.max(1, motion.frames - 1);
        page.set_time(was_at_end && !page.is_playing ? page.times[1] : clamp(time, page.times[0], page.times[1]));
        page.resize();
    }

    show_chart(data, motion) {
        const {chart} = this.page, names = ({columns}) => columns.map(({name}) => name).join("\n"), is_alike = names(chart.data) === names(data);
        Object.assign(chart, {data, motion});
        if (is_alike)
            return;
        chart.chosen = chart.first_choice();
        chart.list.replaceChildren();
        chart.list_columns();
    }

    show_figure(data, motion, is_alike) {
        const {page} = this, {figure, painter} = page;
        if (!is_alike)
            painter.texture = painter.make_texture();
        const next = new Figure(painter, data, motion);
        if (is_alike)
            Object.assign(next, {hidden: figure.hidden, traced: figure.traced, force_scale: figure.force_scale});
        page.figure = next;
        next.build(page.theme);
    }

    largest_drift() {
        const {motion, data} = this.page, column = data.columns.findIndex(({name}) => name === DRIFT);
        return column < 0 ? NaN : Math.max(...Array.from({length: motion.frames}, (_, i) => Math.abs(motion.values[i * motion.columns + column])));
    }

    /* ---- the shadow --------------------------------------------------------------------------------------------- */

    get shadow() { return find("compare").checked ? this.last : null; }

    /* Paints the last run pale over the picture, at the same time. */
    paint_shadow() {
        const {page, shadow} = this, p = page.painter;
        if (shadow === null || p === null || page.figure === null)
            return;
        const canvas = find("picture"), view = page.camera.look(canvas.width, canvas.height, page.shift());
        if (shadow.figure === undefined) {
            shadow.figure = new Figure(p, shadow.data, shadow.motion);
            shadow.texture = p.make_texture();
            shadow.poses = new Float32Array(8 * POSES_A_ROW * Math.ceil(shadow.data.bodies.length / POSES_A_ROW));
        }
        if (shadow.figure.theme !== page.theme)
            shadow.figure.build(page.theme);
        pose_bodies(shadow.motion, page.time, shadow.poses);
        const apart = sub(shadow.motion.centre, page.motion.centre);
        for (let i = 0; i < shadow.data.bodies.length; i++)
            apart.forEach((x, k) => { shadow.poses[8 * i + k] += x; });
        p.set_poses(shadow.texture, shadow.poses);
        p.paint_solids(shadow.figure.static.bodies, view, shadow.texture, 12, 0.3);
    }

    /* ---- lists and plots ---------------------------------------------------------------------------------------- */

    colour(i) { return css(this.page.theme.series[i % 6]); }

    list_runs() {
        const body = find("ledger");
        body.replaceChildren();
        this.runs.forEach((run, i) => {
            const row = element("tr", {title: run.method}, body), name = element("td", {}, row);
            element("i", {style: `background:${this.colour(i)}`}, name);
            name.append(run.label);
            element("td", {text: String(run.evaluations)}, row);
            element("td", {text: short(run.ms)}, row);
            element("td", {text: short(run.drift)}, row);
            if (this.state.loops > 0)
                element("td", {text: short(run.gap)}, row);
        });
    }

    paint() {
        this.paint_errors();
        this.paint_costs();
    }

    /* A canvas with axes; both may be logarithmic. Returns the functions to its pixels. */
    start_plot(id, [x0, x1], [y0, y1], words) {
        const canvas = find(id), ratio = window.devicePixelRatio || 1, {clientWidth: width, clientHeight: height} = canvas, {theme} = this.page;
        canvas.width = Math.max(1, Math.round(width * ratio));
        canvas.height = Math.max(1, Math.round(height * ratio));
        const c = canvas.getContext("2d"), left = 40, right = 6, top = 18, bottom = 18;
        c.scale(ratio, ratio);
        c.font = "11px system-ui, sans-serif";
        const x = (v) => left + ((v - x0) / (x1 - x0)) * (width - left - right), y = (v) => height - bottom - ((v - y0) / (y1 - y0)) * (height - top - bottom);
        c.strokeStyle = css(theme.faint);
        c.fillStyle = css(theme.quiet);
        c.textAlign = "right";
        c.textBaseline = "middle";
        const decades = Math.max(1, Math.ceil((y1 - y0) / 5));
        for (let k = Math.ceil(y0); k <= y1; k += decades) {
            stroke(c, [[left, y(k)], [width - right, y(k)]]);
            if (y(k) > top + 2)
                c.fillText(`1e${k}`, left - 4, y(k));
        }
        c.textAlign = "left";
        c.fillText(shorten(words, width - 4, (text) => c.measureText(text).width), 2, 7);
        return {c, x, y, width, height, left, right, bottom};
    }

    /* Pairs [time, log10 |value|] of a column. */
    sizes(run, column) {
        const {motion} = run, stride = Math.max(1, Math.floor(motion.frames / 600)), all = [];
        for (let i = 0; i < motion.frames; i += stride)
            all.push([motion.times[i], log10(Math.abs(motion.values[i * motion.columns + column]))]);
        return all.filter(([, v]) => v > -30 && Number.isFinite(v));
    }

    error_columns(data) {
        const drift = data.columns.findIndex(({name}) => name === DRIFT), gap = this.state.loops > 0 ? data.columns.findIndex(({name}) => name.startsWith("constraint")) : -1;
        return [[drift, "energy error, J"], [gap, "loop gap"]].filter(([column]) => column >= 0);
    }

    paint_errors() {
        const {page} = this, now = {data: page.data, motion: page.motion}, columns = this.error_columns(page.data);
        const curves = columns.map(([column]) => this.sizes(now, column)), pale = this.shadow === null ? [] : this.error_columns(this.shadow.data).map(([column]) => this.sizes(this.shadow, column));
        const all = [...curves, ...pale].flat().map(([, v]) => v), low = Math.floor(Math.min(-16, ...all)), high = Math.ceil(Math.max(-12, ...all));
        const end = page.times[1] > page.times[0] ? page.times[1] : page.times[0] + 1;
        const {c, x, y, width, height, bottom} = this.start_plot("errors", [page.times[0], end], [Math.max(low, high - 20), high], "");
        [...pale.map((points, k) => [points, k, 0.35]), ...curves.map((points, k) => [points, k, 1])].forEach(([points, k, alpha]) => {
            c.globalAlpha = alpha;
            c.strokeStyle = this.colour(k);
            c.lineWidth = 1.5;
            stroke(c, points.map(([t, v]) => [x(t), y(v)]));
        });
        c.globalAlpha = 1;
        let at = 2;
        columns.forEach(([, words], k) => {
            c.fillStyle = this.colour(k);
            c.fillText(words, at, 7);
            at += c.measureText(words).width + 12;
        });
        c.fillStyle = css(page.theme.quiet);
        c.textAlign = "right";
        c.fillText(`${show_number(end)} s`, width - 6, height - bottom + 10);
    }

    /* Accuracy against cost: a point for each run. */
    paint_costs() {
        const points = this.runs.map((run, i) => ({i, x: log10(run.evaluations), y: log10(run.drift), run})).filter(({x, y}) => x > -30 && y > -30);
        const xs = points.map((p) => p.x), ys = points.map((p) => p.y);
        const span = (all, least) => { const low = Math.min(...all), high = Math.max(...all), room = Math.max(0.15 * (high - low), least); return all.length > 0 ? [low - room, high + room] : [0, 1]; };
        const {c, x, y, width, height, bottom} = this.start_plot("costs", span(xs, 0.3), span(ys, 0.7), "energy error, J, by evaluations");
        const [x0, x1] = span(xs, 0.3);
        c.textAlign = "center";
        for (let k = Math.floor(x0), last = -Infinity; k <= x1 + 1; k++)
            for (const v of [1, 2, 5].map((m) => k + Math.log10(m)).filter((v) => v >= x0 && v <= x1 && x(v) > last + 32 && x(v) < width - 14)) {
                c.fillText(short(Math.round(10 ** v)), x(v), height - bottom + 10);
                last = x(v);
            }
        points.forEach(({i, x: px, y: py}) => {
            c.fillStyle = this.colour(i);
            c.beginPath();
            c.arc(x(px), y(py), i === this.runs.length - 1 ? 5 : 3.5, 0, 2 * Math.PI);
            c.fill();
        });
    }

    /* ---- input -------------------------------------------------------------------------------------------------- */

    listen() {
        const {page} = this, on = (id, kind, act) => find(id).addEventListener(kind, act);
        on("run", "click", () => this.run());
        on("cancel", "click", () => {
            this.bench.next = null;
            this.bench.cancel();
            this.report("The run was cancelled.");
        });
        on("reset", "click", () => this.reset());
        on("compare", "change", () => this.refresh());
        on("integrator", "change", () => { this.choose_stepping(); this.change(true); });
        on("stepping", "change", () => { this.choose_stepping(); this.change(true); });
        on("unprojected", "change", () => this.change(true));
        on("reduction", "change", () => this.change(true));
        on("drag", "change", () => this.prepare_drag());
        new ResizeObserver(() => this.state !== null && this.paint()).observe(find("accuracy"));
        const paint = page.paint.bind(page), set_theme = page.set_theme.bind(page), draw_curve = page.chart.paint_curve.bind(page.chart);
        page.paint = (is_fine) => { paint(is_fine); this.paint_shadow(); };
        page.set_theme = (is_dark) => { set_theme(is_dark); this.state !== null && (this.list_runs(), this.paint()); };
        page.chart.paint_curve = (context, column, x, y, width) => { this.paint_pale_curve(context, column, x, y, width); draw_curve(context, column, x, y, width); };
        this.listen_to_drag();
    }

    paint_pale_curve(context, column, x, y, width) {
        const {chart} = this.page, {shadow} = this;
        if (shadow === null || shadow.data.columns.length !== chart.data.columns.length)
            return;
        context.save();
        context.globalAlpha = 0.35;
        Chart.prototype.paint_curve.call(Object.assign(Object.create(chart), {motion: shadow.motion}), context, column, x, y, width);
        context.restore();
    }

    refresh() {
        if (this.state === null)
            return;
        this.page.resize();
        this.paint();
    }

    run() {
        if (this.state === null)
            return;
        this.page.set_time(this.page.times[0]);
        this.change(true);
        this.page.play();
    }

    reset() {
        if (this.state === null)
            return;
        const {parameters, joints, gravity, tolerance, step, duration} = this.controls;
        [...parameters.map(({control}) => control), ...joints.map(({control}) => control), ...gravity, tolerance, step, duration].forEach((one) => one.reset());
        find("integrator").value = this.state.method;
        find("stepping").value = this.state.step > 0 ? "step" : "tolerance";
        find("unprojected").checked = false;
        find("reduction").value = "qr";
        this.choose_stepping();
        this.page.seek(this.page.times[0]);
        this.change(true);
    }

    /* ---- dragging ----------------------------------------------------------------------------------------------- */

    prepare_drag() {
        find("stage").classList.toggle("dragging", find("drag").checked);
        if (find("drag").checked)
            this.page.seek(this.page.times[0]);
    }

    /* Before the camera hears of it: the stage contains the canvas. */
    listen_to_drag() {
        const stage = find("stage"), end = () => {
            if (this.grip === undefined)
                return;
            this.grip = undefined;
            this.change(true);
        };
        stage.addEventListener("pointerdown", (event) => this.grab(event), true);
        stage.addEventListener("pointermove", (event) => this.pull(event), true);
        stage.addEventListener("pointerup", end, true);
        stage.addEventListener("pointercancel", end, true);
    }

    /* The nearest joint towards the world that has a control moves with the pointer. */
    grab(event) {
        const {page} = this;
        if (!find("drag").checked || this.state === null || event.button !== 0)
            return;
        page.seek(page.times[0]);
        const thing = page.thing_at(event.clientX, event.clientY);
        let body = thing?.body ?? 0;
        while (body > 0 && !this.controls.joints.some((one) => one.body === body))
            body = page.data.bodies[body].parent;
        if (body === 0)
            return;
        event.stopPropagation();
        find("stage").setPointerCapture(event.pointerId);
        this.grip = {...this.axis_of(body), joint: this.controls.joints.find((one) => one.body === body), at: this.point_under(thing.body, event), x: event.clientX, y: event.clientY};
    }

    axis_of(body) {
        const {data, poses} = this.page, {on, at, turn: turned, type} = data.joints.find((one) => one.body === body && !one.loop);
        return {o: point_of(poses, on, at), n: turn(turn_of(poses, on, turned), [0, 0, 1]), slides: type === "prismatic"};
    }

    view() {
        const {page} = this, canvas = find("picture");
        return page.camera.look(canvas.width, canvas.height, page.shift());
    }

    pixel_of(p) {
        const box = find("picture").getBoundingClientRect(), [u, v] = to_page(this.view(), p) ?? [0, 0];
        return [box.left + u * box.width, box.top + v * box.height];
    }

    /* The point under the pointer, in the plane of the picture through the body. */
    point_under(body, event) {
        const {data, poses, camera} = this.page, centre = point_of(poses, body, data.solids.find((one) => one.body === body)?.at ?? [0, 0, 0]);
        const {right, up} = camera.axes(), [x, y] = this.pixel_of(centre), [x1] = this.pixel_of(add(centre, scale(data.radius, right))), unit_length = data.radius / (x1 - x);
        return add(centre, add(scale((event.clientX - x) * unit_length, right), scale((y - event.clientY) * unit_length, up)));
    }

    /* The coordinate changes so that the point follows the pointer along its own way. */
    pull(event) {
        const {grip} = this;
        if (grip === undefined)
            return;
        event.stopPropagation();
        const along = grip.slides ? grip.n : cross(grip.n, sub(grip.at, grip.o)), small = (1e-3 * this.page.data.size) / Math.max(norm(along), 1e-9);
        const [x0, y0] = this.pixel_of(grip.at), [x1, y1] = this.pixel_of(add(grip.at, scale(small, along)));
        const s = [(x1 - x0) / small, (y1 - y0) / small], square = s[0] ** 2 + s[1] ** 2, most = grip.slides ? this.page.data.size : 0.5;
        if (!(square > 0))
            return;
        const dq = clamp(((event.clientX - grip.x) * s[0] + (event.clientY - grip.y) * s[1]) / square, -most, most);
        Object.assign(grip, {x: event.clientX, y: event.clientY, at: grip.slides ? add(grip.at, scale(dq, grip.n)) : add(grip.o, turn([Math.cos(dq / 2), ...scale(Math.sin(dq / 2), grip.n)], sub(grip.at, grip.o)))});
        grip.joint.control.set(grip.joint.control.value + dq, false);
    }
}

window.kinetree_live = new Live(window.kinetree);
