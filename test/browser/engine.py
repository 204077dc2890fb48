"""engine KINETREE SCENES WASM NODE NUMBERS.js MOTION.js: the engine of live pages under node.

Each bundled scene runs twice: by the command, whose frames are in the page, and by the engine of the same page. Both are compared by
hashes of times, places, orientations, forces and recorded columns. Frames have single precision.

Other bits have one reason: sin, cos and exp belong to the C library. musl, that of WebAssembly, and glibc round some values
differently, which is shown by itself. Which values these are depends on the version of glibc and on the processor. Scenes with
other bits are therefore named in the output, and their motions must agree otherwise.
"""
# SPDX-License-Identifier: Apache-2.0
import concurrent.futures
import json
import math
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

KINETREE, SCENES, WASM, NODE, *SCRIPTS = sys.argv[1:]
HERE = pathlib.Path(__file__).resolve().parent
TOGETHER = 2
FARTHEST = 1e-3  # of the size of the mechanism: a chaotic motion amplifies a rounding


def write_page(scene, folder):
    """The live page of a scene; the words of the command if it writes none."""
    page = folder / f"{scene.stem}.html"
    run = subprocess.run([KINETREE, "view", "--live", str(scene), "--view", str(page), "--quiet"], capture_output=True, text=True)
    return (page, None) if run.returncode == 0 else (None, run.stderr.strip() or f"status {run.returncode}")


def compare(scene, folder):
    page, words = write_page(scene, folder)
    if page is None:
        return scene.stem, {"words": words}
    run = subprocess.run([NODE, str(HERE / "engine.mjs"), str(page), *SCRIPTS], capture_output=True, text=True, timeout=600)
    page.unlink()
    return scene.stem, json.loads(run.stdout) if run.returncode == 0 else {"words": run.stderr.strip()[-400:]}


def problems_of(result):
    """Whatever the engine does besides rounding differently."""
    if "words" in result:
        return [result["words"]]
    if not result["is_run"]:
        return result["faults"] or ["there is no motion"]
    parts, worst = result["parts"], result["worst"]
    found = [f"{name}: {part['differing']} of {part['count']} differ" for name, part in parts.items() if name in ("columns", "failure") and part["differing"]]
    if parts["times"]["count"] == 0 or not worst <= FARTHEST:
        found.append(f"positions differ by {worst:.3g} of the size of the mechanism, bound {FARTHEST:g}")
    return found + [f"parameter {i} reads {p['read']} by FMI, not {p['value']}" for i, p in enumerate(result["parameters"]) if p["read"] != p["value"]]


def see_library(functions, other):
    """The reason for other bits: values of the C library, at k / 64. A value of musl is the next number at most."""
    counts, farthest = {}, 0.0
    for name, values in functions.items():
        own = [getattr(math, name)(k / 64) for k in range(len(values))]
        counts[name] = sum(a != b for a, b in zip(own, values))
        farthest = max(farthest, *(abs(a - b) / math.ulp(a) for a, b in zip(own, values)))
    note(f"of {len(next(iter(functions.values())))} values each differ {counts}, by {farthest:g} units in the last place at most, bound 1")
    claim("other_bits_have_the_c_library_as_their_reason", [] if farthest <= 1.0 and (sum(counts.values()) > 0 or not other) else ["no value of the library differs"])


def main():
    with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(TOGETHER) as pool:
        results = dict(pool.map(lambda scene: compare(scene, pathlib.Path(folder)), sorted(pathlib.Path(SCENES).glob("*.yaml"))))
    equal, other = [], []
    for name, result in results.items():
        differing = {part: (p["differing"], p["count"]) for part, p in result.get("parts", {}).items() if p["differing"]}
        (other if differing else equal).append(name)
        claim(f"{name}_runs_in_the_engine_as_in_the_command", problems_of(result))
        if differing:
            note(f"{name}: " + ", ".join(f"{part} {a} of {b} differ" for part, (a, b) in differing.items()) + f", worst {result['worst']:.2g} of its size")
    note(f"{len(equal)} scenes of {len(results)} have the bits of the command: {' '.join(equal)}")
    note(f"{len(other)} have others: {' '.join(other)}")
    see_library(next(result["functions"] for result in results.values() if "functions" in result), other)
    finish()


main()
