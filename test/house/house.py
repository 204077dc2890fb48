"""The order of the house, read from the sources.

house.py SOURCE-ROOT
"""
# SPDX-License-Identifier: Apache-2.0
import collections
import pathlib
import re
import shutil
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note
from folders import PLACES, ROOMS, STOREYS

# Faces with another name than their room's.
FACES = {"status": "base", "description": "model", "descriptor": "model", "quantity": "model", "function": "model", "lookup": "expression", "body": "model", "import": "robot", "export": "robot",
         "method": "integrator", "stability": "integrator", "run": "step", "record": "step", "equations": "step", "instant": "step", "simulation": "step",
         "formulation": "compare", "dae": "compare", "study": "compare", "build": "parts", "ensemble": "batch", "closure": "assembly", "mechanism": "evaluate",
         "kinetree": None, "experimental": None}

UMBRELLAS = ("kinetree.h", "experimental.h")  # the stable faces, and the others

TOP = {"CHANGELOG.md", "CITATION.cff", "LICENSE", "README.md", "apps", "bench", "include", "lib", "meson.build", "meson_options.txt", "pyproject.toml", "test"}
NEW_FORMAT = re.compile(r"%[-+ 0#]*[\d.*]*(?:[zjt][diouxX]|ll[diu])")  # newlib takes the wrong argument for the %s after these: it reads a wild address
LONG = 600
LICENCE = "SPDX-License-Identifier: " + "Apache-2.0"
WIDE = 120  # columns of a line, as in .clang-format, which leaves comments and strings alone
NAME_FILES_MOST = 5  # files that have a static function of one name
NAMES_ALONE_LEAST = 0.95  # of all static functions; their names are in one file alone
LARGEST_PICTURE, LARGEST_MOVING = 60_000, 300_000  # bytes


def face_room(name):
    return FACES[name] if name in FACES else name if name in ROOMS else None


def source_room(root, path):
    parts = path.relative_to(root).parts
    return face_room(path.stem) if parts[0] == "include" else parts[2]


def includes(path):
    for number, line in enumerate(path.read_text().splitlines(), 1):
        found = re.match(r'\s*#\s*include\s*"([^"]+)"', line)
        if found:
            yield number, found[1]


def direction_problem(root, path, target):
    """Why a source may not include target, or None."""
    own = source_room(root, path)
    parts = target.split("/")
    if parts[0] == "kinetree":
        other = face_room(pathlib.Path(parts[-1]).stem)
        if other is None and path.name == "struct_size.c":  # sizes of all public structs, and no symbol
            return None
        if other is None:
            return "is for users of the library" if parts[-1] in UMBRELLAS else "is no room's face"
    elif len(parts) == 1:
        return None if (path.parent / target).is_file() else "is not in this room (write ROOM/name.h)"
    else:
        other = parts[0]
    if other not in ROOMS:
        return "is no room of the house"
    if own is None:
        return None
    if ROOMS.index(other) > ROOMS.index(own):
        return f"is above: {own} may not use {other}"
    return None


def direction_problems(root, sources):
    for path in sources:
        if path.name in UMBRELLAS:
            continue
        if source_room(root, path) not in ROOMS:
            yield f"{path.relative_to(root)}: no room of the house has this face"
        for number, target in includes(path):
            problem = direction_problem(root, path, target)
            if problem:
                yield f"{path.relative_to(root)}:{number}: \"{target}\" {problem}"


def misplaced_tests(root):
    """Rooms of lib/ without tests in the same place of test/, folders of storeys there that are no room, and rooms beside them."""
    rooms = {path.relative_to(root / "test").as_posix() for storey in STOREYS for path in (root / "test" / storey).glob("*") if path.is_dir()}
    beside = {path.name for path in (root / "test").iterdir() if path.is_dir() and path.name not in STOREYS}
    return sorted(rooms ^ set(PLACES)) + sorted(beside & set(ROOMS))


def misplaced(root):
    """Folders of lib/ that are no storey, and folders of storeys that are no room."""
    storeys = sorted(path.name for path in (root / "lib").iterdir() if path.is_dir())
    rooms = [path.relative_to(root / "lib").as_posix() for path in (root / "lib").glob("*/*") if path.is_dir()]
    return ([f"lib has {', '.join(storeys)}"] if storeys != sorted(STOREYS) or len(storeys) != 7 else []) + sorted(set(rooms) ^ set(PLACES))


def unbuilt(root, folder, pattern):
    """Sources that no meson.build next to or above them names: they would be forgotten in silence."""
    for path in sorted((root / folder).rglob(pattern)):
        builds = [parent / "meson.build" for parent in path.parents if parent.is_relative_to(root / folder)]
        names = (path.relative_to(build.parent).as_posix() for build in builds)
        # With its suffix, or without where a foreach adds it.
        if not any(build.is_file() and re.search(rf"'{re.escape(name.removesuffix('.c'))}(\.c)?'", build.read_text())
                   for build, name in zip(builds, names)):
            yield f"{path.relative_to(root)}: in no meson.build"


def repeated_names(sources):
    """Names of static functions -> in how many files each is, the most frequent first."""
    files = collections.Counter()
    for path in sources:
        if path.suffix == ".c":
            files.update(set(re.findall(r"^static (?:inline )?(?:\w+ |\w+ \*|const )+\**(\w+)\(", path.read_text(), re.M)))
    return files.most_common()


def strays_at_top(root):
    """What git keeps at the top level and TOP does not name; files with a dot are tools' own."""
    kept = subprocess.run(["git", "-C", root, "ls-files"], capture_output=True, text=True, check=True).stdout.split("\n")
    return sorted({name.split("/")[0] for name in kept if name and not name.startswith(".")} - TOP)


def picture_problems(path, pages):
    text = path.read_text()
    moves = "<animate" in text  # it has no text where bodies are not named
    if len(text) > (LARGEST_MOVING if moves else LARGEST_PICTURE):
        yield f"{path.name}: {len(text)} bytes"
    if not moves and "<text" not in text or "glyph" in text:
        yield f"{path.name}: its text is drawn as shapes"
    if path.name not in pages and not re.match("(joint|loop|effect)-", path.name):  # those are on the page that the command makes: command/types
        yield f"{path.name}: no page shows it"


def surface_problems(faces):
    """Faces in no umbrella or in both, stable ones that include experimental ones, and first lines that do not fit."""
    stable, experimental = ([target.split("/")[1] for _, target in includes(faces[0].parent / name)] for name in UMBRELLAS)
    for path in faces:
        if path.name in UMBRELLAS:
            continue
        if [path.name in stable, path.name in experimental].count(True) != 1:
            yield f"{path.name}: in {'both' if path.name in stable else 'none'} of {' and '.join(UMBRELLAS)}"
        if path.name in stable:
            yield from (f"{path.name}:{number}: includes {target}, which is experimental" for number, target in includes(path)
                        if target.split("/")[-1] in experimental)
        if path.read_text().startswith("/* Experimental. ") != (path.name in experimental):
            yield f"{path.name}: '/* Experimental. ' begins the experimental headers, and no other ones"


def strangers_in_comments(root, sources):
    """Files that comments name and that do not exist. Names of system headers and of generated files are exempt."""
    exempt = {"ctype.h", "math.h", "ndarraytypes.h", "arm.c", "mech.c", "native.c", "c.c", "n.c", "s.c", "s.h"}
    paths = [f"/{path.relative_to(root)}" for top in ("lib", "include", "apps", "test", "bench") for path in (root / top).rglob("*.[ch]")]
    names = {path.split("/")[-1] for path in paths} | exempt
    for path in sources:
        for comment in re.finditer(r"/\*.*?\*/", path.read_text(), re.S):
            for name in re.findall(r'(?<![\w<"*/])[a-z][a-z_0-9/]*\.[ch]\b', comment[0]):
                last = name.split("/")[-1]
                if last not in names or "/" in name and last not in exempt and not any(p.endswith("/" + name) for p in paths):
                    yield f"{path.relative_to(root)}: {name}"


def torn_rows(path):
    """Rows of tables with more or fewer cells than the row above, as a formula with |x| has, and rows after a text."""
    above, cells = "", 0
    for number, line in enumerate(path.read_text().splitlines(), 1):
        seen = len(re.findall(r"(?<!\\)\|", line)) if line.startswith("|") else 0
        if seen and (seen != cells if above.startswith("|") else above and not above.startswith("<!--")):
            yield f"{path.name}:{number}: {line[:80]}"
        above, cells = line, seen


def main():
    root = pathlib.Path(sys.argv[1])
    faces = sorted((root / "include/kinetree").glob("*.h"))
    library = sorted(path for path in (root / "lib").rglob("*.[ch]")) + faces
    everything = sorted(path for folder in ("lib", "include", "apps", "test", "bench")
                        for path in (root / folder).rglob("*") if path.suffix in (".c", ".h", ".cpp", ".py", ".js", ".mjs"))
    note(f"{len(library)} files of the library, {len(everything)} in all")
    claim("there_is_a_library", [] if library else ["no sources"])
    if (root / ".git").exists() and shutil.which("git"):
        claim("top_level_holds_what_is_fixed_and_no_more", strays_at_top(root))
    else:
        note("no git here: what stands at the top level is not asked")
    claim("lib_has_seven_storeys_of_rooms_that_meson_lists", misplaced(root))
    claim("tests_mirror_the_storeys_and_rooms_of_lib", misplaced_tests(root))
    claim("rooms_use_only_what_is_below_them", list(direction_problems(root, library)))

    claim("each_face_is_stable_or_experimental_and_its_first_line_states_it", list(surface_problems(faces)))

    claim("every_source_is_built",
          [*unbuilt(root, "lib", "*.c"), *unbuilt(root, "apps", "*.c"), *unbuilt(root, "test", "*.c"),
           *unbuilt(root, "bench", "*.c")])

    places = collections.defaultdict(list)
    for path in library:
        if path.stem in ("internal", "kind", "kernel") and path.suffix == ".h":
            places[path.name].append(path.parent.name)
    claim("no_header_is_called_internal_kind_or_kernel_in_two_rooms",
          [f"{name}: {', '.join(rooms)}" for name, rooms in places.items() if len(rooms) > 1])

    homes = collections.defaultdict(list)
    for path in library:
        if path.is_relative_to(root / "lib"):
            homes[path.name].append(str(path.relative_to(root)))
    claim("file_names_of_the_library_are_unique", [", ".join(found) for found in homes.values() if len(found) > 1])

    callers = [str(path.relative_to(root)) for path in library if re.search(r"\b(LAPACKE|cblas)_", path.read_text())]
    claim("lapack_is_called_in_one_file_of_a_library",
          sorted(set(callers) - {"lib/math/linear/lapack_call.c", "lib/study/compare/study_lapack.c"}))

    claim("library_is_plain_ascii",
          [f"{path.relative_to(root)}" for path in library if not path.read_bytes().isascii()])

    claim("files_that_comments_name_exist", list(strangers_in_comments(root, [path for path in everything if path.suffix in (".c", ".h")])))

    core = [path for path in library if path.parent.name in [*ROOMS[:ROOMS.index("analysis") + 1], "parts"]]
    claim("core_prints_counts_as_the_smallest_printf_can",
          [f"{path.relative_to(root)}: {found}" for path in core for found in NEW_FORMAT.findall(path.read_text())] if len(core) > 100 else ["no sources"])

    texts = [root / "README.md", *sorted((root / "include/pages").glob("*.md"))]
    claim("rows_of_tables_have_the_cells_of_their_head", [row for path in texts for row in torn_rows(path)])
    pages = "".join(path.read_text() for path in texts)
    pictures = [*sorted((root / "apps/pictures").glob("*.svg")), *sorted((root / "include/pages/pictures").glob("*.svg"))]
    claim("pictures_are_shown_and_small_and_keep_text_as_text",
          [problem for path in pictures for problem in picture_problems(path, pages)] if pictures else ["no pictures"])

    names = repeated_names([*library, *sorted((root / "apps").rglob("*.c"))])
    repeated = [f"{name}: in {count} files; give it the name of its object" for name, count in names if count > 1]
    total, alone = sum(count for _, count in names), sum(count == 1 for _, count in names)
    note(f"{total} static functions, {alone / total:.3f} of them with a name of their own, bound {NAMES_ALONE_LEAST}; '{names[0][0]}' is in "
         f"{names[0][1]} files, bound {NAME_FILES_MOST}")
    claim("static_names_are_unique", ["names are not found"] if len(names) < 1000
          else repeated if alone < NAMES_ALONE_LEAST * total or names[0][1] > NAME_FILES_MOST else [])

    unnamed = [str(path.relative_to(root)) for path in everything if LICENCE not in path.read_text()]
    claim("each_source_names_its_licence", unnamed if len(everything) > 1000 else ["no sources"])
    lengths = {path.relative_to(root): path.read_text().replace(f"/* {LICENCE} */\n", "").count("\n") for path in everything}
    claim(f"no_file_has_more_than_{LONG}_lines",
          [f"{path}: {length}; split it where an idea ends" for path, length in lengths.items() if length > LONG])
    wide = [(path, number, len(line)) for path in everything if path.suffix in (".c", ".h")
            for number, line in enumerate(path.read_text().splitlines(), 1) if len(line) > 110]
    note(f"the longest lines: {sorted((width for _, _, width in wide), reverse=True)[:3]}, bound {WIDE}")
    claim(f"no_line_of_c_has_more_than_{WIDE}_columns",
          [f"{path.relative_to(root)}:{number}: {width}" for path, number, width in wide if width > WIDE] if len(wide) > 1000 else ["lines are not found"])
    finish()


main()
