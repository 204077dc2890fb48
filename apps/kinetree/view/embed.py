"""embed.py OUT PAGE.html PAGE.css SCRIPT.js...: the page with its style and scripts, as texts for view.c.

The page is cut where the program puts in the mechanism (@DATA@) and the frames (@MOTION@).
"""
import sys

out, page, style, *scripts = sys.argv[1:]


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def literal(text):
    """The bytes as a list of numbers: string literals may only be 4095 long."""
    data = text.encode()
    lines = [",".join(str(b) for b in data[i:i + 32]) for i in range(0, len(data), 32)]
    return ",\n".join(lines)


whole = read(page).replace("@STYLE@", read(style)).replace("@SCRIPT@", "".join(map(read, scripts)))
head, rest = whole.split("@DATA@")
middle, tail = rest.split("@MOTION@")
with open(out, "w", encoding="utf-8") as file:
    file.write('#include "view/page.h"\n\n')
    for name, text in (("head", head), ("middle", middle), ("tail", tail)):
        file.write(f"const char kt_page_{name}[] = {{\n{literal(text)}}};\n")
        file.write(f"const size_t kt_page_{name}_size = sizeof kt_page_{name};\n")
