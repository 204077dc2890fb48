#!/usr/bin/env python3
"""Counts the single tests in meson's testlog.json, and shows what each that failed has printed.

A program prints "[       OK ] name" for each test that passes and "[  FAILED  ] name" for each that fails, as cmocka does.
One that prints no such line is one test by itself; one that fails without saying which test did counts as one failure.
The last line is "N passed, M failed".
"""
import json
import re
import sys

PASSED = re.compile(r"^\[ +OK +\] \S", re.M)
# The list after the run says "N test(s)" and repeats the names: only what comes before it counts.
FAILED = re.compile(r"^\[ +FAILED +\] (?!\d+ test)\S", re.M)
SKIPPED = re.compile(r"^\[ +SKIPPED +\] (?!\d+ test)\S", re.M)
SUMMARY = re.compile(r"^\[ +FAILED +\] \d+ test.*", re.M | re.S)


def during_the_run(text):
    return SUMMARY.sub("", text)


def without_what_passed(text):
    """The output less the lines from a test's start, or from the test before it, to its OK."""
    kept, section = [], []
    for line in text.splitlines():
        if re.match(r"\[ +RUN +\]", line):
            kept += section
            section = []
        section.append(line)
        if PASSED.match(line):
            section = []
        elif FAILED.match(line):
            kept += section
            section = []
    return "\n".join(kept + section)


def main(path):
    passed = failed = skipped = 0
    with open(path, encoding="utf-8") as log:
        for line in log:
            test = json.loads(line)
            texts = [during_the_run(test.get(key) or "") for key in ("stdout", "stderr")]
            well = sum(len(PASSED.findall(text)) for text in texts)
            ill = sum(len(FAILED.findall(text)) for text in texts)
            skipped += sum(len(SKIPPED.findall(text)) for text in texts)
            if test["result"] in ("SKIP",):
                skipped += 1
                continue
            if test["result"] != "OK":
                ill = max(ill, 1)
                print(f"---- {test['name']}: {test['result']}")
                for key in ("stdout", "stderr"):
                    if test.get(key):
                        print(without_what_passed(test[key]).rstrip())
            elif well + ill == 0:
                well = 1
            passed += well
            failed += ill
    if skipped:
        print(f"{skipped} skipped")
    if passed + failed == 0:
        print("no test has run")
        failed = 1
    print(f"{passed} passed, {failed} failed")
    return 1 if failed else 0


sys.exit(main(sys.argv[1]))
