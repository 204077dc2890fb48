"""The limits on the page of security are those of the sources.

    security.py SOURCES
"""
# SPDX-License-Identifier: Apache-2.0
import re
import sys
from pathlib import Path

# The words of a row, the name of the constant, and the unit of the page in the constant.
ROWS = [("size of a scene or a robot, with all files that it includes", "KT_FILE_SIZE_MAX", 1 << 20),
        ("nodes of a scene", "KT_NODE_COUNT_MAX", 1),
        ("elements of a robot, with all copies of included files", "KT_XML_ELEMENTS_MAX", 1),
        ("files that a robot includes; a file counts each time", "KT_INCLUDED_MOST", 1),
        ("elements of XML within one another", "KT_XML_DEPTH_MAX", 1),
        ("triangles of a mesh", "KT_TRIANGLES_MOST", 1),
        ("columns of a table", "KT_TABLE_COLUMNS_MOST", 1),
        ("numbers of a table", "KT_TABLE_NUMBERS_MOST", 1)]


def constants(root):
    found = {}
    for path in [*root.glob("lib/**/*.h"), *root.glob("apps/kinetree/**/*.h")]:
        for name, base, shift in re.findall(r"\b(KT_\w+) = (\d+)(?: << (\d+))?", path.read_text()):
            found[name] = int(base) << int(shift or 0)
    return found


def main(root):
    rows = dict(re.findall(r"^\| ([^|]+?) \| ([\d,]+)[^|]*\|$", (root / "include/pages/security.md").read_text(), flags=re.M))
    known, faults = constants(root), []
    for words, name, unit in ROWS:
        stated, actual = rows.pop(words, "missing"), known.get(name)
        if actual is None or stated.replace(",", "") != str(actual // unit):
            faults.append(f"'{words}': the page has {stated}, {name} is {actual}")
    faults += [f"'{words}' has no constant in {Path(__file__).name}" for words in rows]
    print("\n".join(faults) or f"{len(ROWS)} limits agree")
    return len(faults)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
