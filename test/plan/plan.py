"""What a scene does not name costs not one instruction.

plan.py VALGRIND PLAN-COUNT
"""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import re
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note, skip
from counted import count

valgrind, program = sys.argv[1:]
EVALUATE = "kt_acceleration_evaluate"
SCENES = pathlib.Path(__file__).resolve().parents[2] / "apps/scenes"

# Three arms in space, or n in a row; parts of a scene in turn.
ARMS = """  - {name: ARM, parent: PARENT, mass: 1, com: [0.1, 0.2, -0.1], inertia: [1, 1.2, 1.4, 0.1, 0.05, -0.1],
     joint: {type: revolute, axis: [1, 0.3, SKEW], at: [0.3, 0.2, 0.1], position: 0.3, velocity: 0.7}}
"""
EFFECTS = {
    "spring": "{type: spring, between: [{body: arm2, at: [0.1, 0.2, 0.3]}, {body: world, at: [1, 0, 0]}], stiffness: 3, damping: 1}",
    "bushing": "{type: bushing, between: [arm0, arm2], stiffness: [1, 2, 3, 4, 5, 6], damping: [1, 1, 1, 1, 1, 1]}",
    "force": "{type: force, at: arm1, value: [1, 2, 3]}",
    "torque": "{type: torque, on: arm1, value: [1, 2, 3]}",
    "drag": "{type: drag, on: arm1, linear: 1, quadratic: 2}",
    "attraction": "{type: attraction, between: [arm0, arm2], strength: 3}",
    "contact": "{type: contact, point: {body: arm2, at: [0, 0, 0]}, radius: 9, plane: world, stiffness: 10, friction: 0.3}",
    "joint_spring": "{type: joint_spring, joint: arm0, stiffness: 3}",
    "joint_damper": "{type: joint_damper, joint: arm1, damping: 3}",
    "joint_friction": "{type: joint_friction, joint: arm1, coulomb: 3}",
    "joint_limit": "{type: joint_limit, joint: arm2, lower: 1, stiffness: 3}",
    "motor": "{type: motor, joint: arm0, torque: 2}",
    "servo": "{type: servo, joint: arm1, target: 2, stiffness: 3}",
}


def scene(arms=3, effects=(), gravity=None, record=None):
    text = "kinetree: 1\n" + (f"gravity: {gravity}\n" if gravity else "") + "bodies:\n"
    for i in range(arms):
        text += ARMS.replace("ARM", f"arm{i}").replace("PARENT", f"arm{i - 1}" if i else "world").replace("SKEW", f"{0.5 * (i % 5)}")
    if effects:
        text += "effects:\n" + "".join(f"  - {EFFECTS.get(effect, effect)}\n" for effect in effects)
    text += "simulate: {duration: 0.02, integrator: rk4, step: 0.01}\n"
    return text + (f"output: {{record: {record}}}\n" if record else "")


folder = tempfile.TemporaryDirectory()
made = 0


def path_of(text):
    """A scene in a file; a Path stays what it is."""
    global made
    if isinstance(text, pathlib.Path):
        return text
    made += 1
    path = pathlib.Path(folder.name) / f"{made}.yaml"
    path.write_text(text)
    return path


def counted(*texts, function=EVALUATE, what="acceleration"):
    return count(valgrind, function, program, what, *(path_of(text) for text in texts))


def files(c, part):
    return sorted({pathlib.Path(name).name for name, times in c.instructions_in.items() if part in name and times})


# ---- what is not named -------------------------------------------------------------------------------------------------

bare = counted(scene())
everything = counted(scene(effects=EFFECTS))
both = counted(scene(), scene(effects=EFFECTS))
note(f"bare {bare.instructions}, with every effect {everything.instructions}, both in one program {both.instructions} instructions")
claim("effects_of_another_scene_cost_nothing",
      [] if both.instructions == bare.instructions + everything.instructions else ["the sum differs"])
claim("scene_without_effects_runs_nothing_of_them", files(bare, "/lib/model/effect/") + [name for name in bare.instructions_of
      if name.startswith(("kt_effects", "kt_force_links")) and bare.instructions_of[name]])

problems = []
one = {name: counted(scene(effects=[name])) for name in EFFECTS}
for name, c in one.items():
    own = "effect_contact.c" if name == "contact" else f"{name}.c"  # file names are unique in lib
    ran = [file for file in files(c, "/lib/model/effect/") if file not in (own, "kind.c", "curves.c", "effect.h", "triple.h")]
    problems += [f"{name} runs {', '.join(ran)}"] if ran else []
    problems += [f"{name} runs nothing of its own"] if own not in files(c, "/lib/model/effect/") else []
claim("scene_runs_the_effect_types_that_it_names_and_no_others", problems)

on_joints = [name for name in EFFECTS if name.startswith("joint_") or name in ("motor", "servo")]
claim("effects_on_joints_move_no_links", [name for name in on_joints if any(f.startswith("kt_force_links") for f in one[name].instructions_of)])
sums = counted(*(scene(effects=[name]) for name in EFFECTS)).instructions
claim("each_scene_pays_for_its_own_effect_alone",
      [] if sums == sum(c.instructions for c in one.values()) else [f"{sums} together, {sum(c.instructions for c in one.values())} one by one"])

pulls = counted(scene(gravity="[0, 0, -9.81]"))
claim("gravity_costs_nothing", [] if pulls.instructions == bare.instructions else [f"{pulls.instructions - bare.instructions} instructions"])

# 47 with gcc 12.2: 41 check the arguments of the public call and write the state, and six check the stack. Steps have
# seven of them.
problems = []
for arms in (3, 30):
    text = scene(arms)
    all_of_it, recursion = counted(text), counted(text, function="kt_forward_tree")
    note(f"{arms} arms: {all_of_it.instructions} instructions, of which {recursion.instructions} are the recursion's")
    problems += [all_of_it.instructions - recursion.instructions]
claim("evaluation_is_the_bare_recursion_and_a_few_tests",
      [] if problems[0] == problems[1] and problems[0] <= 51 else [f"{problems} instructions besides"])

spring = "{type: spring, between: [{body: armN, at: [0.1, 0, 0]}, {body: world, at: [1, 0, 0]}], stiffness: 3}"
first, last = (counted(scene(30, [spring.replace("N", n)])).instructions_of["kt_force_links_baseline"] for n in ("0", "29"))
note(f"a spring on the first of 30 arms moves links in {first} instructions, one on the last for {last}")
claim("spring_asks_for_the_motion_of_the_links_below_it_alone", [] if 0 < first < last / 5 else ["it asks for more"])

plain = counted(scene(effects=EFFECTS), function="kt_simulation_run", what="run")
kept = counted(scene(effects=EFFECTS, record="[position, balance]"), function="kt_simulation_run", what="run")
claim("run_without_balance_runs_nothing_of_it", files(plain, "/lib/mechanics/evaluate/power.c"))
claim("run_with_balance_does", [] if files(kept, "/lib/mechanics/evaluate/power.c") else ["nothing of power.c"])
claim("run_without_reactions_runs_nothing_of_them", files(plain, "/lib/mechanics/evaluate/reaction.c") + files(plain, "/lib/mechanics/constraint/loop_wrenches.c"))

claim("run_that_does_not_record_effects_runs_nothing_of_them", files(plain, "/lib/mechanics/evaluate/quantity.c"))

# ---- contacts and stops between stages ---------------------------------------------------------------------------------

def stops(rods):
    text = "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n"
    for i in range(rods):
        parent, at, position = (f"rod{i - 1}", -0.2, 0.3) if i else ("world", 0, 1.2)
        text += (f"  - {{name: rod{i}, parent: {parent}, joint: {{type: revolute, axis: y, at: [0, 0, {at}], position: {position}}}, "
                 "mass: 0.1, shape: {type: rod, to: [0, 0, -0.2], radius: 0.01}}\n")
    text += "effects:\n" + "".join(f"  - {{type: joint_limit, joint: rod{i}, lower: -2, upper: 2, stiffness: 20}}\n" for i in range(rods))
    return text + "simulate: {duration: 0.2}\n"


def box():
    text = ("kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n  - {name: box, mass: 0.2, shape: {type: box, size: [0.1, 0.2, 0.3]}, "
            "joint: {type: free, position: {position: [0, 0, 30]}, velocity: {linear: [0.5, 0.1, 0], angular: [1, 2, 3]}}}\neffects:\n")
    text += "".join(f"  - {{type: contact, point: {{body: box, at: [{x}, {y}, {z}]}}, plane: world, stiffness: 1e5}}\n"
                    for x in (-0.05, 0.05) for y in (-0.1, 0.1) for z in (-0.15, 0.15))
    return text + "simulate: {duration: 1}\n"


# What following their distances adds to steps: 0.9 % of those of two links, 0.7 % of one ball, twenty stops or eight corners; and what
# compilers differ by.
FOLLOWED = {name: re.sub(r"duration: \S+", f"duration: {duration}", (SCENES / f"{name}.yaml").read_text())
            for name, duration in {"cart-pole": 3, "rolling-ball": 0.5}.items()}
FOLLOWED.update({"twenty stops": stops(20), "eight corners of a box": box()})
problems = []
for name, text in FOLLOWED.items():
    step, followed = (counted(text, function=f, what="run").instructions for f in ("kt_simulation_take_step", "reject_leap"))
    share, most = followed / (step - followed), 0.011 if name == "cart-pole" else 0.01
    note(f"{name}: {followed} of {step} instructions, {100 * share:.2f} %, bound {100 * most:g} %, ratio {share / most:.2f}")
    problems += [f"{name}: {100 * share:.2f} %"] if not 0 < share <= most else []
claim("contacts_and_stops_cost_steps_little", problems)

# ---- forces by formulas ------------------------------------------------------------------------------------------------

# An evaluation with the effect less one without, in a joint and between two ends: of a formula, and of the same in C.
SAME = {
    "in a joint": ("{type: joint_damper, joint: arm1, damping: 3}", "{type: expression, joint: arm1, force: -3*velocity.arm1}"),
    "of a position": ("{type: joint_spring, joint: arm0, stiffness: 3, damping: 1}",
                      "{type: expression, joint: arm0, force: -3*position.arm0 - velocity.arm0}"),
    "of time": ("{type: motor, joint: arm0, torque: {sine: {amplitude: 2, frequency: 1}}}", "{type: expression, joint: arm0, force: 2*sin(2*pi*t)}"),
    "between two ends": (EFFECTS["spring"].replace("damping", "length: 1, damping"),
                         EFFECTS["spring"].split(", stiffness")[0].replace("spring", "expression") + ", force: -3*(length - 1) - speed}"),
}
problems = []
for where, (in_c, formula) in SAME.items():
    c, f = (counted(scene(effects=[text])).instructions - bare.instructions for text in (in_c, formula))
    note(f"{where}: {c} instructions in C, {f} by a formula, {f / c:.2f} times")
    problems += [f"{where}: {f / c:.2f} times"] if not 0 < f <= 3 * c else []
claim("formula_costs_at_most_three_times_the_same_effect_in_c", problems)

# ---- the matrices of an implicit method --------------------------------------------------------------------------------

ROD = """  - {name: link, parent: above, joint: {type: revolute, axis: z, at: [0, -0.05, 0], position: 0.2, velocity: 0.3},
     mass: 0.02, shape: {type: rod, to: [0, -0.05, 0], radius: 0.004}}
"""
STIFF = "  - {type: joint_spring, joint: link, stiffness: 100, damping: 1}\n"


def stiff_chain(rods):
    text = "kinetree: 1\nbodies:\n"
    text += "".join(ROD.replace("link,", f"link{i},").replace("above", f"link{i - 1}" if i else "world") for i in range(rods))
    return text + "effects:\n" + "".join(STIFF.replace("link", f"link{i}") for i in range(rods))


def ratio(text, function):
    """What a function costs next to an evaluation of accelerations."""
    what = function.removeprefix("kt_").removesuffix("_evaluate")
    cost, evaluation = (counted(text, function=f, what=what).instructions for f in (function, EVALUATE))
    note(f"{function}: {cost} instructions, an evaluation {evaluation}, {cost / evaluation:.2f}")
    return cost / evaluation


# With the kernels that most processors take. The bars are those that make implicit methods worth while on stiff scenes.
governor = SCENES / "flyball-governor.yaml"
if "avx2" in pathlib.Path("/proc/cpuinfo").read_text():
    five_bar = SCENES / "five-bar.yaml"  # measured: 9.7, of which two thirds are the loop's derivatives
    bars = {"the governor": (governor, 3), "a five-bar loop": (five_bar, 12), "20 rods": (stiff_chain(20), 12), "40 rods": (stiff_chain(40), 20)}
    claim("stiffness_matrices_cost_few_evaluations",
          [f"more than {bar} of {name}" for name, (text, bar) in bars.items() if ratio(text, "kt_stiffness_evaluate") > bar])
else:
    skip("stiffness_matrices_cost_few_evaluations", "no kernels of x86-64-v3")


def beam(segments):
    return (f"kinetree: 1\nbeams:\n  - {{name: b, segments: {segments}, length: 1, mass_per_length: 1, inertia_per_length: 1e-3, GJ: 1, EI: [1, 2]}}\n"
            "simulate: {duration: 0.02, integrator: rk4, step: 0.01}\n")


beams = [counted(beam(n)).instructions for n in (10, 20, 40)]
note(f"beams of 10, 20 and 40 segments: {', '.join(map(str, beams))} instructions")
claim("beams_cost_in_proportion_to_their_segments",
      [] if abs((beams[2] - beams[1]) / (2 * (beams[1] - beams[0])) - 1) < 0.01 else ["the second difference is not small"])

finish()
