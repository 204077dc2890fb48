"""Each allocation of the command fails in turn, alone: it ends with an exit code and a word, or does its work all the same.

memory.py PRELOAD.so KINETREE SCENES
"""
# SPDX-License-Identifier: Apache-2.0
import os
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

preload, kinetree, scenes = sys.argv[1:]
FORTRAN = b"Operating system error: Cannot allocate memory"  # its runtime's own end, while OpenBLAS is loaded
MOST = 120  # allocations made to fail in one command line: the first half of them one by one, then evenly spread


def run(folder, words, fail_at):
    environment = {**os.environ, "LD_PRELOAD": preload, "KT_FAIL_AT": str(fail_at), "KT_COUNT_TO": str(folder / "count")}
    return subprocess.run([kinetree, *words], capture_output=True, cwd=folder, env=environment, timeout=600)


def chosen(count, most):
    if count <= most:
        return list(range(1, count + 1))
    half = most // 2
    return list(range(1, half + 1)) + [half + round((count - half) * (k + 1) / half) for k in range(half)]


def results(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.name.startswith("out")}


def clear(folder):
    for path in folder.iterdir():
        if path.name.startswith("out"):
            path.unlink()


def lost(whole, got):
    """Whether a warning is missing, and nothing says why."""
    kinds = [sum(b"warning" in line for line in ran.stderr.splitlines()) for ran in (whole, got)]
    return kinds[1] < kinds[0] and not any(word in got.stderr for word in (b"memory", b"allocated"))


def problems(words, most=MOST):
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        whole = run(folder, words, 0)
        if whole.returncode != 0:
            return [f"status {whole.returncode}", whole.stderr.decode()]
        expected = (whole.stdout, results(folder))
        count = int((folder / "count").read_text())
        found, failed = [], 0
        for n in chosen(count, most):
            clear(folder)
            got = run(folder, words, n)
            if got.returncode == 0:
                if (got.stdout, results(folder)) != expected:
                    found.append(f"allocation {n}: status 0, and another result")
                if lost(whole, got):
                    found.append(f"allocation {n}: status 0, and a warning less, without a word")
            elif FORTRAN in got.stderr:
                pass
            elif got.returncode not in (2, 3, 4) or not got.stderr:
                found.append(f"allocation {n}: status {got.returncode}: {got.stderr.decode(errors='replace')[:200]}")
            failed += got.returncode != 0
        note(f"{words[0]}: {count} allocations, {len(chosen(count, most))} made to fail, {failed} of them told")
        return found if failed >= 5 else found + [f"only {failed} were told"]


four_bar = f"{scenes}/four-bar.yaml"
andrews = f"{scenes}/andrews.yaml"
# No summary and no cpu time in what is compared: that differs from run to run.
claim("run_stands_it", problems(["run", andrews, "--quiet", "--duration", "1e-3", "--out", "out.csv",
                                 "--record", "position,energy,reaction,balance"]))
claim("view_stands_it", problems(["view", four_bar, "--quiet", "--duration", "1e-2", "--interval", "1e-4", "--view", "out.html", "--glb", "out.glb"]))
claim("absolute_run_stands_it", problems(["run", four_bar, "--quiet", "--duration", "1e-2", "--out", "out.csv",
                                          "--formulation", "absolute"]))
claim("checkpoint_stands_it", problems(["run", four_bar, "--quiet", "--duration", "1e-2", "--out", "out.csv",
                                        "--checkpoint", "state", "--checkpoint-interval", "1e-9"]))
with tempfile.TemporaryDirectory() as place:
    swing = pathlib.Path(place) / "swing.yaml"  # 2.4 steps a period, which is warned of
    swing.write_text("kinetree: 1\nbodies: [{name: mass, mass: 2, joint: {type: prismatic, axis: x, velocity: 1}}]\n"
                     "effects: [{type: joint_spring, joint: mass, stiffness: 800}]\n", encoding="utf-8")
    claim("warnings_of_steps_are_not_lost", problems(["run", str(swing), "--duration", "2", "--out", "out.csv",
                                                      "--integrator", "rk4", "--step", "0.13", "--interval", "0.13"], most=1000))
claim("evaluate_stands_it", problems(["evaluate", four_bar]))
claim("info_stands_it", problems(["info", andrews]))
claim("check_stands_it", problems(["check", four_bar]))


def status_without_a_line():
    """The exit status of a study along a parameter whose file lacks a line for want of memory; None: none lacked one."""
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "arm.yaml").write_text("kinetree: 1\nparameters: {L: 1}\ngravity: [0, 0, -9.81]\n"
                                         "bodies: [{name: a, joint: {type: revolute, axis: y, position: 1}, "
                                         "mass: 1, com: [=L, 0, 0]}]\nsimulate: {duration: 0.1}\n", encoding="utf-8")
        words = ["accuracy", "arm.yaml", "--vary", "L=1,2", "--integrators", "rk4", "--quiet", "--out", "out.csv"]
        run(folder, words, 0)
        for n in range(1, int((folder / "count").read_text()) + 1):
            got = run(folder, words, n)
            if b"a line is left out" in got.stderr:
                return got.returncode
    return None


status = status_without_a_line()
claim("a_line_that_is_left_out_is_an_exit_status", [] if status == 4 else [f"status {status}"])
finish()
