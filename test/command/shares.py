"""shares.py KINETREE: reactions of redundant loops are the least sum of |F|^2 + |M|^2/L^2 that balances, and the run names them once.

The oracle does not know how the loops are reduced. It has the wrench of every joint and loop as an unknown, restricted to what its type can
hold, and the balance of every body as an equation; the right-hand side is that of the recorded wrenches. The singular value decomposition of
these equations has the self-stresses, and a least-squares problem the least sum. L is taken from the warning; two hinges have closed forms.
Random mechanisms: hinges and slides with more loops on them, planar linkages of spatial joints with masses out of the plane, and structures
with fixed joints, in random axes, at lengths of 1e-4 to 1e4 m, with and without motion.
"""
# SPDX-License-Identifier: Apache-2.0
import csv
import json
import math
import pathlib
import random
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

try:
    import numpy as np
except ImportError:
    sys.exit(77)

KINETREE, = sys.argv[1:]
MECHANISMS, BOUND, UNIQUE = 150, 1e-8, 1e-7
REDUCTIONS = ["qr", "svd", "partition"]
COMPONENTS = ["mx", "my", "mz", "fx", "fy", "fz"]


def run(folder, scene, *options):
    path = pathlib.Path(folder)
    (path / "s.json").write_text(json.dumps({"kinetree": 1, **scene}))
    ran = subprocess.run([KINETREE, "run", "s.json", "--out", "s.csv", "--summary", "s-summary.json", "--quiet", *options], cwd=folder, capture_output=True, text=True)
    if ran.returncode:
        return None, None, ran.stderr
    with (path / "s.csv").open(newline="") as file:
        rows = [{k: float(x) if x else math.nan for k, x in row.items() if k != "event"} for row in csv.DictReader(file)]
    return rows, json.loads((path / "s-summary.json").read_text()), ran.stderr


def shared(summary):
    return [w for w in summary["warnings"] if w["code"] == "shared_reaction"]


# ---- closed forms ----------------------------------------------------------------------------------------------------

def two_hinges(load, limit):
    return {"gravity": [0, 0, 0],
            "bodies": [{"name": "f", "joint": {"type": "revolute", "axis": "x", "at": [-1, 0, 0]}, "mass": 10, "com": [1, 0, 0], "inertia": [1, 2, 2]}],
            "loops": [{"name": "h2", "type": "revolute", "axis": "x", "between": [{"body": "world", "at": [1, 0, 0]}, {"body": "f", "at": [2, 0, 0]}]}],
            "effects": [{"type": "force", "at": {"body": "f", "at": [1, 0, 0]}, "value": ["0", "0", load]}],
            "events": [{"name": "breaks", "when": f"abs(reaction.h2.fz) > {limit}", "then": {"release": "h2"}, "limit": 1}],
            "simulate": {"duration": 1}, "output": {"interval": 0.1, "record": ["reaction"]}}


def check_fuse():
    """Two hinges carry half each, and a fuse at one of them breaks at twice its limit; then the other carries all, with a moment."""
    faults = []
    with tempfile.TemporaryDirectory() as folder:
        rows, summary, words = run(folder, two_hinges("-100*t", 30))
    if rows is None:
        return [words]
    before, after = [r for r in rows if r["time"] < 0.55], [r for r in rows if r["time"] > 0.65]
    for r in before:
        off = max(abs(r[f"reaction.{x}.fz"] - 50 * r["time"]) for x in ("f", "h2")) + abs(r["reaction.f.my"]) + abs(r["reaction.h2.my"])
        faults += [] if off < 1e-9 else [f"t = {r['time']}: off by {off} N"]
    for r in after:
        off = abs(r["reaction.f.fz"] - 100 * r["time"]) + abs(r["reaction.f.my"] + 100 * r["time"])
        faults += [] if off < 1e-7 and r["reaction.h2.fz"] == 0 else [f"t = {r['time']}: off by {off}, {r['reaction.h2.fz']} N"]
    note(f"fuse: {len(before)} records before and {len(after)} after; {[w['what'][:90] for w in shared(summary)]}")
    warned = shared(summary)
    return faults + ([] if len(before) > 4 and len(after) > 2 else ["no records"]) + (
        [] if len(warned) == 1 and abs(warned[0]["value"] - 4) < 1e-12 and "reaction.h2.fz" in warned[0]["what"] else [f"warnings {warned}"])


def check_gears():
    """A ring of three equal gears repeats one mesh: the multipliers are least."""
    gears = {"gravity": [0, 0, 0],
             "bodies": [{"name": f"g{i}", "mass": 1, "inertia": [1, 1, 2], "joint": {"type": "revolute", "axis": "z", "at": [3 * i, 0, 0]}} for i in range(3)],
             "loops": [{"name": f"c{i}{j}", "type": "coupling", "coefficients": {f"g{i}": 1, f"g{j}": -1}}
                       for i, j in ((0, 1), (1, 2), (0, 2))],
             "effects": [{"type": "motor", "joint": "g0", "torque": 12}], "simulate": {"duration": 0.1}, "output": {"record": ["multiplier", "reaction"]}}
    with tempfile.TemporaryDirectory() as folder:
        rows, summary, words = run(folder, gears)
    if rows is None:
        return [words]
    # g1 and g2 need 4 N m each: c01 - c12 = -4, c02 + c12 = -4, and the least squares have no mesh between equal gears
    got = [rows[-1][f"reaction.{c}.multiplier"] for c in ("c01", "c12", "c02")]
    off = max(abs(x - y) for x, y in zip(got, (-4, 0, -4)))
    note(f"ring of gears: {got} N m")
    return [] if off < 1e-9 and len(shared(summary)) == 1 else [f"{got}, {words}"]


# ---- random mechanisms -----------------------------------------------------------------------------------------------

def rotation(rng):
    q = np.array([rng.gauss(0, 1) for _ in range(4)])
    w, x, y, z = q / np.linalg.norm(q)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def mechanism(rng):
    """Joints and loops by their types, axes and points in the world; every body has the axes of the world at the start."""
    size, turn = 10 ** rng.choice([0, 0, rng.uniform(-4, 4)]), rng.choice([np.eye(3), rotation(rng)])
    z, point = turn @ [0, 0, 1], lambda: size * np.array([rng.uniform(-1, 1) for _ in range(3)])
    family, joints, loops = rng.choice(["hinge", "slide", "linkage", "linkage", "structure"]), [], []
    if family in ("hinge", "slide"):
        p = point()
        joints.append({"type": {"hinge": "revolute", "slide": "prismatic"}[family], "axis": z, "at": p, "parent": 0})
        for _ in range(rng.randint(1, 4)):
            kind = rng.choice(["revolute", "spherical", "inline", "cylindrical"] if family == "hinge" else ["prismatic", "inline", "cylindrical"])
            on = p + size * rng.uniform(-1, 1) * z if family == "hinge" else point()
            loops.append({"type": kind, "axis": z, "at": on, "ends": (0, 1)})
    else:
        count = rng.randint(2, 5)
        for b in range(count):
            fixed = b > 0 and rng.random() < (0.4 if family == "structure" else 0.1)
            joints.append({"type": "fixed" if fixed else "revolute", "axis": z, "at": point(), "parent": b if rng.random() < 0.8 else rng.randint(0, b)})
        for _ in range(rng.randint(1, 3)):
            second = rng.randint(1, count)
            loops.append({"type": rng.choice(["revolute", "revolute", "weld"] if family == "structure" else ["revolute", "inline"]), "axis": z, "at": point(),
                          "ends": (rng.choice([0, rng.randint(0, count)]), second)})
    return size, turn, joints, [x for x in loops if moving_path(joints, *x["ends"])]


def path_of(joints, a, b):
    """Indices of the joints between two bodies, which are numbered from 1."""
    up = lambda x: [] if x == 0 else [x, *up(joints[x - 1]["parent"])]
    return set(up(a)) ^ set(up(b))


def moving_path(joints, a, b):
    return {x for x in path_of(joints, a, b) if joints[x - 1]["type"] != "fixed"}


def is_one_group(joints, loops):
    sets = [moving_path(joints, *x["ends"]) for x in loops]
    whole, rest = sets[0], sets[1:]
    while any(whole & x for x in rest):
        whole, rest = whole.union(*(x for x in rest if whole & x)), [x for x in rest if not whole & x]
    return not rest


def scene_of(rng, size, joints, loops):
    bodies, origin = [], lambda b: joints[b - 1]["at"] if b else np.zeros(3)
    for i, j in enumerate(joints):
        joint = {"type": j["type"], "at": list(j["at"] - origin(j["parent"]))}
        if j["type"] != "fixed":
            joint["axis"] = list(j["axis"])
        if i == 0 and j["type"] == "revolute":
            joint["velocity"] = rng.choice([0, rng.uniform(-3, 3)])
        bodies.append({"name": f"b{i + 1}", "joint": joint, "mass": rng.uniform(0.5, 5), "com": [size * rng.uniform(-0.5, 0.5) for _ in range(3)],
                       "inertia": [size * size * x for x in (1.0, 1.2, 1.4)], **({"parent": f"b{j['parent']}"} if j["parent"] else {})})
    ends = lambda x: [{"body": f"b{b}" if b else "world", "at": list(x["at"] - origin(b))} for b in x["ends"]]
    return {"gravity": [size * rng.uniform(-9, 9) for _ in range(3)], "bodies": bodies,
            "loops": [{"name": f"l{i}", "type": x["type"], "between": ends(x), **({} if x["type"] in ("weld", "spherical") else {"axis": list(x["axis"])})}
                      for i, x in enumerate(loops)],
            "simulate": {"duration": 1e-3}, "output": {"record": ["reaction"]}}


def held(kind, axis, scale):
    """Orthonormal columns of the wrenches (moment, force) that a joint or loop can hold."""
    across = np.linalg.svd(axis.reshape(1, 3))[2][1:].T
    moments = {"revolute": across, "cylindrical": across, "prismatic": np.eye(3), "weld": np.eye(3), "fixed": np.eye(3)}.get(kind, np.zeros((3, 0)))
    forces = across if kind in ("cylindrical", "prismatic", "inline") else np.eye(3)
    out = np.zeros((6, moments.shape[1] + forces.shape[1]))
    out[:3, :moments.shape[1]], out[3:, moments.shape[1]:] = moments * scale, forces
    return out


def cross(p):
    return np.array([[0, -p[2], p[1]], [p[2], 0, -p[0]], [-p[1], p[0], 0]])


def oracle(joints, loops, recorded, length):
    """The least wrenches with the balance of the recorded ones, the parts outside of what types hold, and which components are unique."""
    items = [(j["type"], j["axis"], j["at"], j["parent"], i + 1) for i, j in enumerate(joints)] + [(x["type"], x["axis"], x["at"], *x["ends"]) for x in loops]
    blocks, weights = [held(kind, axis, length) for kind, axis, *_ in items], []
    columns = np.cumsum([0] + [b.shape[1] for b in blocks])
    whole, balance = np.zeros((6 * len(items), columns[-1])), np.zeros((6 * len(joints), 6 * len(items)))
    for i, (kind, _, at, first, second) in enumerate(items):
        whole[6 * i:6 * i + 6, columns[i]:columns[i + 1]] = blocks[i]
        shift = np.eye(6)
        shift[:3, 3:] = cross(at)
        shift[:3] /= length
        for body, sign in ((second, 1), (first, -1)):
            if body:
                balance[6 * body - 6:6 * body, 6 * i:6 * i + 6] += sign * shift
        weights += [0.0] * 6 if kind == "fixed" else [1 / length] * 3 + [1.0] * 3
    x, weights = recorded.reshape(-1), np.array(weights)
    scale = np.tile([1 / length] * 3 + [1.0] * 3, len(items))
    inside = np.linalg.lstsq(whole * scale[:, None], x * scale, rcond=None)[0]
    outside = np.abs((whole @ inside - x) * scale).max()
    _, s, v = np.linalg.svd(balance @ whole)
    null = v[(s > 1e-10 * s[0]).sum():].T
    stress = whole @ null
    z = np.linalg.lstsq(stress * weights[:, None], -(whole @ inside) * weights, rcond=None)[0]
    open_rows = np.linalg.norm(stress * scale[:, None], axis=1)
    return whole @ inside + stress @ z, outside, open_rows.reshape(len(items), 6), scale


def check_random():
    worst, faults, tried, redundant, moved = 0.0, [], 0, 0, 0.0
    for seed in range(MECHANISMS):
        rng = random.Random(seed)
        size, _, joints, loops = mechanism(rng)
        if not loops or not is_one_group(joints, loops):
            continue
        with tempfile.TemporaryDirectory() as folder:
            rows, summary, words = run(folder, scene_of(rng, size, joints, loops), "--reduction", rng.choice(REDUCTIONS))
        if rows is None:
            faults.append(f"{seed}: {words}")
            continue
        names = [f"b{i + 1}" for i in range(len(joints))] + [f"l{i}" for i in range(len(loops))]
        recorded = np.array([[rows[0][f"reaction.{n}.{c}"] for c in COMPONENTS] for n in names])
        warned = shared(summary)
        length = warned[0]["value"] if warned else size
        least, outside, open_rows, scale = oracle(joints, loops, recorded, length)
        most = np.abs(recorded.reshape(-1) * scale).max()
        off = max(np.abs((least - recorded.reshape(-1)) * scale).max(), outside) / most
        named = [f"reaction.{n}.{c}" for n, row, of in zip(names, open_rows, recorded) for c, x, r in zip(COMPONENTS, row, of)
                 if x > 1e-6 and abs(r) > 1e-6 * most * (length if c[0] == "m" else 1)]
        tried, redundant, worst = tried + 1, redundant + bool(named), max(worst, off)
        if not off < BOUND:
            faults.append(f"{seed}: off by {off:.3g} of {BOUND}")
        if bool(named) != bool(warned) or len(warned) > 1:
            faults.append(f"{seed}: {named} is not unique; warnings {[w['what'] for w in warned]}")
        elif warned and named[0] not in warned[0]["what"] and len(named) <= 6:
            faults.append(f"{seed}: {named}: {warned[0]['what']}")
        around = 2 * max(np.linalg.norm(x["at"] - joints[0]["at"]) for x in loops)
        if warned and len(joints) == 1 and not math.isclose(length, around, rel_tol=1e-9):
            faults.append(f"{seed}: L {length} of {around}")
    note(f"{tried} mechanisms, {redundant} of them with reactions that are not unique: off by {worst:.3g} of {BOUND}")
    return faults if tried > MECHANISMS / 2 and redundant > MECHANISMS / 4 else [*faults, f"only {redundant} of {tried}"]


def windows(count, reads):
    """A row of frames side by side. Every leg stands on a pin, and every bar ends at a pin of the next leg."""
    scene = {"kinetree": 1, "gravity": [0, -9.81, 0], "bodies": [], "loops": [], "simulate": {"duration": 0.01},
             "output": {"interval": 0.005, "record": ["position"] if reads else ["position", "reaction"]}}
    for k in range(count + 1):
        scene["bodies"].append({"name": f"leg{k}", "joint": {"type": "revolute", "axis": "z", "at": [k, 0, 0]}, "mass": 1, "markers": {"top": [0, 1, 0]},
                                "shape": {"type": "rod", "to": [0, 1, 0], "radius": 0.05}})
    for k in range(count):
        scene["bodies"].append({"name": f"bar{k}", "parent": f"leg{k}", "joint": {"type": "revolute", "axis": "z", "at": [0, 1, 0]}, "mass": 1,
                                "markers": {"end": [1, 0, 0]}, "shape": {"type": "rod", "to": [1, 0, 0], "radius": 0.05}})
        scene["loops"].append({"name": f"pin{k}", "type": "revolute", "between": [f"bar{k}.end", f"leg{k + 1}.top"], "axis": "z"})
    if reads:
        scene["events"] = [{"name": "breaks", "when": f"reaction.pin3.{reads} > 1e6", "then": "record"}]
    return scene


def frames_of_space(count):
    """The row of frames as joints and loops of `scene_of`, whose masses lie out of the plane."""
    z, joints, loops = np.array([0.0, 0, 1]), [], []
    for k in range(count + 1):
        joints.append({"type": "revolute", "axis": z, "at": np.array([k, 0.0, 0]), "parent": 0})
    for k in range(count):
        joints.append({"type": "revolute", "axis": z, "at": np.array([k, 1.0, 0]), "parent": k + 1})
        loops.append({"type": "revolute", "axis": z, "at": np.array([k + 1, 1.0, 0]), "ends": (count + 2 + k, k + 2)})
    return joints, loops


def off_by(joints, loops, row, length):
    """The largest difference between the recorded wrenches and the least ones, relative to the largest wrench."""
    names = [f"b{i + 1}" for i in range(len(joints))] + [f"l{i}" for i in range(len(loops))]
    recorded = np.array([[row[f"reaction.{n}.{c}"] for c in COMPONENTS] for n in names])
    least, outside, _, scale = oracle(joints, loops, recorded, length)
    return max(np.abs((least - recorded.reshape(-1)) * scale).max(), outside) / np.abs(recorded.reshape(-1) * scale).max()


def check_row():
    """Eleven frames have the least sum, too."""
    joints, loops = frames_of_space(11)
    with tempfile.TemporaryDirectory() as folder:
        rows, summary, words = run(folder, scene_of(random.Random(1), 1.0, joints, loops))
    if rows is None:
        return [words]
    said = [each["what"] for each in shared(summary)]
    if len(said) != 1 or "are not unique" not in said[0]:
        return [f"{said}"]
    off = off_by(joints, loops, rows[0], shared(summary)[0]["value"])
    note(f"a row of 11 frames: off by {off:.3g} of {BOUND}")
    return [] if off < BOUND else [f"off by {off}"]


def linkage(top, slides, pins):
    """Joints and loops of a four-bar, or of a crank and a slide with a second guide, and their scene with masses and gravity in this plane."""
    x, z, top = np.array([1.0, 0, 0]), np.array([0.0, 0, 1]), np.array(top, float)
    last = {"type": "prismatic", "axis": x} if slides else {"type": "revolute", "axis": z}
    joints = [{"type": "revolute", "axis": z, "at": np.zeros(3), "parent": 0}, {"type": "revolute", "axis": z, "at": top, "parent": 1},
              {**last, "at": np.array([2.0, 0, 0]), "parent": 0}]
    loops = [{"type": "revolute", "axis": z, "at": top + [2, 0, 0], "ends": (2, 3)} for _ in range(pins)]
    loops += [{"type": "prismatic", "axis": x, "at": np.array([3.0, 0, 0]), "ends": (0, 3)}] if slides else []
    scene = scene_of(random.Random(1), 1.0, joints, loops)
    for mass, body in enumerate(scene["bodies"], 1):
        body |= {"com": [0.3, 0, 0], "mass": mass}
        body["joint"].pop("velocity", None)
    return joints, loops, {**scene, "gravity": [5, 0 if top[1] == 0 else -9, 0]}


def check_plane():
    """Loads in the plane have the least sum also where equations in the plane depend on each other, or never change: a parallelogram that is
    folded into a line, whose cranks share its load, one with a pin twice, and a slide with two guides."""
    faults = []
    for name, parts in (("folded", ([1, 0, 0], False, 1)), ("a pin twice", ([0.2, 1, 0], False, 2)), ("two guides", ([0.2, 1, 0], True, 1))):
        joints, loops, scene = linkage(*parts)
        with tempfile.TemporaryDirectory() as folder:
            rows, summary, words = run(folder, scene)
        if rows is None:
            return [words]
        off = off_by(joints, loops, rows[0], shared(summary)[0]["value"] if shared(summary) else 1.0)
        note(f"{name}: off by {off:.3g} of {BOUND}; {[w['what'][:90] for w in shared(summary)]}")
        faults += [] if off < BOUND and len(shared(summary)) == 1 else [f"{name}: off by {off}, {words}"]
    return faults


def check_large():
    """Groups that are too large for the least sum are named if a reaction is recorded or read that is not unique.

    In a row of frames these are the reactions out of the plane, which only forces out of the plane cause. With one pin twice, its own are not
    unique either."""
    faults = []
    aside, twice = {"gravity": [0, -9.81, 1]}, {"name": "pin3b", "type": "revolute", "between": ["bar3.end", "leg4.top"], "axis": "z"}
    names = "pin0, pin1, pin2, pin3, pin4, pin5 and"
    with tempfile.TemporaryDirectory() as folder:
        for reads, change, doubled, named, repeated in (("", {}, False, None, 0), ("", aside, False, f"{names} 74 more", 240), ("", {}, True, f"{names} 75 more", 245),
                                                        ("fx", aside, False, None, 0), ("fz", {}, False, "pin3", 240), ("fx", {}, True, "pin3", 245)):
            scene = {**windows(80, reads), **change}
            scene["loops"] += [twice] if doubled else []
            rows, summary, words = run(folder, scene)
            said = [each["what"] for each in shared(summary)] if rows is not None else [words]
            if named is None and said or named is not None and (
                    len(said) != 1 or f"the reactions of loops {named}, and of joints" not in said[0] or f"{repeated} equations of these loops" not in said[0] or
                    shared(summary)[0]["value"] != repeated or "`inline`" not in shared(summary)[0]["remedy"]):
                faults.append(f"reads {reads}, {change}, twice {doubled}: {said}")
    return faults


claim("a_fuse_breaks_at_its_share", check_fuse())
claim("groups_that_are_too_large_are_named", check_large())
claim("reactions_in_a_plane_are_least_where_its_equations_depend", check_plane())
claim("reactions_of_a_long_row_of_frames_are_least", check_row())
claim("a_ring_of_gears_shares_its_torque", check_gears())
claim("reactions_of_random_redundant_mechanisms_are_least", check_random())
finish()
