"""plots KINETREE SUPPRESSIONS: plots show every value that there is, and report what they leave out.

Random own columns leave the domain of their formula; the records of the position say where, in Python.
"""
# SPDX-License-Identifier: Apache-2.0
import csv
import json
import math
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile
import zlib

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

KINETREE = sys.argv[1]
os.environ["LSAN_OPTIONS"] = f"print_suppressions=0:suppressions={sys.argv[2]}"
ARM = """kinetree: 1
name: swinging arm
gravity: [0, -9.81, 0]
bodies: [{{name: arm, joint: {{type: revolute, position: 0.5}}, mass: 1, shape: {{type: rod, to: [0, -1, 0]}}}}]
simulate: {{duration: 4, tolerance: 1e-8}}
output: {{columns: {columns}}}
"""


def unpacked(pdf):
    """The streams of a PDF: newer versions of cairo pack the list of pages."""
    text = b""
    for stream in re.findall(rb"stream\r?\n(.*?)endstream", pdf, flags=re.S):
        try:
            text += zlib.decompressobj().decompress(stream)
        except zlib.error:
            continue
    return text


def run(path, *words):
    return subprocess.run([KINETREE, *words], cwd=path, capture_output=True, text=True)


def strokes(svg):
    """Lines of curves: their colour, and the pieces of each."""
    found = []
    for element in re.findall(r"<path [^>]*>", svg):
        width = re.search(r'stroke-width[:=]"?1\.6', element)
        colour, shape = re.search(r'stroke[:=]"?(#[0-9a-f]{6})', element), re.search(r' d="([^"]*)"', element)
        if width and colour and shape:
            found.append((colour.group(1), shape.group(1).count("M")))
    return found


def pieces(values):
    """How many stretches of finite values there are."""
    return sum(math.isfinite(b) and not math.isfinite(a) for a, b in zip([math.nan, *values], values))


with tempfile.TemporaryDirectory() as folder:
    path = pathlib.Path(folder)
    wrong, total = [], 0
    for seed in range(10):
        r = random.Random(seed)
        c = r.uniform(-0.6, 0.6)
        formula, domain = r.choice([(f"sqrt(position.arm - {c:.4f})", lambda x: x >= round(c, 4)), (f"log({c:.4f} - position.arm)", lambda x: x < round(c, 4)),
                                    (f"acos(2*position.arm/{abs(c):.4f})", lambda x: abs(2 * x / round(abs(c), 4)) <= 1)])
        (path / "arm.yaml").write_text(ARM.format(columns=f'{{own: "{formula}", fine: "2*position.arm"}}'))
        ran = run(path, "run", "arm.yaml", "--out", "arm.csv", "--summary", "arm.json", "--plot", "arm.svg")
        text = (path / "arm.csv").read_text()
        rows = list(csv.DictReader(text.splitlines()))
        gaps = [float(row["time"]) for row in rows if not domain(float(row["position.arm"]))]
        total += len(gaps)
        summary = json.loads((path / "arm.json").read_text())
        told = [w for w in summary["warnings"] if w["code"] == "not_finite"]
        stated = summary["columns"]["own"].get("gaps", {"count": 0, "time": None})
        if "-nan" in text or stated["count"] != len(gaps) or stated["time"] != (gaps[0] if gaps else None) or len(told) != (len(gaps) > 0) \
                or (told and (told[0]["value"] != len(gaps) or told[0]["time"] != gaps[0] or "max(x, 0)" not in told[0]["remedy"])) \
                or ran.stderr.count("not finite") != len(told) or "rounding noise" in ran.stderr:
            wrong.append(f"seed {seed}, {formula}: {len(gaps)} gaps, {stated}, {told}, {ran.stderr}")
        drawn = run(path, "plot", "arm.csv", "--columns", "own", "--out", "own.svg")
        expected = pieces([float(row["own"]) for row in rows])
        lines = strokes((path / "own.svg").read_text()) if drawn.returncode == 0 and expected else []
        if expected and [m for _, m in lines] != [expected]:
            wrong.append(f"seed {seed}, {formula}: {expected} stretches, drawn {lines}")
    note(f"10 scenes with {total} gaps")
    claim("gaps_of_own_columns_are_counted_reported_and_drawn", wrong if total > 100 else [f"{total} gaps"])
    (path / "arm.yaml").write_text(ARM.format(columns='{never: "log(-1 - position.arm^2)", fine: "2*position.arm"}'))
    ran = run(path, "run", "arm.yaml", "--out", "arm.csv", "--plot", "arm.svg")
    claim("columns_without_a_finite_value_are_no_noise", [] if "since no value is finite: never" in ran.stderr and "rounding noise" not in ran.stderr
          and "1 without a finite value" in (path / "arm.svg").read_text() else [ran.stderr])

    # A sweep of n values of m: each has a curve, of a colour of its own, and a line of them is as its numbers say.
    (path / "sweep.yaml").write_text("""kinetree: 1
gravity: [0, -9.81, 0]
parameters: {L: 1, k: 1}
bodies: [{name: arm, joint: {type: revolute, position: 0.5}, mass: 1, shape: {type: rod, to: [0, =-L, 0]}}]
effects: [{type: joint_spring, joint: arm, stiffness: =k}]
simulate: {duration: 0.2}
""")
    missing = []
    for values in (3, 7, 8, 20, 60):
        run(path, "sweep", "sweep.yaml", "--vary", "L=0.5:2:5", "--vary", f"k=1:50:{values}", "--out", "s.csv", "--quiet")
        ran = run(path, "plot", "s.csv", "--columns", "position.arm.end", "--by", "k", "--out", "s.svg")
        svg = (path / "s.svg").read_text() if ran.returncode == 0 else ""
        curves = [element for element in re.findall(r"<path [^>]*>", svg) if re.search(r'stroke-width[:=]"?1\.3', element)]
        colours = {re.search(r'stroke[:=]"?(#[0-9a-f]{6})', element).group(1) for element in curves}
        legend = len(re.findall(r">k = ", svg))
        if len(curves) < values or len(colours) != values or " more" in svg or legend != (values if values <= 7 else 0):
            missing.append(f"{values} values: {len(curves)} curves of {len(colours)} colours, {legend} in the legend; {ran.stderr}")
    claim("plot_by_draws_a_curve_for_each_value", missing)
    run(path, "sweep", "sweep.yaml", "--vary", "L=1:2:1", "--out", "one.csv", "--quiet")
    run(path, "plot", "one.csv", "--columns", "position.arm.end", "--out", "one.svg")
    claim("one_run_is_no_runs", [] if ">1 run, 0 without a value<" in (path / "one.svg").read_text() else ["another subtitle"])
    run(path, "sweep", "sweep.yaml", "--vary", "L=0.5:2:2", "--vary", "k=1:50:201", "--out", "s.csv", "--quiet")
    ran = run(path, "plot", "s.csv", "--columns", "position.arm.end", "--by", "k", "--out", "many.svg")
    claim("more_values_than_colours_are_rejected", [] if ran.returncode == 1 and "'k' has 201 values" in ran.stderr and "--map L,k" in ran.stderr
          and not (path / "many.svg").exists() else [ran.stderr])

    # Several results: a panel for each column, a colour for each result.
    names = []
    for k in range(9):
        run(path, "run", "sweep.yaml", "--set", f"k={5 * k}", "--out", f"r{k}.csv", "--quiet")
        names.append(f"r{k}.csv")
    off = []
    for count in (2, 7, 9):
        ran = run(path, "plot", *names[:count], "--columns", "position,velocity", "--out", "r.svg")
        svg = (path / "r.svg").read_text() if ran.returncode == 0 else ""
        lines = strokes(svg)
        if len(lines) != 2 * count or len({colour for colour, _ in lines}) != count or f" of {count} results" not in svg or svg.count(">r0.csv<") != (2 if count <= 7 else 0):
            off.append(f"{count}: {lines} {ran.stderr}")
    claim("several_results_have_colours", off)

    # Pages: at most as high as a screen, or as given; PDF; the scene's name.
    (path / "arm.yaml").write_text(ARM.format(columns="{}"))
    high = []
    for record in ("position", "position,velocity,acceleration,energy", "position,velocity,acceleration,reaction,energy,momentum"):
        run(path, "run", "arm.yaml", "--record", record, "--out", "arm.csv", "--plot", "arm.svg", "--quiet")
        size = re.search(r'viewBox="0 0 ([0-9]+) ([0-9]+)"', (path / "arm.svg").read_text())
        if int(size.group(2)) > 1000:
            high.append(f"{record}: {size.group(0)}")
    claim("pages_fit_a_screen", high)
    ran = run(path, "plot", "arm.csv", "--columns", "position,velocity,acceleration,energy", "--size", "1234x567", "--out", "p.svg")
    svg = (path / "p.svg").read_text()
    claim("pages_have_the_size_that_is_given", [] if 'viewBox="0 0 1234 567"' in svg else [svg[:300]])
    close = []
    for size in ("300x300", "500x300", "900x600"):
        run(path, "plot", "arm.csv", "--columns", "position,energy", "--size", size, "--out", "small.svg")
        labels = re.findall(r'<text [^>]*x="([-0-9.]+)" y="([-0-9.]+)"[^>]*>([^<]*)</text>', (path / "small.svg").read_text())
        ticks = sorted((float(x), float(y)) for x, y, text in labels if re.fullmatch(r"\u2212?[0-9.]+", text))
        close += [f"{size}: {a} and {b}" for a in ticks for b in ticks if a < b and abs(a[1] - b[1]) < 12 and abs(a[0] - b[0]) < 12]
        note(f"{size}: {len(ticks)} labels of ticks")
        close += [f"{size}: no ticks"] if len(ticks) < 8 else []
    claim("labels_of_ticks_do_not_overlap_in_small_pictures", close)
    header, _, rest = (path / "arm.csv").read_text().partition("\n")
    (path / "quoted.csv").write_text(",".join(f'"{name}"' for name in header.split(",")) + "\n" + rest)
    (path / "arm.csv").rename(path / "plain.csv")
    (path / "quoted.csv").rename(path / "arm.csv")  # the picture has the name of the file
    run(path, "plot", "arm.csv", "--columns", "position,velocity,acceleration,energy", "--size", "1234x567", "--out", "q.svg")
    (path / "plain.csv").rename(path / "arm.csv")
    claim("names_of_columns_may_have_quotes", [] if (path / "q.svg").exists() and (path / "q.svg").read_text() == svg else ["another picture"])
    (path / "comma.csv").write_text('t,"a,b",c\n0,1,2\n1,2,3\n')
    ran = run(path, "plot", "comma.csv", "--columns", "d", "--out", "q.svg")
    claim("names_in_quotes_may_have_commas", [] if ran.returncode == 1 and "a,b" in ran.stderr and '"' not in ran.stderr else [ran.stderr])
    sizes = [run(path, "plot", "arm.csv", "--size", text, "--out", "q.svg") for text in ("12", "1200", "1200x800x", "1200x", "axb", "200x200", "99999x800")]
    claim("wrong_sizes_are_rejected", [s.stderr for s in sizes if s.returncode != 1 or "--size takes WIDTHxHEIGHT" not in s.stderr])
    for words in (["plot", "arm.csv", "--out", "p.pdf"], ["draw", "arm.yaml", "--out", "p.pdf"], ["run", "arm.yaml", "--out", "a.csv", "--plot", "p.pdf"]):
        run(path, *words)
        made = (path / "p.pdf").read_bytes() if (path / "p.pdf").exists() else b""
        claim(f"{words[0]}_writes_a_page_of_pdf", [] if made.startswith(b"%PDF-") and made.rstrip().endswith(b"%%EOF") and b"/Page" in made + unpacked(made) else [str(made[:20])])
        (path / "p.pdf").unlink(missing_ok=True)
    (path / "ball.yaml").write_text(ARM.format(columns="{}").replace("simulate:", "events: [{name: low, when: position.arm, then: record}]\nsimulate:"))
    run(path, "run", "ball.yaml", "--out", "ball.csv", "--summary", "ball.json", "--quiet")
    run(path, "plot", "ball.csv", "--marks", "ball.json", "--out", "ball.svg")
    claim("the_title_is_the_name_of_the_scene", [] if ">swinging arm<" in (path / "ball.svg").read_text() else ["another title"])

with tempfile.TemporaryDirectory() as folder:
    path = pathlib.Path(folder)
    (path / "arm.yaml").write_text(ARM.format(columns='{range: {value: "sin(position.arm)", unit: m}, speed: {value: velocity.arm, unit: m/s}, plain: "2*position.arm"}'))
    ran = run(path, "run", "arm.yaml", "--out", "arm.csv", "--plot", "run.svg", "--scene", "again.yaml", "--summary", "arm.json")
    header = (path / "arm.csv").read_text().splitlines()[0] if ran.returncode == 0 else ran.stderr
    run(path, "plot", "arm.csv", "--out", "plot.svg")
    seen = []
    for name in ("run.svg", "plot.svg"):
        svg = (path / name).read_text()
        seen += [f"{name}: no panel {title}" for title in (">range, m<", ">speed, m/s<") if title not in svg]
    seen += [] if ">Own columns<" in (path / "run.svg").read_text() else ["run.svg: the plain column has no panel"]
    units = {name: column["unit"] for name, column in json.loads((path / "arm.json").read_text())["columns"].items()}
    seen += [] if units.get("range") == "m" and units.get("plain") == "" else [str(units)]
    claim("own_columns_with_units_have_panels", seen)
    claim("records_have_the_units", [] if header.endswith(",range [m],speed [m/s],plain") else [header])
    run(path, "run", "again.yaml", "--out", "again.csv", "--quiet")
    claim("a_scene_that_is_written_keeps_them", [] if (path / "again.csv").exists() and (path / "again.csv").read_text().splitlines()[0] == header else ["another header"])
    wrong = []
    for columns, told in (('{a: {value: t, unit: "[m]"}}', "a unit: up to 24 letters"), ('{a: {unit: m}}', "a formula"), ('{a: {value: t, units: m}}', "no other key"), ('{a: {value: [1], unit: m}}', "a formula")):
        (path / "wrong.yaml").write_text(ARM.format(columns=columns))
        checked = run(path, "check", "wrong.yaml")
        if checked.returncode == 0 or told not in checked.stderr + checked.stdout:
            wrong.append(f"{columns}: {checked.stderr}{checked.stdout}")
    claim("wrong_units_are_rejected", wrong)

# A slider-crank whose friction stops it: the multiplier of the sticking slider is 1e-90 N. Two drives, of a force and of a torque.
CRANK = """kinetree: 1
bodies:
  - {name: crank, joint: {type: revolute, axis: z, velocity: 20}, mass: 10, inertia: [0.05, 0.05, 0.1], com: [0, 0, 0]}
  - {name: rod, parent: crank, joint: {type: revolute, axis: z, at: [0.1, 0, 0]}, mass: 1, shape: {type: rod, to: [0.3, 0, 0]}}
  - {name: slider, joint: {type: prismatic, axis: x, position: 0.4}, mass: 2, shape: {type: box, size: [0.1, 0.06, 0.06]}}
loops: [{name: wrist, type: revolute, between: [{body: rod, at: [0.3, 0, 0]}, slider], axis: z}]
initial: {hold: [crank]}
effects: [{name: rub, type: joint_friction, joint: slider, coulomb: 20, stick: true}]
simulate: {duration: 6}
output: {interval: 0.01, record: [position, reaction]}
"""
DRIVES = """kinetree: 1
bodies:
  - {name: slider, joint: {type: prismatic, axis: x}, mass: 2, shape: {type: box, size: [0.1, 0.06, 0.06]}}
  - {name: arm, joint: {type: revolute, axis: z}, mass: 1, shape: {type: rod, to: [0.3, 0, 0]}}
  - {name: twin, joint: {type: revolute, axis: z, at: [0, 2, 0]}, mass: 1, shape: {type: rod, to: [0.3, 0, 0]}}
loops:
  - {name: push, type: motion, joint: slider, position: "sin(3*t)"}
  - {name: turn, type: motion, joint: arm, position: "sin(2*t)"}
  - {name: gear, type: coupling, coefficients: {arm: 1, twin: -2}}
simulate: {duration: 1}
output: {interval: 0.01, record: [position, reaction]}
"""
with tempfile.TemporaryDirectory() as folder:
    path = pathlib.Path(folder)
    (path / "crank.yaml").write_text(CRANK)
    ran = run(path, "run", "crank.yaml", "--out", "crank.csv", "--plot", "crank.svg", "--summary", "crank.json")
    svg = (path / "crank.svg").read_text() if ran.returncode == 0 else ""
    size = max(abs(float(row["reaction.rub.stick.multiplier"])) for row in csv.DictReader(open(path / "crank.csv")))
    note(f"the largest multiplier of the slider is {size:g} N")
    unit = json.loads((path / "crank.json").read_text())["columns"]["reaction.rub.stick.multiplier"]["unit"]
    claim("multipliers_of_rounding_noise_have_no_panel", [] if svg and "Multipliers" not in svg and size < 1e-12 else ["a panel"])
    claim("a_slider_that_sticks_has_a_force", [] if unit == "N" else [unit])
    (path / "drives.yaml").write_text(DRIVES)
    ran = run(path, "run", "drives.yaml", "--out", "drives.csv", "--plot", "drives.svg", "--summary", "drives.json")
    svg = (path / "drives.svg").read_text() if ran.returncode == 0 else ran.stderr
    units = {name.split(".")[1]: column["unit"] for name, column in json.loads((path / "drives.json").read_text())["columns"].items() if "multiplier" in name}
    claim("forces_and_torques_of_drives_have_panels", [title for title in (">Multipliers: forces, N<", ">Multipliers: torques, N m<") if title not in svg])
    claim("multipliers_have_the_unit_of_their_equation", [] if units == {"push": "N", "turn": "N m", "gear": "N m"} else [str(units)])

# Names of events are along their lines, from the top down, and lines that have a name are 12 units apart.
with tempfile.TemporaryDirectory() as folder:
    path = pathlib.Path(folder)
    (path / "often.yaml").write_text(ARM.format(columns="{}").replace("simulate:", "events: [{name: low, when: position.arm, then: record}]\nsimulate:").replace("duration: 4", "duration: 12"))
    run(path, "run", "often.yaml", "--out", "often.csv", "--plot", "often.svg", "--quiet")
    names = [element for element in re.findall(r"<text [^>]*>", (path / "often.svg").read_text().replace(">low<", " name='low'><")) if "name='low'" in element]
    places = [float(re.search(r' x="([^"]*)"', element).group(1)) for element in names]
    flat = [element for element in names if not re.search(r'transform="rotate\(-90 [0-9.]+ [0-9.]+\)"', element)]
    close = [f"{a} and {b}" for a, b in zip(places, places[1:]) if b - a < 12]
    note(f"{len(names)} names, at least {min((b - a for a, b in zip(places, places[1:])), default=math.nan):.3g} apart")
    claim("names_of_events_do_not_overlap", [*flat, *close] if len(names) > 5 else [f"{len(names)} names"])


def mean_square(times, values):
    """The mean over the pieces without a gap, by the trapezoidal rule; None of single values."""
    covered = total = 0.0
    for (s, x), (t, y) in zip(zip(times, values), zip(times[1:], values[1:])):
        if math.isfinite(x) and math.isfinite(y):
            covered, total = covered + t - s, total + 0.5 * (t - s) * (x * x + y * y)
    return total / covered if covered > 0 else None


with tempfile.TemporaryDirectory() as folder:
    path, wrong, worst, count, bridged = pathlib.Path(folder), [], 0.0, 0, 0.0
    for seed in range(10):
        r = random.Random(seed)
        c = r.uniform(-0.4, 0.4)
        (path / "arm.yaml").write_text(ARM.format(columns=f'{{own: "3 + sqrt(position.arm - {c:.4f})"}}'))
        run(path, "run", "arm.yaml", "--out", "arm.csv", "--summary", "arm.json", "--quiet")
        run(path, "sweep", "arm.yaml", "--vary", "bodies.arm.mass=1,1", "--columns", "own", "--functionals", "rms,mean,integral", "--out", "s.csv")
        with (path / "arm.csv").open(newline="") as file:
            rows = list(csv.DictReader(file))
        times, own = [float(row["time"]) for row in rows], [float(row["own"]) for row in rows]
        expected = mean_square(times, own)
        found = json.loads((path / "arm.json").read_text())["columns"]["own"]["rms"]
        if expected is None:
            continue
        with (path / "s.csv").open(newline="") as file:
            swept = [float(row["own.rms"]) for row in csv.DictReader(file)]
        wrong += [] if len(swept) == 2 and all(abs(x - math.sqrt(expected)) < 1e-9 for x in swept) else [f"seed {seed}: sweep {swept}, {math.sqrt(expected)}"]
        count += 1
        worst = max(worst, abs(found - math.sqrt(expected)))
        kept = [(t, x) for t, x in zip(times, own) if math.isfinite(x)]
        bridged = max(bridged, abs(math.sqrt(expected) - math.sqrt(mean_square([t for t, _ in kept], [x for _, x in kept]))))
    note(f"{count} columns with gaps: rms off by {worst:.1e} of 1e-9; over bridged gaps it would be off by up to {bridged:.2g}")
    claim("root_mean_squares_do_not_bridge_gaps", wrong if worst < 1e-9 and count > 5 and bridged > 1e-3 else [*wrong, f"{worst}, {count}, {bridged}"])

with tempfile.TemporaryDirectory() as folder:
    path, faults = pathlib.Path(folder), []
    (path / "arm.yaml").write_text(ARM.format(columns="{}").replace("output: {columns: {}}\n", ""))
    for words, title in ((["--out", "arm.csv"], "arm"), (["--out", "arm.csv", "--summary", "arm.json"], "swinging arm"),
                         (["--out", "arm.csv", "--duration", "3"], "arm"), (["--out", "far.csv", "--summary", "x.json"], None)):
        ran = run(path, "run", "arm.yaml", *words, "--quiet")
        run(path, "plot", "arm.csv", "--out", "p.svg")
        texts = re.findall(r"<text[^>]*>(?:<tspan[^>]*>)?([^<]*)", (path / "p.svg").read_text())
        if title is not None and texts[0] != title:
            faults.append(f"{words}: the title is {texts[:1]}, not {title}; {ran.stderr[:100]}")
    claim("a_plot_has_the_name_of_the_scene_where_the_summary_beside_it_is_that_of_the_run", faults)

with tempfile.TemporaryDirectory() as folder:
    path, faults = pathlib.Path(folder), []
    long = "the_link_of_a_pendulum_that_hangs_below_a_very_long_name"
    (path / "arm.yaml").write_text(ARM.format(columns="{near: {value: 84.0314 + 1e-9*position.arm, unit: N}, far: {value: -1e9 - position.arm, unit: kg}}").replace("arm", long)
                                   + f"events: [{{name: {'passes the vertical for the first time ' * 3}, when: position.{long}, then: record, limit: 1}}]\n")
    run(path, "run", "arm.yaml", "--out", "arm.csv", "--summary", "arm.json", "--quiet")
    told = run(path, "plot", "arm.csv", "--columns", "near,far,energy.total", "--marks", "arm.json", "--out", "p.svg").stderr
    drawn = re.findall(r"<text ([^>]*)>(?:<tspan[^>]*>)?([^<]*)", (path / "p.svg").read_text())
    ticks = [text for attributes, text in drawn if 'text-anchor="end"' in attributes and "rotate" not in attributes]
    faults += [f"the label '{text}' has {len(text)} characters" for text in ticks if len(text) > 8]
    faults += [] if len(ticks) > 9 and any("\u2212 84.031" in text for _, text in drawn) and any(re.search(r"\+ 1000000", text) for _, text in drawn) else [f"{drawn}, {told}"]
    names = [text for attributes, text in drawn if "rotate" in attributes]
    faults += [] if names and all("\u2026" in text and len(text) < 60 for text in names) else [f"names of events: {names}"]
    run(path, "sweep", "arm.yaml", "--vary", f"bodies.{long}.mass=1,2,3", "--vary", f"bodies.{long}.joint.position=0.1:0.4:4", "--out", "s.csv", "--quiet")
    run(path, "plot", "s.csv", "--x", f"bodies.{long}.joint.position", "--by", f"bodies.{long}.mass", "--columns", "energy.total.max", "--out", "s.svg")
    legend = [text for _, text in re.findall(r"<text ([^>]*)>(?:<tspan[^>]*>)?([^<]*)", (path / "s.svg").read_text()) if "\u2026" in text]
    faults += [] if [text[-3:] for text in legend] == ["= 1", "= 2", "= 3"] else [f"legend: {legend}"]
    claim("no_label_of_a_plot_is_cut_where_it_differs_from_others", faults)

# Units of a sweep: of results by their kinds, and of values that vary by their places in the scene.
with tempfile.TemporaryDirectory() as folder:
    path, faults = pathlib.Path(folder), []
    (path / "arm.yaml").write_text("""kinetree: 1
gravity: [0, -9.81, 0]
parameters: {L: 1}
bodies: [{name: arm, joint: {type: revolute, position: 0.5}, mass: 1, com: [0, -0.5, 0], shape: {type: rod, to: [0, =-L, 0], radius: 0.05}}]
loops: [{name: rope, type: distance, between: [{body: world, at: [0, 1, 0]}, {body: arm, at: [0, -1, 0]}], length: 3, slack: true}]
effects: [{name: spring, type: joint_spring, joint: arm, stiffness: 10, rest: 0.2}, {name: pull, type: spring, between: [world, arm], stiffness: 1, length: 0.1}]
simulate: {duration: 0.2}
""")
    for name, values, unit in (("bodies.arm.mass", "1,2", ", kg"), ("bodies.arm.com[1]", "-0.4,-0.5", ", m"), ("bodies.arm.joint.position", "0.1,0.2", ", rad or m"),
                               ("bodies.arm.shape.radius", "0.04,0.05", ", m"), ("gravity[1]", "-9,-8", ", m/s²"), ("simulate.duration", "0.1,0.2", ", s"),
                               ("effects.spring.rest", "0.1,0.2", ", rad or m"), ("effects.spring.stiffness", "9,8", ""), ("L", "1,1.1", "")):
        run(path, "sweep", "arm.yaml", "--vary", f"{name}={values}", "--vary", "bodies.arm.joint.velocity=0,1", "--columns", "position.arm", "--functionals", "integral,rms",
            "--out", "s.csv", "--quiet")
        for words, expected in ((["--x", name], [name + unit, "position.arm.rms, rad or m", "position.arm.integral, (rad or m) s"]),
                                (["--map", f"{name},bodies.arm.joint.velocity"], [name + unit, "bodies.arm.joint.velocity, rad/s or m/s", "position.arm.rms", "rad or m", "(rad or m) s"])):
            told = run(path, "plot", "s.csv", *words, "--out", "s.svg").stderr
            drawn = re.findall(r"<text [^>]*>(?:<tspan[^>]*>)?([^<]*)", (path / "s.svg").read_text()) if (path / "s.svg").exists() else []
            faults += [f"{name}, {words[0]}: no '{text}' among {drawn}; {told}" for text in expected if text not in drawn]
            (path / "s.svg").unlink(missing_ok=True)
    claim("sweeps_and_maps_have_units", faults)

with tempfile.TemporaryDirectory() as folder:
    path = pathlib.Path(folder)
    rows = ["time,a,b,note,status", "0,1,2,one,0", '1,oops,3,two,"a, b"', "2,3,,one,0", "3,4,x y,two,0", "4,5,z,one,0"]
    (path / "words.csv").write_text("\n".join(rows) + "\n")
    done = run(path, "plot", "words.csv", "--out", "words.svg")
    told = [line for line in done.stderr.splitlines() if "warning" in line]
    expected = ["kinetree: words.csv:3: warning: 'oops' in column 'a' is not a number and counts as an empty cell (1 cell in all)",
                "kinetree: words.csv:5: warning: 'x y' in column 'b' is not a number and counts as an empty cell (2 cells in all)"]
    claim("words_among_numbers_are_reported", [] if done.returncode == 0 and told == expected else [done.stderr])
finish()
