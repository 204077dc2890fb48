"""C source as tokens and as declarations of file scope."""
# SPDX-License-Identifier: Apache-2.0

import functools
import re

TOKEN = re.compile(r'''
    (?P<comment>/\*.*?\*/|//[^\n]*)
  | (?P<string>"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*')
  | (?P<directive>(?:(?<=\n)|\A)[ \t]*\#(?:\\\n|/\*.*?\*/|[^\n])*)
  | (?P<number>\.?[0-9](?:[eEpP][+-]|[\w.])*)
  | (?P<name>[A-Za-z_]\w*)
  | (?P<space>\s+)
  | (?P<mark>->|\.\.\.|.)
''', re.X | re.S)

KEYWORDS = set('''auto break case char const continue default do double else enum extern float for goto if inline int long
    register restrict return short signed sizeof static struct switch typedef union unsigned void volatile while _Alignas
    _Alignof _Atomic _Bool _Complex _Generic _Noreturn _Static_assert _Thread_local bool size_t'''.split())


@functools.cache
def tokens(text):
    """(kind, text) of all tokens; together they are the text. Each text is read many times, and its tokens are kept."""
    return [(m.lastgroup, m.group()) for m in TOKEN.finditer(text)]


class Item:
    """A declaration, a definition, a call of a macro at file scope, or a directive, with the comments before it."""

    def __init__(self, parts):
        self.parts = parts
        self.code = [p for p in parts if p[0] not in ('comment', 'space')]

    @property
    def directive(self):
        return self.code[0][1].strip() if self.code and self.code[0][0] == 'directive' else None

    def text(self):
        return ''.join(t for _, t in self.parts)

    def bare(self):
        """The text without comments and layout."""
        return ' '.join(t for _, t in self.code)

    def names_used(self):
        """All names that occur, those within directives, too."""
        used = set()
        for kind, text in self.code:
            if kind == 'name':
                used.add(text)
            elif kind == 'directive':
                used |= {t for k, t in tokens(text.replace('#', '', 1)) if k == 'name'}
        return used

    def defines(self):
        """The name that a #define defines, or None."""
        match = re.match(r'#\s*define\s+(\w+)', self.directive or '')
        return match and match.group(1)

    def declares(self):
        """Names of file scope, without macros: the object or function, tags, constants of enumerations."""
        if self.directive or not self.code or self.code[0][1] == '_Static_assert':
            return set()
        return tags_of(self.code) | declared_of(self.code)

    def is_external(self):
        """Whether what it declares is known in other files."""
        words = [t for k, t in self.code if k == 'name']
        return bool(words) and words[0] not in ('static', 'typedef', 'struct', 'union', 'enum', 'KT_INLINE',
                                                'KT_OPERATOR', 'inline', '_Static_assert') and \
            not (self.code[-1][1] not in ';}' and words[0].isupper())


def skip(code, at):
    """The place after the bracket that opens at `at`."""
    depth = 0
    while True:
        depth += {'(': 1, '[': 1, '{': 1, ')': -1, ']': -1, '}': -1}.get(code[at][1], 0)
        at += 1
        if depth == 0 or at == len(code):
            return at


def tags_of(code):
    """Tags and constants of the structs and enumerations that are defined here."""
    found = set()
    for at, (kind, text) in enumerate(code):
        if kind != 'name' or text not in ('struct', 'union', 'enum'):
            continue
        brace = at + 1
        if brace < len(code) and code[brace][0] == 'name':
            brace += 1
        if brace >= len(code) or code[brace][1] != '{':
            continue
        if brace == at + 2:
            found.add(code[at + 1][1])
        if text == 'enum':
            found |= constants_of(code[brace + 1:skip(code, brace) - 1])
    return found


def constants_of(code):
    found, expected, at = set(), True, 0
    while at < len(code):
        kind, text = code[at]
        if expected and kind == 'name':
            found.add(text)
            expected = False
        if text in '([{':
            at = skip(code, at)
            continue
        expected = expected or text == ','
        at += 1
    return found


def declared_of(code):
    """The names of the declarators: the last name before `(`, `[`, `=`, `,` or `;`."""
    words = [t for k, t in code if k == 'name']
    if code[-1][1] == ')' and words and words[0].upper() == words[0]:  # KT_ARENA_LAYOUT(name, ...)
        return {code[2][1]} if len(code) > 3 and code[2][0] == 'name' else set()
    found, last, at = set(), None, 0
    while at < len(code):
        kind, text = code[at]
        if kind == 'name' and text == '__attribute__':
            at = skip(code, at + 1)
            continue
        if kind == 'name' and text not in KEYWORDS:
            if at + 1 < len(code) and code[at + 1][1] == '(' and text in ('KT_KERNEL', 'KT_EFFECT', 'KT_PASTE'):
                return found
            last = text
        elif text == '{':
            at = skip(code, at)
            continue
        elif text == '(' and last is None or text == '(' and code[at + 1][1] == '*':
            at += 1
            continue
        elif text == '(':
            found.add(last)
            return found
        elif text in '=,;[':
            if last:
                found.add(last)
            last = None
            while at < len(code) and code[at][1] not in ',;':
                at = skip(code, at) if code[at][1] in '([{' else at + 1
        at += 1
    return found - {None}


def items(text):
    """Splits a file into its items. Comments belong to the item after them."""
    found, parts, depth, code, last_brace_opened_body = [], [], 0, [], False
    stream = tokens(text)
    for at, part in enumerate(stream):
        kind, t = part
        parts.append(part)
        if kind in ('comment', 'space'):
            continue
        if kind == 'directive':
            if depth == 0 and not code:
                found.append(Item(parts))
                parts = []
            continue
        code.append(t)
        if t in '([{' and kind == 'mark':
            if t == '{' and depth == 0:
                last_brace_opened_body = len(code) > 1 and code[-2] == ')' and code[0] != 'typedef' and '=' not in code
            depth += 1
        elif t in ')]}' and kind == 'mark':
            depth -= 1
        ends = depth == 0 and (t == ';' or (t == '}' and last_brace_opened_body))
        if depth == 0 and t == ')' and re.match(r'[A-Z][A-Z0-9_]+$', code[0]) and code[1] == '(' and skip_ends(code):
            following = next((x for x in stream[at + 1:] if x[0] != 'comment'), ('', ''))
            after = next((x for x in stream[at + 1:] if x[0] not in ('comment', 'space')), ('', ';'))
            ends = '\n' in following[1] and after[1] not in (';', '{', '=')
        if ends:
            found.append(Item(parts))
            parts, code, last_brace_opened_body = [], [], False
    if parts:
        found.append(Item(parts))
    return found


def skip_ends(code):
    """Whether the first bracket closes at the end."""
    depth = 0
    for at, text in enumerate(code):
        depth += {'(': 1, ')': -1}.get(text, 0)
        if depth == 0 and text == ')':
            return at == len(code) - 1
    return False


def rename(text, names):
    """Renames names (old: new) everywhere but where they are members."""
    out, stack, code = [], [], []
    stream = tokens(text)
    for at, (kind, t) in enumerate(stream):
        if kind == 'directive':
            match = re.match(r'(\s*#\s*(?:define|undef|ifdef|ifndef)\s+)(\w+)(.*)', t, re.S)
            if re.match(r'\s*#\s*include', t):
                out.append(t)
            elif match and match.group(1).strip().endswith('define'):
                out.append(match.group(1) + names.get(match.group(2), match.group(2)) + rename(match.group(3), names))
            else:
                out.append(re.sub(r'\w+', lambda m: names.get(m.group(), m.group()), t))
            continue
        if kind in ('comment', 'space', 'string'):
            out.append(t)
            continue
        if t == '{':
            stack.append(is_struct_body(code))
        elif t == '}' and stack:
            stack.pop()
        code.append(t)
        if kind == 'name' and t in names and not is_member(code, stack and stack[-1], stream, at):
            t = names[t]
        out.append(t)
    return ''.join(out)


def is_struct_body(code):
    return len(code) > 0 and (code[-1] in ('struct', 'union') or len(code) > 1 and code[-2] in ('struct', 'union'))


def is_member(code, in_struct, stream, at):
    """Whether the name is that of a member: after a dot, declared in a struct, or in a list of fields X(type, name."""
    before = code[-2] if len(code) > 1 else ''
    if before in ('.', '->'):
        return True
    if len(code) > 5 and code[-3 - 1] == '(' and code[-5] == 'X' and before == ',' or \
            len(code) > 3 and before == ',' and 'X' in code[-12:] and x_field(code):
        return True
    if not in_struct:
        return False
    after = [t for k, t in stream[at + 1:at + 6] if k not in ('comment', 'space')]
    return after[:1] and (after[0] in (';', ',', '[', ':') and before != '[' or after[:2] == [')', '('])


def x_field(code):
    """Whether the last name is the second argument of X( ."""
    at, commas = len(code) - 2, 0
    while at >= 0 and code[at] not in ('(', ')', ';', '{'):
        commas += code[at] == ','
        at -= 1
    return commas == 1 and at > 0 and code[at] == '(' and code[at - 1] == 'X'
