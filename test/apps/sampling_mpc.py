"""The pole is swung up by sampling and stands, within force and rail; equal runs. sampling_mpc.py PROGRAM"""
import math
import re
import sys

from embedded import below, claim, finish, mistakes, run

LIMIT, RAIL = 8.0, 1.0  # N, m

said, run_of = run(sys.argv[1])
time, cart, force = (run_of[key] for key in ("time", "position.cart", "torque.cart"))
angle = [math.remainder(a, 2 * math.pi) for a in run_of["position.pole"]]
claim("pole_hangs_at_the_start", below("from hanging", abs(abs(angle[0]) - math.pi), 1e-15))
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

_, again = run(sys.argv[1])
claim("equal_runs_have_equal_bits", [key for key in run_of if run_of[key] != again[key]])
mistakes(sys.argv[1])
finish()
