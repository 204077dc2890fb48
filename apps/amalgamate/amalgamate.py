"""Writes the core as one file: kinetree.c, kinetree.h and kinetree-experimental.h.

    amalgamate.py FOLDER_OF_SOURCES OUTPUT_FOLDER
    amalgamate.py FOLDER_OF_SOURCES --fmu OUTPUT.c [DEPENDENCIES]

With --fmu, one file without a header has the core, the scene reader and the functions of FMI: the source of all FMUs.
DEPENDENCIES is a file for make and ninja.

Headers are copied once, where they are first included. Headers without a guard are patterns: they are copied wherever
they are included. Then the sources follow in the order of the house. Names of file scope that two sources have receive
the names of folder and file; macros of a source end with it.

Loops and effects are compiled for values and for dual numbers (lib/math/algebra/real.h). In one file the second compilation
has its own types: declarations that depend on the type of numbers are copied again, with names that end with _in_dual.
"""
# SPDX-License-Identifier: Apache-2.0

import functools
import re
import sys
from pathlib import Path

import ctext
import sources

# Headers of other libraries, and of batches; the last two include all others.
STUDY_HEADERS = ('study', 'formulation', 'dae')
ABSENT_HEADERS = ('batch', 'ensemble', *STUDY_HEADERS, 'scene', 'import', 'export', 'codegen', 'kinetree', 'experimental')
ABSENT_FUNCTIONS = {'kt_rollout_width', 'kt_rollout_gradients', 'kt_rollout_gradients_work_size'}  # of rollout_lanes.c
SIZES = 'base/struct_size.c'  # a list of all public structs

MODE = {'KT_DUAL': '1', 'KT_ISA': 'dual', 'KT_LANES': None, 'KT_ISAS': None}
GUARD = re.compile(r'\A(?P<top>.*?)#ifndef (?P<name>K\w+_H)\n#define (?P=name)\n(?P<body>.*)#endif\s*\Z', re.S)
PRIVATE = re.compile(r'^[ \t]*#\s*include "([^"]+)"[^\n]*\n', re.M)

# What the standard headers declare stays visible; a shared object exports the functions of the two headers alone.
HIDDEN = '''
#ifdef __GNUC__
#pragma GCC visibility push(hidden)
#endif
'''

EXPORTED = '#define KT_API __attribute__((visibility("default")))\n'
LAPACK = 'lapacke.h'
UNDEFINED = {'complex.h': '#undef complex\n#undef I\n'}  # macros whose names other sources use
SYSTEM = re.compile(r'^#include <(\w+\.h)>\n', re.M)

TOP = '''/* Kinetree {version}, the core in one file. Do not edit: apps/amalgamate writes it.
 *
 *     cc -std=c17 -O2 -fno-math-errno -Wno-psabi -c kinetree.c
 *
 * A macro for the compiler (-D):
 *     KINETREE_FULL    calls LAPACK (lapacke.h), for groups of loops with 40 or more coordinates, modes and equilibria
 *
 * License: Apache-2.0.
 */
'''

FMU_TOP = '''/* Kinetree {version}, an FMU in one file. Do not edit: apps/amalgamate writes it.
 *
 *     cc -std=c17 -O2 -ffp-contract=off -fno-math-errno -Wno-psabi -fPIC -shared -o NAME.so kinetree-fmu.c -lm
 *
 * The compiler is gcc or clang. The file needs libc with the functions of POSIX, and libm. It exports the functions of
 * FMI alone. The binary reads the scene from the resources of the FMU.
 *
 * License: Apache-2.0.
 */
#ifndef _XOPEN_SOURCE
#define _XOPEN_SOURCE 700 /* POSIX 2008 */
#endif
'''

MACROS = '''
#ifndef NDEBUG
#define NDEBUG 1 /* asserts are for the tests of the library */
#endif
#ifndef KINETREE_FULL
#define KT_NO_LAPACK 1
#endif
#define KT_ISA baseline

#ifdef __GNUC__
#pragma GCC diagnostic ignored "-Wpsabi"          /* vectors are passed between inlined functions only */
#pragma GCC diagnostic ignored "-Wunused-function" /* no set of parts uses all functions of the headers */
#pragma GCC diagnostic ignored "-Wunused-const-variable" /* and all constants */
#endif

/* Equal inputs give equal bits: products and sums are rounded one by one. */
#ifdef __clang__
#pragma STDC FP_CONTRACT OFF
#endif
#if defined(__GNUC__) && !defined(__clang__) && defined(__FP_FAST_FMA) && !defined(__STRICT_ANSI__)
#error "this processor fuses products and sums: compile with -std=c17, or with -ffp-contract=off"
#endif
'''


class Amalgam:
    def __init__(self, root, absent=ABSENT_HEADERS):
        self.folders = [*sources.storeys(root / 'lib'), root / 'apps/fmu', root / 'apps/kinetree']
        self.include, self.absent, self.read_files = root / 'include', absent, []
        self.out, self.seen = [], set()
        self.texts, self.expanded, self.macros = {}, {}, {}

    def read(self, path):
        if path not in self.texts:
            found = next(folder / path for folder in self.folders if (folder / path).is_file())
            self.texts[path] = found.read_text()
            self.read_files.append(found)
        return self.texts[path]

    # ---- public headers

    def public(self):
        """All public headers of the core."""
        return ''.join(self.public_parts())

    def public_parts(self):
        """The stable and the experimental headers of the core: two texts, with each header after those that it includes."""
        done = {f'kinetree/{name}.h' for name in self.absent}

        def add(name, out):
            if name in done:
                return
            done.add(name)
            text = (self.include / name).read_text()
            for other in PRIVATE.findall(text):
                add(other, out)
            out.append(f'\n/* ==== {name} ==== */\n\n' + without(ABSENT_FUNCTIONS, PRIVATE.sub('', text)))

        texts = []
        for umbrella in ('kinetree.h', 'experimental.h'):
            texts.append([])
            for name in PRIVATE.findall((self.include / 'kinetree' / umbrella).read_text()):
                add(name, texts[-1])
        return [''.join(text) for text in texts]

    # ---- values

    def is_pattern(self, path, name):
        """Whether a header is copied at this inclusion: it has no guard, or uses what stands above the inclusion."""
        return not has_guard(self.read(name)) or name in late_inclusions(path, self.read(path))

    def with_patterns(self, path):
        """The text with patterns in their place; other inclusions stay."""
        def replace(match):
            name = match.group(1)
            if name.startswith('kinetree/') or not self.is_pattern(path, name):
                return match.group(0)
            guarded = GUARD.match(self.read(name))
            text = guarded['top'] + guarded['body'] if guarded else self.read(name)
            return f'/* ---- {name} ---- */\n' + text
        if path not in self.expanded:
            self.expanded[path] = PRIVATE.sub(replace, self.read(path))
        return self.expanded[path]

    def body(self, path, text):
        """Text without inclusions: what they include is copied before it, once."""
        def replace(match):
            name = match.group(1)
            if name.startswith('kinetree/'):
                return ''
            if name not in self.seen:
                self.seen.add(name)
                inner = GUARD.match(self.with_patterns(name))
                copied = self.body(name, inner['top'] + inner['body'])
                self.out.append(f'\n/* ==== {name} ==== */\n\n' + copied)
            return ''
        return PRIVATE.sub(replace, text)

    def headers_of(self, path, found):
        """All guarded private headers that a file includes, those below first."""
        for name in inclusions_of(self.read(path)):
            if not name.startswith('kinetree/') and name not in found and not self.is_pattern(path, name):
                self.headers_of(name, found)
                found.append(name)
        return found

    def source(self, path, names):
        text = self.body(path, self.with_patterns(path))
        if path == SIZES:
            types = {t for k, t in ctext.tokens(self.public()) if k == 'name'}
            text = re.sub(r'^ *X\((\w+)\) *\\\n', lambda m: m.group() if m.group(1) in types else '', text, flags=re.M)
        self.emit_source(path, self.macros_with(text, names) + ctext.rename(text, names))

    def macros_with(self, text, names):
        """Macros of headers that use names of the source, with the new names."""
        used = {t for k, t in ctext.tokens(text) if k == 'name'}
        out = []
        for macro, line in self.macros.items():
            if macro in used and ctext.rename(line, names) != line:
                out.append(f'#undef {macro}\n{ctext.rename(line, names)}\n')
        return ''.join(out)

    def find_macros(self, headers):
        """Macros of headers whose text may use names of the sources that use them."""
        for text in headers.values():
            for item in ctext.items(text):
                if item.defines():
                    self.macros[item.defines()] = item.directive

    def emit_source(self, path, text):
        macros = macros_of(text)
        end = ''.join(f'#undef {m}\n' for m in macros)
        self.out.append(f'\n/* ==== {path} ==== */\n\n{text}{end}')

    # ---- dual numbers

    def dual_headers(self, files):
        """Declarations of headers that depend on the type of numbers, in a second copy."""
        headers = []
        for path in files:
            for name in self.headers_of(path, []):
                if name not in headers:
                    headers.append(name)
        names, out = {}, []
        for name in headers:
            text = GUARD.match(self.read(name))
            out.append(self.dual_header(name, PRIVATE.sub('', text['top'] + text['body']), names))
        self.out += [text for text in out if text]
        return names

    def dual_header(self, name, text, names):
        before = live_items(text, {'KT_ISA': 'baseline', 'KT_DUAL': None, **REST})
        if name not in self.seen:
            self.seen.add(name)
            before = []
        plain, kept, after = {i.bare() for i in before}, [], live_items(text, MODE | REST)
        for item in after:
            same = item.bare() in plain and definitions(item, before) == definitions(item, after)
            if same and not item.names_used() & TAINTED and not item.is_branch:
                continue
            kept.append(item)
            if not item.is_branch:
                self.taint(item, names)
        kept = drop_empty_branches(kept)
        if not kept:
            return None
        macros = [i.defines() for i in kept if i.defines()]
        undef = ''.join(f'#undef {m}\n' for m in macros)
        return f'\n/* ==== {name}, for dual numbers ==== */\n\n{undef}' + ctext.rename(
            re.sub(r'(?<!\n)(?=#\s*(?:if|ifdef|ifndef|else|elif|endif|define|undef)\b)', '\n',
                   '\n'.join(i.text().strip(' ') for i in kept)), names) + '\n'

    def taint(self, item, names):
        if item.defines():
            TAINTED.add(item.defines())
        for name in item.declares():
            if not name.endswith('_dual'):
                names[name] = name + '_in_dual'
                TAINTED.add(name)


TAINTED = set()


@functools.cache
def inclusions_of(text):
    return PRIVATE.findall(text)


@functools.cache
def has_guard(text):
    return GUARD.match(text) is not None


def without(names, text):
    """A header without the declarations of these functions and the comments before them."""
    for name in names:
        text = re.sub(r'(?:/\*(?:(?!\*/).)*\*/\n)?KT_API [^;]*\b' + name + r'\([^;]*;\n', '', text, flags=re.S)
    return text


def definitions(item, items):
    """All definitions of the macro that the item defines."""
    return [i.bare() for i in items if item.defines() and i.defines() == item.defines()]


@functools.cache
def late_inclusions(path, text):
    """Private headers that a source includes after a declaration. Each inclusion of a file asks again."""
    late, declared = set(), False
    if not path.endswith('.c'):
        return late
    for item in ctext.items(text):
        match = item.directive and re.match(r'#\s*include "([^"]+)"', item.directive)
        if match and declared:
            late.add(match.group(1))
        declared = declared or bool(item.code and not item.directive)
    return late


REST = {'KT_LANES': None, 'KT_ISAS': None}


def macros_of(text):
    """Macros that a text defines and leaves defined."""
    live = []
    for word, name in re.findall(r'^[ \t]*#\s*(define|undef)\s+(\w+)', text, re.M):
        if word == 'define' and name not in live:
            live.append(name)
        elif word == 'undef' and name in live:
            live.remove(name)
    return live


def decide(line, known):
    """True, False or None (not known here) for #if, #ifdef, #ifndef, #elif."""
    word, rest = re.match(r'#\s*(\w+)\s*(.*)', line, re.S).groups()
    if word in ('ifdef', 'ifndef'):
        name = rest.split()[0]
        if name not in known:
            return None
        return (known[name] is not None) == (word == 'ifdef')
    text = re.sub(r'/\*.*?\*/|\\\n', ' ', rest, flags=re.S)
    text = re.sub(r'defined\s*\(?\s*(\w+)\s*\)?',
                  lambda m: str(int(known[m.group(1)] is not None)) if m.group(1) in known else m.group(0), text)
    python = text.replace('&&', ' and ').replace('||', ' or ')
    python = re.sub(r'!(?!=)', ' not ', python)
    results = set()
    unknown = sorted(set(re.findall(r'\b[A-Za-z_]\w*\b', python)) - {'and', 'or', 'not', 'defined'})
    python = re.sub(r'defined\s*\(?\s*(\w+)\s*\)?', r'\1', python)
    for bits in range(2 ** len(unknown)):
        values = {n: bits >> k & 1 for k, n in enumerate(unknown)}
        results.add(bool(eval(python, {'__builtins__': {}}, values)))
    return results.pop() if len(results) == 1 else None


def live_items(text, known):
    """The items of a text that a compilation with these macros may have; branches that are decided are resolved."""
    out, stack = [], []  # stack: [state, kept directive], state: 'live', 'dead', 'done', 'open'
    for item in ctext.items(text):
        item.is_branch = False
        d = item.directive
        word = re.match(r'#\s*(\w+)', d).group(1) if d else None
        dead = any(s != 'live' and s != 'open' for s in stack)
        if word in ('if', 'ifdef', 'ifndef'):
            verdict = decide(d, known)
            stack.append('open' if verdict is None else 'live' if verdict else 'dead')
            if verdict is None and not dead:
                item.is_branch = True
                out.append(item)
        elif word in ('elif', 'else') and stack[-1] != 'open':
            if stack[-1] == 'dead':
                verdict = True if word == 'else' else decide(d, known)
                stack[-1] = 'open' if verdict is None else 'live' if verdict else 'dead'
                if verdict is None:
                    out.append(branch(re.sub(r'#\s*elif', '#if', d)))
            else:
                stack[-1] = 'done'
        elif word == 'endif':
            if stack.pop() == 'open' and not any(s not in ('live', 'open') for s in stack):
                item.is_branch = True
                out.append(item)
        elif not dead:
            item.is_branch = word in ('elif', 'else')
            out.append(item)
    return out


def branch(line):
    item = ctext.Item([('directive', line), ('space', '\n')])
    item.is_branch = True
    return item


def drop_empty_branches(kept):
    """Without directives that have nothing between them."""
    while True:
        for at in range(len(kept) - 1):
            a, b = kept[at], kept[at + 1]
            if a.is_branch and b.is_branch and re.match(r'#\s*if', a.directive) and b.directive.startswith('#endif'):
                del kept[at:at + 2]
                break
            if a.is_branch and b.is_branch and re.match(r'#\s*el', a.directive) and b.directive.startswith('#endif'):
                del kept[at]
                break
        else:
            return kept


# ---- names that several files have

def file_names(text):
    """Names of file scope that a source does not share: static ones, types, constants."""
    found = set()
    for item in ctext.items(PRIVATE.sub('', text)):
        if not item.is_external():
            found |= item.declares()
    return found


def prefix_of(path):
    folder, *_, name = (path if '/' in path else 'fmu/' + path)[:-2].split('/')
    return re.sub(r'\W', '_', name if name.startswith(folder) else f'{folder}_{name}')


def collisions(texts, headers, included, public):
    """For each file, the names that another file or header declares, and their new names."""
    declared = {path: {name for item in ctext.items(text) for name in item.declares()}
                for path, text in headers.items()}

    def seen(path):
        return public.union(*(declared[h] for h in included[path]))

    own = {path: file_names(text) - seen(path) for path, text in texts.items()}
    count = {}
    for names in own.values():
        for name in names:
            count[name] = count.get(name, 0) + 1
    words = {}
    for path, text in list(texts.items()) + list(headers.items()):
        for name in {t for k, t in ctext.tokens(text) if k == 'name'} | set(re.findall(r'#\s*define\s+(\w+)', text)):
            words.setdefault(name, set()).add(path)
    return {path: {n: f'{prefix_of(path)}_{n}' for n in names if count[n] > 1 or len(words.get(n, ())) > 1}
            for path, names in own.items()}


class Parts:
    """Sources of an amalgam, with the names of file scope that must change."""

    def __init__(self, amalgam, plain, dual):
        paths = dict.fromkeys(plain + dual)
        texts = {p: amalgam.with_patterns(p) for p in paths}
        headers = {}
        for p in paths:
            for h in amalgam.headers_of(p, []):
                headers[h] = amalgam.with_patterns(h)
        self.plain, self.dual, self.texts = plain, dual, texts
        self.names = collisions(texts, headers, {p: amalgam.headers_of(p, []) for p in paths},
                                {n for k, n in ctext.tokens(amalgam.public()) if k == 'name' and n.startswith('kt_')})
        amalgam.find_macros(headers)


def write_dual(amalgam, parts):
    amalgam.out.append('\n/* ==== the same for dual numbers ==== */\n\n'
                       '#define KT_DUAL 1\n#undef KT_ISA\n#define KT_ISA dual\n')
    shared = amalgam.dual_headers(parts.dual)
    for path in parts.dual:
        own = {n: parts.names[path].get(n, n) + '_in_dual' for n in file_names(parts.texts[path])}
        text = amalgam.body(path, amalgam.read(path))
        amalgam.emit_source(path, amalgam.macros_with(text, own) + ctext.rename(text, shared | own))


def system_headers(body):
    """The standard headers of a text, and the text without them."""
    above = ''.join(f'#include <{name}>\n' + UNDEFINED.get(name, '') for name in sorted(set(SYSTEM.findall(body)) - {LAPACK}))
    return above, SYSTEM.sub('', body)


def write_fmu(root, output, dependencies):
    """The functions of FMI stand before the dual numbers, whose macros remain."""
    plain, dual = sources.core(root / 'lib')
    amalgam = Amalgam(root, tuple(name for name in ABSENT_HEADERS if name not in ('scene', *STUDY_HEADERS, 'batch')))
    parts = Parts(amalgam, plain + sources.fmu(root), dual)
    for path in parts.plain:
        amalgam.source(path, parts.names[path])
    write_dual(amalgam, parts)
    public = amalgam.public().replace(EXPORTED, '#define KT_API\n')
    above, body = system_headers(public + ''.join(amalgam.out))
    Path(output).write_text(FMU_TOP.replace('{version}', version_of(root)) + MACROS + '\n' + above + HIDDEN + body)
    if dependencies:
        read = [*amalgam.read_files, *(root / 'include/kinetree').glob('*.h'), *(root / 'lib').glob('**/meson.build'),
                root / 'apps/fmu/meson.build', *Path(__file__).parent.glob('*.py')]
        Path(dependencies).write_text(f'{output}: ' + ' '.join(str(path) for path in read) + '\n')


def version_of(root):
    return re.search(r'KT_VERSION "([^"]+)"', (root / 'include/kinetree/status.h').read_text()).group(1)


def reject(message):
    sys.exit(f'amalgamate.py: {message}')


def folder_of_sources(words):
    """The first word, if the words may be a call."""
    if words in (['-h'], ['--help']):
        print(__doc__)
        sys.exit(0)
    is_fmu = words[1:2] == ['--fmu']
    options = [word for word in words if word.startswith('--') and word != '--fmu']
    if options:
        reject(f"there is no option '{options[0]}'; macros for the compiler choose the parts, such as -DKINETREE_FULL")
    if len(words) not in ((3, 4) if is_fmu else (2,)):
        reject('give the folder of the sources and a folder for the output, such as . build/one; --help has examples')
    if not Path(words[0], 'lib/meson.build').is_file():
        reject(f"'{words[0]}' has no lib/meson.build; give the folder of the sources of Kinetree first")
    return Path(words[0])


def main():
    root = folder_of_sources(sys.argv[1:])
    if sys.argv[2] == '--fmu':
        write_fmu(root, sys.argv[3], sys.argv[4] if len(sys.argv) > 4 else None)
        return
    output = Path(sys.argv[2])
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reject(f"the folder '{output}' cannot be made: {error.strerror}; give another folder for the output")
    amalgam = Amalgam(root)
    parts = Parts(amalgam, *sources.core(root / 'lib'))
    for path in parts.plain:
        amalgam.source(path, parts.names[path])
    write_dual(amalgam, parts)
    top = TOP.replace('{version}', version_of(root))
    stable, experimental = amalgam.public_parts()
    (output / 'kinetree.h').write_text(top + stable)
    (output / 'kinetree-experimental.h').write_text(f'{top}#include "kinetree.h"\n{experimental}')
    above, body = system_headers(''.join(amalgam.out))
    above += f'#ifndef KT_NO_LAPACK\n#include <{LAPACK}>\n#undef complex /* of complex.h */\n#undef I\n#endif\n'
    (output / 'kinetree.c').write_text(top + MACROS + f'\n#include "kinetree-experimental.h"\n\n{above}{HIDDEN}{body}')


if __name__ == '__main__':
    main()
