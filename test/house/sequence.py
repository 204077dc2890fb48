"""The order in which the generator of C makes the nodes of its graph, read from lib/output/codegen.

sequence.py SOURCE-ROOT

C leaves open in which order a call evaluates its arguments, an operator its operands, and braces their entries. If two of
them make nodes, the compiler of the generator decides the numbers of the nodes, and with them the generated file. A function
makes nodes if it calls find_node, directly or through others, or if it is a parameter.
"""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

MAKER = "find_node"
TOKEN = re.compile(r"\w+|->|&&|\|\||[=!<>]=|[-+*/%&|^]=|\S")
BLANK = re.compile(r'/\*.*?\*/|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\])*\'|^ *#(?:\\\n|[^\n])*', re.S | re.M)
DEFINITION = re.compile(r"^(?!typedef|struct|enum)(?:\w[\w ]*[ *])?(\w+)\(((?:[^()]|\([^()]*\))*)\) \{", re.M)
END = re.compile(r"^\}|(?<=\{)[^\n]*\}$", re.M)
CLOSED_BY = {"(": ")", "[": "]", "{": "}"}
ASSIGN = ("=", "+=", "-=", "*=", "/=", "%=", "&=", "|=", "^=")
IN_ORDER = ("&&", "||", "?", ":")  # one operand of these after the other, or one of two


def functions_of(text):
    """The line, name, parameters and body of each function."""
    text = BLANK.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), text)
    for found in DEFINITION.finditer(text):
        end = END.search(text, found.end() - 1).end() - 1
        yield text.count("\n", 0, found.end()) + 1, found[1], found[2], text[found.end():end]


def calls_of(body):
    return set(re.findall(r"\b(\w+)\(", body))


def makers_of(functions):
    """The names of all functions that make nodes."""
    makers, more = set(), {MAKER}
    while more:
        makers |= more
        more = {name for _, name, _, body in functions if calls_of(body) & makers} - makers
    return makers


def nested(body, line):
    """Tokens as (text, line); brackets as lists of their opening and all within."""
    stack = [[]]
    for found in TOKEN.finditer(body):
        if found[0] in CLOSED_BY:
            stack.append([found[0]])
            stack[-2].append(stack[-1])
        elif found[0] in CLOSED_BY.values():
            stack.pop()
        else:
            stack[-1].append((found[0], line + body.count("\n", 0, found.start())))
    return stack[0]


def split(items, separators):
    parts = [[]]
    for item in items:
        if item[0] in separators:
            parts.append([])
        else:
            parts[-1].append(item)
    return parts


class Body:
    """Finds the lines at which two evaluations make nodes in an open order."""

    def __init__(self, text, line, makers):
        self.makers, self.found = makers, set()
        self.read_block(nested(text, line))

    def is_call(self, items, k):
        """Whether items[k] are the arguments of a function that makes nodes."""
        return k > 0 and items[k][0] == "(" and items[k - 1][0] in self.makers

    def line_of_maker(self, items):
        """The line of the first call that makes nodes; None: there is none."""
        for k, item in enumerate(items):
            line = items[k - 1][1] if self.is_call(items, k) else None
            if line is None and isinstance(item, list):
                line = self.line_of_maker(item[1:])
            if line is not None:
                return line
        return None

    def compare(self, parts):
        lines = [line for line in map(self.line_of_maker, parts) if line is not None]
        if len(lines) > 1:
            self.found.add(lines[0])

    def read_expression(self, items):
        sides = split(items, ASSIGN)
        self.compare(sides)
        for operand in (part for side in sides for part in split(side, IN_ORDER)):
            self.compare([operand[max(k - 1, 0):k + 1] for k, item in enumerate(operand) if isinstance(item, list)])
            for item in operand:
                if isinstance(item, list):
                    parts = split(item[1:], ",")
                    self.compare(parts)
                    for part in parts:
                        self.read_expression(part)

    def read_statement(self, items):
        for part in split(items, ",;"):  # of a declaration, or of the head of a loop
            self.read_expression(part)

    def read_block(self, items):
        start = 0
        for k, item in enumerate(items):
            before = items[k - 1][0] if k > 0 else ""
            if item[0] == "(" and before in ("if", "for", "while", "switch"):
                self.read_statement(item[1:])
            elif item[0] == "{" and (k == start or before in ("else", "do", ":")):
                self.read_block(item[1:])
            elif item[0] == ";":
                self.read_statement(items[start:k])
            else:
                continue
            start = k + 1


def faults_of(functions, makers):
    for line, name, parameters, body in functions:
        given = calls_of(body) & set(re.findall(r"\w+", parameters))
        for at in sorted(Body(body, line, makers | given).found):
            yield at, name


def main():
    root = pathlib.Path(sys.argv[1])
    files = {path: list(functions_of(path.read_text())) for path in sorted((root / "lib/output/codegen").glob("*.[ch]"))}
    makers = makers_of([function for functions in files.values() for function in functions])
    note(f"{sum(map(len, files.values()))} functions, of which {len(makers)} make nodes")
    claim("there_are_functions_that_make_nodes", [] if len(makers) > 200 else [str(sorted(makers))])
    claim("no_two_arguments_operands_or_entries_make_nodes",
          [f"{path.relative_to(root)}:{line}: {name}: give one a name" for path, functions in files.items()
           for line, name in faults_of(functions, makers)])

    made = list(functions_of("""
static op in_order(op a) { return a; }
op make(op a) {
    const op b = find_node(in_order(a)), c = find_node(b) /* find_node(a) + find_node(b) */;
    for (int i = find_node(a); i < find_node(b); i++)
        x[i].y = a ? find_node(find_node(b)) : find_node(c);
    if (find_node(a))
        return find_node(b);
    switch (find_node(a)) {
    case 0: {
        f(a, find_node(b) && find_node(c));
    }
    }
    return (two){{a, make(b)}, "make(a) + make(b)"};
}
op both(op a, apply *given) {
    op c = make(a) + make(a);
    two d = {make(a), {make(a)}};
    if (in_order(make(a),
                 given(a)))
        c[make(a)] = make(a);
    while (a)
        return in_order(in_order(in_order(make(a)), make(a)));
    do {
        c = d - make(make(a) - make(a));
    } while (a);
}
"""))
    found = [line for line, _ in faults_of(made, makers_of(made))]
    claim("open_orders_are_found_and_definite_ones_are_not", [] if found == [17, 18, 19, 21, 23, 25] else [str(found)])
    finish()


main()
