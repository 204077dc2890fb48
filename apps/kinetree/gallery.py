"""A page with a picture of every bundled scene, light and dark, by `kinetree draw`, each with a link to its motion, by `kinetree view`.

gallery.py COMMAND SCENES OUTPUT DEPENDENCIES     OUTPUT/index.html, its pictures and views; what was read, as a rule for ninja
"""
import concurrent.futures
import html
import os
import pathlib
import re
import subprocess
import sys

PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Scenes of Kinetree</title>
<style>
:root {{ color-scheme: light dark; }}
body {{ font-family: sans-serif; margin: 2rem auto; max-width: 80rem; padding: 0 1rem; background: light-dark(#fff, #0d1117);
  color: light-dark(#222, #e6ebf0); }}
main {{ display: grid; grid-template-columns: repeat(auto-fill, minmax(22rem, 1fr)); gap: 1.5rem; }}
figure {{ margin: 0; padding: .75rem; border: 1px solid light-dark(#ddd, #2b3039); border-radius: .5rem; }}
img {{ width: 100%; aspect-ratio: 4 / 3; object-fit: contain; }}
figcaption {{ font-size: .85rem; line-height: 1.4; }}
code {{ font-weight: bold; }}
</style>
</head>
<body>
<h1>Scenes of Kinetree</h1>
<p>The scenes that come with the command: <code>kinetree demo NAME</code> runs one, <code>kinetree view</code> shows it in motion.
The pictures are those of <code>kinetree draw</code>; each opens the view of its scene.</p>
<main>
{figures}
</main>
</body>
</html>
"""

FIGURE = """<figure>
<a href="{name}.html"><picture><source media="(prefers-color-scheme: dark)" srcset="{name}-dark.svg">
<img loading="lazy" alt="{title}" src="{name}.svg"></picture></a>
<figcaption><code>{name}</code> {words}</figcaption>
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
    (output / "index.html").write_text(PAGE.format(figures="\n".join(figures)))
    dependencies.write_text(f"{output}: " + " ".join(str(path) for path in [pathlib.Path(__file__), *scenes]) + "\n")


main()
