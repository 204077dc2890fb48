"""The sources of the core, read from lib/STOREY/ROOM/meson.build."""

import re
from pathlib import Path

CONDITIONS = {
    'if kt_has_loops': 'KT_HAS_LOOPS',
    'if not kt_is_small': 'KT_IS_FULL',
    'if kt_has_loops and not kt_is_small': 'KT_HAS_LOOPS && KT_IS_FULL',
}

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
    """Files of a room: (ROOM/name.c, condition) in the lists `plain`, `dual`."""

    def __init__(self, lib, place):
        self.place, self.name = place, place.split('/')[1]
        self.plain, self.dual, self.lists = [], [], {}
        path = lib / place / 'meson.build'
        if path.exists():
            self.read(re.sub(r'#.*', '', path.read_text()))

    def read(self, text):
        condition = None
        if re.search(r'^[ \t]+(?:if|else)\b', text, re.M):
            raise SystemExit(f'lib/{self.place}/meson.build: a condition within another is not read; write `if a and b`')
        pattern = r'^(if [^\n]*|else|endif)$|^\s*(\w+) (\+?=) ((?:files\([^)]*\)|\w+)(?: \+ (?:files\([^)]*\)|\w+))*)$'
        for match in re.finditer(pattern, text, re.M):
            word, target, _, value = match.groups()
            if word == 'endif':
                condition = None
            elif word == 'else':
                condition = 'else'
            elif word:
                if word not in CONDITIONS:
                    raise SystemExit(f'lib/{self.place}/meson.build: "{word}" is not known; add it to CONDITIONS')
                condition = CONDITIONS[word]
            elif condition == 'else':
                self.add_to_both(value)
            else:
                self.add(target, value, condition)

    def add_to_both(self, value):
        """Files that a library has with a part and without it are compiled in any case: the file asks for the part."""
        lists = [part.strip() for part in value.split(' + ')]
        for name in lists:
            if name not in self.lists:
                raise SystemExit(f'lib/{self.place}/meson.build: else {name}: one file has no part for `else` alone; '
                                 'name a list that has a condition, too')
        both = {path for name in lists for path, _ in self.lists[name]}
        self.plain = [(path, None if path in both else own) for path, own in self.plain]

    def add(self, target, value, condition):
        files = []
        for part in value.split(' + '):
            names = re.findall(r"'([\w/.]+)'", part)
            if part.strip().startswith('files('):
                files += [(f'{self.name}/{n}', condition) for n in names]
            else:
                files += [(path, own or condition) for path, own in self.lists.get(part.strip(), [])]
        if target in ('kt_sources', 'kt_kernel_sources'):
            known = {path for path, _ in self.plain}
            self.plain += [f for f in files if f[0] not in known and f[0] not in LEFT_OUT_FILES]
        elif target == 'kt_dual_sources':
            self.dual += files
        elif target != 'kt_lane_sources':
            self.lists[target] = self.lists.get(target, []) + files


def core(lib):
    """The files to compile once, and those to compile again for dual numbers: lists of (path, condition)."""
    parts = [Room(Path(lib), place) for place in core_rooms(Path(lib))]
    plain = [f for part in parts for f in part.plain] + [('linear/lapack_call.c', None)]
    return plain, [f for part in parts for f in part.dual]


# The folders of the scene reader, which reads flow style in an FMU, and the files of apps/fmu/meson.build.
READER_ROOMS = ('files/mesh', 'files/document', 'files/scene')


def fmu(root):
    """The files of an FMU besides the core: the scene reader, the columns of records, and the functions of FMI."""
    lib = Path(root) / 'lib'
    reader = [f for place in READER_ROOMS for f in Room(lib, place).lists['kt_scene_sources']]
    reader = [(path, own) for path, own in reader if '..' not in path] + [('document/flow.c', None)]
    text = (Path(root) / 'apps/fmu/meson.build').read_text()
    names = re.search(r"shared_module\('kinetree-fmu', (.*?)\n  name_prefix", text, re.S).group(1)
    own = [(path.replace('../kinetree/', ''), None) for path in re.findall(r"'([\w/.]+\.c)'", names)]
    return reader + own
