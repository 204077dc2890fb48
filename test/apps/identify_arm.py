"""identify_arm PROGRAM: the sums that a record tells are those of the arm, within their deviations, and predict torques."""
# SPDX-License-Identifier: Apache-2.0
import csv
import pathlib
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note


def identify(*arguments):
    run = subprocess.run([sys.argv[1], *arguments], capture_output=True, text=True, timeout=600)
    note(run.stdout.strip().replace("\n", "\n       "))
    claim(f"program_ends_well {' '.join(map(str, arguments[:2]))}", [] if run.returncode == 0 else [f"status {run.returncode}: {run.stderr}"])
    rank, told = map(int, re.search(r"identifiable sums: (\d+); identified by this record to a third: (\d+)", run.stdout).groups())
    left = float(re.search(r"left of the record: ([0-9.]+)", run.stdout)[1])
    drawing, fitted = map(float, re.search(r"drawing ([0-9.]+), identified ([0-9.]+)", run.stdout).groups())
    return run.stdout, rank, told, left, drawing, fitted


with tempfile.TemporaryDirectory() as folder:
    path = pathlib.Path(folder) / "sums.csv"
    text, rank, told, left, drawing, fitted = identify("--csv", path)
    rows = list(csv.DictReader(path.open()))

# 43 sums of inertias of an arm with seven axes whose first is vertical (Mayeda, Yoshida & Osuka 1990); five armatures, for those of the first two
# joints cannot be distinguished from Izz and Iyy of their bodies, which turn about these axes alone; seven viscous and seven Coulomb frictions.
claim("as_many_sums_as_published", [] if rank == len(rows) == 43 + 5 + 7 + 7 else [f"{rank}"])
# Of 62 normal errors one is beyond 4.5 deviations in a record of 2,300 such.
errors = [abs(float(row["identified"]) - float(row["true"])) / float(row["deviation"]) for row in rows]
note(f"largest error: {max(errors):.2f} deviations; mean square {sum(e * e for e in errors) / len(errors):.2f}")
claim("errors_are_within_their_deviations", [] if max(errors) < 4.5 and 0.5 < sum(e * e for e in errors) / len(errors) < 1.6 else [f"{errors}"])
# 14,000 rows: the rms is 1 within 1 / sqrt(28,000), 0.6 %.
claim("what_is_left_is_the_noise", [] if abs(left - 1) < 0.025 else [f"{left}"])
claim("prediction_is_better_than_the_noise_and_the_drawing", [] if fitted < 0.25 and drawing > 20 * fitted else [f"{drawing} {fitted}"])
claim("what_is_not_told_is_named", [] if told < rank and text.count("not identified") == rank - told else [text])
_, _, fewer, _, _, worse = identify("--seconds", "2")
claim("a_shorter_record_tells_less", [] if fewer < told and worse > fitted else [f"{fewer} {worse}"])
finish()
