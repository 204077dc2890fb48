"""What the tests of apps/embed share."""
# SPDX-License-Identifier: Apache-2.0
import csv
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note  # noqa: F401 (for the tests)


def run(program, *options):
    """(what it says, columns by name) of a run with --csv; the claim that it worked is made here."""
    with tempfile.TemporaryDirectory() as folder:
        name = pathlib.Path(folder) / "run.csv"
        ran = subprocess.run([program, "--csv", str(name), *options], capture_output=True, text=True)
        claim("program_succeeds", [] if ran.returncode == 0 and not ran.stderr else [f"{ran.returncode}: {ran.stderr}"])
        if ran.returncode != 0:
            finish()
        with open(name, encoding="utf-8", newline="") as file:
            rows = list(csv.reader(file))
    for line in ran.stdout.splitlines():
        note(line)
    columns = {key: [float(row[i]) for row in rows[1:]] for i, key in enumerate(rows[0])}
    return ran.stdout, columns


def below(what, observed, bound):
    """Problems, if observed is not below bound; NaN is not."""
    note(f"{what}: {observed:.6g}, bound {bound:.6g}, ratio {observed / bound:.3g}")
    return [] if observed < bound else [f"{what}: {observed} is not below {bound}"]


def mistakes(program):
    """A wrong option and a file that cannot be written are told on stderr, with status 2."""
    claim("mistakes_are_told",
          [" ".join(words) for words in (["--what"], ["--csv"], ["--csv", "no/such/folder/run.csv"])
           for said in [subprocess.run([program, *words], capture_output=True, text=True)]
           if said.returncode != 2 or not said.stderr])
