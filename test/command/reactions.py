"""reactions KINETREE: what `reaction.JOINT` has along the axis of a joint is what effects and drives exert in it.

About its axis a revolute joint without effects transmits nothing; so the page's formula for the bearing alone is zero there.
"""
import csv
import pathlib
import random
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

KINETREE = sys.argv[1]
SCENE = """kinetree: 1
gravity: [0, -9.81, 0]
bodies:
  - {{name: arm, joint: {{type: revolute, axis: z, position: {a:.4f}}}, mass: 2, shape: {{type: rod, to: [0, -1, 0]}}}}
  - {{name: hand, parent: arm, joint: {{type: revolute, axis: z, at: [0, -1, 0], position: {b:.4f}}}, mass: 1, shape: {{type: rod, to: [0, -1, 0]}}}}
loops: [{{name: drive, type: motion, joint: arm, position: {{polynomial: [{a:.4f}, {c:.4f}]}}}}]
effects:
  - {{name: spring, type: joint_spring, joint: arm, stiffness: {k:.4f}}}
  - {{name: elbow, type: joint_spring, joint: hand, stiffness: {l:.4f}}}
simulate: {{duration: 1, tolerance: 1e-9}}
output:
  interval: 0.1
  record: [position, reaction, effect]
  columns:
    bearing: "reaction.arm.mz - reaction.drive.multiplier - effect.spring.torque"
    elbow_bearing: "reaction.hand.mz - effect.elbow.torque"
"""
BOUND = 1e-9  # of moments of some 10 N m

worst, size, problems = 0.0, 0.0, []
for seed in range(6):
    r = random.Random(seed)
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder)
        (path / "r.yaml").write_text(SCENE.format(a=r.uniform(-1, 1), b=r.uniform(-1, 1), c=r.uniform(-2, 2), k=r.uniform(1, 30), l=r.uniform(1, 30)))
        ran = subprocess.run([KINETREE, "run", "r.yaml", "--out", "r.csv", "--quiet"], cwd=path, capture_output=True, text=True)
        rows = list(csv.DictReader((path / "r.csv").open(newline=""))) if ran.returncode == 0 else []
        problems += [] if rows else [ran.stderr]
        for row in rows:
            worst = max(worst, abs(float(row["bearing"])), abs(float(row["elbow_bearing"])))
            size = max(size, abs(float(row["reaction.arm.mz"])))
note(f"moments up to {size:.3g} N m; the bearings alone: {worst:.3g} of {BOUND}")
claim("reactions_of_joints_include_effects_and_drives", problems if worst < BOUND and size > 1.0 else [*problems, f"{worst}"])
finish()
