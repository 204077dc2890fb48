"""glb KINETREE SCENES: the glTF of a run is well formed, and shows its motion.

The file is read back by what the specification says (glTF 2.0, section 4 for GLB); markers are carried along by its nodes and held against the CSV
file. Where node and the Khronos validator (npm gltf-validator; KT_GLTF_VALIDATOR names its folder) are there, it is asked, too.
"""
# SPDX-License-Identifier: Apache-2.0
import csv
import json
import math
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note, skip

KINETREE, SCENES = sys.argv[1:]
NAMES = ("four-bar", "lagrange-top", "stewart", "tethered-satellites")
KINDS = {5122: ("h", 32767), 5125: ("I", 1), 5126: ("f", 1)}
WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}
VALIDATE = """
const fs = require("fs"), validator = require(process.argv[1]);
(async () => {
    for (const name of process.argv.slice(2)) {
        const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(name)));
        for (const m of report.issues.messages.filter((m) => m.severity < 2))
            console.log(name, m.code, m.pointer, m.message);
    }
})();
"""


def run_scene(name, folder):
    text = pathlib.Path(f"{SCENES}/{name}.yaml").read_text()
    markers = ",".join(f"{a}.{b}" for a, b in re.findall(r"([\w-]+)\.([\w-]+)", re.search(r"^  markers: \[(.*?)\]", text, re.M)[1]))
    return subprocess.run([KINETREE, "run", f"{SCENES}/{name}.yaml", "--quiet", "--markers", markers, "--out", f"{name}.csv", "--glb", f"{name}.glb", "--view",
                           f"{name}.html"], cwd=folder, capture_output=True, text=True)


def read_glb(raw, faults):
    """The JSON and the accessors' rows."""
    magic, version, length, json_size, json_kind = struct.unpack("<5I", raw[:20])
    bin_size, bin_kind = struct.unpack("<2I", raw[20 + json_size:28 + json_size])
    if (magic, version, length, json_kind, bin_kind) != (0x46546C67, 2, len(raw), 0x4E4F534A, 0x004E4942) or 28 + json_size + bin_size != len(raw) or json_size % 4 or bin_size % 4:
        faults.append("the chunks are wrong")
    root, data = json.loads(raw[20:20 + json_size]), raw[28 + json_size:]
    if not 0 <= bin_size - root["buffers"][0]["byteLength"] < 4:
        faults.append("the buffer has another length")
    rows, at = [], 0
    for accessor in root["accessors"]:
        view = root["bufferViews"][accessor["bufferView"]]
        (kind, unit), width = KINDS[accessor["componentType"]], WIDTHS[accessor["type"]]
        size = struct.calcsize(kind)
        if view["byteOffset"] != at or view["byteLength"] != accessor["count"] * size * width or view["byteOffset"] % size:
            faults.append(f"view {accessor['bufferView']} is out of place")
        at += view["byteLength"]
        numbers = struct.unpack(f"<{accessor['count'] * width}{kind}", data[view["byteOffset"]:at])
        if (unit != 1) != accessor.get("normalized", False):
            faults.append("shorts are to be normalized, and nothing else")
        found = [[x / unit for x in numbers[i:i + width]] for i in range(0, len(numbers), width)]
        for key, act in (("min", min), ("max", max)):
            if key in accessor and [act(row[k] for row in found) for k in range(width)] != accessor[key]:
                faults.append(f"{key} of an accessor is wrong")
        rows.append(found)
    return root, rows


def turned(q, u):
    x, y, z, w = q
    a = [y * u[2] - z * u[1] + w * u[0], z * u[0] - x * u[2] + w * u[1], x * u[1] - y * u[0] + w * u[2]]
    return [u[0] + 2 * (y * a[2] - z * a[1]), u[1] + 2 * (z * a[0] - x * a[2]), u[2] + 2 * (x * a[1] - y * a[0])]


def check_meshes(root, rows, faults):
    """Corners are points; the normals are of unit length, and triangles turn their front to where these point."""
    for mesh in root["meshes"]:
        for primitive in mesh["primitives"]:
            points, normals = (rows[primitive["attributes"][key]] for key in ("POSITION", "NORMAL"))
            corners = [int(row[0]) for row in rows[primitive["indices"]]]
            if len(points) != len(normals) or max(corners) >= len(points) or len(corners) % 3 or max(abs(math.hypot(*n) - 1) for n in normals) > 1e-6:
                faults.append("a mesh is not well formed")
            for i in range(0, len(corners), 3):
                a, b, c = (points[k] for k in corners[i:i + 3])
                u, v = [y - x for x, y in zip(a, b)], [y - x for x, y in zip(a, c)]
                n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
                if sum(x * sum(normals[k][j] for k in corners[i:i + 3]) for j, x in enumerate(n)) < -1e-12:
                    faults.append("a triangle is inside out")
                    return


def check_scene(name, folder):
    run = run_scene(name, folder)
    if run.returncode != 0:
        return [run.stderr]
    faults = []
    root, rows = read_glb(pathlib.Path(f"{folder}/{name}.glb").read_bytes(), faults)
    check_meshes(root, rows, faults)
    with open(f"{folder}/{name}.csv", newline="", encoding="utf-8") as file:
        header, *table = list(csv.reader(file))
    html = pathlib.Path(f"{folder}/{name}.html").read_text()
    data = json.loads(re.search(r'id="data">(.*?)</script>', html, re.S)[1])
    animation, nodes = root["animations"][0], root["nodes"]
    found = {(c["target"]["node"], c["target"]["path"]): animation["samplers"][c["sampler"]] for c in animation["channels"]}
    times = [row[0] for row in rows[animation["samplers"][0]["input"]]]
    if any(b <= a for a, b in zip(times, times[1:])) or len(times) != len(table):
        faults.append(f"{len(times)} times for {len(table)} records, or they do not rise")
    base, worst = nodes[root["scenes"][0]["nodes"][0]], 0.0
    up = turned(base["rotation"], [-x for x in data["gravity"]])
    if math.hypot(*up) > 0 and up[1] < 0.999999 * math.hypot(*up):
        faults.append(f"up is {up}")
    for marker in (m for m in data["markers"] if m["traced"]):
        body, columns = data["bodies"][marker["body"]]["name"], {}
        node = next(i for i in base["children"] if nodes[i]["name"] == body)
        for k in "xyz":
            columns[k] = header.index(f"marker.{body}.{marker['name']}.{k}")
        for i in range(0, len(times), 7):
            q, p = rows[found[node, "rotation"]["output"]][i], rows[found[node, "translation"]["output"]][i]
            inside = [a + b for a, b in zip(p, turned([x / math.hypot(*q) for x in q], marker["at"]))]
            there = [a + b for a, b in zip(base["translation"], turned(base["rotation"], inside))]
            wanted = turned(base["rotation"], [float(table[i][columns[k]]) for k in "xyz"])
            bound = 2 * math.hypot(*marker["at"]) / 32767 + (math.hypot(*inside) + math.hypot(*base["translation"]) * 1e-8) * 2**-22 + 1e-12
            worst = max(worst, math.dist(there, wanted) / bound)
    note(f"{name}: farthest marker, over its bound: {worst:.2g}")
    return faults + ([] if 0 < worst < 1 else [f"a marker is {worst:.3g} times its bound away"])


def check_by_khronos(folder):
    module = os.environ.get("KT_GLTF_VALIDATOR", "gltf-validator")
    node = shutil.which("node")
    if node is None or subprocess.run([node, "-e", "require(process.argv[1])", module], capture_output=True, check=False).returncode != 0:
        skip("khronos_finds_no_fault", "node and gltf-validator are not on this machine")
        return
    run = subprocess.run([node, "-e", VALIDATE, module, *(f"{name}.glb" for name in NAMES)], cwd=folder, capture_output=True, text=True, check=False)
    claim("khronos_finds_no_fault", run.stdout.splitlines() + run.stderr.splitlines())


def main():
    with tempfile.TemporaryDirectory() as folder:
        for name in NAMES:
            claim(f"gltf_shows_the_motion_{name}", check_scene(name, folder))
        check_by_khronos(folder)
    finish()


main()
