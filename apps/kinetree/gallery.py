"""A picture of every bundled scene, light and dark, by `kinetree draw`, with a link to its motion, by `kinetree view`.

gallery.py COMMAND SCENES OUTPUT DEPENDENCIES
    writes OUTPUT/figures.html, the pictures and views beside it, and DEPENDENCIES, a rule for ninja
"""
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


def draw(command, scene, output):
    for dark in (False, True):
        picture = output / f"{scene.stem}{'-dark' if dark else ''}.svg"
        run = subprocess.run([command, "draw", str(scene), "--out", str(picture)] + ["--dark"] * dark,
                             capture_output=True, text=True)
        if run.returncode != 0:
            raise SystemExit(f"{scene.name}: {run.stderr}")
    run = subprocess.run([command, "view", str(scene), "--view", str(output / f"{scene.stem}.html"), "--quiet"], capture_output=True, text=True)
    if run.returncode != 0:
        raise SystemExit(f"{scene.name}: {run.stderr}")


def main():
    command, scenes, output, dependencies = sys.argv[1], *map(pathlib.Path, sys.argv[2:5])
    scenes = sorted(scenes.glob("*.yaml"))
    output.mkdir(parents=True, exist_ok=True)
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(lambda scene: draw(command, scene, output), scenes))
    figures = [FIGURE.format(name=scene.stem, title=html.escape(scene.stem), words=html.escape(words_of(scene)))
               for scene in scenes]
    (output / "figures.html").write_text("\n".join(["<div class=\"gallery\">", *figures, "</div>"]) + "\n")
    dependencies.write_text(f"{output}: " + " ".join(str(path) for path in [pathlib.Path(__file__), *scenes]) + "\n")


main()
