/* The time that the page shows: its pace, its steps, and drawing that keeps up with it. */
/* SPDX-License-Identifier: Apache-2.0 */

const find = (id) => document.getElementById(id);
const SPEEDS = [1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 1000, 10000];
const MODE_STEPS = 120;

/* Steps by which drawing becomes cheaper where the machine cannot keep up: sides of circles, pixels a pixel of the page, whether joints
 * are drawn; and what the page says of them. */
const COARSE = "This machine draws slowly, so that curved surfaces and fine lines are coarser.";
const QUALITIES = [[40, 2, true], [16, 1, true, COARSE], [8, 1, true, COARSE], [6, 0.6, true, COARSE],
    [6, 0.6, false, "This machine draws slowly, so that curved surfaces and fine lines are coarser, and joints are left out."]];

/* As many digits after the point as the duration needs. */
function show_time(t, end) { return t.toFixed(clamp(3 - Math.floor(Math.log10(Math.max(end, 1e-9))), 0, 9)); }

class Clock {
    /* About the pace of the clock, but motions of less than two seconds slower, of more than a minute faster. */
    choose_speed() {
        if (this.modes !== null) /* a period takes PERIOD seconds of the clock */
            return this.modes.duration / PERIOD;
        const duration = this.times[1] - this.times[0], right = duration < 2 ? duration / 5 : duration > 60 ? duration / 30 : 1;
        return SPEEDS.reduce((best, s) => (Math.abs(Math.log(s / right)) < Math.abs(Math.log(best / right)) ? s : best), 1);
    }

    advance(now) {
        const gone = this.last === undefined ? 0 : (now - this.last) / 1000;
        this.last = now;
        if (this.is_playing) {
            let t = this.time + Math.min(gone, 0.25) * this.speed;
            if (t >= this.times[1]) {
                t = this.repeats && this.times[1] > this.times[0] ? this.times[0] + ((t - this.times[1]) % (this.times[1] - this.times[0])) : this.times[1];
                if (!this.repeats)
                    this.pause();
            }
            this.set_time(t);
            this.watch_pace(gone);
        }
        if (this.is_stale)
            this.paint();
        else if (!this.is_playing && !this.is_fine && this.quality > 0 && this.rested++ > 10)
            this.paint(true);
    }

    set_time(t) {
        this.time = clamp(t, this.times[0], this.times[1]);
        const slider = find("slider"), i = frame_at(this.motion, this.time);
        slider.value = this.modes !== null ? Math.round((MODE_STEPS * this.time) / this.times[1]) : this.motion.frames > 1 ? i : 0;
        slider.setAttribute("aria-valuetext", `${show_number(this.time)} seconds`);
        find("time").textContent = `${show_time(this.time, this.times[1])} s`;
        this.chart.move(this.time);
        this.is_stale = true;
    }

    seek(t) {
        this.pause();
        this.set_time(t);
    }

    step(count) {
        if (this.data.overlay)
            return;
        if (this.modes !== null)
            return this.seek(this.time + (count * this.times[1]) / MODE_STEPS);
        const i = clamp(frame_at(this.motion, this.time) + count, 0, this.motion.frames - 1);
        this.seek(this.motion.times[i]);
        this.say(`frame ${i + 1} of ${this.motion.frames}, ${show_number(this.time)} seconds`);
    }

    play() {
        if ((this.motion.frames < 2 && this.modes === null) || this.data.overlay)
            return;
        if (this.time >= this.times[1])
            this.set_time(this.times[0]);
        this.is_playing = true;
        this.spent = [];
        find("play").setAttribute("aria-label", "Pause");
        find("play").dataset.state = "playing";
    }

    pause() {
        if (!this.is_playing)
            return;
        this.is_playing = false;
        find("play").setAttribute("aria-label", "Play");
        find("play").dataset.state = "paused";
        this.say(`paused at ${show_number(this.time)} seconds`);
    }

    /* Where thirty pictures a second cannot be kept, drawing becomes cheaper, and the page says so. */
    watch_pace(gone) {
        this.spent.push(gone);
        const all = this.spent.reduce((a, b) => a + b), mean = all / this.spent.length;
        if (all < 0.6 || this.spent.length < 3)
            return;
        this.pace = 1 / mean;
        this.spent = [];
        if (mean < 1 / 30 || document.hidden || this.quality === QUALITIES.length - 1)
            return;
        this.quality++;
        const words = QUALITIES.map(([, , , note]) => note);
        this.notes = [...this.notes.filter((note) => !words.includes(note)), words[this.quality]];
        this.show_notes();
        this.resize();
    }
}
