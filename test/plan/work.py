"""Readers, hulls and the compiler take instructions in proportion to their input.

work.py VALGRIND WORK-COUNT
"""
# SPDX-License-Identifier: Apache-2.0
import concurrent.futures
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note
from counted import count

valgrind, program = sys.argv[1:]

# The growth from twice to four times the size, over that from the size to twice: 2 where the instructions are a + b n,
# 2.2 with n log n from 1,000 on, 4 with n^2. Hulls have 2.26.
MOST = 2.5
# A thousand faults at most are printed, so that terms beyond cost less.
LARGE = {"chain": 3000, "chain_from_its_tip": 3000, "star": 3000, "chain_of_parameters": 4000, "equal_terms": 2000}


def growth(kind):
    few, more, many = (count(valgrind, "measured_work", program, kind, k * LARGE.get(kind, 1000)).instructions for k in (1, 2, 4))
    return many, (many - more) / (more - few) if more > few > 0 else float("nan")


kinds = subprocess.run([program], capture_output=True, text=True, check=True).stdout.split()
with concurrent.futures.ThreadPoolExecutor(2) as pool:
    for kind, (many, ratio) in zip(kinds, pool.map(growth, kinds)):
        size = 4 * LARGE.get(kind, 1000)
        note(f"{kind}: {many / size:,.0f} instructions for each of {size}; the growth doubles {ratio:.3f} times, bound {MOST}")
        if kind == "pairs":
            claim("work_that_grows_with_the_square_is_found", [] if 3.5 < ratio < 4.5 else [f"{ratio:.3f}"])
        else:
            claim(f"{kind}_takes_instructions_in_proportion", [] if 1.5 < ratio <= MOST else [f"its growth is multiplied by {ratio:.3f}"])
claim("there_are_kinds", [] if len(kinds) > 10 else kinds)
finish()
