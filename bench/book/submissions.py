"""Files for the IFToMM library of computational benchmark problems: for each problem the two numbers of its form, the file of
results and a zip with the scene, the results and the command.

A problem is run at the loosest of some tolerances that keeps its goal. The accuracy is the largest change of the energy if the
mechanism neither takes nor loses any, which is the library's rule for A01 and A02; otherwise it is the largest error of the
results, against a run with a thousandth of the tolerance."""
# SPDX-License-Identifier: Apache-2.0
import csv
import os
import subprocess
import zipfile

from table import Table

SCENES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "apps", "scenes")
# name, title, scene, duration (s), interval (s), method, results, what the accuracy is, goal
PROBLEMS = [
    ("A01", "simple pendulum", "pendulum", 10, 0.01, "dop853", ["marker.pendulum.bob.x", "marker.pendulum.bob.y"], "energy, J", 5e-5),
    ("A02", "N-four-bar mechanism, N = 2", "n-four-bar-2", 10, 0.01, "dop853", ["marker.crank0.tip.x", "marker.crank0.tip.y"], "energy, J", 1e-3),
    ("A03", "Andrews' squeezer", "andrews", 0.05, 5e-5, "dop853", ["marker.K1.F.x", "marker.K1.F.y"], "place, m", 1e-6),
    ("A04", "Bricard's mechanism", "bricard", 10, 0.01, "dop853", ["marker.rod3.end.x", "marker.rod3.end.y", "marker.rod3.end.z"], "energy, J", 1e-3),
    ("A05", "flyball governor", "flyball-governor", 10, 0.01, "radau5", ["position.slider", "velocity.shaft"], "height and rate, m and rad/s", 1e-5),
]
TOLERANCES = [10.0**(-0.5 * k) for k in range(6, 24)]
TEXT = [
    "The files of a submission to the library (iftomm-multibody.org/benchmark) are in the folder `iftomm` of the book. *Observed* is the",
    "accuracy, as the library defines it for A01 and A02: the largest change of the energy. A03 to A05 have goals of ours. The",
    "processor time is in `times.md`. The tightest published digits are compared in *Published references*."]


def records(context, problem, tolerance):
    """Columns of a run."""
    _, _, scene, duration, interval, method, results, *_ = problem
    out = os.path.join(context.work, scene + "-submission.csv")
    markers = ",".join(dict.fromkeys(name.split(".", 1)[1].rsplit(".", 1)[0] for name in results if name.startswith("marker.")))
    command = [context.kinetree, "run", os.path.join(SCENES, scene + ".yaml"), "--duration", f"{duration:g}", "--interval", f"{interval:g}",
               "--integrator", method, "--tolerance", f"{tolerance:.3g}", "--record", "position,velocity,energy"] + (["--markers", markers] if markers else [])
    ended = subprocess.run([*command, "--quiet", "--out", out], capture_output=True, text=True)
    if ended.returncode != 0:
        raise RuntimeError(f"{scene} at {tolerance:g}: {ended.stderr.strip()}")
    with open(out, newline="") as file:
        rows = [{name: float(cell) for name, cell in row.items()} for row in csv.DictReader(file)]
    return rows, " ".join(["kinetree", "run", scene + ".yaml", *command[3:], "--out", "results.csv"])


def accuracy(rows, fine, problem):
    if problem[7] == "energy, J":
        return max(abs(row["energy.total"] - rows[0]["energy.total"]) for row in rows)
    return max(abs(row[name] - other[name]) for row, other in zip(rows, fine) for name in problem[6])


def loosest(context, problem):
    """(tolerance, accuracy, rows, command) of the loosest tolerance that keeps the goal; otherwise of the last one."""
    fine = None if problem[7] == "energy, J" else records(context, problem, max(1e-13, 1e-3 * problem[8]))[0]
    for tolerance in TOLERANCES:
        rows, command = records(context, problem, tolerance)
        reached = accuracy(rows, fine, problem)
        if reached <= problem[8]:
            break
    return tolerance, reached, rows, command


def processor_time(context, problem, tolerance):
    """Seconds of the run without records."""
    out = os.path.join(context.work, "submission-time.csv")
    subprocess.run([context.kinetree, "accuracy", os.path.join(SCENES, problem[2] + ".yaml"), "--duration", f"{problem[3]:g}", "--integrators", problem[5],
                    "--tolerances", f"{tolerance:.3g}", "--out", out, "--plot", "/dev/null", "--quiet"], check=True, capture_output=True)
    with open(out, newline="") as file:
        return float(next(csv.DictReader(file))["cpu"])


def write_files(context, problem, rows, command, reached):
    """results.txt, and a zip of all; the same bytes on every machine."""
    folder = os.path.join(context.directory, "iftomm")
    os.makedirs(folder, exist_ok=True)
    names = ["time", *problem[6]]
    results = "\n".join(["\t".join(names), *("\t".join(f"{row[name]:.10g}" for name in names) for row in rows)]) + "\n"
    with open(os.path.join(folder, f"{problem[0]}-results.txt"), "w") as file:
        file.write(results)
    note = f"{problem[0]}, {problem[1]}\naccuracy ({problem[7]}): {reached:.2g}\nmethod: {problem[5]}, minimal coordinates, loops by QR and projection\n{command}\n"
    with open(os.path.join(SCENES, problem[2] + ".yaml")) as file:
        scene = file.read()
    with zipfile.ZipFile(os.path.join(folder, f"{problem[0]}.zip"), "w") as archive:
        for name, text in [("README.txt", note), (problem[2] + ".yaml", scene), ("results.txt", results)]:
            archive.writestr(zipfile.ZipInfo(name, (2020, 1, 1, 0, 0, 0)), text)


def tables(context):
    table = Table("submissions", "Submissions to the IFToMM library", ["problem", "title", "method", "tolerance", "accuracy of", "observed", "bound", "verdict"], TEXT)
    times = Table("submissions-times", "Submissions to the IFToMM library: milliseconds of processor time", ["problem", "duration, s", "accuracy", "ms"], timed=True)
    for problem in PROBLEMS[:2] if context.short else PROBLEMS:
        try:
            tolerance, reached, rows, command = loosest(context, problem)
        except RuntimeError as failed:
            table.violations.append(str(failed))
            continue
        table.add(problem[0], problem[1], problem[5], tolerance, problem[7], observed=reached, bound=problem[8])
        write_files(context, problem, rows, command, reached)
        if not context.short:
            times.add(problem[0], problem[3], reached, 1e3 * processor_time(context, problem, tolerance))
    return [table] if context.short else [table, times]
