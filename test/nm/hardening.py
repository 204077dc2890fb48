"""The command and the shared libraries are hardened: read from the binaries.

hardening.py READELF STACK FORTIFY COMMAND LIBRARY...    STACK, FORTIFY: whether the compiler has them (true, false)
"""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note, output_of

readelf, has_stack, has_fortify, command, *libraries = sys.argv[1:]
problems = {"addresses_are_constant_once_loaded": [], "command_has_any_address": [], "stacks_hold_no_code": [],
            "stacks_are_checked": [], "copies_are_checked": []}
for binary in [command, *libraries]:
    name = pathlib.Path(binary).name
    segments, dynamic = output_of(readelf, "-lW", binary), output_of(readelf, "-dW", binary)
    if "GNU_RELRO" not in segments or not re.search(r"BIND_NOW|FLAGS_1.*NOW", dynamic):
        problems["addresses_are_constant_once_loaded"].append(name)
    if not re.search(r"GNU_STACK\s.*\sRW\s", segments):
        problems["stacks_hold_no_code"].append(name)
    imports = set(re.findall(r"UND\s+(\w+)", output_of(readelf, "--dyn-syms", "-W", binary)))
    is_thin = "lapack" in name  # a table of functions alone
    if has_stack == "true" and not is_thin and "__stack_chk_fail" not in imports:
        problems["stacks_are_checked"].append(name)
    if has_fortify == "true" and not is_thin and not any(symbol.endswith("_chk") for symbol in imports):
        problems["copies_are_checked"].append(name)
    if binary == command and not re.search(r"FLAGS_1.*PIE", dynamic):
        problems["command_has_any_address"].append(name)
note(f"{len(libraries)} libraries")
for words, found in problems.items():
    claim(words, found)
finish()
