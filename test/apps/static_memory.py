"""static_memory PROGRAM: what it says of its memory is so."""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

with tempfile.TemporaryDirectory() as folder:
    path = pathlib.Path(folder) / "memory.csv"
    run = subprocess.run([sys.argv[1], "--csv", path], capture_output=True, text=True, timeout=600)
    lines = path.read_text().splitlines() if path.exists() else []
note(run.stdout.strip().replace("\n", "\n       "))
claim("program_ends_well", [] if run.returncode == 0 else [f"status {run.returncode}: {run.stderr}"])


def says(name, pattern):
    found = re.search(pattern, run.stdout, flags=re.M)
    claim(name, [] if found else [f"no line has: {pattern}"])
    return found


found = says("memory_a_byte_short_is_rejected", r"^a byte short: +(\d+) bytes at a multiple of 64 are needed \(kt_model_size\); given: (\d+) bytes$")
if found:
    claim("rejection_says_how_much_is_missing", [] if int(found[1]) - int(found[2]) == 1 else [found[0]])
says("misaligned_memory_is_rejected", r"^misaligned: .* given: \d+ bytes, misaligned$")
found = says("all_lives_in_one_static_buffer",
             r"^one static buffer: model (\d+), simulation (\d+), checkpoint (\d+): (\d+) of (\d+) bytes")
if found:
    model, simulation, checkpoint, used, size = map(int, found.groups())
    padding = used - model - simulation - checkpoint
    page = (pathlib.Path(__file__).resolve().parents[2] / "include/pages/embedding.md").read_text()
    stated = re.search(r"a simulation and a checkpoint in (\d+) kB of static memory", page)
    note(f"{used} bytes, on the page {stated[1] if stated else 'no number'} kB")
    claim("page_states_the_memory", [] if stated and int(stated[1]) == round(used / 1000) else [f"{used} bytes"])
    claim("buffer_holds_no_more_than_these", [] if 0 <= padding < 3 * 64 and used <= size else [found[0]])
says("checkpoint_continues_bit_for_bit", r"from the checkpoint: same bits$")
says("static_memory_gives_the_bits_of_the_heap", r"on the heap: same bits$")
claim("csv_has_a_row_every_hundredth_second", [] if len(lines) == 401 else [f"{len(lines)} lines"])
finish()
