"""Models and simulations of equal bodies on hard contacts take instructions in proportion to their number.

growth.py VALGRIND GROWTH-COUNT
"""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note
from counted import count

valgrind, program = sys.argv[1:]
BOXES = [50, 100, 200]

# Twice the instructions, but for the depth of searches in sorted lists and in tables of names.
MOST = 2.1

for function in "kt_model_compile", "kt_simulation_create", "kt_simulation_advance":
    few, more, many = (count(valgrind, function, program, boxes).instructions for boxes in BOXES)
    growth = (many - more) / (more - few)
    note(f"{function}: {many / BOXES[-1]:,.0f} instructions for each of {BOXES[-1]} boxes; growth by {BOXES[2] - BOXES[1]} boxes, "
         f"over that by {BOXES[1] - BOXES[0]}: {growth:.3f}, at most {MOST}")
    claim(f"{function}_grows_with_the_number_of_boxes", [] if growth <= MOST else [f"it grows by a factor of {growth:.3f}"])

finish()
