"""firmware PROGRAM LEFT-OUT SOURCE-ROOT BUILD-DIRECTORY: apps/firmware prints the same here and on a Cortex-M7, where it fits into
200 kB; and a small library rejects whatever it leaves out."""
import pathlib
import re
import shutil
import struct
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note, skip

TEXT_MOST = 200_000  # bytes
TARGET = [0.9, 0.2, 0.1, 0.9, -0.5, 1.5, 1.0]  # rad, where the path of apps/firmware/firmware.c ends
EMULATOR = ["qemu-system-arm", "-M", "mps2-an500", "-nographic", "-monitor", "none", "-serial", "none",
            "-semihosting-config", "enable=on,target=native", "-kernel"]


def run(*command, **more):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, **more)


def build(source, folder):
    """Problems; the program and the archive that it links are in `folder` then."""
    if not (folder / "build.ninja").is_file():
        shutil.rmtree(folder, ignore_errors=True)
        made = run("meson", "setup", folder, source, "--cross-file", source / ".ci/cortex-m7.ini", "-Dwerror=true")
        if made.returncode != 0:
            return (made.stdout + made.stderr).splitlines()
    made = run("ninja", "-C", folder, "apps/firmware/firmware", "apps/firmware/left_out")
    return [] if made.returncode == 0 else (made.stdout + made.stderr).splitlines()[-40:]


def not_linked(source, archive):
    """Public functions that the small library does not have, and whether the header states it: name -> bool."""
    defined = set(re.findall(r" T (kt_\w+)$", run("arm-none-eabi-nm", "--defined-only", archive).stdout, flags=re.M))
    missing = {}
    for path in sorted((source / "include/kinetree").glob("*.h")):
        if path.name in ("study.h", "formulation.h", "dae.h", "scene.h", "import.h", "export.h", "codegen.h"):  # of other libraries
            continue
        for paragraph in path.read_text().split("\n\n"):
            for name in re.findall(r"^KT_API[^;(]*?\b(kt_\w+)\(", paragraph, flags=re.M):
                if name not in defined:
                    missing[name] = "small library" in paragraph
    return missing


def outcomes(result):
    """Part -> (whether it is accepted, the message), as left_out.c prints them."""
    lines = (line.partition(": ") for line in result.stdout.splitlines())
    return {part: (rest.startswith("accepted"), rest) for part, _, rest in lines}


def compare_parts(program, device):
    here, there = outcomes(run(program)), outcomes(run(*EMULATOR, device, timeout=100))
    claim("full_library_accepts_what_a_small_one_leaves_out",
          [f"{part}: {rest}" for part, (accepted, rest) in here.items() if not accepted] if len(here) > 10 else [str(here)])
    claim("small_library_rejects_what_it_leaves_out_with_a_message",
          [f"{part}: {rest}" for part, (accepted, rest) in there.items() if accepted != (part == "nothing") or len(rest) < 8]
          if there.keys() == here.keys() else [str(there)])
    note(f"{len(here) - 1} parts that a small library leaves out were tried")


def main():
    program, left_out, source, folder = (pathlib.Path(argument) for argument in sys.argv[1:])
    here = run(program)
    lines = dict(line.split() for line in here.stdout.splitlines())
    claim("program_ends_well_here", [] if here.returncode == 0 else [here.stdout + here.stderr])
    reached = [struct.unpack(">d", bytes.fromhex(bits))[0] for bits in list(lines.values())[:7]]
    far = max(abs(q - wanted) for q, wanted in zip(reached, TARGET))
    note(f"after 500 steps joints are within {far:.3g} rad of the end of the path, bound 0.02, ratio {far / 0.02:.3g}")
    claim("arm_follows_the_path_to_its_end", [] if len(reached) == 7 and far < 0.02 else [here.stdout])
    left = abs(struct.unpack(">d", bytes.fromhex(lines.get("swing", "7ff8000000000000")))[0])
    note(f"after a swing to a stop the velocity is {left:.3g} m/s, bound 1e-3, ratio {left / 1e-3:.3g}")
    claim("stop_that_no_stage_meets_is_seen", [] if left < 1e-3 else [here.stdout])

    newlib = run("arm-none-eabi-gcc", "-print-file-name=rdimon.specs").stdout.strip()
    if not pathlib.Path(newlib).is_file():
        skip("cortex_m7_gives_the_same_bits", "newlib for arm-none-eabi is not on this machine")
        sys.exit(77)
    problems = build(source, folder)
    claim("core_and_program_are_built_for_a_cortex_m7_without_a_warning", problems)
    if problems:
        finish()
    archive, firmware = folder / "lib/libkinetree.a", folder / "apps/firmware/firmware"
    claim("archive_is_built_alone", [str(path) for path in folder.rglob("*.so*")] + ([] if archive.is_file() else ["no archive"]))

    missing = not_linked(source, archive)
    note(f"{len(missing)} public functions are not in a small library")
    claim("headers_state_which_functions_a_small_library_lacks",
          [name for name, is_stated in missing.items() if not is_stated] if missing else ["nothing is missing: nm has failed"])

    size = re.search(r"^\s*(\d+)\s+(\d+)\s+(\d+)", run("arm-none-eabi-size", firmware).stdout, flags=re.M)
    text = int(size[1]) if size else 0
    note(f"{text} bytes of text, bound {TEXT_MOST}, ratio {text / TEXT_MOST:.3f}; data {size and size[2]}, bss {size and size[3]}")
    claim("text_is_at_most_200_kB", [] if 0 < text <= TEXT_MOST else [f"{text} bytes"])

    there = run(*EMULATOR, firmware, timeout=300)
    claim("program_ends_well_on_the_device", [] if there.returncode == 0 else [f"status {there.returncode}", there.stdout, there.stderr])
    claim("cortex_m7_gives_the_bits_of_this_machine_over_500_steps",
          [] if there.stdout == here.stdout and "all" in lines else [f"here: {here.stdout}", f"there: {there.stdout}"])
    compare_parts(left_out, folder / "apps/firmware/left_out")
    finish()


main()
