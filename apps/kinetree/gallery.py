"""A picture of every bundled scene, light and dark, by `kinetree draw`, with a link to its motion, by `kinetree view`.

gallery.py COMMAND SCENES OUTPUT DEPENDENCIES [--live]
    writes OUTPUT/figures.html, the pictures and views beside it, and DEPENDENCIES, a rule for ninja. With --live each
    page runs its scene. All pages share the engine, OUTPUT/engine.js
"""
# SPDX-License-Identifier: Apache-2.0
import concurrent.futures
import html
import os
import pathlib
import re
import subprocess
import sys

FIGURE = """<figure>
<a href="gallery/{name}.html"><img class="only-light" loading="lazy" alt="{title}" src="gallery/{name}.svg">
<img class="only-dark" loading="lazy" alt="{title}" src="gallery/{name}-dark.svg"></a>
<figcaption><code>kinetree demo {name}</code><br>{words}</figcaption>
</figure>"""


def words_of(scene):
    """The comment at the top of a scene, up to the end of its first sentence."""
    lines = []
    for line in scene.read_text().splitlines():
        if not line.startswith("#"):
            break
        lines.append(line[1:].strip())
    text = " ".join(lines)
    ends = [found.end() for found in re.finditer(r"\.(?= [A-Z]|$)", text)]
    return next((text[:end] for end in ends if text[:end].count("(") == text[:end].count(")")), text)


ENGINE = re.compile(r'<script type="text/plain" id="engine">([^<]*)</script>')


def share_engine(page):
    """Takes the engine out of a live page, which then loads engine.js from its folder. Returns the engine."""
    text = page.read_text()
    engine = ENGINE.search(text).group(1)
    text = ENGINE.sub('<script src="engine.js"></script>', text).replace("script-src 'sha256-", "script-src 'self' 'sha256-", 1)
    page.write_text(text)
    return engine


def draw(command, scene, output, live):
    for dark in (False, True):
        picture = output / f"{scene.stem}{'-dark' if dark else ''}.svg"
        run = subprocess.run([command, "draw", str(scene), "--out", str(picture)] + ["--dark"] * dark,
                             capture_output=True, text=True)
        if run.returncode != 0:
            raise SystemExit(f"{scene.name}: {run.stderr}")
    page = output / f"{scene.stem}.html"
    run = subprocess.run([command, "view", str(scene), "--view", str(page), "--quiet"] + ["--live"] * live, capture_output=True, text=True)
    if run.returncode != 0:
        raise SystemExit(f"{scene.name}: {run.stderr}")
    return share_engine(page) if live else None


def main():
    command, scenes, output, dependencies = sys.argv[1], *map(pathlib.Path, sys.argv[2:5])
    live = sys.argv[5:] == ["--live"]
    scenes = sorted(scenes.glob("*.yaml"))
    output.mkdir(parents=True, exist_ok=True)
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        engines = list(pool.map(lambda scene: draw(command, scene, output, live), scenes))
    if live:
        (output / "engine.js").write_text(f'globalThis.kinetree_engine = "{engines[0]}";\n')
    figures = [FIGURE.format(name=scene.stem, title=html.escape(scene.stem), words=html.escape(words_of(scene)))
               for scene in scenes]
    (output / "figures.html").write_text("\n".join(["<div class=\"gallery\">", *figures, "</div>"]) + "\n")
    dependencies.write_text(f"{output}: " + " ".join(str(path) for path in [pathlib.Path(__file__), *scenes]) + "\n")


main()
