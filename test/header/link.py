"""Writes a table of all public functions: link.py HEADER-FOLDER > link.h

What is in the table is linked: link.c fails to link in a build that lacks a function which its header declares.
"""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import re
import sys


def functions(path):
    return re.findall(r"^KT_API[^;(]*?\b(kt_\w+)\(", path.read_text(), flags=re.M)


names = [name for path in sorted(pathlib.Path(sys.argv[1]).glob("*.h")) for name in functions(path)]
print("#define FUNCTION_LIST(X) \\\n" + " \\\n".join(f"    X({name})" for name in names))
