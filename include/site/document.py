#!/usr/bin/env python3
"""The site: the pages, and the reference of the C interface from the headers, by Doxygen and Sphinx.

document.py build OUTPUT [DEPENDENCIES [COMMAND [GALLERY]]]
    writes OUTPUT/html, and DEPENDENCIES, a rule for ninja; a warning is a failure. COMMAND is `kinetree`, whose manual
    pages and whose page of types become a part of the reference; GALLERY is the folder that gallery.py has written
document.py filter FILE
    prints the header FILE for Doxygen; lines keep their numbers

The headers are written to be read in an editor, in plain comments. The filter says the same in Doxygen's way:

- the comment at the top of NAME.h opens the group NAME.h, in which all of the file is;
- a comment above a declaration documents it, and what follows without an empty line between;
- a comment behind a member or an enumerated value documents that;
  above members which have one, it goes for each of them, too;
- a line /* ---- title ---- */ opens a section;
- a list of enumerated values, KT_..._LIST(X), becomes them: each with the comment behind it, or else its text
  or name;
- names of the library in comments become links: Doxygen then warns of one that does not exist;
- lines that are indented by two more begin an item of a list; blocks that are indented by four more, after an empty
  line, are shown as they stand.
"""
# SPDX-License-Identifier: Apache-2.0
import itertools
import os
import pathlib
import re
import shutil
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parents[1]
PICTURES = [HERE / "pages/pictures", HERE.parent / "apps/pictures"]
NAME = r"(?:kt|KT)_\w*[A-Za-z0-9]"

# ---- prose -----------------------------------------------------------------------------------------------------------


def link(name, shown=None):
    """A name, kt_struct.member, a header's name, or a page."""
    if (HERE / f"pages/{name}.md").exists() or name == "types" or name.endswith(".h"):
        return f"[{shown or name}]({name}.html)"
    target = name.replace(".", "::")
    return f'\\ref {target} "{shown or name}"'


def inline(text):
    """Words of a comment: nothing in them is an order to Doxygen, which leaves what is quoted alone."""
    parts = re.split(r"""(`[^`]*`|"[^"]*")""", text)
    for i in range(0, len(parts), 2):
        plain = re.sub(r"([\\@<>&#%~])", r"\\\1", parts[i])
        plain = re.sub(r"\*(?!\w+\*)(?<!\w\*)", r"\\*", plain)
        plain = re.sub(r"(?<!\w)_(?=\w)", r"\\_", plain)
        plain = re.sub(r"\b([a-z-]+)\.md\b", lambda found: link(found[1], found[0]), plain)
        parts[i] = re.sub(rf"(?<![\w/]){NAME}(?![\w*])(?:\.[a-z]\w*)?|\b(?:{headers()})\.h\b(?!\")",
                          lambda found: link(found[0]), plain)
    return "".join(parts)


_headers = []
# Headers without a page: all of them at once, and names of the last version.
UNLISTED = ("kinetree", "experimental")


def headers():
    if not _headers:
        _headers.extend(sorted(path.stem for path in (HERE / "kinetree").glob("*.h") if path.stem not in UNLISTED))
    return "|".join(_headers)


def is_code(lines):
    """Of the lines of a block that is shown as it stands: is it C, or a formula?"""
    return any(line.rstrip().endswith((";", "{", "}")) for line in lines)


def verbatim(lines, i):
    """The end of the block that begins at i, or i where there is none."""
    if not lines[i].startswith("    ") or (i > 0 and lines[i - 1].strip()):
        return i
    end = i
    while end < len(lines) and (lines[end].startswith("    ") or not lines[end].strip()):
        end += 1
    while not lines[end - 1].strip():
        end -= 1
    return end


def items(lines):
    """Lists, in HTML: Markdown's would need an empty line behind them."""
    out, inside, dashes = [], False, False
    for line in lines:
        item = line.startswith("  ") and line[2] != " " and not dashes
        if item:
            line = ("<li>" if inside else "<ul><li>") + line[2:]
            inside = True
        elif inside and not line.startswith("  "):
            line = "</ul>" + line
            inside = False
        dashes = line.startswith("- ") or dashes and line.startswith("  ")
        out.append(line)
    if inside:
        out[-1] += "</ul>"
    return out


def prose(lines):
    """The lines of a comment, as many as before, in Doxygen's Markdown."""
    out, words, i = [], [], 0

    def write():
        out.extend(items(inline("\n".join(words)).split("\n")) if words else [])
        words.clear()

    while i < len(lines):
        end = verbatim(lines, i)
        if end == i:
            words.append(lines[i])
            i += 1
            continue
        write()
        order = "code{.c}" if is_code(lines[i:end]) else "verbatim"
        assert out and not out[-1], lines[i]  # an empty line is before it
        out[-1] = f"\\{order}"
        out += [line[4:] for line in lines[i:end]]
        close = f"\\end{order.split('{')[0]}"
        if end < len(lines):
            out.append(close)
            end += 1
        else:
            out[-1] += f" {close}"
        i = end
    write()
    return out


def content(comment):
    """The lines of a comment without what makes it one."""
    lines = comment.strip()[2:-2].split("\n")
    return [re.sub(r"^\s*\* ?", "", line).rstrip() if i else line.strip() for i, line in enumerate(lines)]


def flat(comment):
    return inline(" ".join(line.strip() for line in content(comment)).strip())


# ---- headers ---------------------------------------------------------------------------------------------------------


def split(text, separator=","):
    """At separators outside of all brackets."""
    parts, depth, quoted = [""], 0, False
    for letter in text:
        quoted ^= letter == '"'
        depth += letter in "([{"
        depth -= letter in ")]}"
        if letter == separator and depth == 0 and not quoted:
            parts.append("")
        else:
            parts[-1] += letter
    return parts


def variables(declaration):
    """double a, *b; as two declarations."""
    first, *others = split(declaration.rstrip(";"))
    start = re.match(r"\s*(?:(?:const|unsigned|struct)\s+)*\w+(?:\s+const)?\s*", first)
    if not others or not start:
        return [declaration]
    return [f"{first};"] + [f"{start[0].strip()} {other.strip()};" for other in others]


class Header:
    def __init__(self, path):
        self.name = path.name
        self.lines = path.read_text().split("\n")
        self.out, self.lists, self.section = [], {}, False
        self.at = 0

    def emit(self, text, count):
        """As many lines as were read."""
        lines = text.split("\n")
        assert len(lines) <= count, (self.name, self.at, text)
        self.out += lines + [""] * (count - len(lines))

    def take(self, ends):
        """Lines up to the one on which `ends` is true of what was read."""
        start = self.at
        while self.at < len(self.lines):
            self.at += 1
            text = "\n".join(self.lines[start:self.at])
            if ends(text):
                return text
        raise SystemExit(f"{self.name}:{start + 1}: this has no end")

    def comment(self):
        return self.take(lambda text: text.rstrip().endswith("*/"))

    def filtered(self):
        head = self.comment()
        lines = prose(content(head))
        lines[0] = f"/** \\header{{{self.name[:-2]}_h,{self.name}}} {lines[0]}"
        self.emit("\n".join(lines) + " */", head.count("\n") + 1)
        self.body()
        end = max(i for i, line in enumerate(self.out[:-4]) if not line.strip())
        self.out[end] = ("/** @} */ " if self.section else "") + "/** @} */"
        return "\n".join(self.out)

    def body(self):
        above, known = None, None  # the comment above; the name whose documentation goes on
        while self.at < len(self.lines):
            line = self.lines[self.at].strip()
            if not line:
                above = known = None
                self.out.append("")
                self.at += 1
            elif line.startswith("/* ----"):
                self.open_section(self.comment())
            elif line.startswith("/*"):
                above, known = self.comment(), None
                if self.at < len(self.lines) and not self.lines[self.at].strip():
                    raise SystemExit(f"{self.name}:{self.at}: this comment is on nothing")
                lines = prose(content(above))
                self.emit("/** " + "\n".join(lines) + " */", above.count("\n") + 1)
            elif line.startswith(("#if", "#el", "#end", "#inc", 'extern "C"')) or line == "}":
                self.emit(self.lines[self.at], 1)
                self.at += 1
            else:
                known = self.declaration(known if not above else None)
                above = None

    def open_section(self, comment):
        lines = content(comment)
        title = re.sub(r"-{3,}", "", lines[0]).strip()
        lines[0] = f"\\name {title[0].upper() + title[1:]}"
        words = "\n".join(lines[:1] + prose(lines[1:]))
        self.emit(("/** @} */ " if self.section else "") + f"/** {words} */ /** @{{ */", comment.count("\n") + 1)
        self.section = True

    def declaration(self, known):
        """One, at the top; known: what it is documented like. Returns its name, or that."""
        line = self.lines[self.at].strip()
        if line.startswith("#define"):
            return self.macro(known)
        start = self.at
        if re.match(r"(typedef )?(struct|enum)\b[^;]*{", line):
            self.compound(known)
            return None
        if line.startswith("static inline"):
            text = self.take(lambda text: text.endswith("\n}") or "\n" not in text and text.endswith("}"))
        else:
            text = self.take(lambda text: text.rstrip().endswith(";"))
        name = re.search(r"\b(kt_\w+)(?= ?\(|;)", text) if "(" in text else re.search(r"(\w+);", text)
        self.emit(self.likeness(known) + text, self.at - start)
        return known or (name[1] if name else None)

    def macro(self, known):
        start = self.at
        text = self.take(lambda text: not text.endswith("\\"))
        name = re.match(r"#define (\w+)", text)[1]
        if name.endswith("_LIST"):
            self.lists[name] = []
            for part in text.split("\n")[1:]: # of another list, or a value
                within = re.match(r"\s*(\w+_LIST)\(X\)", part)
                self.lists[name] += (self.lists[within[1]] if within else
                                     re.findall(r"X\((.*?)\)\s*(?:(/\*.*?\*/)\s*)?\\?$", part))
            text = re.sub(r"/\*.*?\*/", lambda found: " " * len(found[0]), text)
        self.emit(text + (" " + self.likeness(known).replace("**", "**<") if known else ""), self.at - start)
        return known or name

    def likeness(self, known):
        return f"/** \\copybrief {known} \\copydetails {known} */ " if known else ""

    def compound(self, known):
        start = self.at
        if re.search(r"}[^}]*;", self.lines[self.at]):
            text = self.take(lambda text: True)
        else:
            text = self.take(lambda text: re.search(r"\n}[^\n]*;$", text))
        opening, inside, closing = re.fullmatch(r"([^{]*{)(.*)(}[^}]*)", text, flags=re.S).groups()
        make = self.values if "enum" in opening else self.members
        self.emit(self.likeness(known) + opening + make(inside) + closing, self.at - start)

    def values(self, inside):
        """Enumerated ones, each with the comment before or behind its comma."""
        inside = re.sub(r"#define \w+\(.*?\n#undef \w+", self.expand, inside, flags=re.S)

        def one(found):
            words = found["before"] or found["behind"] or ""
            if not found["name"] or words.startswith("/**<"):
                return found[0]
            text = f"{found['name']}{found['value'] or ''}, " + (f"/**< {flat(words)} */" if words else "")
            return text + "\n" * found[0].count("\n")

        return re.sub(r"(?P<name>\b[A-Z]\w+)(?P<value> = [^,/\n]*[^,/\s])?\s*(?P<before>/\*.*?\*/)?"
                      r"(?:\s*,)?[ \t]*(?P<behind>/\*.*?\*/)?|/\*.*?\*/", one, inside, flags=re.S)

    def expand(self, found):
        """A list of values in the place of the macros that make them of it."""
        name = re.search(r"(\w+_LIST)\(", found[0])[1]
        valued = re.match(r"#define \w+\(.*?\) \w+ = (\w+)", found[0])
        pasted = re.match(r"#define \w+\(.*?\) (\w+)##\w+", found[0])  # KT_QUANTITY_##id
        prefix = pasted[1] if pasted else ""
        out = ""
        for entry, comment in self.lists[name]:
            fields = [field.strip() for field in split(entry)]
            value = f" = {fields[1]}" if valued else ""
            if comment:
                words = flat(comment)
            else:
                last = fields[-1]
                words = inline(last[1:-1]) if last.startswith('"') else f'"{last}"'
            out += f" {prefix}{fields[0]}{value}, /**< {words} */"
        return out + "\n" * found[0].count("\n")

    def joined(self, inside):
        """Lines, each with the whole of the comment behind it, as many as before."""
        lines, i, out = inside.split("\n"), 0, []
        while i < len(lines):
            line, j = lines[i], i + 1
            if "/*" in line and "/**<" not in line and not line.strip().startswith("/*"):
                while "*/" not in line:
                    line += " " + re.sub(r"^\s*\* ?", "", lines[j]).strip()
                    j += 1
            out += [line] + [""] * (j - i - 1)
            i = j
        return out

    def members(self, inside):
        out, above, heading = [], "", False
        lines, i = self.joined(inside), 0
        fresh = True  # the next declaration is the first below a comment
        while i < len(lines):
            line, stripped = lines[i], lines[i].strip()
            if stripped.startswith("/*"):
                j = i
                while "*/" not in lines[j]:
                    j += 1
                above, fresh = flat("\n".join(lines[i:j + 1])), True
                out += [""] * (j - i + 1)
                i = j + 1
                continue
            if not stripped:
                if i == 0 or inside.split("\n")[i].strip() == "":
                    above, heading = "", False
                out.append("")
                i += 1
                continue
            j = i
            while not re.search(r";\s*(/\*.*\*/)?$", lines[j]):
                j += 1
            whole = " ".join(part.strip() for part in lines[i:j + 1])
            declared, behind = re.fullmatch(r"(.*;)\s*(/\*.*\*/)?", whole).groups()
            behind = flat(behind) if behind else ""
            if fresh:
                heading, fresh = bool(above and behind), False
            words = f"{behind.rstrip('.')}. {above}" if heading else behind or above
            out.append("    " + " ".join(f"{one} /**< {words} */" if words else one for one in variables(declared)))
            out += [""] * (j - i)
            i = j + 1
        return "\n".join(out)


# ---- pages -----------------------------------------------------------------------------------------------------------


def header_page(name):
    return f"{name}\n{'=' * len(name)}\n\n.. doxygengroup:: {name[:-2]}_h\n   :members:\n   :undoc-members:\n"


def manual(troff):
    """The manual page of a subcommand in Markdown. The command writes few of troff's requests."""
    def words(text):
        text = re.sub(r"\\f[BI](.*?)\\fR", r"`\1`", text).replace("` `", " ")
        for escape, letter in (("\\-", "-"), ("\\(aq", "'"), ("\\e", "\\"), ("\\&", ""), ("\\(ga", "`")):
            text = text.replace(escape, letter)
        return text

    out, term, literal = [], False, False
    for line in troff.splitlines():
        request, _, rest = line.partition(" ")
        if request == ".TH":
            out.append("# kinetree " + words(rest.split()[0].lower()).partition("-")[2])
        elif request == ".SH":
            out += ["", "## " + words(rest).capitalize(), ""] if rest != "NAME" else [""]
        elif request == ".SS":
            out += ["", "### " + words(rest), ""]
        elif request == ".TP":
            term = True
        elif request in (".nf", ".EX"):
            out += ["", "```text"]
            literal = True
        elif request in (".fi", ".EE"):
            out += ["```", ""]
            literal = False
        elif request == ".PP":
            out.append("")
        elif request == ".B":
            out.append(f"`{words(rest)}`")
        elif request == ".BR":
            out.append("`{}`{}".format(*words(rest).split(" ", 1)))
        elif re.match(r"\.[A-Z]", request):
            raise ValueError(f"the manual page has a request that is not converted: {line}")
        elif term:
            out += ["", words(line), ":   "]
            term = False
        elif out[-1] == ":   ":
            out[-1] += words(line)
        else:
            out.append(words(line).partition(" - ")[2] + "." if len(out) == 2 else words(line))
    return "\n".join(out) + "\n"


# Live figures: the page, the scene of the gallery with values in the address (apps/browser/live.js), and what to try.
FIGURES = [
    ("method-drift", "four-bar", "method=rk4&step=0.01&unprojected=1", "Drift, and what the projection does",
     "The linkage runs with steps of 10 ms, and its loop drifts open. Clear <em>Let loops drift</em>: the gap falls to rounding. "
     "Choose <em>Compare</em> to keep the last run as a shadow."),
    ("method-singular", "n-four-bar-2", "method=dopri5&tolerance=1e-8&reduction=partition&compare=1", "Partitioning and QR through singular positions",
     "All rods of these windows lie flat ten times in 10 s, and three freedoms exist for an instant. The page begins with coordinate partitioning. Choose "
     "<em>QR decomposition</em>: the run with partitioning stays as a shadow. The errors of the energy agree to four digits, because this partitioning chooses "
     "its coordinates anew in each state, as QR finds the rank. Then move <em>Tolerance</em>: the energy follows it, and the gap of the loops stays at rounding."),
    ("choosing-a-method", "double-pendulum", "method=rk4&step=0.01&duration=2", "The order of a method",
     "Halve <em>Step</em> several times. Each half divides the error of the energy by about 2<sup>4</sup> or more, since the method has order four. Then choose "
     "<code>heun</code>, of order two."),
    ("method-contacts", "clutch", "", "Stick and slip",
     "Friction drives a load until both wheels turn alike. Then the friction sticks: it is a loop that bears at most its static limit. After 3 s the "
     "motor pushes harder, and the plates slip again. Give the wheels other positions or another <em>push</em>, and choose the velocities below <em>Columns</em>."),
]

FIGURE = """
```{{raw}} html
<figure class="live"><figcaption><strong>{title}.</strong> {words} <a href="gallery/{scene}.html{address}">Open this figure alone.</a></figcaption>
<iframe src="gallery/{scene}.html{address}" title="{title}" loading="lazy"></iframe></figure>
```
"""


def add_live_figures(source, gallery):
    """Adds the figures to the pages of the site, if the pages of the gallery are live."""
    if not (pathlib.Path(gallery) / "engine.js").exists():
        return
    for name, scene, values, title, words in FIGURES:
        address = f"#{values.replace('&', '&amp;')}" if values else ""
        with open(source / f"{name}.md", "a", encoding="utf-8") as page:
            page.write(FIGURE.format(title=title, words=words, scene=scene, address=address))


# If the site is built without the command, which makes the page of its descriptors.
TYPES = "# Joints, loops, effects, functions and shapes\n\n`kinetree help --types` prints every type with its keys, its formula and a scene.\n"


def gather(output, command, gallery):
    """The sources of the site: the pages, the pictures, a page for each header, one of all types, and one for each subcommand."""
    source, extra = output / "source", output / "extra"
    for folder in (source, extra):
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
    for pictures in PICTURES:
        shutil.copytree(pictures, source / "pictures", dirs_exist_ok=True)
    for path in (HERE / "pages").glob("*.md"):
        (source / path.name).write_text(path.read_text().replace("(../../apps/pictures/", "(pictures/"))
    for name in headers().split("|"):
        (source / f"{name}.h.rst").write_text(header_page(f"{name}.h"))
    (extra / "index.html").write_text('<!DOCTYPE html>\n<meta http-equiv="refresh" content="0; url=kinetree.html">\n')
    (source / "types.md").write_text(TYPES)
    if command:
        (source / "types.md").write_text(subprocess.run([command, "help", "--types"], capture_output=True, text=True, check=True).stdout)
        said = subprocess.run([command, "help"], capture_output=True, text=True, check=True).stdout
        for name in re.findall(r"^  ([a-z]+)  +", said.partition("Usage")[2], flags=re.M):
            page = subprocess.run([command, "help", "--man", name], capture_output=True, text=True, check=True).stdout
            (source / f"command-{name}.md").write_text(manual(page))
    if gallery:
        shutil.copytree(gallery, extra / "gallery", dirs_exist_ok=True)
        with open(source / "gallery.md", "a", encoding="utf-8") as page:
            page.write(f"\n```{{raw}} html\n{(extra / 'gallery/figures.html').read_text()}```\n")
        add_live_figures(source, gallery)


def name_anonymous(folder):
    """Doxygen 1.9.8 leaves the names of anonymous enumerations empty, which Sphinx rejects; earlier versions wrote @0, @1 ..."""
    number = itertools.count()
    for path in sorted(folder.glob("*.xml")):
        text = path.read_text(encoding="utf-8")
        path.write_text(re.sub("<name></name>", lambda _: f"<name>@{next(number)}</name>", text), encoding="utf-8")


def build(output, dependencies=None, command=None, gallery=None):
    output = pathlib.Path(output).resolve()
    output.mkdir(parents=True, exist_ok=True)
    version = re.search(r'#define KT_VERSION "(.*)"', (HERE / "kinetree/status.h").read_text())[1]
    environment = {**os.environ, "KT_PYTHON": sys.executable, "KT_OUTPUT": str(output), "KT_VERSION": version}
    if dependencies:
        read = [*sorted((HERE / "site").glob("*.*")), *sorted((HERE / "kinetree").glob("*.h")), *sorted((HERE / "pages").glob("*.md")),
                *sorted(picture for pictures in PICTURES for picture in pictures.glob("*.svg"))]
        pathlib.Path(dependencies).write_text(f"{output / 'html'}: " + " ".join(str(path) for path in read) + "\n")
    status = subprocess.run(["doxygen", "site/Doxyfile"], cwd=HERE, env=environment).returncode
    if status:
        return status
    name_anonymous(output / "xml")
    gather(output, command, gallery)
    return subprocess.run(["sphinx-build", "-q", "-W", "--keep-going", "-c", HERE / "site", "-d", output / "doctrees",
                           output / "source", output / "html"], env={**environment, "PYTHONWARNINGS": "ignore::DeprecationWarning"}).returncode


def main():
    if sys.argv[1:2] == ["filter"]:
        sys.stdout.write(Header(pathlib.Path(sys.argv[2])).filtered())
        return 0
    if sys.argv[1:2] == ["build"] and 3 <= len(sys.argv) <= 6:
        return build(*sys.argv[2:])
    print(__doc__, file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main())
