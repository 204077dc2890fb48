"""The count of a run: what is passed, failed and skipped, from the log that meson writes.

counting.py TEST/COUNT.PY
"""
# SPDX-License-Identifier: Apache-2.0
import json
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish


def counted(*tests):
    """Status and lines of the counter, of a log of (result, standard output)."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "testlog.json"
        path.write_text("".join(json.dumps({"name": f"kinetree:a / a/{i}", "result": result, "stdout": out}) + "\n"
                                for i, (result, out) in enumerate(tests)))
        ran = subprocess.run([sys.executable, sys.argv[1], path], capture_output=True, text=True, check=False)
        return ran.returncode, ran.stdout.splitlines()


def differs(observed, *expected):
    return [] if observed == (expected[0], list(expected[1:])) else [f"{observed}, not {expected}"]


TWO = "[ RUN      ] x\n[       OK ] x\n[ RUN      ] y\n[       OK ] y\n"
ONE_FAILS = "[ RUN      ] x\n  FAIL e\n[  FAILED  ] x\n[ RUN      ] y\n[       OK ] y\n"
PART = "[ RUN      ] x\n[  SKIPPED ] x, v4: no such processor\n[       OK ] x\n"
WHOLE = "[ RUN      ] x\n[  SKIPPED ] x, v4: no such processor\n"

claim("tests_and_programs_without_tests_are_counted", differs(counted(("OK", TWO), ("OK", "words\n")), 0, "3 passed, 0 failed"))
code, lines = counted(("OK", TWO), ("FAIL", ONE_FAILS))
claim("failure_is_counted_and_shown", differs((code, lines[-1:]), 1, "3 passed, 1 failed") + ([] if "  FAIL e" in lines else lines))
claim("test_that_is_skipped_as_a_whole_is_told_once",
      differs(counted(("OK", WHOLE), ("OK", TWO)), 0, "skipped, no such processor: x, v4", "1 skipped", "2 passed, 0 failed"))
claim("program_that_ends_badly_is_a_failure", differs((lambda c, l: (c, l[-1:]))(*counted(("TIMEOUT", TWO))), 1, "2 passed, 1 failed"))
claim("part_that_is_skipped_is_told_and_does_not_count",
      differs(counted(("OK", PART), ("OK", TWO)), 0, "skipped, no such processor: x, v4", "1 skipped", "3 passed, 0 failed"))
claim("what_the_same_lack_skips_stands_in_one_line",
      differs(counted(("SKIP", "[  SKIPPED ] a/b: no cat\n"), ("SKIP", "[  SKIPPED ] a/c: no cat\n"), ("OK", TWO)), 0,
              "skipped, no cat: a/b; a/c", "2 skipped", "2 passed, 0 failed"))
claim("skipped_without_a_reason_is_told", differs(counted(("SKIP", ""), ("OK", TWO)), 0, "skipped, it does not say why: a/0", "1 skipped",
                                                  "2 passed, 0 failed"))
claim("nothing_run_is_a_failure", differs(counted(("SKIP", "[  SKIPPED ] a: no cat\n")), 1, "skipped, no cat: a", "1 skipped", "no test has run",
                                          "0 passed, 1 failed"))
finish()
