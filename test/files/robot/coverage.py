"""The page on what readers of robots read, change and leave out, made of the readers' own lists.

    coverage.py SOURCE-ROOT            checks that include/pages/robot-coverage.md is that page
    coverage.py SOURCE-ROOT --write    writes it
"""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
from claims import claim, finish, note

FORMATS = (("MJCF", "mjcf_attribute.c", "mjcf"), ("SDF", "sdf.c", "sdf"), ("URDF", "urdf_tree.c", "urdf"))
TEXT = r'"(?:\\.|[^"\\])*"'
HEAD = """# Elements of robot files

This page lists all elements and attributes that the readers of [robots](robots.md) read, change and leave out. `test/files/robot/coverage.py` makes
the page from the lists of the readers, and a test compares both. The messages are those of `import`, without numbers.
"""


def joined(text):
    return "".join(part[1:-1] for part in re.findall(TEXT, text)).replace('\\"', '"')


def code_of(path):
    code = re.sub(r"/\*.*?\*/", "", path.read_text(), flags=re.S)
    for name, body in re.findall(r"#define (\w+)\s*\\?\n?((?:[^\n]*\\\n)*[^\n]*)", code):
        if re.fullmatch(rf"(?:\s|\\|{TEXT})+", body):
            macros[name] = '"' + joined(body) + '"'
    return code


macros = {}


def expanded(code):
    return re.sub(r"\b(" + "|".join(macros) + r")\b", lambda found: macros[found[1]], code)


def words(code, member):
    found = re.search(rf"\.{member}\s*=\s*((?:\s*{TEXT})+)", code)
    return sorted(set(joined(found[1]).split())) if found else []


def known_of(code):
    part = re.search(r"static const kt_known known\[\] = \{(.*?)\n\};", code, flags=re.S)[1]
    rows = re.findall(rf"\{{((?:\s*{TEXT})+),\s*((?:\s*{TEXT})+)\}}", part)
    pairs = [(name, sorted(joined(words).split())) for names, words in rows for name in joined(names).split()]
    return [(name, words) for name, words in pairs if "." not in name]


def messages(folder, prefix):
    """Notes that warn, changes and forces: the texts that the sources of a format pass on."""
    changes, lost, start = set(), set(), set()
    listed = folder / f"{prefix}_notes.h"
    list_code = expanded(re.sub(r"\s*\\\n", "\n", code_of(listed))) if listed.exists() else ""
    for rank, text in re.findall(rf"X\(\w+, (\w+),\s*((?:\s*{TEXT})+)\)", list_code):
        {"MOTION": changes, "START": start}.get(rank, set()).add(joined(text))
    for path in sorted(folder.glob("*.c")):
        code = expanded(code_of(path))
        shared = path.name in ("robot_inertia.c", "notes.c") or (path.name == "collision.c" and prefix != "mjcf")
        if not (path.name == f"{prefix}.c" or path.name.startswith(f"{prefix}_") or shared):
            continue
        for rank, text in re.findall(rf"KT_NOTE\(kt_(?:{prefix}|contact_tally|collisions), [\w.]+, (\w+),\s*((?:\s*{TEXT})+)\)",
                                     code):
            {"MOTION": changes, "START": start}.get(rank, set()).add(joined(text))
        for rank, text in re.findall(rf"kt_note_put\([^;]*?KT_NOTE_RANK_(\w+),[^;\"]*((?:\s*{TEXT})+)", code):
            {"MOTION": changes, "START": start}.get(rank, set()).add(joined(text))
        for kind, text in re.findall(rf"kt_unknown_count\(\s*&\w+->(changes|forces),\s*((?:\s*{TEXT})+)", code):
            (changes if kind == "changes" else lost).add(joined(text))
        lost.update(joined(text) for text in re.findall(rf"kt_mjcf_add_formula\([^;]*?,\s*((?:\s*{TEXT})+)\)", code))
    return changes, lost, start


def clean(text):
    text = re.sub(r"%s|%\.?\d*[a-z]", "...", text.replace("%%", "%")).rstrip(": ")
    return re.sub(r"(--?\w[\w-]*(?: [A-Z]+(?:=[A-Z]+)?)?|<\w+>)", r"`\1`", text.replace("|", "\\|"))


def rows(texts):
    """A row for each message; those that are nothing but a frame for a name are left out."""
    texts = sorted((clean(text) for text in texts), key=str.lower)
    return "".join(f"- {text}\n" for text in texts if not re.match(r"'\.\.\.'|a force or an equality|[. :]+$", text))


def page_of(root):
    folder = root / "lib/files/robot"
    for path in sorted(folder.glob("*.[ch]")):
        code_of(path)
    text = HEAD
    for name, source, prefix in FORMATS:
        code = expanded(code_of(folder / source))
        changes, lost, start = messages(folder, prefix)
        known = known_of(code)
        text += f"\n## {name}\n\n### Read\n\n| element | attributes |\n|---|---|\n"
        text += "".join(f"| `{element}` | {' '.join(f'`{a}`' for a in attributes)} |\n" for element, attributes in known if attributes)
        text += f"| {' '.join(f'`{element}`' for element, attributes in known if not attributes)} | none |\n"
        text += f"\n### Left out or changed, with a warning each\n\n{rows(changes | lost)}"
        text += "".join(f"- the name `{word}`\n" for word in words(code, "moving"))
        text += f"\n### Notes on the start and the limits, printed on one line\n\n{rows(start)}"
        text += "\n### Left out without a warning, since the motion does not need them\n\n"
        text += " ".join(f"`{word}`" for word in words(code, "harmless")) + "\n"
    return text


def main():
    root = pathlib.Path(sys.argv[1])
    path, page = root / "include/pages/robot-coverage.md", page_of(root)
    if "--write" in sys.argv:
        path.write_text(page)
        return
    there = path.read_text().splitlines() if path.exists() else []
    made = page.splitlines()
    note(f"{len(made)} lines")
    claim("the_page_has_elements_and_messages_of_all_formats", [] if len(made) > 150 else [f"{len(made)} lines"])
    claim("the_page_is_that_of_the_readers",
          [f"missing: {line}" for line in made if line not in there][:9] + [f"outdated: {line}" for line in there if line not in made][:9] +
          (["coverage.py SOURCE-ROOT --write writes it"] if made != there else []))
    finish()


main()
