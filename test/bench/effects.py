"""bench/effects: a line for every type of effect, whole and in order.

effects.py PROGRAM MODEL-HEADER OPTION...
"""
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

program, header, *options = sys.argv[1:]
types = re.findall(r"X\(KT_EFFECT_\w+, (\w+)\)", pathlib.Path(header).read_text()) + ["custom"]
with tempfile.TemporaryDirectory() as folder:
    name = pathlib.Path(folder) / "figures.csv"
    ran = subprocess.run([program, "--csv", str(name), *options], capture_output=True, text=True)
    rows = list(csv.DictReader(open(name, encoding="utf-8", newline=""))) if name.exists() else []
claim("results_are_to_be_trusted", [] if ran.returncode == 0 else [f"status {ran.returncode}", *ran.stdout.splitlines(), *ran.stderr.splitlines()])
claim("every_type_has_its_rows", [t for t in types if sum(row["effect"] == t for row in rows) != 3] if len(types) > 12 else ["too few types"])
claim("every_type_is_printed", [t for t in types if not any(line.split()[:1] == [t] for line in ran.stdout.splitlines())])
claim("samples_are_ordered", [f"{row}" for row in rows
      if not 0.0 < float(row["least_s"]) <= float(row["low_s"]) <= float(row["median_s"]) <= float(row["high_s"])])
note(f"{sum(row['each_instructions'] != '' for row in rows)} of {len(rows)} rows have counted instructions")
claim("instructions_of_each_are_counted_or_left_blank",
      [row["effect"] for row in rows if row["each_instructions"] and not
       (math.isfinite(float(row["each_instructions"])) and float(row["each_instructions"]) > 0.0)])
finish()
