"""How many parameters functions inside the library, and those of programs, have: what belongs together travels as a
struct (kt_dynamic_state).

parameters.py SOURCE-ROOT

Public functions are not asked, since their arguments stand in the order that a caller reads them, nor those of
lib/math/linear/lapack_call.c, which have LAPACK's. Counted are definitions, declarations, those within macros, and pointers
to functions.
"""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

MOST = 8
LAPACK = "lib/math/linear/lapack_call.c"
FUNCTION = re.compile(r"(?:\bKT_KERNEL\((\w+)\)|\(\s*\*\s*(\w+)\s*\)|\b(\w+)(?=\s*\((?!\s*\*)))\s*\(((?:[^()]|\([^()]*\))*)\)")
PARAMETER = re.compile(r"(?:(?:const|unsigned|struct|enum)\s+)*\w+(?:[\s*]+(?:const\s+|restrict\s+)?\w+)?(?:\[\w*\])*|\.\.\.|.*\(\s*\*.*")


def code_of(text):
    def blank(found):
        return re.sub(r"[^\n]", " ", found[0])
    return re.sub(r'/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\\n])*"', blank, text, flags=re.S).replace("\\\n", " \n")


def pieces_of(arguments):
    depth, start, pieces = 0, 0, []
    for i, c in enumerate(arguments):
        depth += (c in "([{") - (c in ")]}")
        if c == "," and depth == 0:
            pieces.append(arguments[start:i])
            start = i + 1
    return [piece.strip() for piece in (*pieces, arguments[start:])]


def functions_of(text):
    """Lines, names and numbers of parameters; calls are left out, since their arguments are no declarations."""
    for found in FUNCTION.finditer(text):
        pieces = pieces_of(found[4])
        typed = all(re.search(r"\w[\s*]+\w", piece) or piece == "..." or "(*" in piece for piece in pieces)
        if typed and all(PARAMETER.fullmatch(piece) for piece in pieces):
            yield text.count("\n", 0, found.start()) + 1, found[1] or found[2] or found[3], len(pieces)


def main():
    root = pathlib.Path(sys.argv[1])
    public = {name for path in (root / "include/kinetree").glob("*.h") for _, name, _ in functions_of(code_of(path.read_text()))}
    found = [(path.relative_to(root).as_posix(), *function) for folder in ("lib", "apps", "bench")
             for path in sorted((root / folder).rglob("*.[ch]")) for function in functions_of(code_of(path.read_text()))]
    inside = [one for one in found if one[2] not in public and one[0] != LAPACK]
    note(f"{len(public)} public functions, {len(inside)} inside, of which {sum(one[3] == MOST for one in inside)} have {MOST} parameters")
    claim("there_are_functions", [] if len(inside) > 4000 and len(public) > 300 else [f"{len(inside)}, {len(public)}"])
    claim(f"functions_have_at_most_{MOST}_parameters",
          [f"{path}:{line}: {name}: {count}" for path, line, name, count in inside if count > MOST])
    made = code_of("void f(int a, const kt_model *b, double c[3], size_t d, bool e, void (*f)(int, int), /* , */ int g,\\\n int h, int i);\n"
                   "bool (*g)(int a, int b); f(a, b, c, d, e, g, h, i, j);")
    claim("nine_parameters_are_counted_and_arguments_are_not", [] if list(functions_of(made)) == [(1, "f", 9), (3, "g", 2)]
          else [str(list(functions_of(made)))])
    finish()


main()
