"""firmware COMMAND SOURCE-ROOT PROGRAM.C COMPILER...: generated C of an arm gives the same bits here and on a Cortex-M7, in less than
30 kB."""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import re
import struct
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note, skip

TEXT_MOST = 30_000  # bytes
STEP, STEPS = 1e-3, 500
TARGET = [0.9, 0.2, 0.1, 0.9, -0.5, 1.5, 1.0]  # rad
PROCESSOR = ["-mcpu=cortex-m7", "-mthumb", "-mfpu=fpv5-d16", "-mfloat-abi=hard"]
EMULATOR = ["qemu-system-arm", "-M", "mps2-an500", "-nographic", "-monitor", "none", "-serial", "none",
            "-semihosting-config", "enable=on,target=native", "-kernel"]
WARNINGS = ["-std=c99", "-Wall", "-Wextra", "-Werror"]


# One instruction takes a nanosecond of the emulator's clock (-icount shift=0). The counter of the processor has 25 MHz.
COUNTER = """#include "arm.h"
#include <stdint.h>
#include <stdio.h>
#define COUNTER ((volatile uint32_t *)0xE000E010)
enum { CALLS = 64 };
static arm_model model;
static const arm_real q[7] = {0.2, 0.6, -0.3, -1.9, 0.4, 1.7, 0.8}, v[7] = {0.5, -0.3, 0.4, 0.6, -0.8, 0.3, 1.2}, x[7] = {0.1, 0.2};
static arm_real out[49];
#define COUNT(call) do { \
    int code = 0; \
    const uint32_t from = COUNTER[2]; \
    for (int i = 0; i < CALLS; i++) \
        code |= call; \
    printf("%lu\\n", code == 0 ? (unsigned long)((from - COUNTER[2]) & 0xFFFFFF) * 40 / CALLS : 0); \
} while (0)
int main(void) {
    COUNTER[1] = 0xFFFFFF;
    COUNTER[2] = 0;
    COUNTER[0] = 5;
    arm_prepare(&arm_default, &model);
    COUNT(arm_forward(&model, q, v, x, out));
    COUNT(arm_inverse(&model, q, v, x, out));
    COUNT(arm_mass(&model, q, out));
    return 0;
}
"""
INSTRUCTIONS = {"forward": 2183, "inverse": 1341, "mass": 1101}  # of the arm with gcc 12 -O2


def run(*command, **more):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, **more)


def reached(target):
    """The position of a mass that PD control with 100 /s^2 and 20 /s moves, by the program's own steps."""
    q = v = 0.0
    for _ in range(STEPS):
        v += STEP * (100 * (target - q) - 20 * v)
        q += STEP * v
    return q


def check_instructions(command, root, folder):
    """Compilers differ by 5 %."""
    made = run(command, "export", "--c", root / "apps/scenes/arm7.yaml", "--functions", ",".join(INSTRUCTIONS), "--out", folder / "arm.c")
    (folder / "count.c").write_text(COUNTER)
    firmware = root / "apps/firmware"
    made = made.returncode == 0 and run("arm-none-eabi-gcc", *PROCESSOR, *WARNINGS, "-O2", "--specs=rdimon.specs", f"-I{folder}", folder / "count.c", folder / "arm.c",
                                        firmware / "cortex_m7.c", "-T", firmware / "cortex_m7.ld", "-o", folder / "count")
    seen = run(*EMULATOR[:3], "-icount", "shift=0", *EMULATOR[3:], folder / "count", timeout=300).stdout.split() if made and made.returncode == 0 else []
    problems = [] if len(seen) == len(INSTRUCTIONS) else [f"it prints {seen}"]
    for (name, bar), count in zip(INSTRUCTIONS.items(), seen):
        note(f"{name}: {count} instructions, bound {1.05 * bar:.0f}, ratio {int(count) / (1.05 * bar):.3f}")
        problems += [] if 0 < int(count) <= 1.05 * bar else [f"{name}: {count} instructions"]
    claim("functions_take_no_more_instructions_than_before", problems)


def check_page(root, folder):
    """The program and the commands of the page; the emulator prints what the page shows."""
    page = (root / "include/pages/generated-c.md").read_text()
    program, shown = re.search(r"^```c\n(.*?)^```\n\n```text\n(.*?)^```$", page, flags=re.S | re.M).groups()
    commands = re.search(r"^ +arm-none-eabi-gcc .*?(?=\n\n)", page, flags=re.S | re.M)[0]
    (folder / "main.c").write_text(program)
    (folder / "apps").symlink_to(root.resolve() / "apps")
    ran = run("bash", "-ec", commands, cwd=folder, timeout=300)
    claim("commands_of_the_page_print_what_it_shows", [] if ran.stdout == shown and ran.returncode == 0 else [ran.stdout, ran.stderr])


def main():
    command, root, program, *compiler = sys.argv[1:]
    root = pathlib.Path(root)
    firmware = root / "apps/firmware"
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        made = run(command, "export", "--c", root / "apps/scenes/arm7.yaml", "--functions", "forward,inverse", "--out", folder / "arm.c")
        claim("arm_is_exported", [] if made.returncode == 0 else [made.stderr])
        sources = [program, folder / "arm.c"]
        made = run(*compiler, *WARNINGS, "-O2", f"-I{folder}", *sources, "-o", folder / "here")
        claim("program_compiles_here_without_a_library", [] if made.returncode == 0 else [made.stderr])
        here = run(folder / "here")
        ends = [struct.unpack(">d", bytes.fromhex(word))[0] for word in here.stdout.split()]
        far = max([abs(q - reached(wanted)) for q, wanted in zip(ends, TARGET)], default=1.0)
        note(f"joints are {far:.3g} rad from those of masses that move freely, bound 1e-14, ratio {far / 1e-14:.3g}")
        claim("inverse_and_forward_dynamics_cancel", [] if len(ends) == 7 and far < 1e-14 else [here.stdout + here.stderr])

        made = run(*compiler, *WARNINGS, "-O2", "-Darm_FLOAT", f"-I{folder}", *sources, "-o", folder / "single")
        claim("program_compiles_in_single_precision", [] if made.returncode == 0 else [made.stderr])
        ends = [struct.unpack(">d", bytes.fromhex(word))[0] for word in run(folder / "single").stdout.split()]
        far = max([abs(q - reached(wanted)) for q, wanted in zip(ends, TARGET)], default=1.0)
        note(f"in single precision they are {far:.3g} rad from there, bound 1e-5, ratio {far / 1e-5:.3g}")
        claim("inverse_and_forward_dynamics_cancel_in_single_precision", [] if len(ends) == 7 and 1e-12 < far < 1e-5 else [str(ends)])

        newlib = run("arm-none-eabi-gcc", "-print-file-name=rdimon.specs").stdout.strip()
        if not pathlib.Path(newlib).is_file():
            skip("cortex_m7_gives_the_same_bits", "newlib for arm-none-eabi is not on this machine")
            finish()
        made = run("arm-none-eabi-gcc", *PROCESSOR, *WARNINGS, "-O2", "-ffunction-sections", "-Wl,--gc-sections", "--specs=nano.specs",
                   "--specs=rdimon.specs", f"-I{folder}", *sources, firmware / "cortex_m7.c", "-T", firmware / "cortex_m7.ld", "-o", folder / "there")
        claim("program_compiles_for_a_cortex_m7", [] if made.returncode == 0 else [made.stderr])
        size = re.search(r"^\s*(\d+)\s+(\d+)\s+(\d+)", run("arm-none-eabi-size", folder / "there").stdout, flags=re.M)
        text = int(size[1]) if size else 0
        note(f"{text} bytes of text, bound {TEXT_MOST}, ratio {text / TEXT_MOST:.3f}")
        claim("text_is_at_most_30_kB", [] if 0 < text <= TEXT_MOST else [f"{text} bytes"])
        there = run(*EMULATOR, folder / "there", timeout=300)
        claim("cortex_m7_gives_the_bits_of_this_machine", [] if there.stdout == here.stdout and ends else [here.stdout, there.stdout, there.stderr])
        check_page(root, folder)
        check_instructions(command, root, folder)
    finish()


main()
