/* The chart: chosen columns against time, a panel for each unit, the present time as a line that moves with the
 * slider. The curves are painted once; what moves lies over them. */
/* SPDX-License-Identifier: Apache-2.0 */

const DASHES = [[], [6, 3], [2, 2], [8, 3, 2, 3]];

/* What a chart opens with, by how names of columns begin. */
const FIRST = ["position.", "effect", "velocity."];

class Chart {
    constructor(elements, data, motion, seek) {
        Object.assign(this, {...elements, data, motion, seek, readings: [], left: 64, right: 14});
        this.chosen = this.first_choice();
        this.canvas.addEventListener("pointerdown", (event) => {
            this.canvas.setPointerCapture(event.pointerId);
            this.seek_to(event);
        });
        this.canvas.addEventListener("pointermove", (event) => event.buttons & 1 && this.seek_to(event));
        this.list_columns();
    }

    /* The positions that move; else what effects exert; else the first group. Of each unit what varies most, and nothing that varies by
     * rounding alone. */
    first_choice() {
        const all = this.data.columns, moving = this.moving();
        const found = FIRST.map((kind) => moving.filter((i) => all[i].name.startsWith(kind))).find((some) => some.length > 0);
        const chosen = found ?? moving.filter((i) => all[i].group === all[moving[0]].group);
        return (chosen.length > 0 ? chosen : all.map((c, i) => i)).slice(0, 6).sort((a, b) => a - b);
    }

    /* The columns that vary by more than 1e-11 of the largest number of their unit, those first that vary most. */
    moving() {
        const all = this.data.columns, ranges = all.map((c, i) => this.extent(i)), most = {};
        ranges.forEach(({size}, i) => { most[all[i].unit] = Math.max(most[all[i].unit] ?? 0, size); });
        const share = (i) => ranges[i].range / most[all[i].unit];
        return all.map((c, i) => i).filter((i) => share(i) > 1e-11).sort((a, b) => share(b) - share(a));
    }

    extent(column) {
        let low = Infinity, high = -Infinity;
        for (let i = 0; i < this.motion.frames; i++) {
            const y = this.value(column, i);
            if (Number.isFinite(y)) {
                low = Math.min(low, y);
                high = Math.max(high, y);
            }
        }
        return low <= high ? {size: Math.max(Math.abs(low), Math.abs(high)), range: high - low} : {size: 0, range: 0};
    }

    /* The columns as a list of boxes to tick, by group; a filter for many. */
    list_columns() {
        const groups = new Map();
        this.data.columns.forEach((column, i) => groups.set(column.group, [...(groups.get(column.group) ?? []), i]));
        for (const [group, columns] of groups) {
            const set = element("fieldset", {}, this.list);
            element("legend", {text: group}, set);
            for (const i of columns) {
                const label = element("label", {}, set), box = element("input", {type: "checkbox"}, label);
                box.checked = this.chosen.includes(i);
                element("span", {text: this.data.columns[i].name}, label);
                box.addEventListener("change", () => {
                    this.chosen = box.checked ? [...this.chosen, i] : this.chosen.filter((k) => k !== i);
                    this.paint(this.theme);
                    this.move(this.time);
                });
            }
        }
        this.filter.addEventListener("input", () => {
            for (const label of this.list.querySelectorAll("label"))
                label.hidden = !label.textContent.toLowerCase().includes(this.filter.value.toLowerCase());
        });
    }

    seek_to(event) {
        const box = this.canvas.getBoundingClientRect(), {times} = this.motion;
        const s = clamp((event.clientX - box.left - this.left) / (box.width - this.left - this.right), 0, 1);
        this.seek(times[0] + s * (times[times.length - 1] - times[0]));
    }

    value(column, frame) { return this.motion.values[frame * this.motion.columns + column]; }

    range(columns) {
        let low = Infinity, high = -Infinity;
        for (const c of columns)
            for (let i = 0; i < this.motion.frames; i++) {
                const y = this.value(c, i);
                if (Number.isFinite(y)) {
                    low = Math.min(low, y);
                    high = Math.max(high, y);
                }
            }
        if (!(low <= high))
            return [0, 1];
        const room = high > low ? 0.06 * (high - low) : Math.max(Math.abs(low) * 0.1, 1e-12);
        return [low - room, high + room];
    }

    paint(theme) {
        this.theme = theme;
        const canvas = this.canvas, ratio = window.devicePixelRatio || 1, context = canvas.getContext("2d");
        const panels = [...new Map(this.chosen.map((c) => [this.data.columns[c].unit, null])).keys()]
            .map((unit) => ({unit, columns: this.chosen.filter((c) => this.data.columns[c].unit === unit)}));
        const width = canvas.clientWidth, height = canvas.clientHeight;
        canvas.width = Math.max(1, Math.round(width * ratio));
        canvas.height = Math.max(1, Math.round(height * ratio));
        context.scale(ratio, ratio);
        context.font = "12px system-ui, sans-serif";
        Object.assign(this, {top: 8, bottom: 22});
        const each = (height - this.top - this.bottom) / Math.max(1, panels.length);
        this.list_legend(panels);
        this.marks = [];
        panels.forEach((panel, k) => {
            const top = this.top + k * each + (k > 0 ? 6 : 0), bottom = this.top + (k + 1) * each - 2;
            this.paint_panel(context, panel, top, bottom, width, k === panels.length - 1);
            this.paint_events(context, top, bottom, width, k === 0);
        });
        if (panels.length === 0) {
            context.fillStyle = css(theme.quiet);
            context.fillText("No column is chosen.", this.left, this.top + 14);
        }
    }

    paint_panel(context, {unit, columns}, top, bottom, width, is_last) {
        const {theme, motion, left, right} = this, [low, high] = this.range(columns), {times} = motion;
        const t0 = times[0], t1 = times[motion.frames - 1] > t0 ? times[motion.frames - 1] : t0 + 1;
        const x = (t) => left + ((t - t0) / (t1 - t0)) * (width - left - right);
        const y = (v) => bottom - ((v - low) / (high - low)) * (bottom - top);
        context.strokeStyle = context.fillStyle = css(theme.faint);
        context.lineWidth = 1;
        context.textBaseline = "middle";
        context.textAlign = "right";
        const rows = ticks(low, high, Math.max(2, Math.floor((bottom - top) / 28)));
        const {texts, offset} = label_ticks(rows);
        const unit_end = 4 + context.measureText(unit).width;
        let below = Infinity;
        rows.forEach((v, k) => {
            context.strokeStyle = css(theme.faint);
            stroke(context, [[left, y(v)], [width - right, y(v)]]);
            context.fillStyle = css(theme.quiet);
            const at = clamp(y(v), top + 5, bottom - 5); /* panels are close to each other */
            if (below - at < 11 || (at < top + 21 && left - 6 - context.measureText(texts[k]).width < unit_end + 4))
                return; /* another number or the unit is there */
            context.fillText(texts[k], left - 6, at);
            below = at;
        });
        context.textAlign = "center";
        for (const t of ticks(t0, t1, Math.max(2, Math.floor((width - left - right) / 90)))) {
            context.strokeStyle = css(theme.faint);
            stroke(context, [[x(t), top], [x(t), bottom]]);
            context.fillStyle = css(theme.quiet);
            if (is_last)
                context.fillText(`${show_number(t)} s`, clamp(x(t), left, width - right - 12), bottom + 13);
        }
        context.textAlign = "left";
        context.fillText(unit, 4, top + 7);
        if (offset !== 0)
            context.fillText(`${offset < 0 ? "+" : "\u2212"} ${Math.abs(+offset.toPrecision(15))} ${unit}`, left + 4, top + 7);
        context.save();
        context.beginPath();
        context.rect(left, top, width - left - right, bottom - top);
        context.clip();
        columns.forEach((c) => {
            const k = this.chosen.indexOf(c);
            context.strokeStyle = css(theme.series[k % 6]);
            context.setLineDash(DASHES[Math.floor(k / 6) % 4]);
            context.lineWidth = 1.6;
            this.paint_curve(context, c, x, y, width);
            this.marks.push({column: c, y, colour: css(theme.series[k % 6])});
        });
        context.restore();
    }

    /* Lines at the times of events, with their names in the first panel where these do not cover each other. */
    paint_events(context, top, bottom, width, is_first) {
        const {theme, left, right} = this, {times, frames} = this.motion, t0 = times[0], t1 = times[frames - 1];
        let last = -Infinity, named = -Infinity;
        for (const {time, name} of t1 > t0 ? this.data.marks : []) {
            const x = left + ((time - t0) / (t1 - t0)) * (width - left - right);
            if (x < last + 1)
                continue;
            last = x;
            context.strokeStyle = css(theme.quiet);
            context.lineWidth = 1;
            context.setLineDash([3, 3]);
            stroke(context, [[x, top], [x, bottom]]);
            context.setLineDash([]);
            if (!is_first || x < named + 14)
                continue;
            named = x;
            context.save();
            context.translate(x > left + 14 ? x - 7 : x + 7, top + 2);
            context.rotate(-Math.PI / 2);
            context.textAlign = "right";
            context.fillStyle = css(theme.quiet);
            const width_of = (text) => context.measureText(text).width;
            context.fillText(shorten(name, bottom - top - 4, width_of), 0, 0);
            context.restore();
        }
    }

    /* Of many frames to a pixel the lowest and the highest. */
    paint_curve(context, column, x, y, width) {
        const {frames, times} = this.motion, bunch = Math.max(1, Math.floor(frames / (2 * width)));
        context.beginPath();
        let is_on = false;
        for (let i = 0; i < frames; i += bunch) {
            let low = Infinity, high = -Infinity;
            for (let k = i; k < Math.min(i + bunch, frames); k++) {
                const v = this.value(column, k);
                low = Math.min(low, v);
                high = Math.max(high, v);
            }
            if (!Number.isFinite(low) || !Number.isFinite(high)) {
                is_on = false;
                continue;
            }
            for (const v of low < high ? [low, high] : [low]) {
                context[is_on ? "lineTo" : "moveTo"](x(times[i]), y(v));
                is_on = true;
            }
        }
        context.stroke();
    }

    list_legend(panels) {
        this.legend.replaceChildren();
        this.readings = [];
        for (const column of panels.flatMap((panel) => panel.columns)) {
            const item = element("li", {}, this.legend), k = this.chosen.indexOf(column);
            element("i", {style: `background:${css(this.theme.series[k % 6])}`, "aria-hidden": "true"}, item);
            element("span", {text: this.data.columns[column].name}, item);
            this.readings.push({column, output: element("output", {}, item)});
        }
    }

    /* The line of the present time and the values there. */
    move(t) {
        this.time = t;
        const {times, frames} = this.motion, i = frame_at(this.motion, t), t0 = times[0], t1 = times[frames - 1];
        const width = this.canvas.clientWidth, s = t1 > t0 ? (t - t0) / (t1 - t0) : 0;
        this.cursor.style.transform = `translateX(${this.left + s * (width - this.left - this.right)}px)`;
        for (const {column, output} of this.readings)
            output.textContent = Number.isFinite(this.value(column, i)) ? `${show_number(this.value(column, i))} ${this.data.columns[column].unit}` : "\u2013";
    }
}

function stroke(context, points) {
    context.beginPath();
    points.forEach(([x, y], i) => context[i > 0 ? "lineTo" : "moveTo"](x, y));
    context.stroke();
}

const css = (c) => `rgb(${c.slice(0, 3).map((x) => Math.round(255 * x)).join(" ")})`;

/* Round numbers between low and high, about `count`. */
function ticks(low, high, count) {
    const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 2.5, 5, 10].map((k) => k * power).find((s) => s >= rough) ?? rough, all = [];
    for (let v = Math.ceil(low / step) * step; v <= high && all.length < 50; v += step)
        all.push(Math.abs(v) < 1e-9 * step ? 0 : v);
    return all;
}

/* A new element; names of scenes only ever come in as text. */
function element(name, {text, ...attributes}, parent) {
    const made = document.createElement(name);
    for (const [key, value] of Object.entries(attributes))
        made.setAttribute(key, value);
    if (text !== undefined)
        made.textContent = text;
    parent?.append(made);
    return made;
}
