/* The controls of a live page: numbers with sliders. */
/* SPDX-License-Identifier: Apache-2.0 */

/* A number with a slider. log: the slider moves along powers of ten; factor: of the number that is shown. */
class Control {
    constructor(parent, {label, title = label, value, low, high, unit = "", factor = 1, log = false, has_slider = true}, changed) {
        Object.assign(this, {value, start: value, factor, log, changed});
        const box = element("label", {class: "control", title}, parent);
        element("span", {text: label}, box);
        const right = element("span", {class: "number"}, box);
        this.number = element("input", {type: "number", step: "any"}, right);
        element("span", {class: "unit", text: unit}, right);
        this.slider = has_slider ? element("input", {type: "range", step: "any", "aria-label": title}, box) : null;
        this.limit(low, high);
        this.show();
        this.slider?.addEventListener("input", () => this.set(log ? Number((10 ** Number(this.slider.value)).toPrecision(2)) : Number(this.slider.value) / factor, false));
        this.slider?.addEventListener("change", () => this.changed(true));
        this.number.addEventListener("change", () => Number.isFinite(this.number.valueAsNumber) && this.set(this.number.valueAsNumber / factor, true));
    }

    limit(low, high) {
        if (this.slider === null)
            return;
        this.slider.min = this.log ? log10(low) : low * this.factor;
        this.slider.max = this.log ? log10(high) : high * this.factor;
    }

    show() {
        const shown = Number((this.value * this.factor).toPrecision(5));
        this.number.value = this.log && Math.abs(shown) < 1e-3 ? shown.toExponential() : shown;
        if (this.slider !== null)
            this.slider.value = this.log ? log10(this.value) : this.value * this.factor;
    }

    /* is_last: the end of a gesture, not a part of it. */
    set(value, is_last) {
        this.value = value;
        this.show();
        this.changed(is_last);
    }

    reset() {
        this.value = this.start;
        this.show();
    }

    get is_changed() { return this.value !== this.start; }
}

/* A range around a value of unknown meaning. */
const around = (x) => (x > 0 ? [0, 2 * x] : x < 0 ? [2 * x, 0] : [-1, 1]);

/* Names that need no quotes in the path of a setting. */
const is_plain_name = (name) => /^[A-Za-z_][\w-]*$/.test(name);
