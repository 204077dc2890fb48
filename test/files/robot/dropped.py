"""drop.py drops the dog of the page: it stands, with a trunk as high as before the drop.

dropped.py KINETREE PAGE
"""
# SPDX-License-Identifier: Apache-2.0
import os
import pathlib
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
from claims import claim, finish, note

kinetree, page = sys.argv[1:]
DROP = pathlib.Path(__file__).with_name("drop.py")
with tempfile.TemporaryDirectory() as folder:
    model = pathlib.Path(folder) / "dog.xml"
    model.write_text(re.search(r"```xml\n(<!-- dog.xml -->.*?)```", pathlib.Path(page).read_text(), flags=re.S)[1])
    environment = {name: value for name, value in os.environ.items() if name != "KT_MUJOCO_WASM"}
    ran = subprocess.run([sys.executable, DROP, kinetree, model, "200,5", "--height", "0.5", "--pose=0.3,-0.6,0.3,-0.6", "--duration", "3"],
                         capture_output=True, text=True, env=environment)
    for line in ran.stdout.splitlines():
        note(line)
    states = [float(height) for height in re.findall(r"here: stands, height ([\d.]+) m", ran.stdout)]
    claim("dog_stands_before_and_after_a_drop", [] if len(states) == 2 else [ran.stdout + ran.stderr])
    claim("it_is_as_high_as_before", [] if len(states) == 2 and abs(states[0] - states[1]) < 1e-3 and states[0] > 0.35 else [str(states)])
    claim("mujoco_is_not_asked_without_its_package", [] if ran.stdout.count("in MuJoCo: no result") == 2 else [ran.stdout])
    claim("no_file_is_left", [path.name for path in pathlib.Path(folder).iterdir() if path != model])
finish()
