"""The sources of the core, read from lib/STOREY/ROOM/meson.build."""
# SPDX-License-Identifier: Apache-2.0

import re
from pathlib import Path

# Other libraries have the other rooms of `study`, `files` and `output`. Batches run in lanes, which need a second
# compilation of the recursions for vectors of states; one file has one compilation.
LEFT_OUT_ROOMS = {'batch'}
LEFT_OUT_FILES = {'sensitivity/rollout_lanes.c'}
CORE_STOREYS = {'math', 'model', 'mechanics', 'motion'}
MORE_CORE_ROOMS = {'analysis', 'parts'}


def rooms_of(lib):
    """STOREY/ROOM in the order of lib/meson.build."""
    text = re.search(r'kt_rooms = \[(.*?)\]', (lib / 'meson.build').read_text(), re.S).group(1)
    return re.findall(r"'(\w+/\w+)'", text)


def storeys(lib):
    """The folders in which a path ROOM/name is found."""
    return list(dict.fromkeys(lib / place.split('/')[0] for place in rooms_of(lib)))


def core_rooms(lib):
    return [place for place in rooms_of(lib) for storey, room in [place.split('/')]
            if (storey in CORE_STOREYS or room in MORE_CORE_ROOMS) and room not in LEFT_OUT_ROOMS]


class Room:
    """Files of a room, ROOM/name.c, in the lists `plain`, `dual`."""

    def __init__(self, lib, place):
        self.name = place.split('/')[1]
        self.plain, self.dual, self.lists = [], [], {}
        path = lib / place / 'meson.build'
        if re.search(r'^\s*if\b', path.read_text(), re.M):
            raise SystemExit(f'lib/{place}/meson.build: a condition is not read; name all sources')
        self.read(re.sub(r' *#.*', '', path.read_text()))

    def read(self, text):
        pattern = r'^\s*(\w+) (\+?=) ((?:files\([^)]*\)|\w+)(?: \+ (?:files\([^)]*\)|\w+))*)$'
        for match in re.finditer(pattern, text, re.M):
            self.add(match[1], match[3])

    def add(self, target, value):
        files = []
        for part in value.split(' + '):
            if part.strip().startswith('files('):
                files += [f'{self.name}/{n}' for n in re.findall(r"'([\w/.]+)'", part)]
            else:
                files += self.lists.get(part.strip(), [])
        if target in ('kt_sources', 'kt_kernel_sources'):
            self.plain += [f for f in files if f not in self.plain and f not in LEFT_OUT_FILES]
        elif target == 'kt_dual_sources':
            self.dual += files
        elif target != 'kt_lane_sources':
            self.lists[target] = self.lists.get(target, []) + files


def core(lib):
    """The files to compile once, and those to compile again for dual numbers: lists of paths."""
    parts = [Room(Path(lib), place) for place in core_rooms(Path(lib))]
    plain = [f for part in parts for f in part.plain] + ['linear/lapack_call.c']
    return plain, [f for part in parts for f in part.dual]


# The scene reader, which reads flow style in an FMU: its rooms, and the list of each.
READER_LISTS = {'files/document': 'kt_scene_sources', 'files/scene': 'kt_flow_sources'}


def fmu(root):
    """The files of an FMU besides the core: the scene reader, the columns of records, and the functions of FMI."""
    lib = Path(root) / 'lib'
    reader = [f for place, name in READER_LISTS.items() for f in Room(lib, place).lists[name]]
    reader = [path for path in reader if '..' not in path] + ['document/flow.c']
    text = (Path(root) / 'apps/fmu/meson.build').read_text()
    names = re.search(r"shared_module\('kinetree-fmu', (.*?)\n  name_prefix", text, re.S).group(1)
    own = [path.replace('../kinetree/', '') for path in re.findall(r"'([\w/.]+\.c)'", names)]
    return reader + own
