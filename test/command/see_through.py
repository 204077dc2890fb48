"""see_through KINETREE SUPPRESSIONS: bodies of --see-through show what is behind them, as shapes and as pixels.

A small plate is before a ball, and a large wall behind both makes the page the same with and without the plate. Each pixel of the picture
with the clear plate is 0.3 of that with the plate and 0.7 of that without it. In the second scene the plate is a mesh, as a post is in both pictures.
"""
# SPDX-License-Identifier: Apache-2.0
import os
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

try:
    import numpy as np
    from PIL import Image
except ImportError as missing:
    print(f"[  SKIPPED ] command/see_through: Python's {missing.name} is not on this machine")
    sys.exit(77)

KINETREE, SUPPRESSIONS = sys.argv[1:]
os.environ["LSAN_OPTIONS"] = f"print_suppressions=0:suppressions={SUPPRESSIONS}"
OPACITY, BOUND = 0.3, 2.5  # of 255: each picture is rounded
SCENE = """kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - {{name: wall, joint: {{type: fixed, at: [0, 0.5, 0]}}, mass: 1, shape: {{type: box, size: [2, 0.1, 2]}}}}
  - {{name: wheel, joint: {{type: spherical}}, mass: 1, shape: {{type: sphere, radius: 0.3}}}}
{plate}
simulate: {{duration: 0.1}}
"""
PLATE = "  - {name: plate, joint: {type: free, at: [0.1, -0.6, 0]}, mass: 1, shape: {type: box, size: [0.5, 0.05, 0.8]}}"
POST = """  - {name: post, joint: {type: fixed, at: [-0.7, 0, 0]}, mass: 1, inertia: [1, 1, 1]}
meshes: [{body: post, file: plate.obj}]"""
MESH = """  - {name: post, joint: {type: fixed, at: [-0.7, 0, 0]}, mass: 1, inertia: [1, 1, 1]}
  - {name: plate, joint: {type: free, at: [0.1, -0.6, 0]}, mass: 1, inertia: [1, 1, 1]}
meshes: [{body: post, file: plate.obj}, {body: plate, file: plate.obj}]"""
OBJ = "\n".join(["v -0.25 0 -0.4", "v 0.25 0 -0.4", "v 0.25 0 0.4", "v -0.25 0 0.4", "f 1 2 3", "f 1 3 4", ""])


def kinetree(path, *words):
    return subprocess.run([KINETREE, *words], cwd=path, capture_output=True, text=True)


def drawn(path, text, *words):
    (path / "scene.yaml").write_text(text)
    done = kinetree(path, "draw", "scene.yaml", "--view", "y", "--out", "p.png", *words)
    return np.asarray(Image.open(path / "p.png").convert("RGB"), float) if done.returncode == 0 else np.full((1, 1, 3), np.nan), done.stderr


def near(mask, reach):
    """Pixels with one of a mask within `reach` along each axis."""
    found = mask.copy()
    for axis in (0, 1):
        found = np.any([np.roll(found, shift, axis) for shift in range(-reach, reach + 1)], axis=0)
    return found


def check(path, plate, without):
    """The largest difference from the mean of two pictures, but for the line around the plate."""
    whole, told = drawn(path, SCENE.format(plate=plate))
    bare, more = drawn(path, SCENE.format(plate=without))
    clear, most = drawn(path, SCENE.format(plate=plate), "--see-through", "plate")
    if whole.shape != bare.shape or whole.shape != clear.shape:
        return [f"{whole.shape}, {bare.shape}, {clear.shape}: {told} {more} {most}"]
    plate = np.abs(whole - bare).max(axis=2) > 8
    line = near(plate, 3) & near(~plate, 3)
    off = np.abs(clear - OPACITY * whole - (1 - OPACITY) * bare).max(axis=2)[~line].max()
    seen = (np.abs(clear - whole).max(axis=2) > 8)[plate & ~line].mean()
    note(f"{(plate & ~line).sum()} pixels within the plate, {seen:.3g} of them see-through; off by up to {off:.3g} of 255, bound {BOUND}")
    return [] if off <= BOUND and seen > 0.9 and (plate & ~line).sum() > 2000 else [f"off by {off}, {seen}; {most}"]


with tempfile.TemporaryDirectory() as folder:
    path = pathlib.Path(folder)
    (path / "plate.obj").write_text(OBJ)
    claim("a_clear_shape_shows_what_is_behind_it", check(path, PLATE, ""))
    claim("a_clear_mesh_shows_what_is_behind_it", check(path, MESH, POST))
    (path / "scene.yaml").write_text(SCENE.format(plate=PLATE))
    svg = kinetree(path, "draw", "scene.yaml", "--see-through", "plate", "--out", "p.svg")
    claim("a_clear_shape_stays_a_shape", [] if svg.returncode == 0 and "<image" not in (path / "p.svg").read_text() else [svg.stderr])
    faults = []
    for words, expected in ((["--see-through", "plat"], "there is no body 'plat'; did you mean 'plate'?"), (["--see-through", "plate", "--animate"], "--out FILE.png"),
                            (["--see-through", "world"], "the world has no solids")):
        done = kinetree(path, "draw", "scene.yaml", *words)
        faults += [] if done.returncode == 1 and expected in done.stderr else [f"{words}: {done.stderr}"]
    claim("wrong_bodies_are_named", faults)
finish()
