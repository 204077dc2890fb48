"""The sources of `kinetree export --fmu --sources`: compiled by foreign commands, against the binary of the archive.

sources.py COMMAND IMPORTER SOURCE-ROOT COMPILER...

Each compiler builds the binary as the description in the archive says, but without optimisation, unless KT_FMU_OPTIMISED is
set: that takes minutes. The new binary takes the place of the old one in the archive. KT_FMI_SCHEMA names a folder
with the schemas of FMI 3.0.
"""
# SPDX-License-Identifier: Apache-2.0
import math
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree
import zipfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from archive import FIXED, Fmu, differences, fixed_scene, rows, run
from claims import claim, finish, note, skip

EXCHANGED = ["double-pendulum", "four-bar", "arm7"]


def build(fmu, compiler):
    """Compiles sources/ as buildDescription.xml says. Returns the path, or None after the errors have been printed."""
    folder = fmu.folder / "sources"
    configuration = xml.etree.ElementTree.parse(folder / "buildDescription.xml").getroot().find("BuildConfiguration")
    files, out = configuration.find("SourceFileSet"), folder / f"{configuration.get('modelIdentifier')}.so"
    options = files.get("compilerOptions").split() + ([] if os.environ.get("KT_FMU_OPTIMISED") else ["-O0"])
    options += ["-pedantic-errors", "-Wall", "-Wextra", "-Werror", "-Wl,-z,defs", "-fPIC", "-shared"]
    ended = subprocess.run([compiler, *options, *(file.get("name") for file in files.findall("SourceFile")), "-o", out,
                            *(f"-l{library.get('name')}" for library in configuration.findall("Library"))],
                           capture_output=True, text=True, cwd=folder)
    for line in ended.stderr.splitlines()[:20]:
        note(line)
    return out if ended.returncode == 0 else None


def exports(binary):
    _, text, _ = run("readelf", "--dyn-syms", "-W", binary)
    return {line.split()[-1] for line in text.splitlines() if " UND " not in line and " GLOBAL " in line}


def put_into_archive(fmu, binary):
    """Writes the archive again with another binary, and unpacks it again."""
    entry, other = str(fmu.binary.relative_to(fmu.folder)), fmu.archive.with_suffix(".new")
    with zipfile.ZipFile(fmu.archive) as old, zipfile.ZipFile(other, "w") as new:
        for item in old.infolist():
            new.writestr(item, binary.read_bytes() if item.filename == entry else old.read(item))
    other.replace(fmu.archive)
    shutil.rmtree(fmu.folder)
    with zipfile.ZipFile(fmu.archive) as opened:
        opened.extractall(fmu.folder)


def plays(scene, folder, binary):
    """What an FMU computes in the importer, by kind; with another binary if there is one."""
    fmu = Fmu(scene, folder, "--sources")
    if binary is not None:
        put_into_archive(fmu, binary)
    modes = ["cs"] + (["me"] if scene.stem in EXCHANGED else [])
    return {mode: fmu.play(mode) for mode in modes}


def compare(folder, name, binary, shipped):
    """Faults of a binary, with its number of compared values."""
    problems, count = [], 0
    for stem, theirs in shipped.items():
        for mode, (status, text, errors) in plays(folder / f"{stem}.yaml", folder, binary).items():
            found = differences(rows(text), rows(theirs[mode][1])) if status == 0 and theirs[mode][0] == 0 else math.nan
            count += sum(map(len, rows(text)))
            if found != 0.0 or text != theirs[mode][1]:
                problems.append(f"{stem}, {mode}: the largest difference is {found:g} {errors.strip()}")
    note(f"{name}: {len(shipped)} scenes, {count} numbers, {len(problems)} runs with other bits, bound 0")
    return problems + ([] if count > 25000 else [f"only {count} numbers"])


def check_compiler(compiler, folder, plays_of_archive):
    name = re.sub(r"\W", "_", pathlib.Path(compiler).name)
    fmu = Fmu(fixed_scene("arm7", folder), folder, "--sources")
    shipped, binary = exports(fmu.binary), build(fmu, compiler)
    claim(f"{name}_compiles_the_sources_without_warnings", [] if binary else ["it does not compile"])
    if binary is None:
        return
    kept = folder / f"{name}.so"
    shutil.copy(binary, kept)
    found = sorted(exports(kept) ^ shipped)
    note(f"{name}: {kept.stat().st_size / 1e6:.1f} MB, {len(shipped)} functions")
    claim(f"{name}_exports_the_functions_of_the_binary", found + ([] if len(shipped) >= 110 else ["too few functions"]))
    claim(f"{name}_gives_the_bits_of_the_binary", compare(folder, name, kept, plays_of_archive))


def check_schemas(folder):
    """The description of the build has the form of the standard, and FMI 2.0 lists the sources in each interface."""
    schema, xmllint = os.environ.get("KT_FMI_SCHEMA"), shutil.which("xmllint")
    scene, problems = fixed_scene("arm7", folder), []
    lists = []
    for version in (3, 2):
        fmu = Fmu(scene, folder, "--fmi", version, "--sources")
        lists += [[file.get("name") for file in fmu.root.findall(f"{kind}/SourceFiles/File")]
                  for kind in ("ModelExchange", "CoSimulation")]
        if schema and xmllint:
            for file, of in (("fmi3BuildDescription.xsd", fmu.folder / "sources/buildDescription.xml"),
                             ("fmi3ModelDescription.xsd" if version == 3 else "fmi2Merged.xsd", fmu.description)):
                if (pathlib.Path(schema) / file).is_file():
                    status, _, errors = run(xmllint, "--noout", "--schema", pathlib.Path(schema) / file, of)
                    problems += [f"FMI {version}, {file}: {errors}"] if status != 0 else []
                else:
                    skip(f"descriptions_of_fmi_{version}_are_valid", f"KT_FMI_SCHEMA has no {file}")
    expected = [[], [], ["kinetree-fmu.c"], ["kinetree-fmu.c"]]
    claim("interfaces_of_fmi_2_list_the_sources", [] if lists == expected else [str(lists)])
    if schema and xmllint:
        claim("descriptions_of_builds_are_valid", problems)
    else:
        skip("descriptions_of_builds_are_valid", "KT_FMI_SCHEMA names no folder of schemas, or xmllint is absent")


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        check_schemas(folder)
        shipped = {stem: plays(fixed_scene(stem, folder), folder, None) for stem in FIXED}
        for compiler in sys.argv[4:]:
            check_compiler(compiler, folder, shipped)
    finish()


main()
