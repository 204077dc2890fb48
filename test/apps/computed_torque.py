"""computed_torque PROGRAM: inverse dynamics follows the path better than PD with the same gains."""
# SPDX-License-Identifier: Apache-2.0
import csv
import math
import pathlib
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

NUMBER = r"([0-9.e+-]+)"


def follow(*arguments):
    """rms errors of PD and computed torque, and the largest share of a torque limit."""
    run = subprocess.run([sys.argv[1], *arguments], capture_output=True, text=True, timeout=600)
    note(run.stdout.strip().replace("\n", "\n       "))
    claim(f"program_ends_well {' '.join(map(str, arguments[:2]))}",
          [] if run.returncode == 0 else [f"status {run.returncode}: {run.stderr}"])
    found = re.findall(rf"^(?:PD|computed torque): +rms {NUMBER} rad, most {NUMBER} rad, torques up to (\d+) %",
                       run.stdout, flags=re.M)
    ratio = re.search(rf"^ratio of rms errors: {NUMBER}$", run.stdout, flags=re.M)
    if len(found) != 2 or not ratio:
        claim("results_are_printed", [run.stdout])
        finish()
    pd, computed = float(found[0][0]), float(found[1][0])
    claim("ratio_is_that_of_the_errors",
          [] if abs(float(ratio[1]) - pd / computed) <= 0.05 + 1e-3 * pd / computed else [ratio[0]])
    return pd, computed, max(int(line[2]) for line in found)


# As measured: 3.6 with masses off by 8 % and friction, 3.5 at 15 %, 191 where the model is exact.
with tempfile.TemporaryDirectory() as folder:
    path = pathlib.Path(folder) / "torque.csv"
    pd, computed, torque = follow("--csv", path)
    rows = list(csv.DictReader(path.open()))
claim("computed_torque_errs_less_than_a_third_of_pd", [] if pd > 3.0 * computed else [f"{pd} {computed}"])
claim("masses_off_by_some_percent_leave_an_error_of_a_degree",
      [] if 0.005 < computed < math.radians(1.2) else [f"{computed} rad"])
claim("torques_stay_below_their_limits", [] if torque < 50 else [f"{torque} %"])

late = [row for row in rows if float(row["time"]) >= 1.0]
rms = [math.sqrt(sum(float(row[name]) ** 2 for row in late) / len(late))
       for name in ("error.PD", "error.computed")]
claim("csv_has_the_errors_that_are_printed",
      [] if len(rows) == 600 and abs(rms[0] / pd - 1) < 0.01 and abs(rms[1] / computed - 1) < 0.01 else [f"{rms}"])

pd, exact, _ = follow("--error", "0")
claim("with_an_exact_model_pd_errs_a_hundred_times_more", [] if pd > 100 * exact else [f"{pd} {exact}"])
_, more, _ = follow("--error", "15")
claim("a_worse_model_errs_more", [] if more > computed > exact else [f"{more} {computed} {exact}"])
finish()
