"""A check that cannot fail proves nothing: every test of failing.c must be seen to fail, and those of crashing.c to end.

selftest.py PROGRAM SOURCE; the program has crashing.c, too.
"""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import re
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish

program, source = sys.argv[1:]
names = re.findall(r"^KT_TEST\((\w+)\)", pathlib.Path(source).read_text(), flags=re.M)
run = subprocess.run([program], capture_output=True, text=True)
output = run.stdout + run.stderr
seen = {mark: re.findall(rf"^\[ +{mark} +\] failing/(\w+)$", output, flags=re.M) for mark in ("RUN", "OK", "FAILED")}

claim("every_test_is_run_without_a_list", [] if names and seen["RUN"] == names else [f"run: {seen['RUN']}"])
claim("every_failing_check_fails_its_test",
      [f"{name} did not fail" for name in names if name not in seen["FAILED"] or name in seen["OK"]])
claim("checks_go_on_after_a_failure", [] if re.search(r"^ +y +true$", output, flags=re.M) else ["the second was not made"])
marked = re.findall(r"^ +(.*): (slack|tight) .*?(slack)?$", output, flags=re.M)
claim("slack_is_marked", [f"{what} is marked '{mark}'" for what, kind, mark in marked if (kind == "slack") != (mark == "slack")]
      if len(marked) == 6 else [f"checks: {marked}"])
claim("worst_names_its_place", [] if re.search(r"at second  \(1 of 3 fail\)", output) else ["no place"])
claim("program_reports_failure", [] if run.returncode == 1 else [f"status {run.returncode}"])
ends = [re.findall(rf"^\[ +{mark} +\] crashing/(\w+)", output, flags=re.M) for mark in ("RUN", "OK", "FAILED")]
last = "process_ends_badly_after_its_last_test"
claim("crash_fails_its_test_and_the_others_are_run",
      [] if ends == [["file_does_not_see_what_another_left", "crash_ends_its_process", "test_behind_a_crash_is_run",
                      "exit_ends_its_process", "test_behind_an_exit_is_run", last],
                     ["file_does_not_see_what_another_left", "test_behind_a_crash_is_run", "test_behind_an_exit_is_run", last],
                     ["crash_ends_its_process", "exit_ends_its_process", last]] else [f"{ends}"])
claim("crash_is_told", [] if re.search(r"ended by signal 6", output) and re.search(r"ended with status 3", output) else [output])
one = subprocess.run([program, "true_*"], capture_output=True, text=True)
claim("pattern_chooses_tests", [] if re.findall(r"^\[ +RUN +\] failing/(\w+)$", one.stdout, flags=re.M) == ["true_is_false"]
      else [one.stdout])
finish()
