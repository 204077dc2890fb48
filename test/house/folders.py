"""The rooms of the library, from the ground up, as lib/meson.build lists them: each may use itself and those before it."""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import re

_TEXT = (pathlib.Path(__file__).resolve().parents[2] / "lib" / "meson.build").read_text()
PLACES = re.findall(r"'(\w+/\w+)'", re.search(r"kt_rooms = \[(.*?)\]", _TEXT, re.S)[1])
STOREYS = list(dict.fromkeys(place.split("/")[0] for place in PLACES))
ROOMS = [place.split("/")[1] for place in PLACES]
