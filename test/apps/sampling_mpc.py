"""The pole is swung up by sampling and stands, within force and rail; the quadruped trots on the spot at its height; equal
runs. sampling_mpc.py PROGRAM [SECONDS]

Runs of so many seconds are too short for the motions: they show the rest, for sanitizers."""
# SPDX-License-Identifier: Apache-2.0
import math
import re
import sys

from embedded import below, claim, finish, mistakes, run

LIMIT, RAIL = 8.0, 1.0  # N, m

program, seconds = sys.argv[1], sys.argv[2:]
short = ["--seconds", *seconds] if seconds else []
said, run_of = run(program, *short)
time, cart, force = (run_of[key] for key in ("time", "position.cart", "torque.cart"))
angle = [math.remainder(a, 2 * math.pi) for a in run_of["position.pole"]]
claim("pole_hangs_at_the_start", below("from hanging", abs(abs(angle[0]) - math.pi), 1e-15))
if not short:
    # Over noises of half and twice the size, half as many rollouts and other temperatures, the angle in the last second was
    # 0.014 to 0.12 rad.
    claim("pole_is_upright_in_the_end",
          below("angle in the last second, rad", max(abs(a) for t, a in zip(time, angle) if t >= 5.0), 0.05))
    claim("pole_is_up_after_four_seconds",
          below("last time away from upright, s", max(t for t, a in zip(time, angle) if abs(a) > 0.3), 4.0))
claim("cart_stays_on_its_rail", below("furthest, m", max(abs(x) for x in cart), RAIL))
largest = max(abs(u) for u in force)
claim("force_is_never_above_its_limit", [] if largest <= LIMIT else [f"{largest}"])
claim("rollouts_per_second_are_told", [] if re.search(r"[1-9]\d* rollouts a second", said) else [said])
claim("a_batch_has_the_costs_of_single_rollouts", [] if "one by one, with the same costs" in said else [said])


# The quadruped. Over half the noise, correlations of 0.5 and 0.8, twice as many rollouts and temperatures of a fifth to five
# times as much, its height in the last second was off by 9 to 17 mm; without armature, where steps are unstable, by 72 mm.
said, trot = run(program, "--quadruped", *short)
if not short:
    late = [i for i, t in enumerate(trot["time"]) if t >= 1.0]
    claim("trunk_stays_at_its_height", below("height off, m", max(abs(trot["height"][i] - 0.35) for i in late), 0.02))
    claim("trunk_stays_on_the_spot", below("off, m", max(abs(x) for x in trot["x"]), 0.1))
    claim("trunk_stays_level", below("pitch, rad", max(abs(a) for a in trot["pitch"]), 0.1))
    raised = {}
    for leg in range(4):
        foot, target = trot[f"foot.{leg}"], trot[f"target.{leg}"]
        raised[leg] = {i for i in late if foot[i] > 0.02}
        claim(f"foot_{leg}_is_lifted", below("25 mm over its height", 0.025 / max(foot[i] for i in late), 1.0))
        claim(f"foot_{leg}_stands_between", below("highest where it is to stand, m", max(foot[i] for i in late if target[i] == 0), 0.01))
    claim("neighbouring_feet_are_not_lifted_at_once", [f"{i}" for a, b in ((0, 1), (2, 3), (0, 2), (1, 3)) for i in raised[a] & raised[b]])
_, again = run(program, "--quadruped", *short)
claim("equal_runs_have_equal_bits", [key for key in trot if trot[key] != again[key]])
claim("torques_are_within_their_limit", [] if max(trot["torque"]) <= 30.0 else [f"{max(trot['torque'])}"])
claim("a_batch_of_quadrupeds_has_the_costs_of_single_ones", [] if "one by one, with the same costs" in said else [said])

mistakes(program)
finish()
