"""view KINETREE SCENES: the frames in a view are the motion of its records.

The page's JSON and base64 are read back; poses are held against markers in the CSV file, which come from the library's own kinematics, and
columns and forces against its columns.
"""
# SPDX-License-Identifier: Apache-2.0
import base64
import csv
import json
import math
import os
import pathlib
import random
import re
import struct
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

KINETREE, SCENES = sys.argv[1:]
os.environ["LSAN_OPTIONS"] = f"print_suppressions=0:suppressions={pathlib.Path(__file__).resolve().with_name('suppressions.txt')}"  # of pictures


def kinetree(*words, folder, text=None):
    return subprocess.run([KINETREE, *words], cwd=folder, input=text, capture_output=True, text=True)


def read_view(path):
    """The description and the blocks of frames, by name."""
    text = pathlib.Path(path).read_text()
    data = json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.S)[1])
    raw = base64.b64decode(re.search(r'<script type="text/plain" id="motion">(.*?)</script>', text, re.S)[1])
    frames, bodies, at, blocks = data["frames"], len(data["bodies"]) - 1, 0, {}
    for name, kind, width in (("times", "d", 1), ("places", "f", 3 * bodies), ("turns", "h", 4 * bodies), ("values", "f", len(data["columns"])),
                              ("forces", "f", 3 * len(data["arrows"]))):
        size = struct.calcsize(kind) * width
        blocks[name] = [struct.unpack(f"<{width}{kind}", raw[at + i * size:at + (i + 1) * size]) for i in range(frames)]
        at += frames * size
    return data, blocks, len(raw) - at


def turned(q, u):
    w, x, y, z = q
    a = [y * u[2] - z * u[1] + w * u[0], z * u[0] - x * u[2] + w * u[1], x * u[1] - y * u[0] + w * u[2]]
    return [u[0] + 2 * (y * a[2] - z * a[1]), u[1] + 2 * (z * a[0] - x * a[2]), u[2] + 2 * (x * a[1] - y * a[0])]


def marker_of(data, blocks, frame, marker):
    """Where a marker is, from the pose of its body."""
    b = marker["body"] - 1
    q = [x / 32767 for x in blocks["turns"][frame][4 * b:4 * b + 4]]
    norm = math.sqrt(sum(x * x for x in q))
    place = blocks["places"][frame][3 * b:3 * b + 3]
    return [p + c + u for p, c, u in zip(place, data["centre"], turned([x / norm for x in q], marker["at"]))]


TETRAHEDRON = [(0.5, 0.25, 1.0), (2.5, 0.25, 1.0), (0.5, 3.25, 1.0), (0.5, 0.25, 5.0)]


def check_mesh(folder):
    """Points of a mesh: shares of the box, which they fill; in the body they are those of the file, to a unit of 1/32767 of it. Normals are unit
    vectors once they are divided by the box, along the areas."""
    (pathlib.Path(folder) / "t.obj").write_text("".join(f"v {x} {y} {z}\n" for x, y, z in TETRAHEDRON) + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    scene = "kinetree: 1\nbodies: [{name: a, mass: 1, inertia: [1, 1, 1], joint: {type: revolute}}]\nmeshes: [{body: a, file: t.obj, scale: [2, 1, 1]}]\n"
    (pathlib.Path(folder) / "m.yaml").write_text(scene + "simulate: {duration: 0.1}\n")
    run = kinetree("view", "m.yaml", "--view", "m.html", "--quiet", folder=folder)
    if run.returncode != 0:
        return [run.stderr]
    data, _, rest = read_view(pathlib.Path(folder) / "m.html")
    solids = [solid for solid in data["solids"] if "points" in solid]
    if len(solids) != 1 or solids[0]["points"] != 12 or rest not in (144, 145, 146):
        return [f"{len(solids)} meshes, {rest} bytes"]
    text = (pathlib.Path(folder) / "m.html").read_text()
    raw = base64.b64decode(re.search(r'<script type="text/plain" id="motion">(.*?)</script>', text, re.S)[1])
    at, half, faults = len(raw) - rest, solids[0]["half"], []
    corners = []
    for k in range(12):
        numbers = struct.unpack_from("<6h", raw, at + 12 * k)
        corners.append(tuple(c + h * n / 32767 for c, h, n in zip(solids[0]["at"], half, numbers[:3])))
        length = math.sqrt(sum((n / 32767) ** 2 for n in numbers[3:]))
        faults += [] if abs(length - 1) < 1e-4 else [f"a normal has the length {length}"]
    wanted = [tuple(s * x for s, x in zip((2, 1, 1), p)) for p in TETRAHEDRON]
    for corner in corners:
        nearest = min(max(abs(a - b) for a, b in zip(corner, p)) for p in wanted)
        faults += [] if nearest < 4.0 / 32767 else [f"{corner} is no corner"]
    for k in range(0, 12, 3):
        a, b, c = corners[k:k + 3]
        u, v = [y - x for x, y in zip(a, b)], [y - x for x, y in zip(a, c)]
        area = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
        n = [x / 32767 / h for x, h in zip(struct.unpack_from("<6h", raw, at + 12 * k)[3:], half)]
        cosine = sum(x * y for x, y in zip(area, n)) / math.hypot(*area) / math.hypot(*n)
        faults += [] if abs(cosine - 1) < 1e-3 else [f"a normal is inclined: {cosine}"]
    return faults


def check_scene(name, folder):
    """Bounds: half a unit of 1/32767 in each of four components of a quaternion turns a lever by 2 * 1/32767 of it; a place has 2^-24 of its size."""
    markers = ",".join(f"{body}.{marker}" for body, marker in re.findall(r"\[?([\w-]+)\.([\w-]+)", re.search(r"^  markers: \[(.*?)\]", pathlib.Path(
        f"{SCENES}/{name}.yaml").read_text(), re.M)[1]))
    run = kinetree("run", f"{SCENES}/{name}.yaml", "--record", "position,energy,reaction", "--markers", markers, "--out", "r.csv", "--view", "r.html", "--quiet",
                   folder=folder)
    if run.returncode != 0:
        return [run.stderr]
    with open(f"{folder}/r.csv", newline="", encoding="utf-8") as file:
        header, *rows = list(csv.reader(file))
    data, blocks, rest = read_view(f"{folder}/r.html")
    table = {column: [float(row[i]) for row in rows] for i, column in enumerate(header)}
    faults = [] if len(rows) == data["frames"] and 0 <= rest < 3 else [f"{len(rows)} records, {data['frames']} frames, {rest} bytes too many"]
    faults += [] if [t[0] for t in blocks["times"]] == table["time"] else ["times differ"]
    worst = 0.0
    for marker in (m for m in data["markers"] if m["traced"]):
        column = f"marker.{data['bodies'][marker['body']]['name']}.{marker['name']}"
        lever = math.hypot(*marker["at"])
        for i in range(0, len(rows), 7):
            found, wanted = marker_of(data, blocks, i, marker), [table[f"{column}.{k}"][i] for k in "xyz"]
            bound = 2 * lever / 32767 + sum(abs(w - c) + abs(c) * 1e-8 for w, c in zip(wanted, data["centre"])) * 2**-23 + 1e-12
            worst = max(worst, math.dist(found, wanted) / bound)
    note(f"{name}: farthest marker, over its bound: {worst:.2g}")
    faults += [] if 0 < worst < 1 else [f"a marker is {worst:.3g} times its bound away"]
    for k, column in enumerate(data["columns"]):
        if column["name"] in table:
            pairs = ((blocks["values"][i][k], table[column["name"]][i]) for i in range(len(rows)))
            faults += [f"{column['name']} differs" for _ in [0] if any(struct.pack("<f", a) != struct.pack("<f", b) for a, b in pairs)]
        elif column["group"] != "Change of the energy":
            faults.append(f"{column['name']} is no column")
    names = [j["name"] for j in data["joints"] if j["type"] != "free"] + [loop["name"] for loop in data["loops"]]
    for k, joint in enumerate(names):
        for i in range(0, len(rows), 7):
            wanted = [table[f"reaction.{joint}.f{x}"][i] for x in "xyz"]
            if struct.pack("<3f", *blocks["forces"][i][3 * k:3 * k + 3]) != struct.pack("<3f", *wanted):
                faults.append(f"force of {joint} differs at record {i}")
                break
    jumps = sum(1 for i in range(1, len(rows)) for b in range(len(data["bodies"]) - 1)
                if sum(x * y for x, y in zip(blocks["turns"][i][4 * b:4 * b + 4], blocks["turns"][i - 1][4 * b:4 * b + 4])) < 0)
    return faults + ([f"{jumps} quaternions change their sign"] if jumps else [])


def check_thinning(folder):
    """What would be too large is thinned, and said: on standard error, on the page and in the summary."""
    scene = kinetree("make", "chain", "--links", "1000", folder=folder).stdout
    run = kinetree("run", "-", "--duration", "3", "--step", "1e-3", "--integrator", "rk4", "--interval", "1e-3", "--record", "energy", "--out", "/dev/null", "--view",
                   "long.html", "--summary", "long.json", folder=folder, text=scene)
    faults = [] if run.returncode == 0 else [run.stderr]
    size = (pathlib.Path(folder) / "long.html").stat().st_size
    head = (pathlib.Path(folder) / "long.html").read_text()[:2_000_000]
    frames, codes = int(re.search(r'"frames":(\d+)', head)[1]), [w["code"] for w in json.loads((pathlib.Path(folder) / "long.json").read_text())["warnings"]]
    note(f"a thousand bodies, 3001 records: {frames} frames, {size} bytes")
    faults += [] if frames == 1501 and size < 70e6 else [f"{frames} frames, {size} bytes"]
    faults += [] if f"it has {size / 1e6:.3g} MB; a longer --interval makes it smaller" in run.stderr else [f"size not said: {run.stderr}"]
    faults += [] if "thinned_view" in codes and "one record in 2" in run.stderr and "one record in 2" in head else [f"not said: {codes}, {run.stderr}"]
    return faults


def check_fast(folder):
    """A rotation that is too fast for the frames is said."""
    words = ("view", f"{SCENES}/landing-gear.yaml", "--interval", "0.05", "--duration", "0.5", "--summary", "fast.json", "--quiet")
    kinetree(*words, folder=folder)
    warnings = json.loads((pathlib.Path(folder) / "fast.json").read_text())["warnings"]
    found = [w for w in warnings if w["code"] == "fast_rotation"]
    return [] if len(found) == 1 and "'wheel'" in found[0]["what"] and abs(found[0]["value"] - 120) < 5 else [f"{warnings}"]


# The rocker is driven out of the reach of crank and coupler, 3 m, at t = 0.47 s: |(2.5 + 1.5 cos a, 1.5 sin a)| = 3, cos a = 1 / 15,
# a = pi / 2 - 0.3 t^2.
OUT_OF_REACH = """kinetree: 1
name: out of reach
bodies:
  - name: crank
    joint: {type: revolute, axis: z, position: 60 deg}
    mass: 1
    shape: {type: rod, to: [1, 0, 0]}
  - name: coupler
    parent: crank
    joint: {type: revolute, axis: z, at: [1, 0, 0], position: -50 deg}
    mass: 2
    shape: {type: rod, to: [2, 0, 0]}
    markers: {tip: [2, 0, 0]}
  - name: rocker
    joint: {type: revolute, axis: z, at: [2.5, 0, 0], position: 90 deg}
    mass: 1
    shape: {type: rod, to: [1.5, 0, 0]}
    markers: {tip: [1.5, 0, 0]}
loops:
  - {name: close, type: revolute, between: [coupler.tip, rocker.tip]}
  - {name: drive, type: motion, joint: rocker, position: {polynomial: [1.5707963267948966, 0, -0.3]}}
initial: {hold: [rocker]}
simulate: {duration: 5, integrator: dop853, tolerance: 1e-9}
"""


BALL = """kinetree: 1
name: ball on a plane and a spring
gravity: [0, 0, -9.81]
bodies:
  - name: ball
    joint: {type: free, position: {position: [0.1, 0, 0.3]}}
    mass: 0.5
    shape: {type: sphere, radius: 0.1}
    markers: {centre: [0, 0, 0]}
effects:
  - {type: spring, between: [ball.centre, world], stiffness: 8, length: 1}
  - {type: contact, point: ball.centre, radius: 0.1, plane: world, stiffness: 1e4, exponent: 1.5}
simulate: {duration: 1, integrator: dop853, tolerance: 1e-9}
output: {interval: 0.002}
"""


def check_effects(folder):
    """--out names the page. Forces of a spring and a contact against their formulas at the places of the frames. These are exact to 2^-25 m (floats
    up to 0.5 m), which the contact's stiffness, at most 1e4 * 1.5 * sqrt(0.1) N/m, turns into 1.4e-4 N."""
    run = kinetree("view", "-", "--out", "ball.html", "--quiet", folder=folder, text=BALL)
    data, blocks, _ = read_view(f"{folder}/ball.html")
    kinds = [(arrow["source"], data["effects"][arrow["effect"]]["type"]) for arrow in data["arrows"] if "effect" in arrow]
    worst, deepest, first = 0.0, 0.0, 3 * [arrow["source"] for arrow in data["arrows"]].index("effect")
    for i in range(data["frames"]):
        p = [a + b for a, b in zip(blocks["places"][i][:3], data["centre"])]
        length, depth = math.hypot(*p), max(0.1 - p[2], 0.0)
        wanted = [-8 * (length - 1) / length * x for x in p] + [0, 0, 1e4 * depth**1.5]
        worst = max(worst, math.dist(blocks["forces"][i][first:first + 6], wanted))
        deepest = max(deepest, depth)
    note(f"farthest from the formulas, N: {worst:.2g}; deepest contact: {deepest:.2g} m")
    faults = [] if run.returncode == 0 and kinds == [("effect", "spring"), ("contact", "contact")] else [f"{run.stderr}, {kinds}"]
    return faults + ([] if worst < 1.4e-4 and 0.001 < deepest < 0.1 else [f"{worst} N off, {deepest} m deep"])


def gap_of(data, blocks, frame):
    """How far the two ends of the first loop are apart."""
    ends = [marker_of(data, blocks, frame, end) for end in data["loops"][0]["ends"]]
    return math.dist(*ends)


def check_failure(folder):
    """The last state of a run that fails, with what its error names."""
    run = kinetree("view", "-", "--view", "fail.html", "--quiet", folder=folder, text=OUT_OF_REACH)
    data, blocks, _ = read_view(f"{folder}/fail.html")
    failed, last = data.get("failed", {}), blocks["times"][-1][0]
    wanted = math.sqrt((math.pi / 2 - math.acos(1 / 15)) / 0.3)
    note(f"ends at t = {last:.6f} s; the reach at t = {wanted:.6f} s; gap {gap_of(data, blocks, -1):.2g} m")
    faults = [] if run.returncode == 3 else [f"status {run.returncode}"]
    faults += [] if wanted - 0.005 < last < wanted + 1e-6 and gap_of(data, blocks, -1) < 1e-4 else [f"the last frame is at {last}"]
    names = [[data["bodies"][b]["name"] for b in failed.get("bodies", [])], [data["loops"][i]["name"] for i in failed.get("loops", [])]]
    return faults + ([] if names == [["rocker"], ["close"]] and "'close'" in failed["message"] else [f"marked: {names}"])


def check_start(folder):
    """The positions that the scene gives, and those that assembly finds, or reaches."""
    faults = []
    for name, scene, status, gaps in (("closed", OUT_OF_REACH, 0, (0.05, 1e-4)), ("open", OUT_OF_REACH.replace("[1.5, 0, 0]", "[0.1, 0, 0]").replace("[2.5, 0", "[9, 0"), 3,
                                                                              (6, 6.5))):
        (pathlib.Path(folder) / f"{name}.yaml").write_text(scene)
        run = kinetree("check", f"{name}.yaml", "--view", f"{name}.html", folder=folder)
        data, blocks, _ = read_view(f"{folder}/{name}.html")
        found = [gap_of(data, blocks, frame) for frame in (0, 1)]
        note(f"{name}: gap of the given and the assembled positions: {found[0]:.3g}, {found[1]:.3g} m")
        if run.returncode != status or data["frames"] != 2 or data["overlay"] is not True or ("failed" in data) != (status != 0):
            faults.append(f"{name}: status {run.returncode}, {data['frames']} frames, failed: {data.get('failed')}")
        if not (found[0] > gaps[0] and found[1] < gaps[1]):
            faults.append(f"{name}: gaps {found}")
    return faults


def check_bounces(folder):
    """A ball that falls 1 m and bounces with 1/2: impacts after 1, 2, 2.5, 2.75 ... times sqrt(2 / g), until a bounce is lower than ten tolerances. Marks add no rows and move no bit."""
    pathlib.Path(f"{folder}/ball.yaml").write_text("""kinetree: 1
gravity: [0, 0, -9.81]
bodies: [{name: a, joint: {type: prismatic, axis: z, position: 1}, mass: 1}]
effects: [{type: joint_limit, joint: a, lower: 0, restitution: 0.5}]
simulate: {duration: 2, tolerance: 1e-12}
output: {interval: 0.1, record: [position, velocity, balance, reaction]}
""")
    plain = kinetree("run", "ball.yaml", "--out", "plain.csv", "--quiet", folder=folder)
    run = kinetree("run", "ball.yaml", "--view", "b.html", "--plot", "b.svg", "--out", "marked.csv", "--quiet", folder=folder)
    if plain.returncode != 0 or run.returncode != 0:
        return [plain.stderr + run.stderr]
    marks, fall = read_view(f"{folder}/b.html")[0]["marks"], (2 / 9.81) ** 0.5
    expected = [fall * (3 - 2 * 0.5**k) for k in range(len(marks) - 1)]
    worst = max(abs(m["time"] - t) for m, t in zip(marks, expected))
    note(f"{len(marks)} marks, {worst:.3g} s from the closed form, bound 6e-9: nine digits are written")
    rows = [pathlib.Path(f"{folder}/{name}.csv").read_bytes() for name in ("plain", "marked")]
    good = len(marks) == 19 and worst < 6e-9 and {m["name"] for m in marks} == {"a.lower"}
    return ([] if good else [f"marks are {marks}"]) + ([] if rows[0] == rows[1] else ["marks have changed the records"])


def check_ropes(folder):
    """The lengths of a rope: one number, or one for each frame. Loops that cannot sag have none."""
    faults = []
    for slack, length in ((True, "1.25"), (True, "1 + 0.25*t"), (False, "1.25")):
        pathlib.Path(f"{folder}/rope.yaml").write_text(f"""kinetree: 1
bodies: [{{name: a, joint: {{type: prismatic, position: 1}}, mass: 1}}]
loops: [{{name: rope, type: distance, between: [world, a], length: "{length}"{', slack: true, restitution: 0' if slack else ''}}}]
initial: {{hold: []}}
simulate: {{duration: 1}}
output: {{interval: 0.25}}
""")
        run = kinetree("run", "rope.yaml", "--view", "rope.html", "--out", "rope.csv", "--quiet", folder=folder)
        if run.returncode != 0:
            return [run.stderr]
        data, expected = read_view(f"{folder}/rope.html")[0], [] if not slack else [1.25] if length == "1.25" else [1, 1.0625, 1.125, 1.1875, 1.25]
        found = data["loops"][0].get("rope", [])
        if len(found) != len(expected) or any(abs(a - b) > 1e-8 for a, b in zip(found, expected)):
            faults.append(f"{slack}, {length}: {found}, expected {expected}")
    return faults


def check_marks(folder):
    """x = 1 - t of a slider at -1 m/s: it is at 0.6 after 0.4 s, and two rows of one event are one mark."""
    pathlib.Path(f"{folder}/marks.yaml").write_text("""kinetree: 1
parameters: {k: 0}
bodies: [{name: a, joint: {type: prismatic, position: 1, velocity: -1}, mass: 1}]
effects: [{type: expression, joint: a, force: k}]
events: [{name: push, when: position.a - 0.6, then: {set: {k: 1}}, limit: 1}]
simulate: {duration: 10, until: t > 0.8}
""")
    run = kinetree("run", "marks.yaml", "--view", "m.html", "--plot", "m.svg", "--out", "/dev/null", "--quiet", folder=folder)
    if run.returncode != 0:
        return [run.stderr]
    marks = read_view(f"{folder}/m.html")[0]["marks"]
    good = [m["name"] for m in marks] == ["push", "until"] and all(abs(m["time"] - t) < 1e-9 for m, t in zip(marks, (0.4, 0.8)))
    bounces = check_bounces(folder)
    if bounces:
        return bounces
    lines = pathlib.Path(f"{folder}/m.svg").read_text().count("stroke-dasharray")
    note(f"lines of events in the plot: {lines}")
    return ([] if good else [f"marks are {marks}"]) + ([] if lines >= 4 else [f"the plot has {lines} lines of events in two panels"])


def check_released(folder):
    """Times at which loops and effects are released and engaged: the first frames behind the events, in random scenes."""
    faults = []
    for seed in range(4):
        r = random.Random(seed)
        cut, caught, gust = r.uniform(0.1, 0.5), r.uniform(0.6, 0.9), r.uniform(0.1, 0.9)
        scene = f"""kinetree: 1
bodies:
  - {{name: a, joint: {{type: free}}, mass: 1, inertia: [1, 1, 1], markers: {{m: [0, 0, 0]}}}}
  - {{name: b, joint: {{type: free, position: {{position: [1, 0, 0]}}}}, mass: 1, inertia: [1, 1, 1], markers: {{m: [0, 0, 0]}}}}
loops:
  - {{name: rod, type: distance, between: [a.m, b.m], length: 1}}
  - {{name: string, type: distance, slack: true, between: [a.m, b.m], length: 1}}
effects: [{{name: spring, type: spring, between: [a.m, b.m], stiffness: 1, length: 1, switched: off}}]
events:
  - {{name: cut, when: t - {cut:.5f}, then: {{release: rod}}}}
  - {{name: torn, when: t - {cut:.5f}, then: {{release: string}}}}
  - {{name: caught, when: t - {caught:.5f}, then: {{engage: rod}}}}
  - {{name: gust, when: t - {gust:.5f}, then: {{engage: spring}}}}
simulate: {{duration: 1}}
"""
        (pathlib.Path(folder) / "r.yaml").write_text(scene)
        ran = kinetree("view", "r.yaml", "--view", "r.html", "--interval", "0.01", "--quiet", folder=folder)
        if ran.returncode != 0:
            faults.append(ran.stderr)
            continue
        data, _, _ = read_view(pathlib.Path(folder) / "r.html")
        expected = {"rod": [cut, caught], "string": [cut], "spring": [0, gust]}
        for one in data["loops"] + data["effects"]:
            times, events = one.get("released", []), expected[one["name"]]
            if len(times) != len(events) or any(not 0 <= t - e <= 0.01 + 1e-6 for t, e in zip(times, events)):
                faults.append(f"seed {seed}: {one['name']} released at {times}, events {events}")
    return faults


def main():
    with tempfile.TemporaryDirectory() as folder:
        for name in ("four-bar", "landing-gear", "bead", "stewart"):
            claim(f"frames_are_the_records_{name}", check_scene(name, folder))
        claim("loops_and_effects_are_shown_released_from_the_event_on", check_released(folder))
        claim("views_have_the_lengths_of_ropes", check_ropes(folder))
        claim("meshes_are_on_the_page_with_points_and_normals", check_mesh(folder))
        claim("frames_have_the_forces_of_effects", check_effects(folder))
        claim("events_are_marked_in_views_and_plots", check_marks(folder))
        claim("too_large_a_view_is_thinned_and_says_so", check_thinning(folder))
        claim("view_of_a_failure_has_its_last_state_and_names", check_failure(folder))
        claim("view_of_the_start_has_given_and_assembled_positions", check_start(folder))
        claim("rotation_too_fast_for_frames_is_said", check_fast(folder))
    finish()


main()
