"""The pendulum is swung up, caught, knocked, and stays up, by no more torque than there is. furuta.py PROGRAM"""
# SPDX-License-Identifier: Apache-2.0
import math
import re
import sys

from embedded import below, claim, finish, mistakes, run

LIMIT, KNOCK = 0.08, 8.0  # N m, s

said, run_of = run(sys.argv[1])
time, torque = run_of["time"], run_of["torque.motor"]
angle = [math.remainder(a, 2 * math.pi) for a in run_of["position.pendulum"]]
largest = max(abs(u) for u in torque)
claim("torque_is_never_above_its_limit", [] if largest <= LIMIT else [f"{largest}"])
claim("torque_limit_is_reached", [] if largest == LIMIT else [f"{largest}"])
claim("pendulum_hangs_at_the_start", below("from hanging", abs(abs(angle[0]) - math.pi), 1e-15))

held = [t for t, a in zip(time, angle) if abs(a) > 0.4]
claim("pendulum_is_caught_before_the_knock_and_never_lost", below("last time away from upright, s", max(held), 4.0))
after = max(abs(a) for t, a in zip(time, angle) if KNOCK <= t < KNOCK + 1.0)
before = max(abs(a) for t, a in zip(time, angle) if KNOCK - 1.0 <= t < KNOCK)
claim("knock_moves_the_pendulum", below("before / after", before / after, 0.1))
# What the regulator leaves is the encoder's grain: within two counts of 2 pi / 8192.
late = max(abs(a) for t, a in zip(time, angle) if t >= 10.0)
claim("pendulum_is_upright_in_the_end", below("angle in the last 2 s, rad", late, 2 * 2 * math.pi / 8192))
claim("arm_stays_near_its_place", below("arm in the last 2 s, rad",
                                        max(abs(a) for t, a in zip(time, run_of["position.arm"]) if t >= 10.0), 0.1))
residual = float(re.search(r"Riccati residual (\S+)", said)[1])
# Schur's vectors are exact for a matrix near the Hamiltonian by a few roundings of its norm, some 1e3.
claim("gain_solves_the_riccati_equation", below("residual", residual, 1e-11))
mistakes(sys.argv[1])
finish()
