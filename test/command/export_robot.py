"""export_robot COMMAND SOURCE-ROOT: the command line of `kinetree export --mjcf` and `--urdf`: files, rejections, exit statuses."""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish

from exported import BOUNCE, COMMAND, export, rejected

SCENES = pathlib.Path(sys.argv[2]).resolve() / "apps/scenes"
ROOTS = {"--mjcf": "mujoco", "--urdf": "robot"}


def import_of(path):
    return subprocess.run([COMMAND, "import", path], capture_output=True, text=True)


def written(option, scene, notes):
    """The file is XML with the format's root, with the notes of the export; `import` ends with status 0, too."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder, "out.xml")
        made = export(folder, option, scene, "--out", path.name)
        problems = [] if made.returncode == 0 and path.is_file() else [f"status {made.returncode}: {made.stderr}"]
        problems += [] if (made.stderr != "") == notes and made.stdout == "" else [f"printed: {made.stdout}{made.stderr}"]
        if not problems:
            root = xml.etree.ElementTree.parse(path).getroot().tag
            back = import_of(path)
            problems += [] if root == ROOTS[option] else [f"the root is {root}"]
            problems += [] if back.returncode == 0 else [f"import: status {back.returncode}: {back.stderr}"]
            problems += [] if path.read_text() == export(folder, option, scene).stdout else ["standard output differs"]
        claim(f"{option[2:]}_of_{scene.stem}_is_written".replace("-", "_"), problems)


def main():
    arm, loop, top = (SCENES / f"{name}.yaml" for name in ("arm7", "four-bar", "lagrange-top"))
    written("--mjcf", arm, notes=False)
    written("--mjcf", loop, notes=False)
    written("--mjcf", SCENES / "bicycle.yaml", notes=True)
    written("--urdf", arm, notes=True)
    written("--urdf", loop, notes=True)
    for option in ROOTS:
        name = option[2:]
        rejected(f"{name}_needs_a_scene_that_exists", 2, "nothing.yaml", option, "nothing.yaml", "--out", "out.xml")
        rejected(f"{name}_needs_a_path_that_exists", 2, "'nobody'", option, arm, "--set", "bodies.nobody.mass=2", "--out", "out.xml")
        rejected(f"{name}_needs_a_folder_that_exists", 4, "No such file or directory", option, arm, "--out", "no/folder/out.xml")
        rejected(f"{name}_writes_no_folder", 4, "Is a directory", option, arm, "--out", "/")
        rejected(f"{name}_keeps_the_scene", 1, "is the scene itself", option, arm, "--out", arm)
        rejected(f"{name}_needs_a_scene", 1, "SCENE is missing", option)
        rejected(f"{name}_takes_one_scene", 1, "is one word too many", option, arm, loop)
        rejected(f"{name}_has_no_inputs", 1, "--input is an option of --fmu", option, arm, "--input", "j1")
        full = subprocess.run(f"'{COMMAND}' export {option} '{arm}' > /dev/full", shell=True, capture_output=True, text=True)
        claim(f"{name}_reports_a_full_disk", [] if full.returncode == 4 and "is the disk full?" in full.stderr else [str(full)])
        with tempfile.TemporaryDirectory() as folder:
            pathlib.Path(folder, "bounce.yaml").write_text(BOUNCE)
            notes = export(folder, option, "bounce.yaml", "--out", "b.xml").stderr
            claim(f"{name}_notes_parameters_and_states_apart",
                  [] if all(f"left out or changed: {what} (1)\n" in notes for what in ("events", "auxiliary states", "parameters as set by events")) else [notes])
            claim(f"{name}_notes_the_scene_once", [] if notes.count("bounce.yaml") == 1 else [notes])
            quiet = export(folder, option, "bounce.yaml", "--out", "b.xml", "--quiet").stderr
            claim(f"{name}_notes_nothing_with_quiet", [] if quiet == "" else [quiet])
    rejected("urdf_has_no_spherical_joint", 2, "URDF has no spherical joint", "--urdf", top, "--out", "out.urdf")
    rejected("a_format_is_needed", 1, "give --urdf, --mjcf, --c or --fmu", arm, "--out", "out.xml")
    rejected("one_format_is_taken", 1, "one of them", "--urdf", "--mjcf", arm, "--out", "out.xml")
    finish()


main()
