"""engines KINETREE FOLDER: the programs kinetree-peer-NAME of a build run mechanisms with and without loops. Their errors
against the study's reference fall with their steps or tolerances: both sides have the same mechanism."""
# SPDX-License-Identifier: Apache-2.0
import csv
import os
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

KINETREE, FOLDER, SCENES = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve(), pathlib.Path(sys.argv[3]).resolve()
# Of each engine: the error that its best method reaches at least. Methods of first order end where runs take too long.
BOUNDS = {
    "lagrange-top": {"MuJoCo": 1e-6, "ODE": 1e-3, "Simbody": 1e-8, "SUNDIALS": 1e-9},
    "four-bar": {"MuJoCo": 1e-3, "ODE": 1e-3, "Simbody": 1e-6, "SUNDIALS": 1e-9},
}


def least_errors(scene, folder):
    """{engine: least error} of a study."""
    path = os.pathsep.join([str(FOLDER), os.environ["PATH"]])
    ran = subprocess.run([KINETREE, "accuracy", SCENES / f"{scene}.yaml", "--peers", "--integrators", "dop853", "--duration", "0.2", "--budget", "1.5",
                          "--plot", "/dev/null", "--out", "out.csv", "--quiet"],
                         cwd=folder, env=dict(os.environ, PATH=path), capture_output=True, text=True)
    if ran.returncode != 0:
        claim(f"{scene}_is_studied", [f"status {ran.returncode}: {ran.stderr}"])
        finish()
    found = {}
    with open(pathlib.Path(folder, "out.csv"), newline="") as file:
        for row in csv.DictReader(file):
            if row["variant"] and row["status"] in ("ok", "below the reference"):
                engine = row["variant"].split()[0]
                found[engine] = min(found.get(engine, float("inf")), float(row["error.position"]))
    return found


def main():
    engines = sorted(entry.name for entry in FOLDER.glob("kinetree-peer-*") if entry.is_file() and os.access(entry, os.X_OK))
    claim("there_is_a_program_to_test", [] if engines else [f"none in {FOLDER}"])
    for scene, bounds in BOUNDS.items():
        with tempfile.TemporaryDirectory() as folder:
            found = least_errors(scene, folder)
        for engine, bound in bounds.items():
            if f"kinetree-peer-{engine.lower()}" not in engines:
                note(f"{engine} is not built here")
                continue
            error = found.get(engine, float("inf"))
            note(f"{scene}, {engine}: error {error:.3g}, bound {bound:g}")
            claim(f"{engine}_has_the_motion_of_{scene}".replace("-", "_"), [] if error <= bound else [f"error {error:g}, bound {bound:g}"])
    finish()


main()
