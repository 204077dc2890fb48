/* The panel beside the picture: layers, modes, traces and bodies, each with a box to tick. */
/* SPDX-License-Identifier: Apache-2.0 */

const LISTED_MAX = 300;

class Panel extends Clock {
    tick(parent, text, is_on, changed) {
        const label = element("label", {}, parent), box = element("input", {type: "checkbox"}, label);
        box.checked = is_on;
        const words = element("span", {text}, label);
        box.addEventListener("change", () => {
            changed(box.checked);
            this.is_stale = true;
        });
        return {label, words, box};
    }

    /* Only layers of which this scene has something. */
    build_panel() {
        const {data} = this, has = {
            joints: data.joints.length, axes: data.joints.some((j) => j.type !== "free" && j.type !== "spherical"), loops: data.loops.length,
            springs: data.effects.some(({type, ends}) => (ends.length === 2 && type !== "contact") || type === "joint_spring" || type === "joint_limit"),
            drives: data.relations.length || data.effects.some(({type}) => DRIVES.includes(type)), planes: data.planes.length,
            contacts: data.effects.some((e) => e.type === "contact"), ...Object.fromEntries(data.arrows.map((arrow) => [arrow.source, true])), traces: this.modes === null && data.markers.length, markers: data.markers.length,
            names: true, frame: true,
        };
        for (const [key, text] of LAYERS.filter(([key]) => has[key]))
            this.tick(find("layers"), text, this.shown[key], (on) => { this.shown[key] = on; });
        find("lengths").hidden = data.arrows.length === 0;
        this.list_modes();
        this.list_traces();
        this.list_bodies();
        this.show_notes();
    }

    list_modes() {
        find("modes").hidden = this.modes === null;
        if (this.modes === null)
            return;
        const list = find("mode"), size = find("amplitude");
        this.modes.list.forEach(({title, short}, i) => element("option", {value: i, text: short, title}, list));
        list.size = clamp(this.modes.list.length, 2, 12);
        list.addEventListener("change", () => this.choose_mode(list.selectedIndex));
        this.name_mode(0);
        size.value = this.modes.size;
        size.addEventListener("input", () => {
            this.modes.size = Number(size.value);
            this.is_stale = true;
        });
        this.tick(find("modes"), "Undeflected, pale", true, (on) => { this.has_ghost = on; });
        find("repeat").checked = true;
    }

    name_mode(k) {
        find("mode").selectedIndex = k;
        find("method").textContent = `${this.data.method}; ${this.modes.mode.title}`;
    }

    choose_mode(k) {
        this.modes.choose(k);
        this.name_mode(k);
        this.times = [0, this.modes.duration];
        this.speed = this.choose_speed();
        this.list_speeds();
        this.set_time(0);
        this.say(this.modes.mode.title);
    }

    list_traces() {
        const all = this.data.markers.slice(0, LISTED_MAX);
        find("traces").closest("details").hidden = all.length === 0 || this.modes !== null;
        all.forEach((marker, i) => this.tick(find("traces"), `${this.data.bodies[marker.body].name}.${marker.name}`, this.figure?.traced.has(i), (on) => {
            this.figure?.traced[on ? "add" : "delete"](i);
            this.figure?.build_paths();
        }));
    }

    list_bodies() {
        const {data} = this;
        data.bodies.slice(1, LISTED_MAX + 1).forEach((body, k) => {
            const {label, words} = this.tick(find("bodies"), body.name, true, (on) => {
                this.figure?.hidden[on ? "delete" : "add"](k + 1);
                this.figure?.build(this.theme);
            });
            words.before(element("i", {"data-body": k + 1, style: `background:${css(this.figure?.colour_of(k + 1) ?? this.theme.quiet)}`}));
            label.title = describe_body(data, k + 1);
        });
        if (data.bodies.length - 1 > LISTED_MAX)
            element("p", {text: `and ${data.bodies.length - 1 - LISTED_MAX} more`}, find("bodies"));
    }
}
