"""The site: these pages, and a page for each header and subcommand that document.py adds, by Sphinx, MyST and Furo.

kinetree.md lists the pages in sections; these lists are the navigation, too.
"""
# SPDX-License-Identifier: Apache-2.0
import os
import pathlib
import re

from docutils import nodes
from sphinx import addnodes

project = "Kinetree"
version = release = os.environ["KT_VERSION"]
extensions = ["myst_parser", "breathe", "sphinx.ext.mathjax"]
root_doc = "kinetree"
language = "en"
smartquotes = False  # they make a dash of the two of an option
html_theme = "furo"
html_title = f"Kinetree {version}"
html_show_copyright = False
html_copy_source = False
html_static_path = ["site.css"]
html_css_files = ["site.css"]
html_extra_path = [os.path.join(os.environ["KT_OUTPUT"], "extra")]
myst_heading_anchors = 4
myst_enable_extensions = ["deflist", "dollarmath"]
breathe_projects = {"kinetree": os.path.join(os.environ["KT_OUTPUT"], "xml")}
breathe_default_project = "kinetree"
breathe_domain_by_extension = {"h": "c"}
breathe_show_define_initializer = False
c_id_attributes = ["KT_API", "KT_CHECKED"]
c_extra_keywords = ["alignas", "alignof", "bool", "complex", "noreturn", "static_assert", "thread_local"]

# Words that lead a search to the page that answers first: a how-to, not each page with the word in its title.
SOUGHT = {
    "hard-contacts": "contact, contacts, stop, impact, bounce, friction", "scene-loops": "loop, loops, constraint, linkage",
    "robots": "robot, robots, URDF, MJCF, SDF, MuJoCo, ROS", "control-cookbook": "control, controller", "fmu": "FMU, FMI, Modelica, Simulink",
    "generated-c": "microcontroller, generated C, code generation", "choosing-a-method": "step, tolerance, integrator, accuracy, stiff",
    "gradients": "gradient, derivative, optimal control", "sweeps": "sweep, parameter study, Monte Carlo", "views": "animation, view, video",
    "drawings": "drawing, picture, figure", "identification": "identification, calibration", "python": "Python", "installation": "install, build",
    "real-time": "real time, HIL", "warnings": "warning, warnings", "method": "theory, Maggi, Kane, QR, DAE", "switching": "clutch, switch",
    "sticking-friction": "stiction, stick, Stribeck", "batches": "batch, GPU, SIMD", "embedding": "embed, embedding, library",
}

# Pages that document.py adds, below the page that introduces them.
ADDED = {"c-interface": r".*\.h", "command": r"command-.*"}


def toctree(caption, pages):
    return "\n".join(["", "```{toctree}", ":hidden:", *([f":caption: {caption}"] if caption else []), "", *pages, "```", ""])


def read_navigation(app):
    """(section, [[page, page below it, ...], ...]) for each list of kinetree.md; a page stands in the first one."""
    listed, sections = set(), []
    text = pathlib.Path(app.srcdir, f"{root_doc}.md").read_text()
    above = ""  # the section of a group
    for level, section in re.findall(r"^(##+) (.*?)(?=^##|\Z)", text, flags=re.M | re.S):
        items = []
        for item in re.split(r"^- ", section, flags=re.M)[1:]:
            pages = [page for page in re.findall(r"\]\(([a-z-]+)\.md\)", item) if page not in listed]
            listed.update(pages)
            items += [pages] if pages else []
        title = section.partition("\n")[0]
        above = title if level == "##" else above
        sections += [(title if level == "##" else f"{above}, {title.lower()}", items)] if items else []
    app.config.navigation = sections


def add_navigation(app, name, source):
    """A section's list of links is a part of the navigation; further pages of an item are below its first one."""
    if name == root_doc:
        source[0] += "".join(toctree(title, [item[0] for item in items]) for title, items in app.config.navigation)
    if name in SOUGHT:
        title, _, rest = source[0].partition("\n")
        source[0] = "\n".join([title, "", "```{index} " + SOUGHT[name], "```", "", rest])
    below = [page for _, items in app.config.navigation for item in items if item[0] == name for page in item[1:]]
    if name in ADDED:
        below += sorted(page for page in app.env.found_docs if re.fullmatch(ADDED[name], page))
    if below:
        source[0] += toctree("", below)


def link_names(app, document):
    """`kt_name` and `model.h` in a page are links, if there is such a name."""
    for literal in list(document.findall(nodes.literal)):
        name = re.sub(r"\(\)$", "", literal.astext())
        if name in app.env.found_docs and name.endswith(".h"):
            kind = {"refdomain": "std", "reftype": "doc", "reftarget": name, "refexplicit": True, "refdoc": app.env.docname}
        elif re.fullmatch(r"(?:kt|KT)_\w+(?:\.\w+)*", name):
            kind = {"refdomain": "c", "reftype": "any", "reftarget": name}
        else:
            continue
        if not isinstance(literal.parent, (nodes.reference, addnodes.pending_xref)):
            reference = addnodes.pending_xref("", refwarn=False, **kind)
            literal.replace_self(reference)
            reference += literal


def name_enumerations(app, document):
    """An enumeration without a name is shown with the part that its values share, or with its only value."""
    for enumeration in document.findall(addnodes.desc):
        signature = enumeration.children[0] if enumeration.get("objtype") == "enum" else None
        hidden = [text for text in signature.findall(nodes.Text) if "[anonymous]" in text] if signature else []
        values = [value["ids"][0].rpartition(".")[2] for value in enumeration.findall(addnodes.desc_signature)
                  if value is not signature and value["ids"]]
        if hidden and values:
            shared = os.path.commonprefix(values)
            shared = shared[:shared.rfind("_") + 1]
            name = values[0] if len(values) == 1 else (values[0] + ", " if shared == "KT_" else shared) + "..."
            hidden[0].parent.replace(hidden[0], nodes.Text(name))


def outline_header(app, document):
    """The parts of a header become sections of its page, so that the page has an outline."""
    if not app.env.docname.endswith(".h"):
        return
    page = next(iter(document.findall(nodes.section)))
    for part in list(document.findall(nodes.container)):
        is_top = "breathe-sectiondef" in part["classes"] and part.parent.parent.parent is page
        if is_top and isinstance(part.children[0], nodes.rubric):
            title = part.children[0].astext()
            part.parent.remove(part)
            page.append(nodes.section("", nodes.title("", title), *part.children[1:], ids=[nodes.make_id(title)]))


def restore_theme(app, exception):
    """Adds three parts to Debian's Furo 2022.12.7 that newer ones have.

    Its script imports another one, which browsers reject outside of a module: without it there is no button for dark
    mode. Its compiler of styles drops the dark colours for readers whose system is dark. Its reset of browsers' styles is
    an import from a path of Debian's web server, which a site elsewhere does not have.
    """
    folder = pathlib.Path(app.outdir, "_static")
    sheet, script = folder / "styles/furo.css", folder / "scripts/furo.js"
    if exception or not sheet.is_file() or not script.is_file():
        return
    words, imported = script.read_text(), re.compile(r'^import Gumshoe from "\./([\w-]+\.js)";$', re.M)
    script.write_text(imported.sub(lambda found: (script.parent / found[1]).read_text(), words))

    style = sheet.read_text()
    reset = re.search(r"@import url\((/javascript/[^)]*)\);", style)
    if reset:
        source = pathlib.Path("/usr/share" + reset[1])
        style = style.replace(reset[0], source.read_text() if source.is_file() else "body { margin: 0 }")
    dark = re.search(r'body\[data-theme="dark"\] (\{[^}]*\})', style)
    if dark and "prefers-color-scheme" not in style:
        auto = 'body:not([data-theme="light"])'
        style += f"""
@media not print {{ @media (prefers-color-scheme: dark) {{
  {auto} {dark[1]}
  html {auto} .only-light {{ display: none !important }}
  {auto} .only-dark {{ display: block !important }}
}} }}
"""
    sheet.write_text(style)


def setup(app):
    app.add_config_value("navigation", [], "env")
    app.connect("builder-inited", read_navigation)
    app.connect("source-read", add_navigation)
    app.connect("doctree-read", link_names)
    app.connect("doctree-read", name_enumerations, priority=300)
    app.connect("doctree-read", outline_header, priority=400)  # before Sphinx collects the outline
    app.connect("build-finished", restore_theme)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
