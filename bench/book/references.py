"""Published references: each entry of references/index.json runs, and its quantities are held against published tables."""
# SPDX-License-Identifier: Apache-2.0
import json
import math
import os
import re
import subprocess

import compare
from table import Table

HERE = os.path.dirname(os.path.abspath(__file__))
TABLES = os.path.join(HERE, "..", "..", "test", "reference", "data")
COLUMNS = ["source", "problem", "quantity", "times", "all times", "own", "observed", "bound", "verdict"]
TEXT = [
    "Each problem of `bench/book/references/index.json` runs with `kinetree run`. *Observed* is the largest difference to the",
    "published values, over their largest value. *Own* is the difference to a run with a hundredfold tolerance: it bounds the",
    "error of the run, so the rest of *observed* belongs to the source. *All times* includes the times after the last one that",
    "the index compares, with its reason."]


def load():
    with open(os.path.join(HERE, "references", "index.json")) as file:
        return json.load(file)


def published(group, entry):
    """The published table of an entry: names of columns of the run, and rows."""
    if "table" not in entry:
        return compare.read(os.path.join(HERE, "references", group["name"], entry["name"] + ".csv"))
    with open(os.path.join(TABLES, entry["table"] + ".json")) as file:
        data = json.load(file)["reference"]
    where = [data["columns"].index(name) for name in entry["columns"]]
    rows = [[t] + [float(row[k]) for k in where] for t, row in zip(data["t"], data["value"])]
    return ["time"] + list(entry["columns"].values()), rows


def scene_of(group, entry):
    return os.path.join(HERE, entry.get("scene", os.path.join("scenes", group["name"], entry["name"] + ".yaml")))


def run(kinetree, group, entry, work, factor):
    """The records of a run whose tolerance is a factor of the entry's; None and the message of a run that fails."""
    path, options = scene_of(group, entry), list(entry.get("options", []))
    if "--tolerance" in options:
        k = options.index("--tolerance") + 1
        options[k] = f"{factor * float(options[k]):g}"
    else:
        with open(path) as file:
            options += ["--tolerance", f"{factor * float(re.search(r'tolerance: ([0-9.e+-]+)', file.read()).group(1)):g}"]
    out = os.path.join(work, f"{group['name']}-{entry['name']}.csv")
    ended = subprocess.run([kinetree, "run", path, "--quiet", "--out", out, *options], capture_output=True, text=True)
    if ended.returncode != 0:
        return None, (ended.stderr.strip().splitlines() or [f"exit status {ended.returncode}"])[-1]
    return compare.read(out), None


def measure(kinetree, group, entry, work):
    """[(quantity, times, error over all times, own error, error, bound)] of an entry."""
    names, rows = published(group, entry)
    chosen = [row for row in rows if row[0] <= entry.get("until", rows[-1][0]) * (1.0 + 1e-9)]
    bounds = {**group["bounds"], **entry.get("bounds", {})}
    found, fault = run(kinetree, group, entry, work, 1.0)
    coarse, coarse_fault = run(kinetree, group, entry, work, 100.0)
    if fault or coarse_fault:
        return [(fault or coarse_fault, len(chosen), None, None, math.nan, math.inf)]
    errors, whole = compare.errors((names, chosen), found), compare.errors((names, rows), found)
    times = [row[0] for row in chosen]
    own = compare.errors((names, [[t] + row for t, row in zip(times, compare.at_times(*coarse, names[1:], times))]), found)
    return [(quantity, len(chosen), whole[quantity][0], own[quantity][0], error, bounds.get(quantity, bounds.get("*", 0.0)))
            for quantity, (error, _) in errors.items()]


def sources():
    table = Table("sources", "Sources", ["source", "title", "where", "version", "licence", "digits"])
    for name, source in load()["sources"].items():
        table.add(name, *(source[key] for key in ["title", "where", "version", "licence", "digits"]))
    return table


def reasons():
    """What the index leaves out or bounds more widely than its set does, and why."""
    table = Table("reasons", "Exceptions", ["source", "problem", "exception", "reason"])
    for group in load()["sets"]:
        for entry in group["entries"]:
            if "reason" in entry:
                text = f"until {entry['until']:g} s" if "until" in entry else "wider bounds"
                table.add(group["name"], entry["name"], text, entry["reason"])
    return table


def summary(detail):
    """For each source the number of values, and the one that is nearest to its bound."""
    table = Table("summary", "Published references in short", ["source", "problems", "quantities", "nearest to its bound", "observed over bound"])
    index, rows = load(), detail.rows
    for name in dict.fromkeys(row[0] for row in rows):
        own = [row for row in rows if row[0] == name]
        near = max(own, key=lambda row: math.inf if row[6] == "NaN" else float(row[6]) / float(row[7]))
        source = next(group["source"] for group in index["sets"] if group["name"] == name)
        table.add(index["sources"][source]["title"], len({row[1] for row in own}), len(own), f"{near[1]}, {near[2]}",
                  float(near[6]) / float(near[7]))
    return table


def tables(context):
    table = Table("references", "Published references", COLUMNS, TEXT)
    for group in load()["sets"]:
        for entry in group["entries"]:
            for quantity, times, whole, own, error, bound in measure(context.kinetree, group, entry, context.work):
                table.add(group["name"], entry["name"], quantity, times, whole, own, observed=error, bound=bound)
    return [summary(table), table, reasons(), sources()]
