"""Man pages and completions tell of every option that the help tells of, and are well formed.

reference.py COMMAND SCENES
"""
# SPDX-License-Identifier: Apache-2.0
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note, skip

COMMAND, SCENES = sys.argv[1:]


def kinetree(*words):
    run = subprocess.run([COMMAND, *words], capture_output=True, text=True)
    claim(f"ends_well: {' '.join(words)}", [run.stderr or f"status {run.returncode}"] if run.returncode or run.stderr else [])
    return run.stdout


def options_of(text):
    """The options that a help shows, with the words that each takes where it names them: {name: words}."""
    shown = re.sub(r"\n {27}", " ", text.partition("\nUsage:")[2])
    found = {}
    for line in shown.splitlines():
        name = re.match(r"  --([\w-]+)( \S+)?", line)
        if not name:
            continue
        words = re.search(r"\(([\w-]+(?:\|[\w-]+)+)\)$", line)
        found[name[1]] = words[1].split("|") if words else []
    return found


def complete(script, folder, *words):
    """What bash offers for the last word."""
    code = f"""
. {script}
COMP_WORDS=("$@")
COMP_CWORD=$(($# - 1))
_kinetree
[ "${{#COMPREPLY[@]}}" -eq 0 ] || printf '%s\\n' "${{COMPREPLY[@]}}"
"""
    run = subprocess.run(["bash", "--norc", "--noprofile", "-c", code, "bash", COMMAND, *words], cwd=folder, capture_output=True, text=True,
                         env={**os.environ, "KINETREE_SCENES": SCENES})
    return run.stdout.split("\n")[:-1] if run.returncode == 0 and not run.stderr else [f"failed: {run.stderr}"]


def offers(name, found, wanted):
    claim(name, [] if sorted(found) == sorted(wanted) else [f"offers {found}, not {wanted}"])


def check_bash(script, subcommands, options):
    with tempfile.TemporaryDirectory() as folder:
        for name in ("four bar.yaml", "five.yaml", "four.csv"):
            (pathlib.Path(folder) / name).touch()
        (pathlib.Path(folder) / "folder").mkdir()
        offers("bash_completes_subcommands", complete(script, folder, ""), subcommands)
        offers("bash_completes_a_subcommand", complete(script, folder, "acc"), ["accuracy"])
        for name, own in options.items():
            missing = {f"--{option}" for option in own} - set(complete(script, folder, name, "--"))
            claim(f"bash_completes_every_option: {name}", sorted(missing))
            for option, words in own.items():
                if words:
                    offers(f"bash_completes_the_words_of: {name} --{option}", complete(script, folder, name, f"--{option}", ""), words)
                    offers(f"bash_completes_after_equals: {name} --{option}",
                           complete(script, folder, name, f"--{option}", "=", words[-1][:-1]),
                           [word for word in words if word.startswith(words[-1][:-1])])
        offers("bash_completes_an_option", complete(script, folder, "run", "five.yaml", "--dur"), ["--duration"])
        offers("bash_completes_scene_files", complete(script, folder, "run", "f"), ["five.yaml", "four bar.yaml", "folder"])
        offers("bash_completes_results", complete(script, folder, "plot", "f"), ["folder", "four.csv"])
        offers("bash_completes_any_file_after_out", complete(script, folder, "run", "--out", "four"), ["four bar.yaml", "four.csv"])
        offers("bash_offers_nothing_for_a_number", complete(script, folder, "run", "--duration", ""), [])
        offers("bash_completes_help_by_subcommands", complete(script, folder, "help", ""), subcommands)
        methods = [line.split()[0] for line in kinetree("integrators").partition("\n\n")[0].splitlines()[1:]]
        claim("there_are_methods", [] if len(methods) > 15 else methods)
        offers("bash_completes_methods", complete(script, folder, "run", "--integrator", ""), methods)
        offers("bash_completes_a_method", complete(script, folder, "stability", "--integrator", "dopr"), ["dopri5"])
        scenes = [path.stem for path in pathlib.Path(SCENES).glob("*.yaml")]
        claim("there_are_bundled_scenes", [] if len(scenes) > 10 else [f"{len(scenes)}"])
        offers("bash_completes_bundled_scenes", complete(script, folder, "demo", ""), scenes)
        offers("bash_completes_a_bundled_scene", complete(script, folder, "demo", "double-pend"),
               [scene for scene in scenes if scene.startswith("double-pend")])


def check_fish(script, reductions):
    """What fish offers, asked without a terminal."""
    if shutil.which("fish") is None:
        skip("fish_completes", "fish is not on this machine")
        return

    def found(line):
        environment = {**os.environ, "KINETREE_SCENES": SCENES, "PATH": f"{pathlib.Path(COMMAND).parent}:{os.environ['PATH']}"}
        run = subprocess.run(["fish", "--no-config", "-c", f"source {script}; complete -C '{line}'"], capture_output=True, text=True,
                             env=environment)
        return [offer.split("\t")[0] for offer in (run.stdout + run.stderr).splitlines()]

    offers("fish_completes_a_subcommand", found("kinetree acc"), ["accuracy"])
    offers("fish_completes_an_option", found("kinetree run five.yaml --dur"), ["--duration"])
    offers("fish_completes_the_words_of_an_option", found("kinetree run --reduction "), reductions)
    offers("fish_completes_a_bundled_scene", found("kinetree demo double-pend"), ["double-pendulum"])


def check_syntax(shell, script):
    """The shell itself reads the script."""
    if shutil.which(shell) is None:
        skip(f"{shell}_reads_its_completion", f"{shell} is not on this machine")
        return
    read = subprocess.run([shell, "-n", script], capture_output=True, text=True)
    claim(f"{shell}_reads_its_completion", [read.stderr or f"status {read.returncode}"] if read.returncode or read.stderr else [])


def check_man(name, text):
    if shutil.which("groff") is None:
        skip(f"groff_warns_of_nothing: {name}", "groff is not on this machine")
        return
    run = subprocess.run(["groff", "-man", "-ww", "-Tascii", "-rLL=80n"], input=text, capture_output=True, text=True)
    claim(f"groff_warns_of_nothing: {name}", run.stderr.splitlines() + ([] if run.stdout.strip() else ["an empty page"]))


def main():
    overview = kinetree("help")
    subcommands = re.findall(r"^  (\w+) +\S", overview.partition("\nUsage:")[2].partition("\nExit status")[0], flags=re.M)
    note(f"{len(subcommands)} subcommands")
    claim("there_are_subcommands", [] if len(subcommands) > 10 and "run" in subcommands else subcommands)
    options = {name: options_of(kinetree(name, "--help")) for name in subcommands}
    options["demo"] |= options["run"]
    claim("there_are_options", [] if sum(map(len, options.values())) > 60 else ["hardly any"])

    page = kinetree("help", "--man")
    check_man("kinetree", page)
    claim("every_subcommand_is_in_the_man_page", [name for name in subcommands if f".B {name}\n" not in page])
    for name in subcommands:
        page = kinetree("help", "--man", name)
        check_man(name, page)
        plain = page.replace("\\-", "-")
        claim(f"man_page_has_its_name: {name}", [] if f"\nkinetree-{name} - " in plain else ["no name"])
        told = set(re.findall(r"^\\fB--([\w-]+)\\fR", plain, flags=re.M))
        own = set(options[name]) - (set(options["run"]) if name == "demo" else set())
        claim(f"every_option_is_in_the_man_page: {name}", sorted(own - told))
        claim(f"every_choice_is_in_the_man_page: {name}",
              [f"{option}: {'|'.join(words)}" for option, words in options[name].items()
               if words and option in own and f"({'|'.join(words)})" not in plain])
        if name == "demo":
            claim("man_page_of_demo_sends_to_that_of_run", [] if ".BR kinetree-run (1)" in plain else ["it does not"])

    with tempfile.TemporaryDirectory() as folder:
        texts = {shell: kinetree("help", "--completion", shell) for shell in ("bash", "zsh", "fish")}
        for shell, text in texts.items():
            script = pathlib.Path(folder) / f"kinetree.{shell}"
            script.write_text(text)
            check_syntax(shell, script)
        check_bash(pathlib.Path(folder) / "kinetree.bash", subcommands, options)
        claim("zsh_and_fish_ask_for_methods", [shell for shell in ("zsh", "fish") if "kinetree integrators" not in texts[shell] or "[SUBCOMMAND" in texts[shell]])
        check_fish(pathlib.Path(folder) / "kinetree.fish", options["run"]["reduction"])
    for name in subcommands:
        part = re.search(rf"^    {name}\)\n(.*?)^        ;;", texts["zsh"], flags=re.S | re.M)
        told = set(re.findall(r"'\*?--([\w-]+)", part[1])) if part else set()
        claim(f"every_option_is_in_the_completion_of_zsh: {name}", sorted(set(options[name]) - told))
        told = set(re.findall(rf"from {name}' -l ([\w-]+) ", texts["fish"]))
        claim(f"every_option_is_in_the_completion_of_fish: {name}", sorted(set(options[name]) - told))
    finish()


main()
