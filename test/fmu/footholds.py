"""Footholds of scenes (engage_here) in co-simulation: an input leads to the events, and places are in states of an FMU."""
# SPDX-License-Identifier: Apache-2.0
from archive import COMMAND, Fmu, rows, run
from claims import claim, note
from instance import Instance

# A body flies in a plane. A lever is driven by an input: it has the body caught, let go, and caught again.
SCENE = """kinetree: 1
parameters: {px: 0.1}
gravity: [0, 0, -9.81]
bodies:
  - name: foot
    joint: {type: planar, axis: y, position: [0.3, 2, 0.2], velocity: [0.7, 0.2, 1.3]}
    mass: 0.5
    inertia: [0.01, 0.02, 0.03]
    markers: {sole: [0.01, 0, -0.05]}
  - {name: lever, joint: {type: revolute, axis: y, at: [3, 0, 0]}, mass: 1, inertia: [1, 1, 1]}
loops:
  - {name: hold, type: weld, between: [foot.sole, {body: world, at: [=px, 0, 0]}], switched: off}
effects:
  - {type: motor, joint: lever, torque: %s}
events:
  - {name: grips, when: position.lever - 0.1, limit: 1, then: {engage_here: hold}}
  - {name: lets go, when: position.lever - 0.2, limit: 1, then: {release: hold}}
  - {name: grips again, when: position.lever - 0.3, limit: 1, then: {engage_here: hold}}
simulate: {duration: 1.2, integrator: rk4, step: 0.001}
output: {record: [position, velocity, state], interval: 0.01}
"""
SIZE, STEPS, PX = 0.01, 120, 0.7
AT = [20, 40, 52, 60, 110]  # steps behind which the state is kept


def play(instance, names, first, kept=None):
    """The values of the outputs at the ends of steps."""
    values = []
    for k in range(first, STEPS):
        if kept is not None and k in AT:
            kept[k] = instance.keep()
        instance.set(**{"input.lever": 2.0})
        instance.step(SIZE)
        values.append(instance.get(*names))
    return values


def check_footholds(folder):
    scene, driven = folder / "held.yaml", folder / "driven.yaml"
    scene.write_text(SCENE % 0)
    driven.write_text(SCENE % 2)
    fmu = Fmu(scene, folder, "--input", "lever")
    one, kept = Instance(fmu, px=PX), {}
    described = one.get("state.hold_x")[0]
    claim("described_place_of_a_foothold_follows_its_parameter", [] if described == PX else [f"{described}, expected {PX}"])
    _, text, _ = run(COMMAND, "run", driven, "--set", f"px={PX}", "--quiet", "--out", "-")
    names = text.partition("\n")[0].split(",")[1:]
    theirs = {round(row[0], 9): row[1:] for row in rows(text)}
    ours = play(one, names, 0, kept)
    wrong = [k for k in range(STEPS) if ours[k] != theirs[round(SIZE * (k + 1), 9)]]
    places = {(values[names.index("state.hold_x")], values[names.index("state.hold_z")]) for values in ours}
    note(f"{STEPS - len(wrong)} of {STEPS} steps have the bits of a run; {len(places)} places, expected 3")
    claim("footholds_that_an_input_leads_to_have_the_bits_of_a_run",
          [f"step {k}" for k in wrong[:3]] + ([] if len(places) == 3 else [f"{places}"]))
    other = Instance(fmu, px=PX)
    problems = []
    for k in reversed(AT):
        other.restore(kept[k])
        if play(other, names, k) != ours[k:]:
            problems.append(f"from step {k}")
    claim("another_instance_continues_at_a_foothold_with_equal_bits", problems)
    one.free()
    other.free()
