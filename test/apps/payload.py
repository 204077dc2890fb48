"""payload PROGRAM: one call reads a robot's file, and its controller fits on a page: computed torque, and a payload."""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

LINES_MOST = 35
ROOT = pathlib.Path(__file__).resolve().parents[2]
source = [line for line in (ROOT / "apps/embed/payload.c").read_text().splitlines() if "SPDX" not in line]
claim("program_has_at_most_35_lines", [] if len(source) <= LINES_MOST else [f"{len(source)} lines"])
claim("no_line_is_wider_than_others_of_the_sources", [line for line in source if len(line) > 120])


def link(name, mass, length):
    return (f'<link name="{name}"><inertial><origin xyz="0 0 {length / 2}"/><mass value="{mass}"/>'
            f'<inertia ixx="{mass * length**2 / 12}" iyy="{mass * length**2 / 12}" izz="0.002" ixy="0" ixz="0" iyz="0"/>'
            "</inertial></link>")


def joint(name, parent, child, axis, up):
    return (f'<joint name="{name}" type="continuous"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="0 0 {up}"/><axis xyz="{axis}"/></joint>')


URDF = ('<robot name="arm"><link name="base"/>' + link("upper", 3, 0.5) + link("fore", 2, 0.4) + link("hand", 1, 0.2)
        + joint("shoulder", "base", "upper", "0 1 0", 0.1) + joint("elbow", "upper", "fore", "0 1 0", 0.5)
        + joint("wrist", "fore", "hand", "0 0 1", 0.4) + "</robot>")


def run(path, *arguments):
    return subprocess.run([sys.argv[1], str(path), *arguments], capture_output=True, text=True, timeout=600)


with tempfile.TemporaryDirectory() as folder:
    path = pathlib.Path(folder) / "arm.urdf"
    path.write_text(URDF)
    ended, wrong, absent = run(path, "hand.mass", "6"), run(path, "hnad.mass", "6"), run(path.with_suffix(".xml"), "hand.mass", "6")
note(ended.stdout.strip())
found = re.search(r"largest error ([0-9.e+-]+) rad before, ([0-9.e+-]+) rad with the payload", ended.stdout)
claim("program_ends_well", [] if ended.returncode == 0 and found else [ended.stderr])
errors = [float(x) for x in found.groups()] if found else [1.0, 1.0]
# What is left is that of torques that are held for a millisecond: some (w^2 h) of the path, 1e-3 rad at most.
claim("path_is_followed_with_the_payload_and_without", [] if 0.0 < max(errors) < 2e-3 else [f"{errors}"])
claim("a_wrong_name_is_told_with_the_nearest_one",
      [] if wrong.returncode and "hand" in wrong.stderr else [wrong.stderr])
claim("a_failure_prints_no_result", [word.stdout for word in (wrong, absent) if word.stdout])
claim("a_file_that_is_not_there_is_told", [] if absent.returncode and "arm.xml" in absent.stderr else [absent.stderr])
finish()
