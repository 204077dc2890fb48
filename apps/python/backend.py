"""Builds the wheel of the Python package: the interface of PEP 517 for pip.

The libraries are linked into the module and into the command, so that the wheel needs the system's OpenBLAS, LAPACKE, libyaml,
expat, jansson and cairo, and no library of its own. meson-python would do the same, but the versions of Debian 12 install every
header, archive and man page of the project into the environment, and leave the tag of the stable interface out.
"""
# SPDX-License-Identifier: Apache-2.0
import base64
import hashlib
import pathlib
import re
import shlex
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
OPTIONS = ["-Ddefault_library=static", "-Dpython=enabled", "-Dscene=enabled", "-Dcommand=enabled", "-Dtests=disabled", "-Dembed=disabled",
           "-Dhdf5=disabled", "-Dassimp=disabled", "-Ddebug=false"]
MODULE = "apps/python/kinetree/_kinetree.abi3.so"
TAG = f"cp39-abi3-{re.sub(r'[^a-z0-9_]', '_', sysconfig.get_platform().lower())}"


def version():
    return re.search(r"^  version: '(.*?)'", (ROOT / "meson.build").read_text(), flags=re.M)[1]


def address():
    """The address of the project in CITATION.cff; None: it has none yet."""
    found = re.search(r"^(?:repository-code|url): *['\"]?(\S+?)['\"]?$", (ROOT / "CITATION.cff").read_text(), flags=re.M)
    return found and found[1].rstrip("/")


def description():
    """The README for an index of packages, which has no other files: links are absolute, or words if the project has no address."""
    text, base = (ROOT / "README.md").read_text(), address()
    relative = r"\]\((?!https?:|#)([^)]*)\)"
    if base:
        return re.sub(relative, rf"]({base}/blob/main/\1)", re.sub(rf"(!\[[^]]*){relative}", rf"\1]({base}/raw/main/\2)", text))
    return re.sub(rf"\[([^][]*){relative}", r"\1", re.sub(rf"^.*!\[[^]]*{relative}.*\n|^.*<img .*\n", "", text, flags=re.M))


def metadata():
    urls = f"Project-URL: Source, {address()}\nProject-URL: Changes, {address()}/blob/main/CHANGELOG.md\n" if address() else ""
    return f"""Metadata-Version: 2.1
Name: kinetree
Version: {version()}
Summary: Mechanisms in minimal coordinates: pendulums, chains, linkages, robots, rotors
License: Apache-2.0
License-File: LICENSE
{urls}Classifier: License :: OSI Approved :: Apache Software License
Classifier: Programming Language :: Python :: 3
Classifier: Programming Language :: C
Classifier: Topic :: Scientific/Engineering :: Physics
Classifier: Typing :: Typed
Requires-Python: >=3.9
Requires-Dist: cffi >= 1.15
Requires-Dist: numpy >= 1.21
Provides-Extra: plot
Requires-Dist: matplotlib ; extra == 'plot'
Provides-Extra: frame
Requires-Dist: pandas ; extra == 'frame'
Description-Content-Type: text/markdown

{description()}"""


def described():
    """The files of dist-info, but for the list of all files."""
    return {"METADATA": metadata(), "licenses/LICENSE": (ROOT / "LICENSE").read_text(), "WHEEL": f"Wheel-Version: 1.0\nGenerator: kinetree\nRoot-Is-Purelib: false\nTag: {TAG}\n"}


class Wheel:
    """A zip archive whose last file lists the others with their sums."""

    def __init__(self, folder):
        self.name = f"kinetree-{version()}-{TAG}.whl"
        self.archive = zipfile.ZipFile(pathlib.Path(folder) / self.name, "w", zipfile.ZIP_DEFLATED)
        self.rows = []

    def add(self, place, content, executable=False):
        entry = zipfile.ZipInfo(place, (1980, 1, 1, 0, 0, 0))
        entry.external_attr = (0o100755 if executable else 0o100644) << 16
        entry.compress_type = zipfile.ZIP_DEFLATED
        self.archive.writestr(entry, content)
        digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
        self.rows.append(f"{place},sha256={digest},{len(content)}")

    def close(self):
        info = f"kinetree-{version()}.dist-info"
        for name, content in described().items():
            self.add(f"{info}/{name}", content.encode())
        self.archive.writestr(f"{info}/RECORD", "\n".join([*self.rows, f"{info}/RECORD,,", ""]))
        self.archive.close()
        return self.name


def compiled(build, settings):
    """Configure and build; a native file makes Meson take this Python, which may be that of an environment.

    The setting `setup-args`, of the name that meson-python gives it, adds options of Meson: words in one text, or a list of them.
    """
    more = (settings or {}).get("setup-args", [])
    more = shlex.split(more) if isinstance(more, str) else more
    native = pathlib.Path(build) / "python.ini"
    native.parent.mkdir(parents=True, exist_ok=True)
    native.write_text(f"[binaries]\npython3 = '{sys.executable}'\n")
    subprocess.run(["meson", "setup", "--native-file", native, *OPTIONS, *more, build, ROOT], check=True, stdout=sys.stderr)
    subprocess.run(["ninja", "-C", build, "python", "apps/kinetree/kinetree"], check=True, stdout=sys.stderr)
    return pathlib.Path(build)


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    info = f"kinetree-{version()}.dist-info"
    (pathlib.Path(metadata_directory) / info).mkdir()
    (pathlib.Path(metadata_directory) / info / "licenses").mkdir()
    for name, content in described().items():
        (pathlib.Path(metadata_directory) / info / name).write_text(content)
    return info


def add_command(wheel, build):
    """The command and its scenes, which go beside those of other programs of the environment."""
    data = f"kinetree-{version()}.data"
    wheel.add(f"{data}/scripts/kinetree", (build / "apps/kinetree/kinetree").read_bytes(), executable=True)
    # pip removes a folder that has a file of its own; a folder of folders would be left empty.
    wheel.add(f"{data}/data/share/kinetree/LICENSE", (ROOT / "LICENSE").read_bytes())
    for path in sorted((ROOT / "apps/scenes").rglob("*")):
        if path.is_file() and path.name != "meson.build":
            wheel.add(f"{data}/data/share/kinetree/scenes/{path.relative_to(ROOT / 'apps/scenes').as_posix()}", path.read_bytes())


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    with tempfile.TemporaryDirectory() as temporary:
        build = compiled(temporary, config_settings)
        wheel, sources = Wheel(wheel_directory), ROOT / "apps/python/kinetree"
        files = [*sources.glob("*.py"), *sources.glob("*.pyi"), sources / "py.typed", build / MODULE]
        for path in sorted(files, key=lambda each: each.name):
            wheel.add(f"kinetree/{path.name}", path.read_bytes(), executable=path.suffix == ".so")
        add_command(wheel, build)
        return wheel.close()


# `pip install -e .`: the sources of the package stay where they are, and the extension module is in the environment.
FINDER = '''"""Finds the extension module of an editable Kinetree, whose sources are in a checkout."""
import importlib.abc
import importlib.util
import pathlib
import sys


class Finder(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name == "kinetree._kinetree":
            return importlib.util.spec_from_file_location(name, pathlib.Path(__file__).with_name("_kinetree_editable.abi3.so"))
        return None


sys.meta_path.insert(0, Finder())
'''


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    with tempfile.TemporaryDirectory() as temporary:
        build = compiled(temporary, config_settings)
        wheel = Wheel(wheel_directory)
        wheel.add("kinetree_editable.pth", f"{ROOT / 'apps/python'}\nimport _kinetree_editable_finder\n".encode())
        wheel.add("_kinetree_editable_finder.py", FINDER.encode())
        wheel.add("_kinetree_editable.abi3.so", (build / MODULE).read_bytes(), executable=True)
        add_command(wheel, build)
        return wheel.close()


prepare_metadata_for_build_editable = prepare_metadata_for_build_wheel


def build_sdist(sdist_directory, config_settings=None):
    """The files that git knows, below one folder, with PKG-INFO."""
    base = f"kinetree-{version()}"
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True).stdout.decode().split("\0")
    with tarfile.open(pathlib.Path(sdist_directory) / f"{base}.tar.gz", "w:gz") as archive:
        for name in filter(None, listed):
            archive.add(ROOT / name, f"{base}/{name}", recursive=False)
        with tempfile.NamedTemporaryFile("w", suffix=".txt") as info:
            info.write(metadata())
            info.flush()
            archive.add(info.name, f"{base}/PKG-INFO")
    return f"{base}.tar.gz"
