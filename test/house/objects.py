"""The order of the house, read from the symbols of the objects: what an include does not show, a declaration by hand does.

objects.py ARCHIVE...
"""
import collections
import pathlib
import re
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note
from folders import FOLDERS


def objects(archive):
    """(name, symbols that it defines, symbols that it needs) of each object: kernels come once a level, of one name."""
    text = subprocess.run(["nm", "-P", "-g", archive], check=True, capture_output=True, text=True).stdout
    parts = re.split(r"^.*\[(?:.*/)?([^/\]]+)\.c\.o\]:$", text, flags=re.MULTILINE)
    for name, lines in zip(parts[1::2], parts[2::2]):
        symbols = [line.split()[:2] for line in lines.splitlines() if line]
        yield (name, {symbol for symbol, kind in symbols if kind not in "Uwv"},
               {symbol for symbol, kind in symbols if kind in "Uwv"})


def main():
    everything = [each for archive in sys.argv[1:] for each in objects(archive)]
    home = {symbol: name for name, defined, _ in everything for symbol in defined}

    kinds = collections.Counter()
    for _, defined, _ in everything:
        kinds.update({suffix for symbol in defined if (suffix := symbol.rsplit("_", 1)[-1])
                      in ("baseline", "v3", "v4", "dual")} or {"plain"})
    note(f"{len(everything)} objects: " + ", ".join(f"{count} {kind}" for kind, count in sorted(kinds.items())))
    claim("objects_of_every_kind_are_read",
          [f"no object is {kind}" for kind in ("plain", "baseline", "dual") if not kinds[kind]])

    rank = {folder: place for place, folder in enumerate(FOLDERS)}
    unknown = sorted({name for name, _, _ in everything if name.split("_")[0] not in rank})
    claim("every_object_is_of_a_folder", unknown)

    upward = collections.defaultdict(set)
    for name, _, needed in everything:
        for symbol in needed & home.keys():
            own, other = name.split("_")[0], home[symbol].split("_")[0]
            if own in rank and other in rank and rank[other] > rank[own]:
                upward[name, home[symbol]].add(symbol)
    note(f"{sum(len(needed & home.keys()) for _, _, needed in everything)} references between objects")
    claim("objects_refer_only_to_what_is_below_them",
          [f"{own} needs {', '.join(sorted(symbols))} of {other}" for (own, other), symbols in sorted(upward.items())])
    finish()


main()
