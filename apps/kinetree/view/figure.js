/* What is painted: the solids of the bodies, symbols of joints, loops and contacts, all fixed to their bodies; and what
 * changes from frame to frame: springs, gaps of loops, arrows, traces. */
/* SPDX-License-Identifier: Apache-2.0 */

const SERIES = [[0.0, 0.447, 0.698], [0.835, 0.369, 0.0], [0.0, 0.62, 0.451], [0.8, 0.475, 0.655], [0.902, 0.624, 0.0],
    [0.337, 0.706, 0.914]];
const THEMES = {
    light: {paper: [1, 1, 1], ink: [0.13, 0.13, 0.13], quiet: [0.42, 0.42, 0.42], faint: [0.86, 0.87, 0.88],
        series: SERIES, fixed: [0.62, 0.63, 0.65], joint: [0.3, 0.31, 0.34], alarm: [0.85, 0.05, 0.1]},
    dark: {paper: [0.051, 0.067, 0.09], ink: [0.9, 0.92, 0.94], quiet: [0.62, 0.65, 0.69], faint: [0.19, 0.21, 0.25],
        series: [[0.22, 0.545, 0.992], ...SERIES.slice(1)], fixed: [0.5, 0.52, 0.55], joint: [0.75, 0.77, 0.8],
        alarm: [1, 0.35, 0.35]},
};

const LAYERS = [
    ["joints", "Joints", true], ["axes", "Joint axes", false], ["loops", "Loops", true], ["springs", "Springs", true], ["drives", "Drives and couplings", true],
    ["planes", "Planes", true], ["contacts", "Contact points", true], ["contact", "Contact forces", true],
    ["effect", "Forces of effects", false], ["reaction", "Reactions", false],
    ["traces", "Traces", true], ["markers", "Markers", false],
    ["names", "Names", false], ["frame", "World axes", true],
];

/* Which layers a page begins with. The dots of many contact points would hide a robot. */
const CONTACTS_MOST = 100;
const layers_at_first = ({effects}) => Object.fromEntries(LAYERS.map(([key, , is_on]) =>
    [key, is_on && (key !== "contacts" || effects.filter(({type}) => type === "contact").length <= CONTACTS_MOST)]));

/* Of arrows, by where their forces come from; each is a layer. */
const ARROWS = {reaction: [0.75, 0.2, 0.55], contact: [0.85, 0.4, 0.1], effect: [0.1, 0.55, 0.6]};

/* Loops whose points coincide, or are held at a distance: a line joins them where they are apart. */
const JOINED = ["spherical", "revolute", "universal", "weld", "distance"];

const DRIVES = ["motor", "servo"];

const PICKABLE = ["joints", "loops", "springs", "contacts", "markers"];

/* Whether a loop or an effect acts at a time; `released` are the times at which it is released, engaged, released, ... */
const acts = ({released = []}, t) => released.filter((at) => at <= t).length % 2 === 0;

/* The name of effect i. Without one, its place in the list, as in records. */
const effect_name = ({name}, i) => name || `effect[${i}]`;

/* How far the middle of a rope hangs below that of its chord c, along the unit vector g, by bisection. lib/output/picture/rope.c
 * derives the length of the parabola. 0: the rope is taut. */
const sag_of = (length, c, g) => {
    const along = dot(c, g), h = norm(sub(c, scale(along, g)));
    const integral = (w) => (w * Math.hypot(w, h) + (h > 0 ? h * h * Math.asinh(w / h) : 0)) / 2;
    let low = 0, high = length / 2;
    for (let i = 0; i < 30 && length > norm(c) * (1 + 1e-6); i++) {
        const depth = (low + high) / 2;
        if (integral(along + 4 * depth) - integral(along - 4 * depth) > 8 * depth * length)
            high = depth;
        else
            low = depth;
    }
    return low;
};

class Figure {
    constructor(painter, data, motion) {
        Object.assign(this, {painter, data, motion});
        this.hidden = new Set();
        this.time = motion.times[0];
        this.switched = [...data.loops, ...data.effects, ...data.relations].filter(({released}) => released !== undefined);
        this.traced = new Set(data.markers.map((m, i) => (m.traced ? i : -1)).filter((i) => i >= 0));
        this.force_scale = 1;
        this.strongest = Object.fromEntries(Object.keys(ARROWS).map((source) => [source,
            Math.max(0, ...data.arrows.map((arrow, i) => (arrow.source === source ? this.longest_force(i) : 0)))]));
        this.make_buffers();
    }

    make_buffers() {
        this.static = Object.fromEntries(["bodies", ...PICKABLE].map((layer) => [layer, []]));
        this.arrows = ["cylinder", "cone"].map((name) => this.painter.make_batch(name, 1.5 * this.data.radius));
        this.thin = this.painter.make_lines(1.5, false);
        this.thick = this.painter.make_lines(2.5, false);
        this.drives = this.painter.make_lines(2.5, false);
        this.paths = [];
    }

    /* The longest vector of an arrow in the motion, but for the longest fiftieth of them: blows, which would leave no
     * length to all others. */
    longest_force(arrow) {
        const {motion} = this, stride = Math.max(1, Math.floor(motion.frames / 2000)), all = [];
        for (let i = 0; i < motion.frames; i += stride) {
            const k = 3 * (i * motion.arrows + arrow);
            const f = Math.hypot(motion.forces[k], motion.forces[k + 1], motion.forces[k + 2]);
            if (Number.isFinite(f))
                all.push(f);
        }
        all.sort((a, b) => a - b);
        return all.length > 0 ? all[Math.floor(0.98 * (all.length - 1))] : 0;
    }

    /* ---- fixed to bodies ----------------------------------------------------------------------------------------- */

    colour_of(body) {
        const k = this.data.bodies[body].colour;
        return this.marked(body) ? this.theme.alarm : k < 0 ? this.theme.fixed : this.theme.series[k % 6];
    }

    marked(body) { return this.data.failed !== undefined && this.data.failed.bodies.includes(body); }

    /* What the pointer finds: its number in the picture is its place in the list plus one. */
    thing(text, body) {
        this.things.push({text, body});
        return this.things.length;
    }

    /* A batch for each doubling of the radius, for small circles need fewer sides. */
    batch(layer, name, radius) {
        const rounded = name === "box" ? 0 : 2 ** Math.ceil(Math.log2(radius));
        const found = this.static[layer].find((one) => one.name === name && one.radius === rounded);
        if (found === undefined)
            this.static[layer].push(this.painter.make_batch(name, rounded));
        return found ?? this.static[layer].at(-1);
    }

    put(layer, name, body, at, turned, half, colour, id, mark = 0) {
        const batch = this.batch(layer, name, half[0]);
        batch.numbers.push_all(...at, ...turned, ...half);
        batch.numbers.push_colour([...colour, 1]);
        batch.numbers.push_all(body, id, mark);
        batch.is_changed = true;
    }

    /* Builds everything that is fixed to bodies; again after a change of the theme or of what is hidden. */
    build(theme) {
        this.theme = theme;
        this.things = [];
        for (const batches of Object.values(this.static))
            for (const batch of batches) {
                batch.numbers.clear();
                batch.is_changed = true;
            }
        this.data.bodies.forEach((body, i) => this.thing(describe_body(this.data, i), i));
        this.data.solids.forEach((solid, i) => this.hidden.has(solid.body) || this.put_solid(solid, i));
        this.data.joints.filter((joint) => !joint.loop && !this.hidden.has(joint.body)).forEach((joint) => this.put_joint(joint));
        this.data.loops.forEach((loop, i) => acts(loop, this.time) && this.put_loop(loop, i));
        this.data.effects.forEach((effect, i) => effect.type === "contact" && this.put_contact(effect, effect_name(effect, i)));
        this.data.effects.forEach((effect, i) => effect.type === "bushing" && acts(effect, this.time) && this.put_bushing(effect, effect_name(effect, i)));
        this.data.markers.forEach((marker) => this.put("markers", "sphere", marker.body, marker.at, [1, 0, 0, 0],
            Array(3).fill(0.8 * this.data.radius), this.theme.ink,
            this.thing(`marker ${this.data.bodies[marker.body].name}.${marker.name}`, marker.body)));
        this.build_paths();
    }

    put_solid({type, body, at, turn: turned, half, points}, i) {
        if (points !== undefined)
            return this.put_mesh(body, at, turned, half.map((h) => Math.max(h, 1e-6 * this.data.size)), i);
        const colour = this.colour_of(body), id = body + 1;
        const mark = type !== "box" && half[0] > 1.5 * this.data.radius && half[0] > 0.3 * half[2] ? 1 : 0;
        if (type === "rod" || type === "cylinder")
            this.put("bodies", "cylinder", body, at, turned, half, colour, id, mark);
        else
            this.put("bodies", type, body, at, turned, half, colour, id, mark);
        for (const side of type === "rod" ? [-1, 1] : [])
            this.put("bodies", "end", body, add(at, turn(turned, [0, 0, side * half[2]])), turned,
                [half[0], half[0], half[0]], colour, id);
    }

    /* A mesh is a batch of its own, of one instance. */
    put_mesh(body, at, turned, half, i) {
        const shape = `mesh ${i}`;
        this.painter.add_mesh(shape, this.motion.meshes[i]);
        this.put("bodies", shape, body, at, turned, half, this.colour_of(body), body + 1);
    }

    put_joint(joint) {
        const {name, type, body, on, at, turn: turned} = joint, r = this.joint_radius(joint), colour = this.marked(body) ? this.theme.alarm : this.theme.joint;
        const id = this.thing(`${type} joint ${name}${on > 0 ? ` on ${this.data.bodies[on].name}` : " on the world"}`, body);
        if (["revolute", "cylindrical", "screw"].includes(type))
            this.put("joints", "cylinder", on, at, turned, [1.25 * r, 1.25 * r, type === "revolute" ? 1.8 * r : 3 * r], colour, id);
        else if (type === "prismatic")
            this.put("joints", "box", on, at, turned, [1.5 * r, 1.5 * r, 2.2 * r], colour, id);
        else if (type === "spherical" || type === "universal")
            this.put("joints", "sphere", on, at, turned, [1.6 * r, 1.6 * r, 1.6 * r], colour, id);
        else if (type === "planar")
            this.put("joints", "box", on, at, turned, [2.5 * r, 2.5 * r, 0.15 * r], colour, id);
        if (on === 0 && type !== "free" && type !== "planar")
            this.put("joints", "box", 0, at, turned, [2.2 * r, 2.2 * r, 0.9 * r], this.theme.fixed, id);
    }

    loop_is_marked(i) { return this.data.failed !== undefined && this.data.failed.loops.includes(i); }

    put_loop({name, type, ends}, i) {
        const r = this.data.radius, colour = this.loop_is_marked(i) ? this.theme.alarm : this.theme.ink;
        const id = this.thing(`${type} loop ${name}`, ends[1].body);
        ends.slice(0, type === "rolling" ? 1 : 2).forEach((end, k) => this.put("loops", type === "distance" || type === "spherical" ? "sphere" : "cylinder",
            end.body, end.at, end.turn, [(1.15 + 0.25 * k) * r, (1.15 + 0.25 * k) * r, (2.1 - 0.5 * k) * r], colour, id));
    }

    put_contact({ends, radius}, name) {
        const r = Math.max(0.6 * this.data.radius, 1.02 * radius);
        const id = this.thing(`contact ${name} of ${this.data.bodies[ends[0].body].name} and ${this.data.bodies[ends[1].body].name}`, ends[0].body);
        if (radius < this.data.radius || !this.data.solids.some((s) => s.body === ends[0].body))
            this.put("contacts", "sphere", ends[0].body, ends[0].at, [1, 0, 0, 0], [r, r, r], this.theme.ink, id);
    }

    /* At its first end; a line from there to the second one is too short to be seen. */
    put_bushing({ends}, name) {
        const r = this.data.radius, [a, b] = ends.map((end) => this.data.bodies[end.body].name);
        this.put("springs", "cylinder", ends[0].body, ends[0].at, ends[0].turn, [2.2 * r, 2.2 * r, 1.6 * r], this.theme.joint,
            this.thing(`bushing ${name} between ${a} and ${b}`, ends[1].body));
    }

    /* ---- from frame to frame ------------------------------------------------------------------------------------- */

    line(lines, a, b, colour) {
        lines.numbers.push_all(...a);
        lines.numbers.push_colour(colour);
        lines.numbers.push_all(...b);
        lines.numbers.push_colour(colour);
    }

    /* What is fixed to bodies is built anew where a loop or an effect is released or engaged. */
    set_time(t) {
        const before = this.time;
        this.time = t;
        if (this.switched.some((one) => acts(one, t) !== acts(one, before)))
            this.build(this.theme);
    }

    update(t, poses, shown) {
        this.set_time(t);
        this.thin.numbers.clear();
        this.thick.numbers.clear();
        this.drives.numbers.clear();
        this.arrows.forEach((batch) => batch.numbers.clear());
        if (shown.frame)
            this.draw_frame(poses);
        if (shown.planes)
            this.data.planes.forEach((plane) => this.draw_plane(poses, plane));
        if (shown.axes)
            this.data.joints.filter((joint) => !joint.loop).forEach((joint) => this.draw_axis(poses, joint));
        if (shown.loops)
            this.data.loops.forEach((loop, i) => { this.draw_strokes(poses, loop); this.draw_wheels(poses, loop, i); acts(loop, t) && this.draw_gap(poses, loop, i); });
        const effects = this.data.effects.filter((effect) => acts(effect, t));
        if (shown.springs)
            effects.filter(({ends, type, lines}) => ends.length === 2 && type !== "contact" && lines === 0).forEach((effect) => this.draw_spring(poses, effect));
        if (shown.springs)
            this.draw_paths(t);
        if (shown.springs)
            effects.filter(({joint}) => joint !== undefined).forEach((effect) => this.draw_in_joint(poses, effect));
        if (shown.drives) {
            effects.filter(({type, joint}) => joint !== undefined && DRIVES.includes(type)).forEach(({joint}) => this.draw_drive(poses, joint));
            this.data.relations.filter((relation) => acts(relation, t)).forEach(({joint, other}) => (other < 0 ? this.draw_drive(poses, joint) : this.draw_coupling(poses, joint, other)));
        }
        this.data.arrows.forEach((arrow, i) => {
            if (shown[arrow.source] && !this.hidden.has(arrow.body))
                this.draw_force(poses, arrow, force_at(this.motion, t, i));
        });
        [this.thin, this.thick, this.drives, ...this.arrows].forEach((one) => { one.is_changed = true; });
        this.update_paths(t);
    }

    place(poses, end) { return point_of(poses, end.body, end.at); }

    draw_frame(poses) {
        const o = point_of(poses, 0, [0, 0, 0]), l = this.data.axis;
        [[0.8, 0.2, 0.2], [0.2, 0.6, 0.2], [0.25, 0.4, 0.95]].forEach((colour, k) => {
            const to = [...o];
            to[k] += l;
            this.line(this.thin, o, to, [...colour, 1]);
        });
    }

    /* A grid under all of the motion. */
    draw_plane(poses, {body, at, turn: turned, half, range}) {
        const q = turn_of(poses, body, turned), o = point_of(poses, body, at), colour = [...this.theme.quiet, 0.35];
        const to = (u, v) => add(o, turn(q, [u, v, 0])), [low, high] = range ?? [[-half, -half], [half, half]];
        const most = Math.max(high[0] - low[0], high[1] - low[1]), step = Math.max(0.2 * half, most / 60);
        for (let u = low[0]; u <= high[0] + 0.01 * step; u += step)
            this.line(this.thin, to(u, low[1]), to(u, high[1]), colour);
        for (let v = low[1]; v <= high[1] + 0.01 * step; v += step)
            this.line(this.thin, to(low[0], v), to(high[0], v), colour);
    }

    draw_axis(poses, {type, body, on, at, turn: turned, axis2}) {
        if (type === "spherical" || type === "free" || this.hidden.has(body))
            return;
        const o = point_of(poses, on, at), l = 0.09 * this.data.size, colour = [...this.theme.ink, 0.9];
        const draw = (n) => {
            this.line(this.thick, add(o, scale(-l, n)), add(o, scale(1.4 * l, n)), colour);
            this.arrow_head(add(o, scale(1.4 * l, n)), n, 1.1 * this.data.radius, this.theme.ink);
        };
        draw(turn(turn_of(poses, on, turned), [0, 0, 1]));
        if (axis2)
            draw(turn(turn_of(poses, body, [1, 0, 0, 0]), axis2));
    }

    /* A curve, or lines on a surface, six numbers each, in the frame of the first end. */
    draw_strokes(poses, {type, ends, strokes = []}) {
        const at = this.place(poses, ends[0]), turned = turn_of(poses, ends[0].body, ends[0].turn);
        const point = (k) => add(at, turn(turned, strokes.slice(k, k + 3)));
        for (let k = 0; k < strokes.length; k += 6)
            this.line(type === "curve" ? this.thick : this.thin, point(k), point(k + 3), [...this.theme.ink, 0.35]);
    }

    /* Pitch circles, pulleys and the spans between them, as lib/output/picture/wheel.c has them. */
    draw_wheels(poses, {type, ends, radii}, index) {
        if (!radii)
            return;
        const rope = type === "span" || type === "belt", colour = [...this.theme.ink, rope ? 1 : 0.5];
        const centre = ends.map((end) => this.place(poses, end));
        const axis = (end, unit) => turn(turn_of(poses, end.body, end.turn), unit);
        ends.forEach((end, k) => {
            const about = (angle) => add(centre[k], axis(end, [radii[k] * Math.cos(angle), radii[k] * Math.sin(angle), 0]));
            for (let i = 0; i < 60 && radii[k] !== 0; i++)
                this.line(this.thin, about(Math.PI * i / 30), about(Math.PI * (i + 1) / 30), [...this.theme.ink, 0.5]);
        });
        if (type === "rack") {
            const t = axis(ends[1], [0, 0, 1]), d = add(centre[0], scale(-1, centre[1]));
            const foot = add(centre[1], scale(dot(d, t), t));
            this.line(this.thin, add(foot, scale(-6 * radii[0], t)), add(foot, scale(6 * radii[0], t)), colour);
        }
        const spans = this.spans_of(poses, {type, ends, radii});
        spans.forEach(({points}) => this.line(this.thick, points[0], points[1], colour));
        for (const k of spans.length > 0 ? [0, 1] : [])
            type === "belt" ? this.draw_wrap(spans[0], k, spans[1].points[k], colour) : this.draw_wrap_to_next(poses, ends[k], spans[0], k, index, colour);
    }

    /* The spans of a loop: their axis, centres, radii, and the points at which they leave the pulleys. */
    spans_of(poses, {type, ends, radii}) {
        const centres = ends.map((end) => this.place(poses, end)), n = turn(turn_of(poses, ends[0].body, ends[0].turn), [0, 0, 1]);
        const d = sub(centres[1], centres[0]), across = add(d, scale(-dot(n, d), n)), a = norm(across), e = scale(1 / a, across);
        const sides = type === "belt" ? [1, -1] : type === "span" ? [1] : [];
        return sides.filter((side) => Math.abs(radii[0] - radii[1]) < a).map((side) => {
            const sine = side * (radii[0] - radii[1]) / a, x = add(scale(Math.sqrt(1 - sine * sine), e), scale(-sine, cross(n, e)));
            const m = cross(n, x), rho = radii.map((radius) => side * radius);
            return {n, centres, rho, points: [0, 1].map((k) => add(centres[k], scale(rho[k], m)))};
        });
    }

    /* The rope on a pulley, from end k of a span to a point of another one (lib/output/picture/wheel.c). */
    draw_wrap({n, centres, rho, points}, k, to, colour) {
        const axis = scale((k ? -1 : 1) * (rho[k] < 0 ? -1 : 1), n), a = sub(points[k], centres[k]), b = sub(to, centres[k]);
        const across = cross(axis, a), angle = (Math.atan2(dot(across, b), dot(a, b)) + 2 * Math.PI) % (2 * Math.PI);
        const about = (x) => add(centres[k], add(scale(Math.cos(x), a), scale(Math.sin(x), across)));
        for (let i = 0, steps = 1 + Math.floor(60 * angle / (2 * Math.PI)); i < steps; i++)
            this.line(this.thick, about(angle * i / steps), about(angle * (i + 1) / steps), colour);
    }

    /* The rope from a span to a later one that goes on at the same pulley. */
    draw_wrap_to_next(poses, end, span, k, index, colour) {
        const winding = ({n, rho}, at) => scale((at ? -1 : 1) * (rho[at] < 0 ? -1 : 1), n), r = Math.abs(span.rho[k]);
        for (const other of this.data.loops.slice(index + 1).filter(({type, radii}) => type === "span" && radii && r > 0))
            for (const next of this.spans_of(poses, other))
                for (const i of [0, 1])
                    if (other.ends[i].body === end.body && norm(sub(next.centres[i], span.centres[k])) <= 1e-6 * r
                        && Math.abs(Math.abs(next.rho[i]) - r) <= 1e-6 * r && dot(winding(span, k), winding(next, i)) < 0)
                        return this.draw_wrap(span, k, next.points[i], colour);
    }

    draw_gap(poses, {type, ends, rope}, i) {
        if (!JOINED.includes(type) && !this.loop_is_marked(i))
            return;
        const [a, b] = ends.map((end) => this.place(poses, end)), chord = norm(sub(a, b));
        const length = rope === undefined ? 0 : rope[Math.min(frame_at(this.motion, this.time), rope.length - 1)];
        const colour = [...(this.loop_is_marked(i) ? this.theme.alarm : this.theme.ink), 0.8];
        const down = scale(-1, this.data.up), depth = sag_of(length, sub(b, a), down);
        if (depth > 0)
            this.draw_sag(a, b, scale(depth, down), colour);
        else if (chord > 1e-3 * this.data.radius)
            this.line(this.thick, a, b, colour);
    }

    draw_sag(a, b, sag, colour) {
        const steps = 16;
        let last = a;
        for (let i = 1; i <= steps; i++) {
            const s = i / steps, p = add(add(a, scale(s, sub(b, a))), scale(4 * s * (1 - s), sag));
            this.line(this.thick, last, p, colour);
            last = p;
        }
    }

    /* Springs as coils whose windings are fixed to their ends; others straight. */
    draw_spring(poses, {type, ends, stiff}) {
        const [a, b] = ends.map((end) => this.place(poses, end)), d = sub(b, a), length = norm(d), n = unit(d);
        const colour = [...this.theme.ink, type === "attraction" ? 0.35 : 1];
        if (type !== "spring" || !stiff || length < 1e-9 * this.data.size)
            return this.line(this.thick, a, b, colour);
        const u = normal_to(n), v = cross(n, u), r = 2 * this.data.radius, turns = 8, steps = 12 * turns;
        const at = (s) => add(a, scale(s, d));
        let last = a;
        for (let i = 0; i <= steps; i++) {
            const w = (2 * Math.PI * i * turns) / steps, s = 0.12 + (0.76 * i) / steps;
            const r_here = r * Math.min(1, i / 6, (steps - i) / 6);
            const p = add(at(s), add(scale(r_here * Math.cos(w), u), scale(r_here * Math.sin(w), v)));
            this.line(this.thin, last, p, colour);
            last = p;
        }
        this.line(this.thin, last, b, colour);
    }

    /* The paths of effects; their lines are in the order of the effects. */
    draw_paths(t) {
        let first = 0;
        this.data.effects.forEach((effect) => {
            for (let i = first; i < first + effect.lines && acts(effect, t); i++)
                this.line(this.thick, ...line_at(this.motion, t, i), [...this.theme.ink, 1]);
            first += effect.lines;
        });
    }

    /* The frame of a joint in the world: its origin and what turns x, y, z into its axes; whether it slides. */
    joint_frame(poses, i) {
        const {body, on, at, turn: turned, type} = this.data.joints[i];
        return {body, o: point_of(poses, on, at), q: turn_of(poses, on, turned), slides: type === "prismatic"};
    }

    curve(points, colour, lines = this.thick) {
        for (let i = 1; i < points.length; i++)
            this.line(lines, points[i - 1], points[i], colour);
    }

    /* Points r(s) from the axis of a joint at angles from a to b. */
    around({o, q}, a, b, r, steps = 24) {
        return [...Array(steps + 1).keys()].map((i) => i / steps).map((s) => add(o, turn(q, [r(s) * Math.cos(a + s * (b - a)), r(s) * Math.sin(a + s * (b - a)), 0])));
    }

    /* A spiral around a joint with a spring, a zigzag along one that slides; stops at its limits. */
    draw_in_joint(poses, {type, joint, lower, upper}) {
        const frame = this.joint_frame(poses, joint), r = this.data.radius, colour = [...this.theme.ink, 0.9];
        if (this.hidden.has(frame.body))
            return;
        if (type === "joint_spring" && frame.slides)
            this.curve([...Array(9).keys()].map((i) => add(frame.o, turn(frame.q, [(i % 2 ? 2.6 : 1.8) * r, 0, (i - 4) * 0.8 * r]))), colour);
        else if (type === "joint_spring")
            this.curve(this.around(frame, 0, 5 * Math.PI, (s) => (1.5 + 2 * s) * r, 60), colour);
        else if (type === "joint_limit")
            [lower, upper].filter((x) => x !== null).forEach((x) => this.draw_stop(frame, x, this.lever(joint), colour));
    }

    /* The direction of what a joint carries at position 0: of the first solid of its body that is not at the joint. */
    lever(joint) {
        const {body, child} = this.data.joints[joint];
        const solid = this.data.solids.find((one) => one.body === body && norm(one.at) > 0);
        const [x, y] = turn(child ?? [1, 0, 0, 0], solid?.at ?? [0, 0, 0]);
        return Math.hypot(x, y) > 0 ? Math.atan2(y, x) : 0;
    }

    /* A stop where the body is at the limit: a short bar across its way. */
    draw_stop(frame, x, lever, colour) {
        const r = this.data.radius, {o, q} = frame;
        if (frame.slides) {
            const at = (u) => add(o, turn(q, [u, 0, x]));
            return this.line(this.thick, at(-3 * r), at(3 * r), colour);
        }
        const angle = lever + x, at = (u) => add(o, turn(q, [u * Math.cos(angle), u * Math.sin(angle), 0]));
        this.line(this.thick, at(2 * r), at(7 * r), colour);
    }

    /* How far the link that a joint carries reaches from the joint: to its solids and to the joints on it. A link
     * without solids is as large as the links that it carries. */
    reach(body, depth = 0) {
        const solids = this.data.solids.filter((one) => one.body === body), next = this.data.joints.filter((one) => one.on === body && !one.loop);
        if (solids.length > 0)
            return Math.max(...solids.map(({at, half}) => norm(at) + Math.max(...half)), ...next.map(({at}) => norm(at)));
        return depth < 8 ? Math.max(0, ...next.map((one) => norm(one.at) + this.reach(one.body, depth + 1))) : 0;
    }

    /* The size of a joint's symbol: the picture's, but of small links smaller. */
    joint_radius(joint) {
        const reach = this.reach(joint.body);
        return reach > 0 ? Math.min(this.data.radius, 0.12 * reach) : this.data.radius;
    }

    /* The radius of a drive's arrow: a share of the link, not hidden by the joint's symbol, nor larger than a picture bears. */
    drive_radius(joint) {
        const least = 2.5 * this.joint_radius(joint);
        return clamp(0.3 * this.reach(joint.body), least, Math.max(least, 0.05 * this.data.size));
    }

    /* An arrow around the axis of a joint that a motor, a servo or a prescribed motion drives; along one that slides. */
    draw_drive(poses, joint) {
        const frame = this.joint_frame(poses, joint), {o, q} = frame, colour = [...this.theme.ink, 0.9];
        const r = (this.data.joints[joint].ring ??= this.drive_radius(this.data.joints[joint]));
        if (this.hidden.has(frame.body))
            return;
        const points = frame.slides ? [-1, 1].map((s) => add(o, turn(q, [0.7 * r, 0, s * r]))) : this.around(frame, 0.3, 4.4, () => r);
        this.curve(points, colour, this.drives);
        this.arrow_head(points.at(-1), unit(sub(points.at(-1), points.at(-2))), 0.2 * r, this.theme.ink);
    }

    draw_coupling(poses, joint, other) {
        const a = this.joint_frame(poses, joint).o, d = sub(this.joint_frame(poses, other).o, a), steps = 20;
        for (let i = 0; i < steps; i++)
            this.line(this.drives, add(a, scale((i + 0.2) / steps, d)), add(a, scale((i + 0.7) / steps, d)), [...this.theme.quiet, 0.9]);
    }

    instance(name, at, turned, half, colour) {
        const {numbers} = this.arrows.find((one) => one.name === name);
        numbers.push_all(...add(at, this.data.centre), ...turned, ...half); /* of the world, whose pose takes `centre` off */
        numbers.push_colour([...colour, 1]);
        numbers.push_all(0, 0, 0);
    }

    arrow_head(tip, n, r, colour) {
        this.instance("cone", sub(tip, scale(1.5 * r, n)), from_z(n), [r, r, 1.5 * r], colour);
    }

    /* Where a force acts: of a contact at the sphere's lowest point. An effect with two ends acts on both; on the world no
     * arrow is drawn. */
    draw_force(poses, {source, body, at, effect}, force) {
        const o = point_of(poses, body, at), {ends, radius} = this.data.effects[effect] ?? {};
        if (source === "contact")
            return this.draw_arrow(sub(o, scale(radius, turn(turn_of(poses, ends[1].body, ends[1].turn), [0, 0, 1]))), force, source);
        if (source !== "effect" || body > 0)
            this.draw_arrow(o, force, source);
        if (source === "effect" && ends.length === 2 && ends[1].body > 0)
            this.draw_arrow(this.place(poses, ends[1]), scale(-1, force), source);
    }

    /* The strongest force of a layer in the motion is a fourth of the mechanism long: next to the reactions of a heavy
     * body a contact that carries little would have no length. */
    draw_arrow(o, force, source) {
        const f = norm(force), most = this.strongest[source], colour = ARROWS[source];
        if (!(f > 1e-3 * most))
            return;
        const length = Math.min((0.25 * f) / most, 0.75) * this.data.size * this.force_scale, n = scale(1 / f, force);
        const r = 0.5 * this.data.radius, head = Math.min(3.6 * r, 0.6 * length);
        const middle = add(o, scale(0.5 * (length - head), n)), tip = add(o, scale(length, n));
        this.instance("cylinder", middle, from_z(n), [r, r, 0.5 * (length - head)], colour);
        this.instance("cone", sub(tip, scale(0.5 * head, n)), from_z(n), [2.2 * r, 2.2 * r, 0.5 * head], colour);
    }

    /* ---- traces -------------------------------------------------------------------------------------------------- */

    build_paths() {
        const known = new Map(this.paths.map((path) => [path.marker, path]));
        this.paths = [...this.traced].map((marker) => {
            const {body, at} = this.data.markers[marker];
            const path = known.get(marker) ?? {marker, body, ...path_of(this.motion, body, at, 20000),
                faint: this.painter.make_lines(1.2, true), past: this.painter.make_lines(2.2, true)};
            path.faint.numbers.clear();
            path.past.numbers.clear();
            path.points.forEach((p) => this.path_point(path.faint, p, [...this.colour_of(body), 0.3]));
            path.faint.is_changed = true;
            path.shown = -1;
            return path;
        });
    }

    path_point(lines, p, colour) {
        lines.numbers.push_all(...p);
        lines.numbers.push_colour(colour);
    }

    /* The way so far is drawn stronger; points are only added while time goes on. */
    update_paths(t) {
        const frame = frame_at(this.motion, t);
        for (const path of this.paths) {
            const upto = Math.floor(frame / path.stride);
            if (upto === path.shown)
                continue;
            if (upto < path.shown)
                path.past.numbers.clear();
            for (let i = path.past.numbers.used / 4; i <= upto; i++)
                this.path_point(path.past, path.points[i], [...this.colour_of(path.body), 0.95]);
            path.past.is_changed = true;
            path.shown = upto;
        }
    }

    /* ---- all of it ----------------------------------------------------------------------------------------------- */

    layers(shown) { return ["bodies", ...PICKABLE.filter((layer) => shown[layer])].flatMap((layer) => this.static[layer]); }

    paint(camera, shown, sides, pixels) {
        const p = this.painter;
        p.paint_solids(this.layers(shown), camera, p.texture, sides);
        p.paint_solids(this.arrows, camera, p.texture, sides);
        const paths = shown.traces ? this.paths.flatMap(({faint, past}) => [faint, past]) : [];
        p.paint_lines([this.thin, this.thick, this.drives, ...paths], camera, pixels);
        /* Arrows within bodies, which are most of a contact's on its sphere and of a motor's in its gear, shine through. */
        p.behind(() => {
            p.paint_solids(this.arrows, camera, p.texture, sides, 0.45);
            p.paint_lines([this.drives], camera, pixels);
        });
    }

    /* The numbers of things in a rectangle of the picture, 0 for none. */
    pick(camera, shown, width, height, x, y, w, h) {
        const p = this.painter;
        p.begin_numbers(width, height);
        p.paint_solids(this.layers(shown), camera, p.texture, 8, 1, true);
        return p.end_numbers(x, y, w, h);
    }
}

function describe_body(data, i) {
    const {name, parent, joint, mass} = data.bodies[i];
    if (i === 0)
        return "the world";
    const on = parent === 0 ? "the world" : data.bodies[parent].name;
    return `${name}: ${joint} joint on ${on}${mass > 0 ? `, ${show_number(mass)} kg` : ""}`;
}
