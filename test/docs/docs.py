"""The site is complete: every public name is documented, every page is there and linked, and no warning is left.

docs.py INCLUDE-DIRECTORY SITE-OR-EMPTY COMMAND-OR-EMPTY C-COMPILER...    SITE is the folder of a finished build, else one is made
"""
# SPDX-License-Identifier: Apache-2.0
import html
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as xml

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

# What the headers hold for the compiler alone.
OURS = r"\b(?:kt|KT)_\w+\b"
SITE = 60_000_000  # bytes


def preprocess(compiler, include, *options):
    run = subprocess.run([*compiler, "-E", *options, f"-I{include}", "-x", "c", "-"], input="#include <kinetree/experimental.h>\n#include <kinetree/kinetree.h>\n",
                         capture_output=True, text=True, check=True, env={**os.environ, "LC_ALL": "C"})
    return run.stdout


def members(body):
    """Names in what stands between the braces of a struct."""
    for declaration in filter(None, map(str.strip, body.split(";"))):
        pointer = re.search(r"\(\*(\w+)\)", declaration)
        if pointer:
            yield pointer[1]
        else:
            for part in declaration.split(","):
                yield re.search(r"(\w+)\s*(?:\[[^]]*\]\s*)*$", part)[1]


def declared(compiler, include):
    """Names in the order of C, without any help of Doxygen's: all, and (struct, member)."""
    text = preprocess(compiler, include, "-P")
    macros = re.findall(rf"^#define ({OURS})", preprocess(compiler, include, "-dM"), flags=re.M)
    structs = re.findall(r"\bstruct (kt_\w+) \{([^{}]*)\}", text)
    return {*re.findall(OURS, text), *macros}, {(name, member) for name, body in structs for member in members(body)}


def documented(path):
    """The same from Doxygen's list of what has been written about."""
    names, fields = set(), set()
    for compound in xml.parse(path).getroot().iter("compound"):
        own = compound.findtext("name")
        names.add(own)
        for member in compound.iter("member"):
            (fields if compound.get("kind") == "struct" else names).add(
                (own, member.findtext("name")) if compound.get("kind") == "struct" else member.findtext("name"))
        names.update(value.text for value in compound.iter("enumvalue"))
    return names, fields


def functions(path):
    return {member.findtext("name") for member in xml.parse(path).getroot().iter("member") if member.get("kind") == "function"}


def left_over(folder):
    """Orders to Doxygen that it has taken for text."""
    for path in sorted(folder.glob("*.html")):
        text = html.unescape(re.sub(r"<script.*?</script>|<[^>]*>", "", path.read_text(), flags=re.S))
        for found in re.finditer(r"\\(?:ref|copy\w+|name|defgroup|brief|endcode|endverbatim|header)\b.{0,40}", text):
            yield f"{path.name}: {found[0]}"


def found_before(index, word, page):
    """What Sphinx's search lists before a page: it scores titles and entries of the index by their length over that of the word."""
    index = json.loads(index[index.index("{"):index.rindex("}") + 1])
    entries = [index["docnames"][place[0]] for entry, places in index["indexentries"].items() if entry.lower() == word
               for place in (places if isinstance(places[0], list) else [places])]
    others = [title for title, places in index["alltitles"].items() if title.lower() == word]
    return [f"{one} comes first" for one in others] + ([] if entries == [page] else [f"the index has {word} of {entries}"])


def long_groups(first):
    """Groups of how-tos on the first page with more than eight entries, and a missing group."""
    how_to = first[first.index("## How-to"):first.index("## Concepts")]
    groups = {group.partition("\n")[0]: len(re.findall(r"^- ", group, flags=re.M)) for group in re.split(r"^### ", how_to, flags=re.M)[1:]}
    return [f"{name}: {count} entries" for name, count in groups.items() if count > 8] + ([] if len(groups) == 6 else [f"groups: {', '.join(groups)}"])


def check_size(folder):
    """The whole site, with the live pages of the gallery, if this build has them."""
    files = [path for path in folder.rglob("*") if path.is_file()]
    size, gallery = (sum(path.stat().st_size for path in chosen) for chosen in (files, [path for path in files if path.parent.name == "gallery"]))
    note(f"the site has {size / 1e6:.1f} MB, bound {SITE / 1e6:g}; of these {gallery / 1e6:.1f} MB are the gallery, "
         f"which {'is' if (folder / 'gallery/engine.js').exists() else 'is not'} live")
    claim("the_site_is_small", [] if 0 < size < SITE else [f"it has {size} bytes"])


def main():
    include, site, command, compiler = pathlib.Path(sys.argv[1]), sys.argv[2], sys.argv[3], sys.argv[4:]
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(site or name)
        if not site:
            run = subprocess.run([sys.executable, include / "site/document.py", "build", folder, folder / "dependencies", *filter(None, [command])],
                                 capture_output=True, text=True)
            said = (run.stdout + run.stderr).splitlines()
            claim("the_site_is_built_without_a_warning", said + ([f"status {run.returncode}"] if run.returncode else []))
        names, fields = declared(compiler, include)
        known, known_fields = documented(folder / "names.xml") if (folder / "names.xml").exists() else (set(), set())
        note(f"{len(names)} names, {len(fields)} members of structs")
        claim("there_are_names", [] if len(names) > 300 and len(fields) > 200 else ["hardly any"])
        claim("every_name_is_documented", sorted(names - known))
        claim("every_member_is_documented", sorted(f"{name}.{field}" for name, field in fields - known_fields))
        claim("nothing_is_documented_that_is_not_there",
              sorted(name for name in known - names if re.fullmatch(OURS, name or "")))
        pages = {path.stem for path in (include / "pages").glob("*.md")}
        first = (include / "pages/kinetree.md").read_text()
        claim("every_page_is_made", sorted(page for page in pages if not (folder / "html" / f"{page}.html").exists()))
        types = re.findall(r"<h3>(\w+: \w+)<", (folder / "html/types.html").read_text()) if command else ["without the command"] * 41
        note(f"{len(types)} types on the page that the command makes")
        claim("page_of_types_has_every_type", [] if len(types) > 40 else types)
        claim("every_page_is_linked_from_the_first", sorted(page for page in pages - {"kinetree"} if f"({page}.md)" not in first))
        made = {path.name: path.read_text() for path in (folder / "html").glob("*.html")}
        claim("every_function_has_an_entry",
              sorted(name for name in names if name in functions(folder / "names.xml")
                     and not any(f'id="c.{name}"' in text for text in made.values())))
        linked = sum(text.count('.h.html#c.kt_') for page, text in made.items() if page[:-5] in pages)
        note(f"{linked} links from pages to names of C")
        claim("names_in_pages_are_links", [] if linked > 300 else [f"only {linked}"])
        shown = {source for text in made.values() for source in re.findall(r'src="([^"]+\.svg)"', text)}
        note(f"{len(shown)} pictures")
        claim("every_picture_is_there", sorted(source for source in shown if not (folder / "html" / source).exists())
              if len(shown) > 30 else [f"only {len(shown)} are shown"])
        claim("search_for_contact_finds_the_how_to_first", found_before((folder / "html/searchindex.js").read_text(), "contact", "hard-contacts"))
        claim("pages_of_headers_have_an_outline",
              [page for page, text in made.items() if page.endswith(".h.html") and not re.search(r'<a class="reference internal" href="#[\w-]+"', text)])
        claim("enumerations_have_names", sorted({f"{page}: {found}" for page, text in made.items() for found in
                                                 re.findall(r"enum \[anonymous\]|enum @\d+", re.sub(r"<[^>]*>", "", text))}))
        claim("a_group_of_how_tos_has_at_most_eight", long_groups(first))
        claim("no_order_is_left_as_text", list(left_over(folder / "html")))
        check_size(folder / "html")
    finish()


main()
