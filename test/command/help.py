"""Help texts: examples lead, lines fit a terminal, each option begins with a verb, and groups and lists are complete.

help.py COMMAND
"""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import re
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

COMMAND, WIDTH = sys.argv[1], 100
VERBS = set("""add allow attach check choose compare compute continue count draw end estimate export find follow give join let limit linearise list
make measure place play print read record replace run seed set show simulate start study take treat use vary write""".split())


def kinetree(*words):
    return subprocess.run([COMMAND, *words], capture_output=True, text=True)


def main():
    overview = kinetree("--help").stdout
    rows = re.findall(r"^  ([a-z]+) +(\w+) [^\n]*$", overview.partition("Usage:")[2].partition("Exit")[0], flags=re.M)
    names = [name for name, _ in rows]
    helps = {name: kinetree(name, "--help").stdout for name in names}
    described = re.findall(r"^complete -c kinetree -n '__fish_seen_subcommand_from (\w+)' -l ([\w-]+).* -d '(\w+)",
                           kinetree("help", "--completion", "fish").stdout, flags=re.M)
    note(f"{len(names)} subcommands, {len(described)} options")
    claim("subcommands_and_options_are_there", [] if len(names) > 15 and len(described) > 100 else [f"{len(names)}, {len(described)}"])
    claim("subcommands_begin_with_a_verb", [f"{name}: {word}" for name, word in rows if word not in VERBS])
    claim("options_begin_with_a_verb", [f"{name} --{option}: {word}" for name, option, word in described if word not in VERBS])
    claim(f"lines_have_at_most_{WIDTH}_columns",
          [f"{name}: {line}" for name, text in {"": overview, **helps}.items() for line in text.splitlines() if len(line) > WIDTH])
    claim("examples_come_first", [name for name, text in helps.items() if not text.startswith(f"Examples\n  kinetree {name}")])
    helps["demo"] += helps["run"]  # whose options demo accepts, too
    claim("help_shows_each_option_once", [f"{name} --{option}" for name, option, _ in described
                                          if len(re.findall(rf"^  --{option}\b(?!-)", helps[name], flags=re.M)) != 1])

    takes = set(re.findall(r"^complete -c kinetree -n '__fish_seen_subcommand_from (\w+)' -l ([\w-]+) (?:-r|-x) ",
                           kinetree("help", "--completion", "fish").stdout, flags=re.M))
    calls = [call.split() for text in helps.values() for call in re.findall(r"(?:^  |[|&] )(kinetree [^|&>]*?)(?=$|   | [|&>])", text.partition("Usage:")[0], flags=re.M)]
    options = [(call[1], word[2:].partition("=")[0], (call + ["--"])[i + 1], word) for call in calls for i, word in enumerate(call) if word.startswith("--")]
    known = {(name, option) for name, option, _ in described} | {("demo", option) for name, option, _ in described if name == "run"}
    note(f"{len(calls)} examples, {len(options)} options in them, {len(takes)} options with a value")
    claim("options_of_examples_are_known", [f"{name} --{option}" for name, option, *_ in options if (name, option) not in known and option != "version"])
    claim("options_of_examples_have_their_values", [f"{name} --{option} {after}" for name, option, after, word in options
                                                    if (name, option) in takes and "=" not in word and after.startswith("--")])
    claim("there_are_examples_with_options", [] if len(options) > 50 and len(takes) > 80 else [f"{len(options)}, {len(takes)}"])
    told = kinetree("import", "arm.urdf", "--mass", "hand").stderr
    claim("a_mass_without_a_link_is_no_path", [] if "takes LINK=MASS, not 'hand'" in told else [told])

    run = helps["run"]
    headings = re.findall(r"^([A-Z]\w+)\n  --(\S+)", run, flags=re.M)
    expected = [("Input", "set"), ("Method", "duration"), ("Output", "interval"), ("Recovery", "checkpoint")]
    claim("options_of_run_are_grouped", [] if headings == expected else [str(headings)])
    man = re.findall(r"^\.SS (\w+)$", kinetree("help", "--man", "run").stdout, flags=re.M)
    claim("man_page_of_run_has_the_groups", [] if man == [title for title, _ in expected] else [str(man)])

    scene = kinetree("make", "pendulum").stdout
    rejection = subprocess.run([COMMAND, "run", "-", "--record", "nothing"], input=scene, capture_output=True, text=True).stderr
    recorded = re.sub(r"(;.*)?\s*$", "", rejection.partition("there are ")[2], flags=re.S).split(", ")
    shown = re.sub(r"\s+", " ", re.search(r"--record A,B (.*?)\n  --", run, flags=re.S)[1])
    note(f"--record: {len(recorded)} quantities")
    claim("quantities_to_record_are_known", [] if len(recorded) > 12 else [rejection])
    claim("help_of_run_lists_each_quantity", [word for word in recorded if f" {word}," not in shown])

    header = (pathlib.Path(__file__).resolve().parents[2] / "include/kinetree/codegen.h").read_text()
    functions = re.findall(r"X\(KT_CODEGEN_\w+, (\w+),", header)
    listed = re.search(r"The\s+functions\s+are\s+(.*?)\.", helps["export"], flags=re.S)[1]
    note(f"--functions: {len(functions)} functions")
    claim("functions_of_generated_c_are_known", [] if len(functions) > 15 else [str(functions)])
    claim("help_of_export_lists_each_function", [word for word in functions if not re.search(rf"\b{word}\b", listed)])
    finish()


main()
