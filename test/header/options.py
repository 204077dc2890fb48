"""Writes wrong values of every member of every options struct: options.py HEADER-FOLDER > options.h

A struct of the list is read from the headers, so that a new member is in the test by itself. Each number, choice and
count gets values that no call accepts: NaN, infinite and negative numbers, bits and choices that there are not, sizes
that memory cannot hold, a count without its array. options.c calls the function that reads the struct.
"""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import re
import sys

STRUCTS = ["kt_run", "kt_simulation_options", "kt_model_options", "kt_linearization_options", "kt_equilibrium_options",
           "kt_floquet_options", "kt_integrator_options", "kt_batch_options", "kt_batch_frame", "kt_batch_sensors", "kt_batch_inputs", "kt_batch_job",
           "kt_step", "kt_rollout", "kt_event", "kt_robot_options", "kt_scene_options", "kt_constraint_formulation_options",
           "kt_dae_options", "kt_variant", "kt_accuracy_options"]

# Values that are right after all: "STRUCT.MEMBER" or "STRUCT.MEMBER VALUE", and why.
ACCEPTED = {
    "kt_robot_options.ground -1.0": "a floor below zero",
    "kt_step.h -1.0": "steps go backwards in time, too",
    "kt_step.t -1.0": "a time before zero",
    "kt_rollout.h -1.0": "steps go backwards in time, too",
    "kt_rollout.t -1.0": "a time before zero",
    "kt_batch_job.h -1.0": "steps go backwards in time, too",
    "kt_batch_frame.marker -1": "the frame of the body itself",
    "kt_run.metric": "for kt_model_options; a simulation does not read it",
    "kt_run.plan": "for kt_model_options; a simulation does not read it",
    "kt_accuracy_options.method_count 1": "the length of the array of the right options",
    "kt_accuracy_options.step_count 1": "the length of the array of the right options",
    "kt_linearization_options.input_count 1": "inputs NULL stands for all",
    "kt_linearization_options.output_count 1": "outputs NULL stands for all",
}

ENUM = r"kt_(isa|metric|plan|structure|formulation|constraint_formulation_type|dae_type|direction|batch_task|robot_inertia)"


def values(kind, count_of):
    if kind == "double":
        return ["(double)NAN", "(double)INFINITY", "-1.0"]
    if kind == "int":
        return ["-1", "INT_MIN"] + (["1"] if count_of else [])
    if kind == "unsigned":
        return ["~0U"]
    if kind == "size_t":
        return ["SIZE_MAX", "SIZE_MAX / 2 + 1", "SIZE_MAX / 16"] + (["1"] if count_of else [])
    if re.fullmatch(ENUM, kind):
        return [f"({kind})99", f"({kind})-1"]
    return []


def members(body):
    body = re.sub(r"/\*.*?\*/", "", body, flags=re.S)
    for declaration in body.split(";"):
        found = re.fullmatch(r"\s*((?:const )?(?:struct )?\w+)\s+(.*)", declaration, flags=re.S)
        if not found or "(" in declaration:
            continue
        for name in found[2].split(","):
            name = name.strip()
            yield ("pointer" if "*" in name else found[1]), name.rsplit("*", 1)[-1].removeprefix("const ").strip()


def main():
    text = "".join(path.read_text() for path in sorted(pathlib.Path(sys.argv[1]).glob("*.h")))
    accepted, rows = set(), []
    for struct in STRUCTS:
        body = re.search(rf"typedef struct {struct} {{(.*?)\n}} {struct};", text, flags=re.S)[1]
        every = list(members(body))
        pointers = {name for kind, name in every if kind == "pointer"}
        for kind, name in every:
            stem = name.removesuffix("_count")
            count_of = name == "count" or (stem != name and bool({stem, stem + "s", stem + "es"} & pointers))
            for value in values(kind, count_of):
                plain = value.replace("(double)", "")
                key = next((k for k in (f"{struct}.{name}", f"{struct}.{name} {plain}") if k in ACCEPTED), None)
                accepted |= {key} if key else set()
                if key is None:
                    rows.append((struct, name, value, count_of and value == "1"))
    if set(ACCEPTED) - accepted:
        raise SystemExit(f"options.py: no such value: {sorted(set(ACCEPTED) - accepted)}")
    for i, (struct, name, value, _) in enumerate(rows):
        print(f"static void spoil_{i}({struct} *options) {{ options->{name} = {value}; }}")
    for struct in STRUCTS:
        print(f"typedef struct wrong_{struct} {{\n    const char *member, *value;\n    void (*spoil)({struct} *);\n}} wrong_{struct};")
        print(f"static const wrong_{struct} wrongs_{struct}[] = {{")
        for i, (owner, name, value, _) in enumerate(rows):
            if owner == struct:
                print(f'    {{"{name}", "{value}", spoil_{i}}},')
        print("};")
    structs = sorted(set(re.findall(r"^typedef struct (kt_\w+) \{", text, flags=re.M)))
    print("#define STRUCT_LIST(X) " + " ".join(f"X({struct})" for struct in structs))
    print("#define SIZED_LIST(X) " + " ".join(f"X({struct})" for struct in structs if struct.endswith("_options")))
    print("#define OPTIONS_LIST(X) " + " ".join(f"X({struct})" for struct in STRUCTS))


main()
