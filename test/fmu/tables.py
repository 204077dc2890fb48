"""Lookup tables in FMUs (fmu.py): of one input and of two, in effects, a coupling and an output. Files are rejected."""
# SPDX-License-Identifier: Apache-2.0
import math

from archive import STEP, STEPS, Fmu, differences, records, rows
from claims import claim, note

SCENE = f"""kinetree: 1
tables:
  torque: {{rows: [[0, 0, 0], [0, 1, 12], [3, 0, -3], [3, 1, 18], [10, 0, -6], [10, 1, 9]], outside: hold}}
  brake: {{rows: [[-20, 8], [0, 0], [5, -1], [20, -9]]}}
  lift: {{rows: [[0, 0], [2, 0.1], [4, 0.02], [6.283185307179586, 0]], interpolation: cubic, outside: repeat}}
parameters: {{throttle: 0.25}}
gravity: [0, 0, -9.81]
bodies:
  - {{name: crank, joint: {{type: revolute, axis: x, velocity: 2}}, inertia: [0.2, 0.2, 0.2], mass: 2}}
  - {{name: valve, joint: {{type: prismatic, axis: z}}, mass: 0.3}}
loops:
  - {{name: cam, type: coupling, coefficients: {{valve: 1}}, formula: "-lift(position.crank)"}}
effects:
  - {{type: expression, joint: crank, force: "torque(velocity.crank, throttle)"}}
  - {{type: expression, joint: crank, force: "brake(velocity.crank)"}}
initial: {{hold: [crank]}}
simulate: {{duration: {STEP * STEPS}, integrator: rk4, step: 0.001}}
output: {{columns: {{brake: "brake(velocity.crank)"}}}}
"""


def check_tables(folder):
    problems, scene = [], folder / "tables.yaml"
    scene.write_text(SCENE)
    fmu = Fmu(scene, folder)
    single, errors = records(scene)
    coarse, _ = records(scene, "--step", STEP)  # steps of the importer; it closes the coupling up to rounding
    exchanged = 1e-3 * differences(coarse, single)  # far below the error of these steps
    modes = (("cs", 0.0), ("early", 0.0), ("serial", 0.0), ("two", 0.0), ("me", exchanged))
    for mode, bound in modes if fmu.status == 0 else ():
        status, text, said = fmu.play(mode)
        times = {row[0] for row in rows(text)}
        theirs = [row for row in (coarse if mode == "me" else single) if row[0] in times]
        found = differences(rows(text), theirs) if status == 0 else math.nan
        note(f"{mode}: largest difference {found:g}, bound {bound:g}")
        if not found <= bound:
            problems.append(f"{mode}: {found:g} {said.strip()} {errors.strip()}")
    if fmu.status != 0:
        problems.append(fmu.errors)
    (folder / "brake.csv").write_text("speed [rad/s],torque [N m]\n-20,8\n20,-9\n")
    filed = folder / "filed.yaml"
    filed.write_text(SCENE.replace("{rows: [[-20, 8], [0, 0], [5, -1], [20, -9]]}", "brake.csv"))
    said = Fmu(filed, folder).errors
    note(said.strip())
    if "write its rows here" not in said:
        problems.append(f"no remedy for a file: {said}")
    claim("tables_of_formulas_are_part_of_an_fmu", problems)
