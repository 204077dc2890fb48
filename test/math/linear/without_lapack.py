"""without_lapack WITHOUT WITH NM: what the library does without LAPACK is what it does with it, but for large groups."""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import re
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
from claims import claim, finish, note, output_of

without, full, nm = sys.argv[1:]


def run(program):
    ended = subprocess.run([program], capture_output=True, text=True, timeout=600)
    *state, rope = ended.stdout.splitlines()
    claim(f"program_ends_well {pathlib.Path(program).name}", [] if ended.returncode == 0 else [ended.stdout[-500:]])
    return state, rope


def symbols(program, *options):
    return re.findall(r"\b(?:LAPACKE?_\w+|cblas_\w+|openblas\w*|d(?:geqp3|ormqr|geevx|potrf|gesv)_\w*)", output_of(nm, *options, program))


state, rope = run(without)
expected, rope_by_lapack = run(full)
groups = [line for line in state if line.startswith("group")]
note(f"{', '.join(groups)}; {len(state) - len(groups)} positions; {rope}")
claim("legs_are_groups_of_four_coordinates", [] if groups == 4 * ["group of 4 coordinates"] else groups)
claim("quadruped_has_the_bits_of_the_library_with_lapack", [] if state == expected and len(state) > 20 else state)
claim("large_group_is_rejected_by_name",
      [] if "unsupported" in rope.lower() and "far-end" in rope and "-DKINETREE_FULL" in rope else [rope])
claim("library_with_lapack_takes_it", [] if "ok" in rope_by_lapack.lower().split(";")[0] else [rope_by_lapack])
claim("no_symbol_of_lapack_is_in_it", symbols(without, "-D", "-u") + symbols(without))
claim("and_one_is_where_lapack_is_linked", [] if symbols(full, "-D", "-u") + symbols(full) else ["none"])
finish()
