"""embed.py OUT PAGE.html PAGE.css SCRIPT.js...: the page with its style and scripts, as texts for view.c.
embed.py --live OUT PAGE.html PAGE.css SCRIPT.js... -- LICENCES LIVE.html LIVE.css LIVE.js... ENGINE.js WORKER.js: a live page.

The page is cut where the program puts in the mechanism (@DATA@) and the frames (@MOTION@); a live page also where it
puts in the scene (@SCENE@) and the engine (@ENGINE@). The parts of a live page stand at fixed places of the same page.
Its policy allows its own script, by the script's hash, WebAssembly and the worker.
"""
# SPDX-License-Identifier: Apache-2.0
import base64
import hashlib
import sys

is_live = sys.argv[1] == "--live"
words = sys.argv[2:] if is_live else sys.argv[1:]
words, live = (words[:words.index("--")], words[words.index("--") + 1:]) if is_live else (words, [])
out, page, style, *scripts = words

LIVE_DATA = """<script type="application/json" id="scene">@SCENE@</script>
<script type="text/plain" id="engine">@ENGINE@</script>
<script type="text/plain" id="worker">
"use strict";
%s</script>
<script>
"""


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def literal(text):
    """The bytes as a list of numbers: string literals may only be 4095 long."""
    data = text.encode()
    lines = [",".join(str(b) for b in data[i:i + 32]) for i in range(0, len(data), 32)]
    return ",\n".join(lines)


def replace_once(text, old, new):
    if text.count(old) != 1:
        raise SystemExit(f"{page}: '{old}' must stand there once, not {text.count(old)} times")
    return text.replace(old, new)


def with_experiment(text):
    """The page with controls and an engine."""
    licences, html, css, *own, engine, worker = map(read, live)
    panel, accuracy = html.split("<!-- beside the chart -->\n")
    text = replace_once(text, "<!doctype html>\n", f"<!doctype html>\n<!--\n{licences}-->\n")
    text = replace_once(text, "<main>\n", "<main>\n" + panel)
    text = replace_once(text, '<div class="aside">\n', accuracy + '<div class="aside">\n')
    text = replace_once(text, "@STYLE@", "@STYLE@" + css)
    text = replace_once(text, "<script>\n", LIVE_DATA % (engine + worker))
    text = replace_once(text, "@SCRIPT@", "@SCRIPT@" + "".join(own))
    return text


def with_hash(text):
    """The page whose policy allows its script alone, instead of all scripts in it."""
    script = text.split("<script>")[1].split("</script>")[0]
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    return replace_once(text, "script-src 'unsafe-inline'", f"script-src 'sha256-{digest}' 'wasm-unsafe-eval'; worker-src blob:")


whole = read(page)
if is_live:
    whole = with_experiment(whole)
whole = whole.replace("@STYLE@", read(style)).replace("@SCRIPT@", "".join(map(read, scripts)))
if is_live:
    whole = with_hash(whole)
names, parts = ["head", "middle", "tail"], []
if is_live:
    names = ["live_head", "live_middle", "live_scene", "live_engine", "live_tail"]
for mark in ["@DATA@", "@MOTION@"] + ["@SCENE@", "@ENGINE@"] * is_live:
    part, whole = whole.split(mark)
    parts.append(part)
with open(out, "w", encoding="utf-8") as file:
    file.write('#include "view/page.h"\n\n')
    for name, text in zip(names, [*parts, whole]):
        file.write(f"const char kt_page_{name}[] = {{\n{literal(text)}}};\n")
        file.write(f"const size_t kt_page_{name}_size = sizeof kt_page_{name};\n")
