"""Figures in the text of pages are those of the commands that they name.

figures.py COMMAND SOURCE-ROOT

Each is read from its page and compared with what the command says today, to the digits that the page gives. A page whose
words have changed so that a figure is not found fails, too.
"""
# SPDX-License-Identifier: Apache-2.0
import concurrent.futures
import json
import pathlib
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

COMMAND, ROOT = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
SCENES = ROOT / "apps/scenes"
QUIET = ("--quiet", "--out", "/dev/null", "--summary", "-")


def text_of(page):
    return (ROOT / "include/pages" / page).read_text()


def kinetree(*words, text=None, folder=None):
    run = subprocess.run([COMMAND, *map(str, words)], input=text, cwd=folder, capture_output=True, text=True)
    return run.stdout + run.stderr if run.returncode == 0 else f"status {run.returncode}: {run.stderr}"


def summary(scene, *options, text=None):
    """The summary of a run; empty where it fails."""
    run = subprocess.run([COMMAND, "run", scene, *map(str, options), *QUIET], input=text, capture_output=True, text=True)
    return json.loads(run.stdout) if run.returncode == 0 else {}


def cost(scene, *options, text=None):
    return summary(scene, *options, text=text).get("cost", {})


def digits_of(figure):
    """Half a unit of the last digit that is given: 0.34 is right to 0.005."""
    mantissa, _, exponent = figure.replace(",", "").lower().partition("e")
    return 0.5 * 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))


def differs(name, shown, found):
    """What is wrong with a figure of a page, as a list."""
    off = abs(float(shown.replace(",", "")) - found) if isinstance(found, (int, float)) else float("inf")
    if off <= 1.001 * digits_of(shown):
        return []
    return [f"{name}: the page has {shown}, the command says {found}"]


def compare(page, pattern, found):
    """Whether the groups of a pattern, which is on the page once, are the figures found."""
    places = re.findall(pattern, text_of(page))
    shown = places[0] if places and isinstance(places[0], tuple) else tuple(places)
    wrong = [] if len(places) == 1 and len(shown) == len(found) else [f"{page}: '{pattern}' is there {len(places)} times"]
    for figure, value in zip(shown, found):
        wrong += differs(pattern, figure, value)
    claim(f"{page}: {pattern}", wrong)


def table(page, head):
    """The rows of the table under a head, without marks of bold."""
    lines = text_of(page).split(head, 1)[1].splitlines()[2:]
    rows = []
    for line in lines:
        if not line.startswith("|"):
            break
        rows.append([cell.strip().replace("**", "") for cell in line.strip("|").split("|")])
    return rows


# ---- method-measurements.md, integrators.md, stable-steps.md -----------------------------------------------------------

METHODS = "rk4 | rkc4 | dopri5 | tsit5 | dop853 | radau5 | auto"
DEAR = 50_000  # evaluations a second; a cell with more takes longer than the test should


def evaluations(scene, method, setting):
    found = summary(SCENES / f"{scene}.yaml", "--integrator", method, "--tolerance", setting, "--record", "position", "--interval", 1000)
    return found["cost"]["evaluations"] / found["time"] if found else None


def evaluations_for_an_error():
    cells = []
    for row in table("method-measurements.md", f"| scene | {METHODS} |"):
        scene = row[0].partition(":")[0]
        for method, cell in zip(METHODS.split(" | "), row[1:]):
            found = re.fullmatch(r"(\d+) \(([\d.e-]+)\)", cell)
            if method != "rk4" and cell != "-" and (not found or float(found[1]) < DEAR):
                cells.append((scene, method, found[1] if found else cell, found[2] if found else ""))
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        seen = list(pool.map(lambda cell: evaluations(cell[0], cell[1], cell[3]), cells))
    wrong = []
    for (scene, method, shown, _), value in zip(cells, seen):
        wrong += differs(f"{scene}, {method}", shown, value)
    note(f"{len(cells)} cells of the table")
    claim("method-measurements.md: the evaluations for an error of 1e-6 are those of its settings",
          wrong + ([] if len(cells) >= 35 else ["most of the table was not read"]))


def governor():
    scene = SCENES / "flyball-governor.yaml"
    steps = [cost(scene, "--integrator", method, "--tolerance", tolerance).get("steps") for tolerance in ("1e-6", "1e-8")
             for method in ("rodas5p", "radau5")]
    compare("integrators.md", r"\| 1e-6 \| (\d+) \| (\d+) \|\n\| 1e-8 \| (\d+) \| (\d+) \|", steps)
    said = kinetree("stability", scene, "--step", "1e-4")
    rate = re.search(r"^ +-(\d+\.\d+) ", said, flags=re.M)
    limits = {name: float(step) for name, step in re.findall(r"^  ([\w-]+) +(0\.\d+) ", said, flags=re.M)}
    wave = re.search(r"undamped oscillation of ([\d.]+) Hz", said)
    waves = [float(wave[1]) if wave else None] * 2
    limited = [limits.get(name, 0.0) * scale for name, scale in (("rk4", 1e3), ("dop853", 1e3), ("rkc2", 1e3), ("rkc4", 1.0))]
    compare("stable-steps.md", r"fastest mode of the governor decays at (\d+) /s", [float(rate[1]) if rate else None])
    compare("stable-steps.md", r"\| `rk4` \| ([\d.]+) ms \| the decay \|\n\| `dop853` \| ([\d.]+) ms \| the decay \|\n"
            r"\| `rkc2` \| (\d+) ms \| the oscillation at ([\d.]+) Hz \|\n\| `rkc4` \| ([\d.]+) s \| the oscillation at ([\d.]+) Hz \|",
            [*limited[:3], waves[0], limited[3], waves[1]])
    warned = kinetree("run", scene, "--integrator", "dopri5", "--out", "/dev/null")
    quoted = re.search(r"^    (the steps of dopri5 are bounded.*?)\n\n", text_of("stable-steps.md"), flags=re.S | re.M)
    words = " ".join(quoted[1].split()) if quoted else "no quotation"
    claim("stable-steps.md: the warning that it quotes is what a run says", [] if words in warned else [words, warned])


def strong_damper():
    page = text_of("stable-steps.md")
    scene = re.search(r"```yaml\n(kinetree: 1\n# stop\.yaml\n.*?)```", page, flags=re.S)[1]
    counts = [cost("-", *options, text=scene).get("evaluations") for options in (("--integrator", "rk4", "--step", "9e-4"), ())]
    said = kinetree("stability", "-", "--step", "0.01", text=scene)
    rate, limit = re.search(r"^ +-(\d+\.\d+) ", said, flags=re.M), re.search(r"^  rk4 +(0\.\d+) ", said, flags=re.M)
    compare("stable-steps.md", r"mode decays at (\d+) /s, so `rk4` must stay below ([\d.]+) ms. These ten seconds take ([\d,]+) evaluations "
            r"with `rk4` and ([\d,]+) with `rkc4`\.", [float(rate[1]) if rate else None, 1e3 * float(limit[1]) if limit else None, *counts])


def fishing_rod():
    counts = [cost(SCENES / "fishing-rod.yaml", "--integrator", method, "--tolerance", "1e-6", "--duration", 1).get("evaluations")
              for method in ("dopri5", "auto")]
    compare("stable-steps.md", r"first run needs ([\d,]+) evaluations of the accelerations, the second ([\d,]+)\.", counts)


# ---- other pages -------------------------------------------------------------------------------------------------------


def watch_resolution():
    wrong, rows = [], table("validation.md", "| scene | uncertainty over scale |")
    for names, shown in rows:
        for name in names.split(", "):
            watch = summary(SCENES / f"{name}.yaml").get("energy_watch", {})
            found = watch.get("uncertainty", float("nan")) / watch.get("scale", 1.0)
            note(f"{name}: {found:.3g}, the page has {shown}")
            wrong += differs(name, shown, found)
    claim("validation.md: what the watch of energies can show", wrong + ([] if len(rows) > 8 else ["no table"]))


def ten_stops():
    links = "".join(f"  - {{name: l{i}, {f'parent: l{i - 1}, ' if i else ''}joint: {{type: revolute, axis: y, at: [{int(i > 0)}, 0, 0]}}, mass: 1, "
                    "shape: {type: rod, to: [1, 0, 0]}}\n" for i in range(10))
    stops = "".join(f"  - {{name: s{i}, type: joint_limit, joint: l{i}, lower: -1, restitution: 0.5}}\n" for i in range(10))
    with tempfile.TemporaryDirectory() as folder:
        scene = pathlib.Path(folder) / "stops.yaml"
        scene.write_text(f"kinetree: 1\nbodies:\n{links}effects:\n{stops}")
        said = kinetree("info", scene)
    found = re.search(r"([\d.]+) MB of compiled models", said)
    compare("switching.md", r"models\s+of\s+a\s+chain\s+with\s+ten\s+stops\s+take\s+(\d+)\s+kB",
            [1000 * float(found[1]) if found else float("nan")])


def warning_codes():
    """Those of the command's sources, and no others."""
    sources = "".join(path.read_text() for path in sorted((ROOT / "apps/kinetree").rglob("*.c")))
    codes = set(re.findall(r'(?:kt_warning_(?:of|at)\(\s*|\.code =)\s*"(\w+)"', sources))
    tables = re.split(r"^\| code \|.*\n", text_of("warnings.md"), flags=re.M)[1:]
    shown = {code for rows in tables for code in re.findall(r"^\| `(\w+)` \|", rows, flags=re.M)}
    note(f"{len(codes)} codes of warnings")
    claim("warnings.md: the codes of warnings are those that runs have",
          [f"{code} is {'not on the page' if code in codes else 'no code'}" for code in sorted(codes ^ shown)])


def error_codes():
    """Those of status.h, and no others."""
    header = (ROOT / "include/kinetree/status.h").read_text()
    codes = set(re.findall(r"\bKT_(?:OK|ERROR_\w+)\b", header))
    shown = set(re.findall(r"^\| `(KT_\w+)` \|", text_of("errors.md"), flags=re.M))
    note(f"{len(codes)} codes of errors")
    claim("errors.md: the codes of errors are those of status.h",
          [f"{code} is {'not on the page' if code in codes else 'no code'}" for code in sorted(codes ^ shown)] + ([] if codes else ["no codes"]))


def callers_memory():
    """What can be laid out in the caller's memory, and what cannot."""
    headers = "".join(path.read_text() for path in sorted((ROOT / "include/kinetree").glob("*.h")))
    made = set(re.findall(r"\b(kt_\w+)_create\(", headers))
    laid_out = {name for name in made if f"{name}_size(" in headers and f"{name}_init(" in headers}
    page = text_of("memory-and-threads.md")
    sentence = re.search(r"Every `\.\.\._create` except (.*?) has a pair", page, flags=re.S)
    named = set(re.findall(r"`(kt_\w+)_create`", sentence[1])) if sentence else set()
    wrong = [f"{name}_create: the page says otherwise" for name in sorted(named ^ (made - laid_out))]
    wrong += [f"{name}_size is not on the page" for name in sorted(laid_out) if f"`{name}_size`" not in page]
    note(f"{len(laid_out)} of {len(made)} in the caller's memory")
    claim("memory-and-threads.md: what can be laid out in the caller's memory", wrong)


def page_of_a_view():
    size = sum(path.stat().st_size for path in (ROOT / "apps/kinetree/view").iterdir() if path.suffix in (".html", ".css", ".js"))
    shown = re.search(r"The page's own sources, some (\d+) kB", text_of("view-format.md"))
    note(f"{size} bytes")
    claim("view-format.md: the size of the page's own sources, to 5 kB", [] if shown and abs(1000 * int(shown[1]) - size) <= 5000 else [f"{size} bytes"])


def hard_cases():
    numbers = [number for path in (ROOT / "test/hard").glob("*.c") for number in re.findall(r"\.number = (\d+)", path.read_text())]
    shown = re.search(r"runs (\d+) cases of (\d+) kinds", text_of("validation.md"))
    in_readme = re.search(r"prints all (\d+) cases", (ROOT / "README.md").read_text())
    found = (len(numbers), len(set(numbers)))
    note(f"{found[0]} cases of {found[1]} kinds")
    claim("validation.md: how many hard cases there are", [] if shown and found == (int(shown[1]), int(shown[2])) else [str(found)])
    claim("README.md: how many hard cases there are", [] if in_readme and found[0] == int(in_readme[1]) else [str(found[0])])


def methods():
    shown = re.search(r"runs a scene with (\d+) methods and (\w+) formulations", (ROOT / "README.md").read_text())
    found = kinetree("integrators").split("\n\n")[0].count("\n")
    note(f"{found} methods")
    claim("README.md: how many methods there are", [] if shown and found == int(shown[1]) else [str(found)])
    with tempfile.TemporaryDirectory() as folder:  # of the picture
        said = kinetree("accuracy", SCENES / "four-bar.yaml", "--formulations", "--budget", 1, "--duration", 0.1, "--out", "/dev/null", folder=folder)
    names = set(re.findall(r"; ([a-zA-Z ]+)$", said.split("a simulated second costs")[0], flags=re.M))
    note(f"formulations: {', '.join(sorted(names))}")
    claim("README.md: how many formulations there are", [] if shown and len(names) == {"six": 6, "seven": 7, "eight": 8}.get(shown[2]) else [said])


for ask in (evaluations_for_an_error, governor, strong_damper, fishing_rod, watch_resolution, ten_stops, warning_codes, error_codes, callers_memory, page_of_a_view, hard_cases, methods):
    ask()
finish()
