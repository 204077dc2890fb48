#!/usr/bin/env python3
"""Counts the single tests in meson's testlog.json, and shows what each that failed has printed.

A program prints "[       OK ] name" for each test that passes and "[  FAILED  ] name" for each that fails.
One that prints no such line is one test by itself; one that fails without saying which test did counts as one failure.
"[  SKIPPED ] name: reason" tells what this machine cannot show; those reasons stand before the last line, and are neither
passed nor failed. Bounds marked "slack" (check.h) are counted, and the tests that have them named. The last line is "N passed, M failed".

count.py LOG [WORDS...]: each of WORDS is a line before the last one. --slowest prints the ten slowest programs.
"""
# SPDX-License-Identifier: Apache-2.0
import json
import re
import sys

PASSED = re.compile(r"^\[ +OK +\] \S", re.M)
FAILED = re.compile(r"^\[ +FAILED +\] \S", re.M)
SLACK = re.compile(r"^ {7}.* ratio \S+  slack\b", re.M)
SKIPPED = re.compile(r"^\[ +SKIPPED +\] (.+?): (.+)$", re.M)


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


def show_slowest(took):
    """The table of the ten slowest."""
    print("seconds  the ten slowest")
    for seconds, name in sorted(took, reverse=True)[:10]:
        print(f"{seconds:7.1f}  {name}")


def main(path, *words):
    passed = failed = 0
    skipped, slack, took = {}, {}, []
    with open(path, encoding="utf-8") as log:
        for line in log:
            test = json.loads(line)
            took.append((test.get("duration", 0.0), test["name"].split(" / ")[-1]))
            texts = [test.get(key) or "" for key in ("stdout", "stderr")]
            well = sum(len(PASSED.findall(text)) for text in texts)
            ill = sum(len(FAILED.findall(text)) for text in texts)
            loose = sum(len(SLACK.findall(text)) for text in texts)
            if loose:
                slack[test["name"].split(" / ")[-1]] = loose
            told = [found for text in texts for found in SKIPPED.findall(text)]
            if test["result"] == "SKIP" and not told:
                told = [(test["name"].split(" / ", 1)[-1], "it does not say why")]
            for name, reason in told:
                skipped.setdefault(reason, []).append(name)
            if test["result"] == "SKIP":
                continue
            if test["result"] != "OK":
                ill = max(ill, 1)
                print(f"---- {test['name']}: {test['result']}")
                for key in ("stdout", "stderr"):
                    if test.get(key):
                        print(without_what_passed(test[key]).rstrip())
            elif well + ill == 0 and not told:
                well = 1
            passed += well
            failed += ill
    if "--slowest" in words:
        show_slowest(took)
    if slack:
        places = ", ".join(f"{name} {count}" for name, count in sorted(slack.items()))
        print(f"{sum(slack.values())} bounds are slack: {places}")
    for reason, names in skipped.items():
        print(f"skipped, {reason}: {'; '.join(names)}")
    if skipped:
        print(f"{sum(map(len, skipped.values()))} skipped")
    if passed + failed == 0:
        print("no test has run")
        failed = 1
    for line in words:
        if not line.startswith("--"):
            print(line)
    print(f"{passed} passed, {failed} failed")
    return 1 if failed else 0


sys.exit(main(*sys.argv[1:]))
