"""live KINETREE SCENES: live pages in a headless Chromium, opened from disk: controls change the motion, names stay names.

The motion of a page after a slider has moved is compared with a page that the command writes for the same value.
"""
# SPDX-License-Identifier: Apache-2.0
import base64
import json
import math
import pathlib
import re
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent), str(HERE.parent / "command")]
import browser
from claims import claim, finish, note, skip


def holds(condition, name, seen):
    """States a claim, with what was seen."""
    note(seen)
    claim(name, [] if condition else ["it does not hold"])


KINETREE, SCENES = sys.argv[1:]
SMALL = ("four-bar", "bead", "cart-pole", "lagrange-top")
NEWEST = 100  # ms, of a small scene after the first run

# The reader allows letters, digits, _ and - in names; titles and units are any text.
HOSTILE = """kinetree: 1
name: "</script><script>window.broken = 1</script><img src=x onerror='window.broken = 2'>"
parameters: {L: 0.5}
gravity: [0, -9.81, 0]
bodies:
  - name: __proto__
    joint: {type: revolute, axis: z, position: 40 deg}
    mass: 1
    shape: {type: rod, to: [=L, 0, 0], radius: 0.02}
  - {name: constructor, parent: __proto__, mass: 1, joint: {type: revolute, axis: z, at: [=L, 0, 0]}, shape: {type: rod, to: [0.3, 0, 0], radius: 0.02}}
simulate: {duration: 1}
output: {columns: {turn: {value: 2*position.constructor, unit: "<b>&lt;"}}}
"""

# Waits for the answer to what an expression does, and returns the ms that the page waited for it.
ACT = """(async () => {
    const live = window.kinetree_live, before = live.answered ?? 0;
    %s
    for (let i = 0; (live.answered ?? 0) === before && i < 6000; i++)
        await new Promise((done) => setTimeout(done, 5));
    return (live.answered ?? 0) > before ? live.bench.waited : null;
})()"""
FIRST = "await new Promise((done) => { const wait = () => ((live.answered ?? 0) > 0 ? done() : setTimeout(wait, 5)); wait(); }); if (before === 0) return live.bench.waited;"
END = "(() => { const m = window.kinetree.motion, n = 3 * m.bodies; return {times: m.frames, place: [...m.places.slice(-n)], turns: [...m.turns.slice(-4 * m.bodies)]}; })()"
SLIDE = """const slider = document.querySelector('%s'); slider.value = %s; slider.dispatchEvent(new Event('input')); slider.dispatchEvent(new Event('change'));"""


def view(scene, page, *options):
    run = subprocess.run([KINETREE, "view", str(scene), "--view", str(page), "--quiet", *options], capture_output=True, text=True)
    holds(run.returncode == 0, f"{page.name}_is_written", run.stderr.strip() or f"{page.stat().st_size} bytes")


def opened(b, page):
    b.open(page)
    return b.evaluate(ACT % FIRST)


def see_sliders(b, folder):
    """A slider changes the motion, and the motion is that of the command."""
    scene = pathlib.Path(folder, "pendulum.yaml")
    scene.write_text("kinetree: 1\nname: pendulum\nparameters: {L: 0.5}\ngravity: [0, -9.81, 0]\nbodies:\n"
                     "  - {name: rod, joint: {type: revolute, axis: z, position: 40 deg}, mass: 1, shape: {type: rod, to: [=L, 0, 0]}}\n"
                     "simulate: {duration: 2}\n")
    page = pathlib.Path(folder, "pendulum.html")
    view(scene, page, "--live")
    head = page.read_text()[:4000]
    holds("Apache License, Version 2.0" in head and "Rich Felker" in head, "the_page_has_the_licences_of_its_engine", head[:60])
    opened(b, page)
    first = b.evaluate(END)
    for what, act, options in (
            ("a parameter", SLIDE % ("#parameters input[type=range]", 0.75), ["--set", "L=0.75"]),
            ("a start", SLIDE % ("#starts input[type=range]", 20), ["--set", "L=0.75", "--set", "bodies.rod.joint.position=20 deg"]),
            ("a tolerance", SLIDE % ("#precision input[type=range]", -4), ["--set", "L=0.75", "--set", "bodies.rod.joint.position=20 deg", "--tolerance", "1e-4"]),
            ("gravity", SLIDE % ("#gravity .control:nth-child(2) input[type=range]", -1.5),
             ["--set", "L=0.75", "--set", "bodies.rod.joint.position=20 deg", "--tolerance", "1e-4", "--set", "gravity=[0, -1.5, 0]"])):
        waited = b.evaluate(ACT % act)
        now = b.evaluate(END)
        other = pathlib.Path(folder, "other.html")
        view(scene, other, *options)
        b2_end = end_of(other)
        apart = max(abs(x - y) for x, y in zip(now["turns"], b2_end))
        holds(now["turns"] != first["turns"], f"{what.replace(' ', '_')}_changes_the_motion", f"last turn {now['turns']}, before {first['turns']}")
        holds(apart <= 1, f"{what.replace(' ', '_')}_gives_the_motion_of_the_command", f"the last turns differ by {apart} of 32767, bound 1 (libraries of sin and cos differ)")
        note(f"{what}: the new motion was there after {waited:.0f} ms")
        first = now
    b.evaluate(ACT % "document.getElementById('reset').click();")
    again = pathlib.Path(folder, "pendulum-again.html")
    view(scene, again)
    holds(max(abs(x - y) for x, y in zip(b.evaluate(END)["turns"], end_of(again))) <= 1, "reset_returns_to_the_scene", str(b.evaluate(END)["turns"]))


def end_of(page):
    """The last orientations in a page of the command."""
    text = page.read_text()
    data = json.loads(re.search(r'id="data">(.*?)</script>', text, re.S).group(1))
    raw = base64.b64decode(re.search(r'id="motion">(.*?)</script>', text, re.S).group(1))
    frames, bodies = data["frames"], len(data["bodies"]) - 1
    end = 8 * frames + 12 * frames * bodies + 8 * frames * bodies
    return [int.from_bytes(raw[at:at + 2], "little", signed=True) for at in range(end - 8 * bodies, end, 2)]


def see_address(b, folder):
    """The address of a page gives values, as the figures of the site do."""
    page = pathlib.Path(folder, "four-bar.html")
    view(pathlib.Path(SCENES, "four-bar.yaml"), page, "--live")
    b.open(f"{page}#method=rk4&step=0.01&unprojected=1&start.crank=1.2")
    words = b.evaluate("""(async () => { const live = () => window.kinetree_live; for (let i = 0; i < 2000 && (live().answered ?? 0) < 2; i++) await new Promise((done) => setTimeout(done, 5));
        return [window.kinetree.data.method, live().runs.at(-1).gap, live().controls.joints[0].control.value]; })()""")
    holds(words[0] == "rk4, step 0.01 s" and words[1] > 1e-12 and words[2] == 1.2, "the_address_gives_values", json.dumps(words) + ", gap above 1e-12: the loop drifts")


# Settings of a page, by its address, and of the command: each gives a warning of another kind.
WARNED = (("four-bar", "method=rk4&step=0.01&unprojected=1", ["--integrator", "rk4", "--step", "0.01", "--unprojected"], "drifted open"),
          ("double-pendulum", "method=heun&step=0.05", ["--integrator", "heun", "--step", "0.05"], "energy"),
          ("still", "duration=1", ["--duration", "1"], "Nothing has moved"),
          ("mathieu", "duration=0.5", ["--duration", "0.5"], None))


STILL = "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies: [{name: arm, mass: 1, shape: {type: rod, to: [1, 0, 0]}, joint: {type: revolute, axis: z}}]\n"
OF_MODES = "steps a period of"  # the words of a warning that needs LAPACK, which the engine of a page lacks


def see_warnings(b, folder):
    """The page has the warnings of the command, word by word."""
    pathlib.Path(folder, "still.yaml").write_text(STILL)
    for name, address, options, word in WARNED:
        scene = pathlib.Path(folder if name == "still" else SCENES, f"{name}.yaml")
        page, other = pathlib.Path(folder, f"{name}-warned.html"), pathlib.Path(folder, "other.html")
        view(scene, page, "--live")
        view(scene, other, *options)
        theirs = json.loads(re.search(r'id="data">(.*?)</script>', other.read_text(), re.S).group(1)).get("notes", [])
        theirs = sorted(f"{one['what'][0].upper()}{one['what'][1:]}. {one['remedy']}." for one in theirs if OF_MODES not in one["what"])
        b.open(f"{page}#{address}")
        ours = sorted(b.evaluate("""(async () => { const live = () => window.kinetree_live; for (let i = 0; i < 4000 && (live().answered ?? 0) < 2; i++) await new Promise((done) => setTimeout(done, 5));
            return window.kinetree.notes; })()"""))
        note(f"{name}, {address}: {json.dumps(ours)}, the command: {json.dumps(theirs)}")
        claim(f"{name}_{address.partition('=')[0]}_has_the_warnings_of_the_command", ([] if ours == theirs else ["other words"]) +
              ([] if (word is None and not ours) or (word is not None and any(word in one for one in ours)) else [f"expected: {word}"]))


def see_reduction(b, folder):
    """Coordinate partitioning in place of QR: another reduction of the same equations, and the same motion."""
    page = pathlib.Path(folder, "four-bar.html")
    view(pathlib.Path(SCENES, "four-bar.yaml"), page, "--live")
    opened(b, page)
    first, label = b.evaluate(END), b.evaluate("window.kinetree_live.runs.at(-1).label")
    b.evaluate(ACT % "const list = document.getElementById('reduction'); list.value = 'partition'; list.dispatchEvent(new Event('change'));")
    second, other = b.evaluate(END), b.evaluate("window.kinetree_live.runs.at(-1).label")
    apart = max(abs(x - y) for x, y in zip(first["turns"], second["turns"]))
    holds(other == f"{label}, partitioning", "the_list_of_runs_names_the_reduction", f"{label}; {other}")
    holds(apart <= 1, "both_reductions_give_one_motion", f"the last turns differ by {apart} of 32767, bound 1")


def see_drag(b, folder):
    """A body that is dragged turns its joint: the pointer pulls the tip of the pendulum to the right, from 40 degrees."""
    b.open(pathlib.Path(folder, "pendulum.html"))
    b.evaluate(ACT % FIRST)
    b.evaluate("document.getElementById('drag').click()")
    x, y, to_x, to_y = b.evaluate("""(() => { const live = window.kinetree_live, page = window.kinetree; page.pose();
        const tip = (angle) => live.pixel_of(sub([0.4 * Math.cos(angle), 0.4 * Math.sin(angle), 0], page.motion.centre));
        return [...tip(40 * Math.PI / 180), ...tip(20 * Math.PI / 180)]; })()""")
    before = b.evaluate("window.kinetree_live.controls.joints[0].control.value")
    b.call("Input.dispatchMouseEvent", type="mousePressed", x=x, y=y, button="left", buttons=1, clickCount=1)
    for k in range(1, 9):
        b.call("Input.dispatchMouseEvent", type="mouseMoved", x=x + (to_x - x) * k / 8, y=y + (to_y - y) * k / 8, button="left", buttons=1)
    b.call("Input.dispatchMouseEvent", type="mouseReleased", x=to_x, y=to_y, button="left", buttons=0, clickCount=1)
    after = b.evaluate("window.kinetree_live.controls.joints[0].control.value")
    degrees = [value * 180 / math.pi for value in (before, after)]
    holds(abs(degrees[0] - 40) < 1e-6 and abs(degrees[1] - 20) < 2, "a_body_that_is_dragged_sets_the_start", f"from {degrees[0]:.3f} to {degrees[1]:.3f} degrees, aim 20, bound 2 (pixels)")


def see_faults(b, folder):
    """Faults have the words of the engine, and the page goes on."""
    page = pathlib.Path(folder, "four-bar.html")
    view(pathlib.Path(SCENES, "four-bar.yaml"), page, "--live")
    opened(b, page)
    b.evaluate("""(async () => { const live = window.kinetree_live; live.controls.duration.set(-1, true);
        for (let i = 0; i < 400 && document.getElementById('failed').hidden; i++) await new Promise((done) => setTimeout(done, 5)); })()""")
    words = b.evaluate("document.getElementById('failed').textContent")
    holds("duration" in words and not b.evaluate("document.getElementById('failed').hidden"), "a_wrong_duration_is_a_fault_in_the_engines_words", repr(words))
    b.evaluate(ACT % "live.controls.duration.set(1, true);")
    holds(b.evaluate("document.getElementById('failed').hidden"), "a_right_one_ends_the_fault", repr(b.evaluate("document.getElementById('status').textContent")))


def see_cancel(b, folder):
    """A long run does not freeze the page, and ends at once."""
    page = pathlib.Path(folder, "four-bar.html")
    opened(b, page)
    pictures = b.evaluate("""(async () => { const live = window.kinetree_live; live.controls.tolerance.set(1e-13, false); live.controls.duration.set(5000, true);
        let turns = 0; const until = performance.now() + 1500;
        while (performance.now() < until) { await new Promise((done) => setTimeout(done, 10)); turns++; }
        return {turns, busy: live.bench.is_busy, cancel: !document.getElementById('cancel').hidden, words: document.getElementById('status').textContent}; })()""")
    holds(pictures["busy"] and pictures["cancel"] and pictures["turns"] >= 5, "the_page_does_not_freeze_during_a_long_run", json.dumps(pictures) + ", bound 5 turns of a timer in 1.5 s")
    b.evaluate("document.getElementById('cancel').click()")
    after = b.evaluate("[window.kinetree_live.bench.is_busy, document.getElementById('status').textContent]")
    holds(after[0] is False and "cancelled" in after[1], "a_run_can_be_cancelled", json.dumps(after))
    waited = b.evaluate(ACT % "live.controls.duration.set(1, true);")
    holds(waited is not None, "and_the_next_one_runs", f"{waited} ms")


def see_names(b, folder):
    scene, page = pathlib.Path(folder, "hostile.yaml"), pathlib.Path(folder, "hostile.html")
    scene.write_text(HOSTILE)
    view(scene, page, "--live")
    opened(b, page)
    b.evaluate(ACT % (SLIDE % ("#parameters input[type=range]", 0.9)))
    seen = b.evaluate("[window.broken ?? null, document.title, document.querySelectorAll('img, b, textarea').length, document.querySelectorAll('script').length]")
    holds(seen[0] is None and seen[1].startswith("</script>") and seen[2] == 0 and seen[3] == 5, "names_of_a_scene_are_data", json.dumps(seen))
    policy = b.evaluate("document.querySelector('meta[http-equiv]').content")
    holds("'unsafe-eval'" not in policy.replace("'wasm-unsafe-eval'", "") and "'wasm-unsafe-eval'" in policy and "script-src 'sha256-" in policy and
          "'unsafe-inline'" not in policy.split("script-src")[1].split(";")[0], "the_policy_allows_webassembly_and_the_own_script_alone", policy)
    refused = b.call("Runtime.evaluate", expression="(() => { try { return eval('1') } catch (error) { return error.name } })()", returnByValue=True,
                     allowUnsafeEvalBlockedByCSP=False)["result"]["value"]
    b.events.clear()
    holds(refused == "EvalError", "eval_is_refused", str(refused))


# The time from a slider's event to the new motion in the page. The picture of it comes at the next frame of the browser, whose time is
# that of the graphics: here a renderer in software.
TIME = """(async () => {
    const live = window.kinetree_live, slider = document.querySelector('#precision input[type=range]'), take = live.take, all = [];
    for (let i = 0; i < %d; i++) {
        const taken = new Promise((done) => { live.take = (...words) => { take.apply(live, words); done(performance.now()); }; });
        const before = window.kinetree.motion, start = performance.now();
        slider.value = -6 + 0.01 * i; slider.dispatchEvent(new Event('input'));
        const end = await taken, frame = await new Promise((done) => requestAnimationFrame(() => done(performance.now())));
        all.push([window.kinetree.motion === before ? null : end - start, frame - start]);
        slider.dispatchEvent(new Event('change'));
        while (live.bench.is_busy || live.bench.next !== null)
            await new Promise((done) => setTimeout(done, 20));
    }
    live.take = take;
    return all;
})()"""
MOVES = 9


def see_speed(b, folder):
    """The motion of a small scene follows a slider at once. Other programs of the machine only lengthen a time: the shortest one counts."""
    for name in SMALL:
        page = pathlib.Path(folder, f"{name}.html")
        view(pathlib.Path(SCENES, f"{name}.yaml"), page, "--live")
        opened(b, page)
        moves = b.evaluate(TIME % MOVES)
        waits = [math.nan if waited is None else waited for waited, _ in moves]
        note(f"{name}: {' '.join(f'{waited:.0f}' for waited in waits)} ms from the slider to the motion, bound {NEWEST} ms for the least; "
             f"{' '.join(f'{frame:.0f}' for _, frame in moves)} ms to the next frame; {page.stat().st_size / 1e6:.2f} MB")
        claim(f"{name}_follows_a_slider_within_100_ms", [] if all(waited > 0 for waited in waits) and min(waits) <= NEWEST else [f"{min(waits):.0f} ms"])


def main():
    if browser.find() is None:
        skip("live_pages_run_in_a_browser", "there is no Chromium on this machine")
        finish()
    with tempfile.TemporaryDirectory() as folder:
        b = browser.Browser(1200, 800)
        try:
            see_sliders(b, folder)
            see_address(b, folder)
            see_warnings(b, folder)
            see_reduction(b, folder)
            see_drag(b, folder)
            see_faults(b, folder)
            see_cancel(b, folder)
            see_speed(b, folder)
            holds(not b.complaints(), "the_pages_are_silent_and_load_nothing", json.dumps(b.complaints()))
            see_names(b, folder)
        finally:
            b.close()
    finish()


main()
