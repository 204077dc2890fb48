#!/usr/bin/env python3
"""Ctrl-C and questions, on pseudo-terminals and without one.

terminal.py KINETREE

An interrupted run names its partial file, counts its records, and states how to continue; what it advises is then done, and
must give the bytes of a run without a break. Large sweeps ask on a terminal.
"""
# SPDX-License-Identifier: Apache-2.0
import fcntl
import os
import pathlib
import pty
import re
import select
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import termios
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note  # noqa: E402

command = os.path.realpath(sys.argv[1])
PATIENCE = 120  # s

# A double pendulum, long enough to be interrupted.
LONG = """kinetree: 1
parameters: {m: 1}
bodies:
  - {name: upper, joint: {type: revolute, axis: y, position: 1}, mass: =m, com: [0, 0, -0.5]}
  - {name: lower, parent: upper, joint: {type: revolute, axis: y, at: [0, 0, -1]}, mass: 1, com: [0, 0, -0.5]}
simulate: {duration: 600, integrator: rk4, step: 1e-3}
output: {interval: 0.01, record: [position]}
"""
SHORT = """kinetree: 1
parameters: {m: 1}
bodies: [{name: stone, joint: {type: prismatic, axis: z}, mass: =m}]
simulate: {duration: 0.01, integrator: rk4, step: 0.01}
output: {record: [position]}
"""


def lines_of(name):
    """Whole lines behind the first one."""
    return max(pathlib.Path(name).read_bytes().count(b"\n") - 1, 0) if pathlib.Path(name).exists() else 0


def interrupt(arguments, is_due, before=None):
    """Sends SIGINT once is_due(); returns the exit status and standard error."""
    process = subprocess.Popen([command, *arguments], stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True, preexec_fn=before)
    end = time.monotonic() + PATIENCE
    while process.poll() is None and not is_due() and time.monotonic() < end:
        time.sleep(0.002)
    process.send_signal(signal.SIGINT)
    try:
        told = process.communicate(timeout=PATIENCE)[1]
    except subprocess.TimeoutExpired:
        process.kill()
        told = process.communicate()[1]
    note(f"{' '.join(arguments[:2])}: status {process.returncode}, {told.strip()!r}")
    return process.returncode, told


def check_interrupted(name, status, told, partial, words, unit):
    """The message of an interrupted command, and the count in it."""
    problems = [] if status == -signal.SIGINT else [f"status {status}, bound {-signal.SIGINT}"]
    found = re.search(rf"interrupted: {re.escape(partial)} holds (\d+) {unit}s?\. ", told)
    late = 1000 if unit == "run" else 0  # other threads of a sweep may write until the program ends
    if found is None or not 1 <= int(found[1]) <= lines_of(partial) <= int(found[1]) + late:
        problems.append(f"{told!r}, bound {lines_of(partial)} {unit}s in {partial}")
    problems += [f"{told!r} lacks {word!r}" for word in words if word not in told]
    claim(name, problems)


def runs():
    status, told = interrupt(["run", "long.yaml", "--out", "a.csv", "--quiet"], lambda: lines_of("a.csv.partial") > 20)
    check_interrupted("an_interrupted_run_names_its_records_and_the_remedy", status, told, "a.csv.partial",
                      ["cannot be continued", "--checkpoint FILE", "--resume FILE"], "record")
    status, told = interrupt(["run", "long.yaml", "--out", "f.csv", "--quiet", "--checkpoint", "none.state", "--checkpoint-interval", "1000"],
                             lambda: lines_of("f.csv.partial") > 20)
    check_interrupted("before_the_first_checkpoint_it_names_the_interval", status, told, "f.csv.partial", ["no checkpoint yet", "--checkpoint-interval"], "record")
    claim("and_leaves_no_file_of_checkpoints", [f"{name} is left" for name in ("none.state", "none.state.new") if os.path.lexists(name)])
    whole = ["run", "long.yaml", "--out", "b.csv", "--quiet", "--checkpoint", "b.state", "--checkpoint-interval"]
    state, times = pathlib.Path("b.state"), set()

    def has_two_checkpoints():  # at the second one the message has the first one
        if state.exists() and state.stat().st_size > 0:
            times.add(state.stat().st_mtime_ns)
        return len(times) > 1

    status, told = interrupt([*whole, "0.05"], has_two_checkpoints)
    check_interrupted("with_a_checkpoint_it_names_resume_and_the_file", status, told, "b.csv.partial", ["--resume b.state"], "record")
    first = lines_of("b.csv.partial")
    status, told = interrupt([*whole, "1000", "--resume", "b.state"], lambda: lines_of("b.csv.partial") > first + 20)
    check_interrupted("a_resumed_run_can_be_resumed_again", status, told, "b.csv.partial", ["--resume b.state"], "record")
    subprocess.run([command, *whole, "1000", "--resume", "b.state"], check=True)
    subprocess.run([command, "run", "long.yaml", "--out", "c.csv", "--quiet"], check=True)
    claim("the_advice_leads_to_the_bytes_of_a_run_without_a_break",
          [] if pathlib.Path("b.csv").read_bytes() == pathlib.Path("c.csv").read_bytes() else ["b.csv and c.csv differ"])
    status, told = interrupt(["run", "long.yaml", "--out", "-", "--quiet"], lambda: True)
    claim("without_a_partial_file_there_is_no_message", [] if (status, told) == (-signal.SIGINT, "") else [f"status {status}, {told!r}"])
    shell = subprocess.Popen(["sh", "-c", f"trap : INT; '{command}' run long.yaml --out d.csv --quiet; echo $?"], stdout=subprocess.PIPE,
                             stderr=subprocess.DEVNULL, text=True, start_new_session=True)
    end = time.monotonic() + PATIENCE
    while lines_of("d.csv.partial") < 20 and shell.poll() is None and time.monotonic() < end:
        time.sleep(0.002)
    os.killpg(shell.pid, signal.SIGINT)
    shown = shell.communicate(timeout=PATIENCE)[0].strip()
    claim("shells_show_the_exit_status_130", [] if shown == "130" else [f"{shown!r}, bound 130"])
    ignore = lambda: signal.signal(signal.SIGINT, signal.SIG_IGN)  # as nohup and scripts do  # noqa: E731
    status, told = interrupt(["run", "long.yaml", "--out", "e.csv", "--quiet"], lambda: lines_of("e.csv.partial") > 20, ignore)
    claim("a_signal_that_is_ignored_stays_ignored", [] if (status, told) == (0, "") else [f"status {status}, {told!r}"])


# Sends SIGINT to the process that writes lines, before it leaves the group of the run.
EARLY = """#include <signal.h>
#include <sys/syscall.h>
#include <unistd.h>
int setsid(void) { return kill(getpid(), SIGINT), (int)syscall(SYS_setsid); }
"""


def writers():
    """Ctrl-C goes to all processes of a group. The one that writes lines ends its write and prints nothing."""
    if shutil.which("cc") is None:
        print("skipped: there is no compiler cc")
        return
    pathlib.Path("early.c").write_text(EARLY)
    subprocess.run(["cc", "-shared", "-fPIC", "early.c", "-o", "early.so"], check=True)
    environment = {**os.environ, "LD_PRELOAD": os.path.abspath("early.so"), "ASAN_OPTIONS": "verify_asan_link_order=0"}
    done = subprocess.run([command, "run", "long.yaml", "--duration", "20", "--out", "g.csv", "--quiet"], env=environment, capture_output=True, text=True, check=False)
    subprocess.run([command, "run", "long.yaml", "--duration", "20", "--out", "h.csv", "--quiet"], check=True)
    claim("the_process_that_writes_lines_reports_no_interrupt", [] if (done.returncode, done.stderr) == (0, "") else [f"status {done.returncode}, {done.stderr!r}"])
    claim("and_writes_all_of_them", [] if done.returncode == 0 and pathlib.Path("g.csv").read_bytes() == pathlib.Path("h.csv").read_bytes() else ["g.csv and h.csv differ"])


def sweeps():
    sweep = ["sweep", "long.yaml", "--vary", "m=1:2:40", "--set", "simulate.duration=200", "--jobs", "2", "--quiet", "--out", "s.csv"]
    status, told = interrupt(sweep, lambda: lines_of("s.csv.partial") > 2)
    check_interrupted("an_interrupted_sweep_names_its_runs_and_resume", status, told, "s.csv.partial", ["repeat the command with --resume"], "run")
    left = lines_of("s.csv.partial")
    subprocess.run([command, *sweep, "--resume"], check=True)
    subprocess.run([command, *sweep[:-1], "t.csv"], check=True)
    claim("its_advice_leads_to_the_bytes_of_a_sweep_without_a_break",
          [] if pathlib.Path("s.csv").read_bytes() == pathlib.Path("t.csv").read_bytes() and 0 < left < 40 else [f"{left} runs before the break"])


def on_terminal(arguments, answer, enough=None, columns=80):
    """Runs on a pseudo-terminal, and answers its question; SIGINT once the output has `enough`. Returns status and output."""
    pid, terminal = pty.fork()
    if pid == 0:
        fcntl.ioctl(0, termios.TIOCSWINSZ, struct.pack("4H", 24, columns, 0, 0))
        os.execv(command, [command, *arguments])
    seen, is_answered, end = b"", False, time.monotonic() + PATIENCE
    while time.monotonic() < end:
        if select.select([terminal], [], [], 0.05)[0]:
            try:
                block = os.read(terminal, 65536)
            except OSError:
                break  # the other side is closed
            if not block:
                break
            seen += block
        if not is_answered and b"[y/N] " in seen:
            os.write(terminal, answer)
            is_answered = True
        if enough is not None and enough():
            os.write(terminal, b"\x03")
            enough = None
    else:
        os.kill(pid, signal.SIGKILL)
    status = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    os.close(terminal)
    told = seen.decode(errors="replace")
    note(f"{' '.join(arguments[:2])} on a terminal: status {status}, {told.strip()[:300]!r}")
    return status, told


def bars():
    """Bars of progress fit the terminal, so that each one replaces the one before."""
    for columns in (20, 40, 70, 200):
        end = time.monotonic() + 2.5
        _, told = on_terminal(["run", "long.yaml", "--duration", "1e6", "--out", "bar.csv"], b"", lambda: time.monotonic() > end, columns)  # noqa: B023
        drawn = [part.partition("\033[K")[0] for part in told.split("\r  ")[1:] if "%" in part]
        wrong = [line for line in drawn if len(line) + 2 >= columns or not re.search(r"\d %", line) or (columns > 20 and "left" not in line)]
        claim(f"bars_fit_{columns}_columns", wrong if drawn else [repr(told)])
        claim(f"bars_are_drawn_in_{columns}_columns", [] if columns < 40 or all(len(line) > 30 for line in drawn) else drawn[:1])


def seconds_of(told):
    found = re.search(r"(\d+) runs take about ([0-9.]+) (days|h|min|s)\. Start\? \[y/N\]", told)
    return (int(found[1]), float(found[2]) * {"days": 86400, "h": 3600, "min": 60, "s": 1}[found[3]]) if found else (0, float("nan"))


def questions():
    many = ["sweep", "short.yaml", "--vary", "m=1:2:100001", "--out", "q.csv"]
    pathlib.Path("q.csv.partial").write_text("of another sweep\n")
    for answer in (b"n\n", b"\n", b"\x04"):
        status, told = on_terminal(many, answer)
        claim(f"a_large_sweep_asks_and_{answer!r}_leaves_all_as_it_was",
              [] if status == 1 and seconds_of(told)[0] == 100001 and "not started" in told and not pathlib.Path("q.csv").exists()
              and pathlib.Path("q.csv.partial").read_text() == "of another sweep\n" else [f"status {status}, {told!r}"])
    began = []

    def has_lines(count):
        if not began and lines_of("q.csv.partial") > 0:
            began.append((time.monotonic(), lines_of("q.csv.partial")))
        return lines_of("q.csv.partial") > count

    status, told = on_terminal(many, b"y\n", lambda: has_lines(3000))
    ended, runs_done = time.monotonic(), lines_of("q.csv.partial")
    check_interrupted("y_starts_it", status, told, "q.csv.partial", ["--resume"], "run")
    spent = (ended - began[0][0]) / (runs_done - began[0][1]) * 100001
    ratio = seconds_of(told)[1] / spent
    note(f"expected {seconds_of(told)[1]:.3g} s, that of {runs_done} runs, for all, {spent:.3g} s: ratio {ratio:.3g}, bounds 0.1 and 10")
    claim("the_expected_time_is_that_of_the_runs_within_a_factor_of_10", [] if 0.1 < ratio < 10 else [f"ratio {ratio:.3g}"])
    status, told = on_terminal([*many, "--resume"], b"n\n", lambda: has_lines(runs_done + 50))
    check_interrupted("runs_that_are_left_of_a_sweep_decide", status, told, "q.csv.partial", ["--resume"], "run")
    claim("resume_asks_nothing_before_100000_further_runs", [] if "[y/N]" not in told else [repr(told)])
    for name, arguments in (("100000_runs", [*many[:3], "m=1:2:100000", "--out", "u.csv"]), ("quiet_sweeps", [*many[:4], "--out", "v.csv", "--quiet"])):
        status, told = on_terminal(arguments, b"n\n", lambda: lines_of(f"{arguments[5]}.partial") > 20)  # noqa: B023
        check_interrupted(f"{name}_start_without_a_question", status, told, f"{arguments[5]}.partial", ["--resume"], "run")
        claim(f"{name}_ask_nothing", [] if "[y/N]" not in told else [repr(told)])
    more = [*many[:3], "m=1:2:200001", "--out", "r.csv", "--resume"]
    status, told = on_terminal(more, b"n\n")
    claim("resume_asks_before_more_than_100000_further_runs", [] if status == 1 and seconds_of(told)[0] == 200001 else [f"status {status}, {told!r}"])
    status, told = on_terminal(more, b"y\n", lambda: lines_of("r.csv.partial") > 100)
    check_interrupted("control_c_on_a_terminal_names_the_partial_file", status, told, "r.csv.partial", ["--resume"], "run")
    status, told = interrupt([*many[:4], "--out", "w.csv"], lambda: lines_of("w.csv.partial") > 20)
    check_interrupted("without_a_terminal_it_starts", status, told, "w.csv.partial", ["--resume"], "run")
    claim("and_prints_the_number", [] if "sweep: 100001 runs\n" in told and "[y/N]" not in told else [repr(told)])


with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    pathlib.Path("long.yaml").write_text(LONG)
    pathlib.Path("short.yaml").write_text(SHORT)
    for part in (runs, writers, bars, sweeps, questions):
        part()
finish()
