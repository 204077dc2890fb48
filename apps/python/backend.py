"""Builds the wheel of the Python package: the interface of PEP 517 for pip.

The libraries are linked into the module and into the command, so that the wheel needs the system's OpenBLAS, LAPACKE, libyaml,
expat, jansson and cairo, and no library of its own. meson-python would do the same, but the versions of Debian 12 install every
header, archive and man page of the project into the environment, and leave the tag of the stable interface out.
"""
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
TAG = f"cp39-abi3-{re.sub(r'[^a-z0-9_]', '_', sysconfig.get_platform().lower())}"


def version():
    return re.search(r"^  version: '(.*?)'", (ROOT / "meson.build").read_text(), flags=re.M)[1]


def metadata():
    return f"""Metadata-Version: 2.1
Name: kinetree
Version: {version()}
Summary: Mechanisms in minimal coordinates: pendulums, chains, linkages, robots, rotors
License: Apache-2.0
Requires-Python: >=3.9
Requires-Dist: cffi >= 1.15
Requires-Dist: numpy >= 1.21
Provides-Extra: plot
Requires-Dist: matplotlib ; extra == 'plot'
Provides-Extra: frame
Requires-Dist: pandas ; extra == 'frame'
Description-Content-Type: text/markdown

{(ROOT / "README.md").read_text()}"""


def described():
    """The files of dist-info, but for the list of all files."""
    return {"METADATA": metadata(), "WHEEL": f"Wheel-Version: 1.0\nGenerator: kinetree\nRoot-Is-Purelib: false\nTag: {TAG}\n"}


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
    for name, content in described().items():
        (pathlib.Path(metadata_directory) / info / name).write_text(content)
    return info


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    with tempfile.TemporaryDirectory() as temporary:
        build = compiled(temporary, config_settings)
        wheel, data = Wheel(wheel_directory), f"kinetree-{version()}.data"
        sources = ROOT / "apps/python/kinetree"
        for path in sorted([*sources.glob("*.py"), sources / "py.typed", build / "apps/python/kinetree/_kinetree.abi3.so"], key=lambda each: each.name):
            wheel.add(f"kinetree/{path.name}", path.read_bytes(), executable=path.suffix == ".so")
        wheel.add(f"{data}/scripts/kinetree", (build / "apps/kinetree/kinetree").read_bytes(), executable=True)
        for path in sorted((ROOT / "apps/scenes").rglob("*")):
            if path.is_file() and path.name != "meson.build":
                wheel.add(f"{data}/data/share/kinetree/scenes/{path.relative_to(ROOT / 'apps/scenes').as_posix()}", path.read_bytes())
        return wheel.close()


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
