"""The sources of the core, read from lib/*/meson.build."""

import re
from pathlib import Path

CONDITIONS = {
    'if kt_has_loops': 'KT_HAS_LOOPS',
    'if not kt_is_small': 'KT_IS_FULL',
    'if kt_has_loops and not kt_is_small': 'KT_HAS_LOOPS && KT_IS_FULL',
}

# Folders above `analysis` are other libraries. Batches run in lanes, which need a second compilation of the recursions
# for vectors of states; one file has one compilation.
LEFT_OUT_FOLDERS = {'batch'}
LEFT_OUT_FILES = {'sensitivity/rollout_lanes.c'}
LAST_FOLDER = 'build'


def folders_of(lib):
    """The folders of the core in their order, which lib/meson.build gives."""
    text = re.search(r'kt_folders = \[(.*?)\]', (lib / 'meson.build').read_text(), re.S).group(1)
    names = re.findall(r"'(\w+)'", text)
    return [name for name in names[:names.index(LAST_FOLDER) + 1] if name not in LEFT_OUT_FOLDERS]


class Folder:
    """Files of a folder: (path, condition) in the lists `plain`, `dual`."""

    def __init__(self, lib, name):
        self.lib, self.name = lib, name
        self.plain, self.dual, self.lists = [], [], {}
        path = lib / name / 'meson.build'
        if path.exists():
            self.read(re.sub(r'#.*', '', path.read_text()))

    def read(self, text):
        condition = None
        if re.search(r'^[ \t]+(?:if|else)\b', text, re.M):
            raise SystemExit(f'lib/{self.name}/meson.build: a condition within another is not read; write `if a and b`')
        pattern = r'^(if [^\n]*|else|endif)$|^\s*(\w+) (\+?=) ((?:files\([^)]*\)|\w+)(?: \+ (?:files\([^)]*\)|\w+))*)$'
        for match in re.finditer(pattern, text, re.M):
            word, target, _, value = match.groups()
            if word == 'endif':
                condition = None
            elif word == 'else':
                condition = 'else'
            elif word:
                if word not in CONDITIONS:
                    raise SystemExit(f'lib/{self.name}/meson.build: "{word}" is not known; add it to CONDITIONS')
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
                raise SystemExit(f'lib/{self.name}/meson.build: else {name}: one file has no part for `else` alone; '
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
    parts = [Folder(Path(lib), name) for name in folders_of(Path(lib))]
    plain = [f for part in parts for f in part.plain] + [('linear/lapack_call.c', None)]
    return plain, [f for part in parts for f in part.dual]


# The folders of the scene reader, which reads flow style in an FMU, and the files of apps/fmu/meson.build.
READER_FOLDERS = ('mesh', 'document', 'scene')


def fmu(root):
    """The files of an FMU besides the core: the scene reader, the columns of records, and the functions of FMI."""
    lib = Path(root) / 'lib'
    folders = [Folder(lib, name) for name in READER_FOLDERS]
    reader = [f for folder in folders for f in folder.lists['kt_scene_sources']]
    reader = [(path, own) for path, own in reader if '..' not in path] + [('document/flow.c', None)]
    text = (Path(root) / 'apps/fmu/meson.build').read_text()
    names = re.search(r"shared_module\('kinetree-fmu', (.*?)\n  name_prefix", text, re.S).group(1)
    own = [(path.replace('../kinetree/', ''), None) for path in re.findall(r"'([\w/.]+\.c)'", names)]
    return reader + own
