#!/usr/bin/env python3
"""Files of sweeps: records of all runs in one HDF5 file, and pictures of their lines and motions.

sweep_files.py COMMAND
"""
# SPDX-License-Identifier: Apache-2.0
import array
import os
import pathlib
import re
import shutil
import signal
import subprocess
import time

from swept import check, command, finish, rows, run, same


def dump(file, name):
    """The numbers of a dataset, by h5dump."""
    subprocess.run(["h5dump", "-d", name, "-b", "LE", "-o", "dump.bin", file], check=True, capture_output=True)
    return array.array("d", pathlib.Path("dump.bin").read_bytes())


def texts(file, name):
    return re.findall(r'"([^"]*)"', subprocess.run(["h5dump", "-d", name, file], check=True, capture_output=True, text=True).stdout.split("DATA {")[1])


def has_h5dump(part):
    """Whether the HDF5 files of a part can be read here."""
    found = shutil.which("h5dump") is not None
    if not found:
        print(f"[  SKIPPED ] {part}: h5dump is not on this machine")
    return found


def attributes(file, name):
    words = subprocess.run(["h5dump", "-A", "-m", "%.17g", "-d", name, file], check=True, capture_output=True, text=True).stdout
    return dict(re.findall(r'ATTRIBUTE "([^"]+)" \{.*?\(0\): "?([^\n"]+)"?\n', words, re.DOTALL))


def kept():
    """All records in one HDF5 file, read by another program, against those of runs alone as CSV."""
    sweep = ["bounce.yaml", "--vary", "v=1,4,7", "--vary", "bodies.stone.mass=1,-1", "--quiet"]
    done = subprocess.run([command, "sweep", *sweep, "--out", "h.csv", "--keep", "h.h5"], capture_output=True, text=True, check=False)
    if "built without HDF5" in done.stderr:
        same("without HDF5: exit code, and nothing is left", (done.returncode, list(pathlib.Path().glob("h.*"))), (1, []))
        same("run without HDF5", subprocess.run([command, "run", "bounce.yaml", "--out", "h.h5"], capture_output=True, check=False).returncode, 1)
        return
    same("exit code with --keep", done.returncode, 0)
    whole = pathlib.Path("h.h5").read_bytes()
    time.sleep(1.1)  # no times of the clock are in it
    run(*sweep, "--jobs", "1", "--out", "h.csv", "--keep", "h.h5")
    same("the same bytes by one thread, later", pathlib.Path("h.h5").read_bytes() == whole, True)
    same("no side file is left", list(pathlib.Path().glob("h.h5.*")), [])
    lines = pathlib.Path("h.csv").read_bytes()
    run("bounce.yaml", "--vary", "g=1:20:100", "--quiet", "--out", "i.csv", "--keep", "i.h5")
    long, records = pathlib.Path("i.csv").read_bytes(), pathlib.Path("i.h5").read_bytes()
    process = subprocess.Popen([command, "sweep", "bounce.yaml", "--vary", "g=1:20:100", "--quiet", "--jobs", "1", "--out", "i.csv", "--keep", "i.h5"])
    partial = pathlib.Path("i.h5.partial")
    while process.poll() is None and not (partial.exists() and partial.stat().st_size > 0):
        time.sleep(0.001)
    process.send_signal(signal.SIGKILL)
    process.wait()
    with open("i.h5.partial", "ab") as file:  # the end of a run that was not finished
        file.write(b"\0" * 20)
    run("bounce.yaml", "--vary", "g=1:20:100", "--quiet", "--resume", "--out", "i.csv", "--keep", "i.h5")
    same("killed and resumed: lines and records", (pathlib.Path("i.csv").read_bytes() == long, pathlib.Path("i.h5").read_bytes() == records), (True, True))
    same("other endings are rejected", "FILE.h5" in run("bounce.yaml", "--vary", "g=1,2", "--keep", "h.csv", code=1).stderr, True)
    subprocess.run([command, "run", "bounce.yaml", "--quiet", "--out", "b.h5"], check=True)
    if not has_h5dump("records of a sweep"):
        return
    columns = texts("h.h5", "/columns")
    same("units", dict(zip(columns, texts("h.h5", "/units")))["velocity.stone"], "m/s")
    for number, line in enumerate(rows(lines.decode())):
        told = attributes("h.h5", f"/runs/{number}")
        same(f"run {number}: its values", (float(told["v"]), float(told["bodies.stone.mass"]), told["status"]), (float(line["v"]), float(line["bodies.stone.mass"]), line["status"]))
        if line["status"] != "done":
            continue
        subprocess.run([command, "run", "bounce.yaml", "--set", f"v={line['v']}", "--quiet", "--out", "a.csv"], check=True)
        numbers = [float(r[c]) for r in rows(pathlib.Path("a.csv").read_text()) for c in columns]
        same(f"run {number}: its records, to the bit", list(dump("h.h5", f"/runs/{number}")) == numbers, True)
    subprocess.run([command, "run", "bounce.yaml", "--quiet", "--out", "a.csv"], check=True)
    records = rows(pathlib.Path("a.csv").read_text())
    same("run --out FILE.h5: columns", texts("b.h5", "/columns"), list(records[0]))
    same("its records, to the bit", list(dump("b.h5", "/records")) == [float(x) for r in records for x in r.values()], True)
    same("its parameters", {k: float(v) for k, v in attributes("b.h5", "/records").items() if k != "status"}, {"v": 3, "h": 1, "g": 9.81})
    layout = subprocess.run(["h5dump", "-p", "-H", "-d", "/runs/0", "h.h5"], check=True, capture_output=True, text=True).stdout
    same("chunked and compressed", ("CHUNKED" in layout, "DEFLATE" in layout), (True, True))


def pictures():
    """What is drawn of the lines of a sweep: counted in the picture."""
    rectangle = r'd="M [-\d. ]+ L [-\d. ]+ L [-\d. ]+ L [-\d. ]+ Z'

    def plot(*arguments, code=0):
        done = subprocess.run([command, "plot", *arguments, "--out", "p.svg"], capture_output=True, text=True, check=False)
        same(f"plot {' '.join(arguments)}", done.returncode, code)
        return done.stderr if code else pathlib.Path("p.svg").read_text()

    run("fall.yaml", "--vary", "g=1:20:12", "--vary", "m=log:0.1:10:7", "--quiet", "--out", "g.csv")
    if "without cairo" in subprocess.run([command, "plot", "g.csv", "--out", "p.svg"], capture_output=True, text=True, check=False).stderr:
        return
    subprocess.run([command, "run", "bounce.yaml", "--quiet", "--out", "a.csv"], check=True)
    picture = plot("g.csv", "--map", "g,m", "--columns", "energy.kinetic.max")
    same("cells of a map, and stripes of its colours", len(re.findall(rectangle, picture)), 12 * 7 + 64)
    same("colours", len({line.split(" d=")[0] for line in picture.splitlines() if re.search(rectangle, line)}) > 60, True)
    curves = [d for d in re.findall(r'd="(M [^"]*)"', plot("g.csv", "--by", "m", "--columns", "energy.kinetic.max", "--log")) if d.count("L") > 4 and "Z" not in d]
    same("curves, one a value", len(curves), 7)
    run("fall.yaml", "--random", "g=normal(9.81,1)", "--random", "m=uniform(-0.1,1)", "--repeats", "200", "--quiet", "--out", "n.csv")
    same("runs that fail, whose words have commas", plot("n.csv", "--columns", "position.stone.end").count("runs, ") <= 1, True)
    words = plot("n.csv", "--histogram", "--columns", "g,position.stone.end")
    same("units of a histogram, and none of a parameter", ("position.stone.end, rad or m<" in words, ">g<" in words), (True, True))
    words = plot("g.csv", "--x", "g", "--by", "m", "--columns", "position.stone.end")
    same("units of curves", "position.stone.end, rad or m<" in words, True)
    head = rows(pathlib.Path("g.csv").read_text())[0].keys()
    times = [1.2867 + 0.4 * k for k in range(6)] + [5.0] * 24
    lines = [",".join(str({"run": k, "status": "done", "time": t}.get(name, 0)) for name in head) for k, t in enumerate(times)]
    pathlib.Path("t.csv").write_text("\n".join([",".join(head), *lines]) + "\n")
    bars = max((d for d in re.findall(r'd="(M [^"]*)"', plot("t.csv", "--histogram", "--columns", "time")) if "Z" not in d), key=lambda d: d.count("L"))
    points = [(float(x), float(y)) for x, y in re.findall(r"([-\d.]+) ([-\d.]+)", bars)]
    (left, floor), (right, _), top = points[0], points[-1], min(y for _, y in points)
    tops = {(round(6 * (a - left) / (right - left), 2), round(24 * (floor - y) / (floor - top), 1)) for (a, y), (b, z) in zip(points, points[1:]) if y == z < floor and a < b}
    same("bins of 30 values, 24 of which are equal: which of six, and the runs in it", tops, {(0.0, 2.0), (1.0, 2.0), (2.0, 1.0), (3.0, 1.0), (5.0, 24.0)})
    same("a map of a sample", len(re.findall(rectangle, plot("n.csv", "--map", "g,m", "--columns", "position.stone.end"))) - 64, sum(1 for line in rows(pathlib.Path("n.csv").read_text()) if line["status"] == "done"))
    lines = [",".join(str({"run": k, "status": "done", "g": g, "m": m, "time": t}.get(name, 0)) for name in head)
             for k, (g, m, t) in enumerate([(1, 1, 0), (1, 1, 2), (2, 1, 1), (1, 2, 0), (2, 2, 3)])]
    pathlib.Path("m.csv").write_text("\n".join([",".join(head), *lines]) + "\n")
    picture = plot("m.csv", "--map", "g,m", "--columns", "time")
    cells = [line.split(" d=")[0] for line in picture.splitlines() if re.search(rectangle, line)][:5]
    same("two runs at one place have the colour of their mean, 1, which a third run has", (len({*cells[:3]}), len({*cells})), (1, 3))
    same("the picture states it", "means of up to 2 runs at one place" in picture, True)
    same("not of single runs", "means of" in plot("g.csv", "--map", "g,m", "--columns", "time"), False)
    for arguments, words in ((["g.csv", "--map", "g"], "two columns"), (["g.csv", "--map", "g,q"], "no column 'q'"), (["g.csv", "--by", "q"], "no column 'q'"),
                             (["g.csv", "--columns", "position.stona"], "did you mean"), (["a.csv", "--histogram"], "this file is no sweep")):
        same(f"words of plot {arguments}", words in plot(*arguments, code=1), True)


def motions():
    """Motions over each other: of several results, and of the runs of an HDF5 file."""
    def curves(*arguments):
        done = subprocess.run([command, "plot", *arguments, "--out", "p.svg"], capture_output=True, text=True, check=False)
        same(f"plot {' '.join(arguments)}", done.returncode, 0)
        paths = [d for d in re.findall(r'd="(M [^"]*)"', pathlib.Path("p.svg").read_text()) if d.count("L") > 4]
        return sum(d.count("M") for d in paths), len(paths), done.stderr  # motions, and how many of them are apart

    pathlib.Path("cases.csv").write_text("m,g\n1,2\n3,4\n5,6\n")
    for v in (1, 2, 3):
        subprocess.run([command, "run", "bounce.yaml", "--set", f"v={v}", "--quiet", "--out", f"v{v}.csv"], check=True)
    if "without cairo" in subprocess.run([command, "plot", "v1.csv", "--out", "p.svg"], capture_output=True, text=True, check=False).stderr:
        return
    same("three results: a curve each, and colours of their own", curves("v1.csv", "v2.csv", "v3.csv", "--columns", "position.stone")[:2], (3, 3))
    told = subprocess.run([command, "plot", "v1.csv", "cases.csv", "--out", "p.svg"], capture_output=True, text=True, check=False)
    same("other columns are rejected", ("other columns" in told.stderr, told.returncode), (True, 2))
    if not pathlib.Path("h.h5").exists():
        return
    same("the runs of an HDF5 file that have records", curves("h.h5", "--columns", "position.stone")[0], 3)
    same("a single run", curves("b.h5", "--columns", "position.stone")[0], 1)
    run("fall.yaml", "--vary", "g=1:20:300", "--set", "output.interval=0.1", "--quiet", "--out", "w.csv", "--keep", "w.h5")
    drawn = curves("w.h5", "--columns", "position.stone")
    same("some of very many", (drawn[0], "200 of 300 runs" in drawn[2]), (200, True))
    pathlib.Path("no.h5").write_text("this is no HDF5")
    told = subprocess.run([command, "plot", "no.h5", "--out", "p.svg"], capture_output=True, text=True, check=False)
    same("no HDF5", ("no HDF5 file" in told.stderr, told.returncode), (True, 2))


def spreadsheets():
    """Tables of spreadsheets: a byte order mark is no part of the first name, and other separators than commas are named."""
    pathlib.Path("marked.csv").write_bytes(b"\xef\xbb\xbfm,g\r\n1,2\r\n3,4\r\n")
    pathlib.Path("plain.csv").write_text("m,g\n1,2\n3,4\n")
    lines = [run("fall.yaml", "--from", table, "--quiet", "--out", "-").stdout for table in ("marked.csv", "plain.csv")]
    same("lines of a table with a mark", lines[0] == lines[1] != "", True)
    subprocess.run([command, "run", "fall.yaml", "--quiet", "--out", "fall.csv"], check=True)
    pathlib.Path("fall2.csv").write_bytes(b"\xef\xbb\xbf" + pathlib.Path("fall.csv").read_bytes())
    for start in ("fall.csv", "fall2.csv"):
        subprocess.run([command, "run", "fall.yaml", "--quiet", "--from", f"{start}:1", "--out", f"from-{start}"], check=True)
    same("a start from records with a mark", pathlib.Path("from-fall.csv").read_bytes() == pathlib.Path("from-fall2.csv").read_bytes(), True)
    pathlib.Path("semicolons.csv").write_text("time;x\n0;1\n1;2\n")
    told = subprocess.run([command, "plot", "semicolons.csv", "--out", "p.svg"], capture_output=True, text=True, check=False)
    if "without cairo" not in told.stderr:
        same("semicolons", ("semicolons.csv:1:" in told.stderr and "commas" in told.stderr, told.returncode), (True, 2))


    for path, words in ((".", ".: this is a directory"), ("none.csv", "none.csv: cannot be read")):
        same(f"a table that is {path}", words in run("fall.yaml", "--from", path, code=2).stderr, True)
    told = subprocess.run([command, "accuracy", "fall.yaml", "--reference", "fall.yaml"], capture_output=True, text=True, check=False)
    same("a scene instead of records", ("fall.yaml:1: the first line has a single name" in told.stderr, told.returncode), (True, 2))


def streams():
    """Lines go behind earlier output of a file that is standard output, and to devices and pipes."""
    sweep = ["fall.yaml", "--vary", "m=1,2", "--quiet", "--out"]
    lines = run(*sweep, "-").stdout
    with open("shared.txt", "w", encoding="ascii") as file:
        file.write("before\n")
        file.flush()
        subprocess.run([command, "sweep", *sweep, "-"], check=True, stdout=file)
        file.seek(0, 2)
        file.write("after\n")
    same("earlier and later output stays", pathlib.Path("shared.txt").read_text() == f"before\n{lines}after\n", True)
    run(*sweep, "/dev/null")
    os.mkfifo("pipe")
    with subprocess.Popen([command, "sweep", *sweep, "pipe"]) as process:
        same("lines through a pipe", pathlib.Path("pipe").read_text() == lines, True)
    same("exit code into a pipe", process.returncode, 0)
    long = [command, "sweep", "fall.yaml", "--vary", "m=1:2:20000", "--quiet", "--out", "pipe"]
    with subprocess.Popen(long, stderr=subprocess.DEVNULL) as process:
        with open("pipe", "rb") as file:
            same("a reader of one line", file.readline(), lines.encode().splitlines(True)[0])
        try:  # it ends, by an error or by a signal, since nobody reads on
            same("it fails without a reader", process.wait(20) != 0, True)
        except subprocess.TimeoutExpired:
            process.kill()
            same("it ends without a reader", False, True)
    same("--resume on a device", "needs a file" in run(*sweep, "/dev/null", "--resume", code=1).stderr, True)


def starts():
    """A run from the records of another one: HDF5 and CSV give the same bytes."""
    run_of = [command, "run", "bounce.yaml", "--quiet"]
    done = subprocess.run([*run_of, "--out", "start.h5"], capture_output=True, text=True, check=False)
    if "built without HDF5" in done.stderr:
        return
    subprocess.run([*run_of, "--out", "start.csv"], check=True)
    for ending in ("h5", "csv"):
        done = subprocess.run([*run_of, "--from", f"start.{ending}:0.1", "--duration", "0.1", "--out", f"{ending}.csv"], capture_output=True, text=True, check=False)
        same(f"exit code of --from start.{ending}:0.1", done.returncode, 0)
    same("records from both", pathlib.Path("h5.csv").read_bytes() == pathlib.Path("csv.csv").read_bytes(), True)
    run("bounce.yaml", "--vary", "v=1,2", "--quiet", "--out", "two.csv", "--keep", "two.h5")
    done = subprocess.run([*run_of, "--from", "two.h5"], capture_output=True, text=True, check=False)
    same("records of two runs", (done.returncode, "the records of 2 runs" in done.stderr), (2, True))
    subprocess.run([command, "run", "fall.yaml", "--quiet", "--record", "position,velocity", "--out", "fall.h5"], check=True)
    study = [command, "accuracy", "fall.yaml", "--integrators", "rk4", "--steps", "0.1", "--out", "/dev/null", "--plot", "/dev/null", "--quiet"]
    same("a reference in HDF5", subprocess.run([*study, "--reference", "fall.h5"], check=False).returncode, 0)


def reported():
    """The report names both files, and those that it replaces."""
    words = ["fall.yaml", "--vary", "m=1,2", "--out", "again.csv"]
    first = run(*words).stderr
    same("the first sweep", (first.endswith("\n  again.csv\n"), "older" in first), (True, False))
    same("the second one", re.search(r"\n  replaces an older again\.csv of 20\d\d-\d\d-\d\d \d\d:\d\d\n$", run(*words).stderr) is not None, True)
    same("one into a stream", "older" in run(*words[:-1], "-").stderr, False)
    done = subprocess.run([command, "sweep", *words, "--keep", "again.h5"], capture_output=True, text=True, check=False)
    if done.returncode == 0:
        same("one with records", "\n  all records: again.h5\n  replaces an older again.csv" in done.stderr, True)
        same("and again", ", again.h5 of 20" in run(*words, "--keep", "again.h5").stderr, True)


def inputs_stay():
    """Results that would overwrite the scene, the table or a part are rejected; the inputs keep their bytes."""
    pathlib.Path("table.csv").write_text("m,g\n1,2\n3,4\n")
    for k in (1, 2):
        run("fall.yaml", "--vary", "g=1:4:4", "--quiet", "--shard", f"{k}/2", "--out", f"part{k}.csv")
    for words, file in ((["fall.yaml", "--vary", "g=1,2", "--out", "./fall.yaml"], "fall.yaml"), (["fall.yaml", "--from", "table.csv", "--out", "table.csv"], "table.csv"),
                        (["--merge", "part1.csv", "part2.csv", "--out", "part2.csv"], "part2.csv")):
        before = pathlib.Path(file).read_bytes()
        told = run(*words, "--quiet", code=1).stderr
        same(f"{file}: bytes, and the message", (pathlib.Path(file).read_bytes() == before, "itself; give the results another file" in told), (True, True))
    same("FILE.shard of a part", pathlib.Path("part2.csv.shard").exists(), True)
    same("the joined file", run("--merge", "part1.csv", "part2.csv", "--out", "parts.csv").stderr, "joined: parts.csv, 4 runs of 2 parts\n")
    same("quietly", run("--merge", "part1.csv", "part2.csv", "--quiet", "--out", "parts.csv").stderr, "")


def named():
    """Parameters with the names of columns of the lines. The HDF5 file of a parameter `status` was lost, and columns had
    equal names."""
    words = {"run": 1, "status": 2, "time": 3, "steps": 4, "evaluations": 5, "why": 6}
    text = pathlib.Path("fall.yaml").read_text().replace("m: 2}", f"m: =why, {', '.join(f'{k}: {v}' for k, v in words.items())}}}")
    pathlib.Path("named.yaml").write_text(text.replace("output:", "states: {sum: {rate: run+status+time+steps+evaluations}}\noutput:"))
    vary = [word for name, value in words.items() for word in ("--vary", f"{name}={value},{value + 1}")]
    run("named.yaml", *vary, "--quiet", "--out", "n.csv")
    names = pathlib.Path("n.csv").read_text().splitlines()[0].split(",")
    same("each column has a name of its own", len(set(names)), len(names))
    same("columns of values", names[1:8], [f"parameters.{name}" for name in words] + ["status"])
    line = rows(pathlib.Path("n.csv").read_text())[-1]
    same("values of the last run", [float(line[f"parameters.{name}"]) for name in words], [value + 1.0 for value in words.values()])
    if not pathlib.Path("h.h5").exists():
        return
    run("named.yaml", "--vary", "status=7,8", "--quiet", "--out", "n.csv", "--keep", "n.h5")
    if not has_h5dump("attributes with names of columns"):
        return
    told = attributes("n.h5", "/runs/1")
    same("attributes of a run of a sweep", (float(told["parameters.status"]), told["status"]), (8, "done"))
    subprocess.run([command, "run", "named.yaml", "--quiet", "--out", "n.h5"], check=False)
    told = attributes("n.h5", "/records")
    same("attributes of a run", (told["status"], float(told["parameters.status"]), float(told["run"])), ("done", 2, 1))


finish((kept, pictures, motions, inputs_stay, spreadsheets, streams, reported, starts, named))
