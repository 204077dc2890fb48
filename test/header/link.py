"""Writes a table of all public functions: link.py HEADER-FOLDER [small] > link.h

What is in the table is linked: link.c fails to link in a build that lacks a function which its header declares. With
`small`, functions are left out of which their header states that they are not in a small library (-Dsmall=enabled).
"""
import pathlib
import re
import sys


def functions(path, small):
    for paragraph in path.read_text().split("\n\n"):
        if not (small and re.search(r"[Nn]ot in\s+(\* )?a small library", paragraph)):
            yield from re.findall(r"^KT_API[^;(]*?\b(kt_\w+)\(", paragraph, flags=re.M)


names = [name for path in sorted(pathlib.Path(sys.argv[1]).glob("*.h")) for name in functions(path, "small" in sys.argv[2:])]
print("#define FUNCTION_LIST(X) \\\n" + " \\\n".join(f"    X({name})" for name in names))
