"""Units and descriptions of parameters (fmu.py): those of the number that a parameter is."""
# SPDX-License-Identifier: Apache-2.0
from archive import Fmu
from claims import claim, note

SCENE = """kinetree: 1
parameters: {load: 5, reach: 3, g: 9.81, about: 7, start: 20 deg, rate: 0.25, k: 40, rigid: 41, drag: 0.6, pull: 12,
  often: 0.75, beside: 11, twice: 2.5, other: =load + 1, formula: 4.5, none: 0}
gravity: [0, 0, =-g]
bodies:
  - {name: slide, mass: =other, joint: {type: prismatic, axis: x, velocity: =rate}}
  - name: arm
    parent: slide
    joint: {type: revolute, axis: y, position: =start, at: [0, =none, 0]}
    mass: =load
    com: [0, 0, =-reach]
    inertia: [=about, 8, 8]
    markers: {tip: [0, 0, -2]}
  - {name: two, parent: arm, joint: {type: revolute, axis: y, at: [=twice, 0, 0]}, mass: =twice, com: [1, 0, 0]}
effects:
  - {name: turns, type: joint_spring, joint: arm, stiffness: =k}
  - {name: slides, type: joint_spring, joint: slide, stiffness: =rigid}
  - {type: joint_damper, joint: arm, damping: =drag}
  - {name: wave, type: motor, joint: slide, force: {sine: {amplitude: =pull, frequency: =often}}}
  - {name: law, type: expression, joint: arm, force: "-formula*velocity.arm"}
  - {name: line, type: spring, between: [{body: world, at: [=beside, 0, 0]}, arm.tip], stiffness: 10, length: 1}
simulate: {duration: 1}
"""
EXPECTED = {"load": ("kg", "mass of arm"), "reach": ("m", "centre of mass of arm"), "g": ("m/s2", "gravity of the scene"),
            "about": ("kg.m2", "inertia of arm"), "start": ("rad", "position of arm"), "rate": ("m/s", "velocity of slide"),
            "k": ("N.m/rad", "stiffness of turns"), "rigid": ("N/m", "stiffness of slides"),
            "drag": ("N.m.s/rad", "damping of joint_damper"), "pull": ("N", "force of wave"),
            "often": ("Hz", "frequency of wave"), "beside": (None, "used in formulas"), "twice": (None, "mass of two"),
            "other": ("kg", "mass of slide"), "formula": (None, "used in formulas"), "none": ("m", "place of arm")}


def check_uses(folder):
    scene, wrong = folder / "uses.yaml", []
    scene.write_text(SCENE)
    for version in (3, 2):
        fmu = Fmu(scene, folder, "--fmi", version)
        if fmu.status != 0:
            wrong.append(fmu.errors)
            continue
        for name, expected in EXPECTED.items():
            variable = fmu.variables[name]
            unit = variable.get("unit") if version == 3 else variable[0].get("unit")
            wrong += [] if (unit, variable.get("description")) == expected else \
                [f"FMI {version}, {name}: {unit}, {variable.get('description')}"]
    note(f"{len(EXPECTED)} parameters; {len(wrong)} with another unit or description, bound 0")
    claim("parameters_have_the_unit_and_the_description_of_their_number", wrong)
