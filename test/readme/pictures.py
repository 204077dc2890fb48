"""pictures.py COMMAND SOURCE-ROOT [--write]: pictures of the README and of pages are those that the command draws today.

The table below has the command of each picture. Equal inputs give equal bits, so a picture has equal bytes on every machine with this
version of cairo. Another version writes other attributes: there the paths and texts are compared. With --write, the pictures are written
instead. Pictures of times differ between machines and belong to `bench/run accuracy`.
"""
# SPDX-License-Identifier: Apache-2.0
import csv
import math
import pathlib
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

COMMAND, ROOT = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
PICTURES = ROOT / "apps/pictures"
GAP = "run apps/scenes/four-bar.yaml --duration 100 --integrator rk4 --step 2e-3 --record constraint --interval 0.25"

# picture: the commands that draw it; the last one gets --out. PAGE/NAME.yaml is a scene of a page.
TABLE = {
    "linkage-moving": ["draw apps/scenes/peaucellier.yaml --animate --until 2.34 --trace upper_outer.pen"],
    "method-four-bar": ["draw method/linkage.yaml --names"],
    "method-loops": ["draw sketch.yaml --names"],
    "method-chain": ["draw apps/scenes/chain.yaml"],
    "method-humanoid": ["draw apps/scenes/humanoid.yaml"],
    "method-groups": ["draw apps/scenes/n-four-bar-40.yaml"],
    "method-contacts": ["run method-contacts/ball.yaml --out ball.csv --summary ball.json",
                        "plot ball.csv --columns position.ball --marks ball.json --title 'Height of a ball that bounces'"],
    "method-drift": [f"{GAP} --unprojected --out open.csv", f"{GAP} --out closed.csv",
                     "plot open.csv closed.csv --columns constraint.position --log --title 'Gap of the loop of a four-bar linkage'"],
    "method-pendulum": ["plot factor.csv --x log10_distance --columns partitioning,qr --log "
                        "--title 'Factor of errors near the level position of a pendulum'"],
    "integrator-region": ["stability apps/scenes/flyball-governor.yaml --integrator rk4 --step 1e-3"],
    "base-parameters": ["draw apps/scenes/double-pendulum.yaml --names"],
    "first-scene": ["draw first-scene/pendulum.yaml --strobe 9 --until 0.878"],
    "first-scene-curves": ["run first-scene/pendulum.yaml --out pendulum.csv --summary pendulum.json", "plot pendulum.csv"],
    "first-program": ["draw first-program/pendulum.yaml --strobe 7 --until 0.87"],
    "python-first-script": ["run python-first-script/pendulum.yaml --out swing.csv --summary swing.json", "plot swing.csv --columns position.arm"],
    "first-press": ["draw first-machines/crank-press.yaml --at 0,0.1,0.2"],
    "first-crane": ["draw first-machines/crane.yaml --strobe 6 --until 2.2"],
    "first-suspension": ["run first-machines/suspension.yaml --out suspension.csv --summary suspension.json", "plot suspension.csv --columns position.car"],
    "first-hoist": ["draw first-machines/hoist.yaml --names"],
    "first-grinder": ["run first-machines/grinder.yaml --out grinder.csv --summary grinder.json", "plot grinder.csv --columns velocity.wheel"],
}


def write_scenes(folder):
    """The named scenes of pages, the sketch of the linkage without its loop, and the factors of the pendulum."""
    for page in [ROOT / "README.md", *sorted((ROOT / "include/pages").glob("*.md"))]:
        for body in re.findall(r"^```yaml\n(.*?)^```", page.read_text(), flags=re.S | re.M):
            name = re.search(r"^# (\S+\.yaml)$", body, flags=re.M)
            if name:
                (folder / page.stem).mkdir(exist_ok=True)
                (folder / page.stem / name[1]).write_text(body)
    linkage = (folder / "method/linkage.yaml").read_text()
    sketch = re.sub(r"^(?:loops:\n.*\n|initial: .*\n)", "", linkage, flags=re.M)
    for old, new in (("-0.608729", "-0.5"), ("1.613606", "1.5"), ("four-bar linkage of the chapter", "the tree of the linkage, before its loop is closed")):
        assert old in sketch, old
        sketch = sketch.replace(old, new)
    (folder / "sketch.yaml").write_text(sketch)
    distances = [-6 + k / 20 for k in range(121)]
    (folder / "factor.csv").write_text("log10_distance,partitioning,qr\n" + "".join(f"{k:.12g},{1 / math.tan(10**k):.12g},1\n" for k in distances))


def words_of(line):
    return [a or b for a, b in re.findall(r"'([^']*)'|(\S+)", line)]


def draw(folder, name):
    """The bytes of a picture, or what is wrong."""
    out = folder / f"{name}.svg"
    for k, line in enumerate(TABLE[name], 1):
        out_option = "--plot" if line.startswith("stability") else "--out"
        words = [COMMAND, *words_of(line), *([out_option, out.name] if k == len(TABLE[name]) else []), *(["--quiet"] if line.startswith("run") else [])]
        ended = subprocess.run(words, cwd=folder, capture_output=True, text=True)
        if ended.returncode != 0:
            return f"{line}: {ended.stderr.strip()}"
    return out.read_bytes()


def leave_the_line(folder):
    """The README states a bound of the distance between the pen and its line, x = 1.2 m."""
    shown = re.search(r"its pen stays on the straight line to (\S+) m\.", (ROOT / "README.md").read_text())
    ended = subprocess.run([COMMAND, "run", "apps/scenes/peaucellier.yaml", "--out", "pen.csv", "--quiet"], cwd=folder, capture_output=True, text=True)
    if ended.returncode != 0 or not shown:
        return [ended.stderr, "the README has no bound" if not shown else ""]
    with open(folder / "pen.csv", newline="") as file:
        worst = max(abs(float(row["marker.upper_outer.pen.x"]) - 1.2) for row in csv.DictReader(file))
    note(f"the pen leaves its line by {worst:.1e} m, bound {shown[1]} m")
    return [] if 0.0 < worst <= float(shown[1]) else [f"the pen leaves its line by {worst:.1e} m"]


def is_same(there, drawn):
    """Whether two pictures have equal bytes. Those of cairo 1.16 have sizes in pt and styles, and those of 1.18 attributes: paths and texts
    are compared."""
    if (b'pt" viewBox=' in there) == (b'pt" viewBox=' in drawn):
        return there == drawn
    parts = [re.findall(rb'(?: d="[^"]*"|<text.*?</text>)', svg) for svg in (there, drawn)]
    return len(parts[0]) > 0 and parts[0] == parts[1]


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "apps").symlink_to(ROOT / "apps")
        write_scenes(folder)
        problems, pages = [], "".join(page.read_text() for page in [ROOT / "README.md", *(ROOT / "include/pages").glob("*.md")])
        for picture in TABLE:
            drawn, path = draw(folder, picture), PICTURES / f"{picture}.svg"
            if isinstance(drawn, str):
                problems.append(drawn)
            elif "--write" in sys.argv:
                path.write_bytes(drawn)
            elif not path.exists() or not is_same(path.read_bytes(), drawn):
                problems.append(f"{path.name}: the command draws another picture; `pictures.py COMMAND SOURCE-ROOT --write` writes it")
            problems += [] if f"apps/pictures/{picture}.svg" in pages else [f"{picture}.svg is on no page"]
        note(f"{len(TABLE)} pictures")
        claim("pictures_are_those_that_the_command_draws", problems)
        claim("pen_of_the_first_picture_stays_on_its_line", leave_the_line(folder))
    finish()


main()
