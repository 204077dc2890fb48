"""No multiplication is fused with an addition: with its one rounding it would give other bits than two instructions do
on a lower level. -ffp-contract=off is not enough: gcc 12 makes vfmaddsub of a product less and another product more a
number, where these are stored side by side.

fused.py OBJDUMP LIBRARY...
"""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note, output_of

objdump, *libraries = sys.argv[1:]
function, instructions, fused = "", 0, []
for line in output_of(objdump, "-d", "--no-show-raw-insn", *libraries).splitlines():
    start = re.match(r"[0-9a-f]+ <(.*)>:", line)
    if start:
        function = start[1]
        continue
    instructions += line.startswith(" ")
    if re.search(r"\tvfn?m(add|sub)", line):
        fused.append(f"{function}: {line.split(chr(9), 1)[1].strip()}")
note(f"{instructions} instructions")
claim("library_was_read", [] if instructions > 10000 else ["there are hardly any instructions"])
claim("no_multiplication_is_fused_with_an_addition", fused)
finish()
