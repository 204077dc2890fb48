"""The order of the house, read from the symbols of the objects: what an include does not show, a declaration by hand does.

objects.py ARCHIVE... [PROGRAM.p]

A folder of objects, that of a program, is asked for circles alone.
"""
# SPDX-License-Identifier: Apache-2.0
import collections
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note, output_of
from folders import PLACES


def objects(archive):
    """(name, symbols that it defines, symbols that it needs) of each object: kernels come once a level, of one name."""
    text = output_of("nm", "-P", "-g", archive)
    parts = re.split(r"^.*\[(?:.*/)?([^/\]]+)\.c\.o\]:$", text, flags=re.MULTILINE)
    for name, lines in zip(parts[1::2], parts[2::2]):
        symbols = [line.split()[:2] for line in lines.splitlines() if line]
        yield (name, {symbol for symbol, kind in symbols if kind not in "Uwv"},
               {symbol for symbol, kind in symbols if kind in "Uwv"})


def objects_of_program(folder):
    """The same of a folder of objects."""
    paths = sorted(pathlib.Path(folder).glob("*.c.o"))
    text = output_of("nm", "-A", "-P", "-g", *paths)
    symbols = collections.defaultdict(list)
    for path, symbol, kind in (line.split()[:3] for line in text.splitlines()):
        symbols[pathlib.Path(path.removesuffix(":")).name.removesuffix(".c.o")].append((symbol, kind))
    for name, found in symbols.items():
        yield (name, {symbol for symbol, kind in found if kind not in "Uwv"},
               {symbol for symbol, kind in found if kind in "Uwv"})


def room_of(name):
    """STOREY_ROOM of an object STOREY_ROOM_SOURCE."""
    return "_".join(name.split("_")[:2])


def references(everything):
    """Which object refers to which other one; objects of one name (one source, compiled several times) are one."""
    home = {symbol: name for name, defined, _ in everything for symbol in defined}
    to = collections.defaultdict(set)
    for name, _, needed in everything:
        to[name] |= {home[symbol] for symbol in needed & home.keys()} - {name}
    return to


def reached(to, start):
    seen, left = set(), [start]
    while left:
        for other in to.get(left.pop(), ()):
            if other not in seen:
                seen.add(other)
                left.append(other)
    return seen


def circles(everything, room_of):
    """The sets of objects of one room that refer to each other in a circle."""
    to = references(everything)
    inside = {name: {other for other in others if room_of(other) == room_of(name)} for name, others in to.items()}
    reach = {name: reached(inside, name) for name in inside}
    found = {tuple(sorted(other for other in reach[name] if name in reach.get(other, ()))) for name in reach
             if name in reach[name]}
    return [" <-> ".join(circle) for circle in sorted(found)]


def main():
    archives = [path for path in sys.argv[1:] if not path.endswith(".p")]
    programs = [path for path in sys.argv[1:] if path.endswith(".p")]
    everything = [each for archive in archives for each in objects(archive)]
    home = {symbol: name for name, defined, _ in everything for symbol in defined}

    kinds = collections.Counter()
    for _, defined, _ in everything:
        kinds.update({suffix for symbol in defined if (suffix := symbol.rsplit("_", 1)[-1])
                      in ("baseline", "v3", "v4", "dual")} or {"plain"})
    note(f"{len(everything)} objects: " + ", ".join(f"{count} {kind}" for kind, count in sorted(kinds.items())))
    claim("objects_of_every_kind_are_read",
          [f"no object is {kind}" for kind in ("plain", "baseline", "dual") if not kinds[kind]])

    rank = {room.replace("/", "_"): place for place, room in enumerate(PLACES)}
    unknown = sorted({name for name, _, _ in everything if room_of(name) not in rank})
    claim("every_object_is_of_a_room", unknown)

    upward = collections.defaultdict(set)
    for name, _, needed in everything:
        for symbol in needed & home.keys():
            own, other = room_of(name), room_of(home[symbol])
            if own in rank and other in rank and rank[other] > rank[own]:
                upward[name, home[symbol]].add(symbol)
    note(f"{sum(len(needed & home.keys()) for _, _, needed in everything)} references between objects")
    claim("objects_refer_only_to_what_is_below_them",
          [f"{own} needs {', '.join(sorted(symbols))} of {other}" for (own, other), symbols in sorted(upward.items())])
    claim("no_files_of_a_room_refer_to_each_other_in_a_circle", circles(everything, room_of))
    for program in programs:
        parts = list(objects_of_program(program))
        note(f"{len(parts)} objects of a program")
        claim("no_files_of_the_command_refer_to_each_other_in_a_circle",
              circles(parts, lambda name: "") if parts else ["no objects"])
    finish()


main()
