"""Writes hostile calls of every public function: hostile.py HEADER-FOLDER > calls.h

For each function of the headers a C function that calls it, first with arguments that are right, then with one of them
wrong at a time: pointers NULL, arrays with a number that is NaN, infinite or huge, numbers NaN, infinite, negative, zero
or huge, indices and sizes off by one, negative or huge, data of another model. hostile.c has what is right, by type and
name, and judges what comes back.
"""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import re
import sys

folder = pathlib.Path(sys.argv[1])
HEADERS = sorted(path for path in folder.glob("*.h") if path.name not in ("kinetree.h", "experimental.h"))

# What takes long or has arguments of its own; hostile.c calls it by hand, or with NULL alone.
LEFT_OUT = {"kt_error_set"}
# Studies of minutes: with pointers that are NULL alone.
SLOW = {"kt_accuracy_create", "kt_accuracy_measure", "kt_accuracy_measure_baseline"}
# Right arguments by name, where the type does not tell; of one function alone: "function.name".
BY_NAME = {
    "q": "f->q", "end": "f->q", "v": "f->v", "dv": "f->v", "start": "f->q",
    "y": "f->y", "previous_y": "f->y", "history": "f->history",
    "t": "0.0", "t_limit": "1e9", "t_end": "1e9", "period": "0.01", "duration": "1.0", "step": "0.01", "growth": "2.0", "goal": "1e-3", "setting": "0.01",
    "size": "MEMORY", "work_size": "MEMORY", "n": "2", "count": "2", "body": "1", "marker": "0", "loop": "0", "row": "0", "group": "0", "effect": "0",
    "rows": "2", "columns": "2", "column": "0", "mode": "0", "multiplier": "0", "sample": "0", "samples": "2", "index": "0", "rank": "1", "sequence": "123", "axis": "2",
    "which": "0", "stages": "4", "most": "4", "k": "0", "code": "0", "adaptive": "false", "velocity": "0",
    "memory": "f->memory", "work": "f->memory", "block": "f->block", "user": "NULL", "text": "f->text", "path": "\"none.yaml\"",
    "name": "\"gravity\"", "kt_native_use.options": "&f->native_options", "kt_scene_parse.text": "\"kinetree: 1\\n\"", "kt_scene_parse.size": "12", "kt_robot_parse.text": "\"<robot/>\"",
    "kt_robot_parse.size": "8", "kt_method_names.size": "64", "kt_variable_name.size": "64", "kt_base_parameter_name.size": "64", "kt_base_parameter_name.column": "f->column",
    "kt_simulation_restore.block": "f->block", "kt_simulation_set_parameter.values": "f->values", "kt_parameter_set.values": "f->values", "kt_loop_place_here.values": "f->out[0]",
    "kt_body_find.name": "\"none\"", "kt_simulation_advance.t_end": "0.1", "kt_motion_derivatives.t_end": "0.1", "kt_simulation_step.t_limit": "1.0", "kt_integrator_step.t_limit": "1.0",
    "kt_integrator_interpolate.t": "0.0", "kt_integrator_start.t": "0.0", "kt_kinematics_update.a": "f->v", "kt_joint_coordinate_kind.k": "0",
    "kt_function_polynomial.count": "2", "kt_function_table.number_count": "4", "kt_stability_worst.count": "1", "kt_stability_step.count": "1",
    "kt_state_project.q": "f->q_out", "kt_state_project.v": "f->v_out", "kt_state_assemble.q": "f->q_out", "kt_state_assemble.v": "f->v_out",
    "kt_velocity_complete.v": "f->v_out", "kt_velocity_impact.v": "f->v_out", "kt_acceleration_complete.a": "f->v_out", "kt_position_normalize.q": "f->q_out",
    "kt_equilibrium_find.q": "f->q_out", "kt_mass_inverse_apply.x": "f->v_out", "kt_integrator_save.y": "f->out[2]",
    "kt_mass_factor_solve.x": "f->v_out", "kt_mass_factor_multiply.x": "f->v_out", "kt_mass_factor_solve_lower.x": "f->v_out",
    "kt_mass_factor_solve_upper.x": "f->v_out",
    "kt_integrator_save.previous_y": "f->out[0]", "kt_integrator_save.history": "f->out[1]", "kt_integrator_save.memory": "&f->integrator_memory",
    "kt_mass_factor_compute.mass": "f->identity", "kt_mass_inverse_init.rows": "2", "kt_run_method.model": "f->model",
    "kt_simulation_set_parameter.copy": "f->copy", "kt_parameter_set.copy": "f->copy", "kt_integrator_init.size": "MEMORY",
    "kt_batch_set_acceleration.a": "f->v", "kt_batch_step.steps": "2", "kt_batch_step.h": "0.01", "kt_batch_compute_block.thread": "0", "kt_batch_compute_block.block": "0", "kt_batch_run.threads": "1",
    "kt_scene_parse_with.text": "\"kinetree: 1\\n\"", "kt_scene_parse_with.size": "12", "kt_expression_parse.text": "\"1 + x\"", "kt_scene_watch_create.model": "f->copy", "kt_simulation_change.model": "f->copy",
    "kt_rollout_run.threads": "1", "kt_rollout_run.count": "1", "kt_step_run.threads": "1", "kt_step_run.count": "1", "kt_rollout_gradients.count": "1", "kt_rollout_width.why": "(const char *[1]){NULL}", "state": "1", "kt_actuation_evaluate.a": "NULL", "kt_actuation_evaluate.v": "NULL", "kt_reduction_method_of.reduction": "KT_REDUCTION_QR",
}
BY_TYPE = {
    "const kt_model *": "f->model", "kt_model *": "f->copy", "kt_data *": "f->data", "const kt_data *": "f->data",
    "const double *": "f->any", "double": "0.5", "int": "1", "unsigned": "1", "bool": "true", "size_t": "2", "const int *": "f->index", "int *": "f->ints",
    "const kt_wrench *": "NULL", "kt_wrench *": "f->wrench", "kt_reaction_share *": "f->share", "kt_vec3": "(kt_vec3){0.1, 0.2, 0.3}", "kt_vec3 *": "&f->vector", "bool *": "&f->flag",
    "kt_mat3": "kt_mat3_identity()", "kt_mat3 *": "&f->matrix", "kt_quat": "(kt_quat){1.0, 0.0, 0.0, 0.0}", "kt_sym3": "(kt_sym3){1.0, 1.0, 1.0, 0.0, 0.0, 0.0}",
    "kt_complex": "(kt_complex){-1.0, 1.0}", "const kt_complex *": "&f->complex", "kt_sym3 *": "&f->inertia", "kt_error *": "&f->error",
    "const kt_rotation *": "&f->rotation", "const kt_method *": "f->method", "kt_method *": "&f->table", "const kt_stability *": "&f->stability",
    "kt_stability *": "&f->stability_out", "const kt_run *": "&f->run", "const kt_simulation_options *": "NULL", "const kt_model_options *": "NULL",
    "const kt_linearization_options *": "NULL", "const kt_equilibrium_options *": "NULL", "kt_simulation *": "f->simulation",
    "const kt_simulation *": "f->simulation", "kt_integrator *": "f->integrator", "const kt_integrator *": "f->integrator",
    "const kt_integrator_options *": "&f->integrator_options", "const kt_integrator_callbacks *": "&f->callbacks",
    "const kt_integrator_memory *": "&f->integrator_memory", "kt_integrator_memory *": "&f->integrator_memory",
    "kt_mass_factor *": "f->factor", "const kt_mass_factor *": "f->factor", "kt_mass_inverse *": "f->inverse", "kt_linearization *": "f->linearization",
    "const kt_linearization *": "f->linearization", "kt_modes *": "f->modes", "const kt_modes *": "f->modes", "kt_spectrum *": "f->spectrum",
    "const kt_spectrum *": "f->spectrum", "kt_mode_watch *": "f->watch", "const kt_mode_watch *": "f->watch", "const kt_linear_system *": "f->system",
    "kt_energy_watch *": "&f->energy", "const kt_energy_watch *": "&f->energy", "const kt_record *": "&f->record", "kt_record *": "&f->record",
    "const kt_parameter *": "&f->parameter", "kt_parameter *": "&f->parameter_out", "kt_coordinate_list": "(kt_coordinate_list){f->index, f->dofs}",
    "kt_residual *": "&f->residual", "kt_power *": "&f->power", "kt_effect_load *": "&f->load", "kt_contact_load *": "&f->touch", "kt_initial_change *": "f->changes",
    "kt_equilibrium *": "&f->equilibrium", "kt_batch *": "f->batch", "const kt_batch *": "f->batch", "const kt_batch_options *": "&f->batch_options", "const kt_batch_sensors *": "&f->sensors", "kt_data *const *": "f->data_list", "void *const *": "f->memory_list", "kt_rollout_task *": "&f->task", "kt_ensemble *": "f->ensemble", "const kt_ensemble *": "f->ensemble", "kt_ensemble_next *": "next_none", "kt_ensemble_done *": "done", "const kt_step *": "&f->step", "const kt_rollout *": "&f->rollout", "kt_cost *": "cost",
    "const kt_beam *": "&f->beam", "const kt_link_tree *": "&f->tree", "kt_builder *": "f->builder", "const kt_builder *": "f->builder", "const kt_effect *": "&f->effect",
    "kt_report *": "report", "kt_scene_report *": "report_scene", "kt_recorder *": "recorder", "const kt_description *": "&f->description",
    "const kt_body *": "&f->body", "const kt_shape *": "&f->body.shape", "const kt_graph_joint *": "&f->graph_joint", "kt_graph_choice *": "&f->choice", "const kt_joint *": "&f->body.joint", "const kt_loop *": "&f->loop", "const kt_descriptor *": "kt_joint_descriptor(KT_JOINT_REVOLUTE)",
    "kt_mechanism *": "&f->mechanism", "kt_scene *": "&f->scene", "const kt_scene *": "&f->scene", "FILE *": "f->stream", "kt_native *": "&f->native", "const kt_robot_options *": "NULL", "const char *": "\"a\"",
    "char *": "f->text", "kt_absolute *": "f->absolute", "const kt_absolute *": "f->absolute", "kt_absolute_motion *": "f->absolute_motion", "const kt_absolute_motion *": "f->absolute_motion", "kt_simulation_options *": "&f->simulation_options",
    "kt_constraint_formulation *": "f->formulation", "const kt_constraint_formulation *": "f->formulation",
    "const kt_constraint_formulation_options *": "&f->formulation_options", "ptrdiff_t *": "&f->place", "kt_plan_step *": "f->steps",
    "double *": None, "const double **": "&f->slope", "const kt_model **": "&f->switched", "uint64_t": "0", "kt_impact *": "&f->impact", "void *": "f->memory", "const void *": "f->block",
    "kt_robot_lost *": "NULL", "kt_accuracy *": "NULL", "const kt_accuracy *": "NULL", "const kt_accuracy_options *": "NULL", "const kt_variant *": "&f->variant",
    "kt_dae *": "f->dae", "const kt_dae *": "f->dae", "const kt_dae_options *": "&f->dae_options",
    "kt_floquet *": "f->floquet", "const kt_floquet *": "f->floquet", "const kt_floquet_options *": "&f->floquet_options",
    "kt_accuracy_point *": "&f->point", "const kt_accuracy_point *": "&f->point", "const kt_expression *": "f->formula", "const kt_expression **": "&f->formula_out",
    "const kt_function *": "&f->of_time", "const kt_symbols *": "&f->symbols", "kt_loop_motion *": "&f->loop_motion", "const kt_scene_options *": "&f->scene_options",
    "const kt_scene_call *": "&f->scene_call", "kt_scene_watch *": "f->scene_watch", "const kt_scene_watch *": "f->scene_watch", "kt_parameter_change *": "f->parameter_changes", "const kt_event *": "&f->event", "const kt_scene_event *": "&f->scene.until",
    "size_t *": "&f->used", "kt_step_task *": "&f->step_task", "const kt_batch_job *": "&f->job", "kt_accuracy_baseline *": "&f->baseline",
    "const kt_variable *": "&f->variable", "kt_variable *": "&f->variable_out",
}
# Those that names tell more of than the type does.
BASIC = ["int", "size_t", "double", "bool", "const double *", "void *", "const void *", "char *", "const char *"]
OBJECTS = ["kt_model", "kt_data", "kt_mass_factor", "kt_mass_inverse", "kt_simulation", "kt_linearization", "kt_modes", "kt_spectrum", "kt_mode_watch",
           "kt_integrator", "kt_absolute", "kt_absolute_motion", "kt_constraint_formulation", "kt_dae", "kt_floquet", "kt_accuracy", "kt_batch", "kt_ensemble", "kt_builder", "kt_scene_watch"]
# What is wrong in one of the structs above: the fixture's right one, and assignments to a copy of it.
SPOILT = {
    "kt_step_task *": ("step_task", ("q = NULL", "v = NULL", "q = f->no_numbers", "v = f->no_numbers", "step.tau = f->no_numbers", "step.method = NULL", "step.h = (double)NAN")),
    "kt_rollout_task *": ("task", ("q = NULL", "v = NULL", "q = f->no_numbers", "v = f->no_numbers", "rollout.inputs = f->no_numbers", "rollout.method = NULL", "rollout.steps = -1", "rollout.h = (double)NAN")),
    "const kt_batch_job *": ("job", ("task = (kt_batch_task)1000", "task = (kt_batch_task)-1", "task = KT_BATCH_SENSE", "h = (double)NAN", "steps = -1", "inputs = &f->bad_inputs")),
    "const kt_function *": ("of_time", ("type = (kt_function_type)1000", "value = (double)NAN", "type = KT_FUNCTION_SUM", "type = KT_FUNCTION_TABLE", "type = KT_FUNCTION_EXPRESSION", "part_count = -1", "number_count = -1")),
    "const kt_symbols *": ("symbols", ("find = NULL", "list = NULL")),
    "const kt_scene_options *": ("scene_options", ("setting_count = 1", "setting_count = -1", "variable_count = 1", "variable_count = -1")),
    "const kt_event *": ("event", ("function = NULL", "name = NULL", "direction = (kt_direction)1000")),
}
ENUMS = r"kt_(joint|loop|effect|shape|surface|track|function|constraint_formulation|dae)_type|kt_(metric|plan|formulation|reduction|twist_frame|robot_format|status|key_kind|interpolation|effect_quantity|graph_reason)"


def split(parameters):
    depth, part, parts = 0, "", []
    for c in parameters:
        depth += (c == "(") - (c == ")")
        if c == "," and depth == 0:
            parts.append(part.strip())
            part = ""
        else:
            part += c
    return parts + [part.strip()]


def read(header):
    text = re.sub(r"/\*.*?\*/", "", header.read_text(), flags=re.S)
    for declaration in re.findall(r"^KT_API (.*?);", text, flags=re.S | re.M):
        declaration = re.sub(r"\s+", " ", declaration.replace("KT_CHECKED ", ""))
        found = re.match(r"(.*?)\b(kt_\w+)\((.*)\)", declaration)
        result, name, parameters = found[1].strip(), found[2], split(found[3])
        if name in LEFT_OUT:
            continue
        arguments = []
        for p in parameters:
            if p == "void":
                continue
            p = re.match(r"(.*?)(\w+)(\[\d*\])?$", p)
            kind = re.sub(r"\s*(\*+)\s*$", r" \1", p[1]).strip()
            arguments.append((kind + " *" if p[3] else kind, p[2]))
        yield result, name, arguments


def right(function, kind, name, outputs):
    exact = BY_NAME.get(f"{function}.{name}")
    if exact:
        return exact
    if kind == "double *":
        outputs.append(name)
        return f"f->out[{len(outputs) - 1}]"
    if kind.endswith("**") and any(kind.startswith(o) for o in OBJECTS):
        return f"({kind})&f->object"
    if re.fullmatch(ENUMS, kind):
        return f"({kind})1"
    if name in BY_NAME and kind in BASIC and kind.endswith("*") == BY_NAME[name].startswith(("f->", '"', "NULL")):
        return BY_NAME[name]
    if BY_TYPE.get(kind) is not None:
        return BY_TYPE[kind]
    raise SystemExit(f"hostile.py: {function}: no right argument for '{kind}' {name} in BY_TYPE")


def wrong(function, kind, name, value):
    """(what, expression, setup) of each wrong argument."""
    if kind.endswith("*"):
        yield "NULL", "NULL", ""
    if kind in ("const kt_data *", "kt_data *"):
        yield "of another model", "f->other_data", ""
    if kind == "const kt_model *" and function.startswith(("kt_body", "kt_point", "kt_dynamics", "kt_kin", "kt_accel", "kt_loop_", "kt_effect", "kt_parameter")):
        yield "another", "f->other_model", ""
    if kind == "const kt_parameter *":
        yield "of another model", "&f->other_parameter", ""
        yield "of none", "&f->no_parameter", ""
    if kind == "const kt_model *" and function in ("kt_step_run", "kt_rollout_run"):
        yield "another", "f->other_model", ""  # which has auxiliary states
    if kind == "kt_data *const *":
        yield "of another model", "f->other_list", ""
    if kind in ("kt_data *const *", "void *const *"):
        yield "of none", f"({kind})f->no_list", ""
    if kind in SPOILT:
        name_right, assignments = SPOILT[kind]
        for assignment in assignments:
            yield assignment, f"&f->bad_{name_right}", f"f->bad_{name_right} = f->{name_right}; f->bad_{name_right}.{assignment};"
    if kind == "const double *" and value not in ("NULL",):
        for what in ("NAN", "INFINITY", "-INFINITY", "1e308", "-1e160", "1e160"):
            for place in (0, 1):
                yield f"[{place}] = {what}", "f->bad", f"spoil(f, {value}, {place}, (double){what});"
    if kind == "double *" and value in ("f->q_out", "f->v_out"):
        for what in ("NAN", "INFINITY", "1e308", "1e160"):
            yield f"[0] = {what}", value, f"{value}[0] = (double){what};"
    if kind == "double":
        far = name in ("t_end", "period", "duration")  # until then steps would be taken for ever
        for what in ("NAN", "INFINITY", "-INFINITY", "-1.0", "0.0", "1e-320") + (() if far else ("1e308",)):
            yield what, f"(double){what}", ""
    if kind == "kt_vec3":
        yield "NaN", "(kt_vec3){(double)NAN, 0.0, 0.0}", ""
        yield "huge", "(kt_vec3){1e200, 1e308, -1e308}", ""
        yield "zero", "(kt_vec3){0.0, 0.0, 0.0}", ""
    if kind == "kt_complex":
        yield "NaN", "(kt_complex){(double)NAN, 0.0}", ""
        yield "huge", "(kt_complex){1e308, -1e308}", ""
    if kind in ("kt_mat3", "kt_sym3", "kt_quat"):
        yield "NaN", {"kt_mat3": "f->no_matrix", "kt_sym3": "f->no_inertia", "kt_quat": "(kt_quat){(double)NAN, 0.0, 0.0, 0.0}"}[kind], ""
    if kind == "int":
        counts = name in ("columns", "steps", "call_count", "body_count", "joint_count") or function in ("kt_loop_jacobian", "kt_stability_grid", "kt_simulation_change")  # of arrays that the caller has, which nothing tells
        for what in ("-1", "INT_MIN", "0") + (() if counts else ("INT_MAX", "1000", "f->bodies", "f->bodies - 1")):
            yield what, what, ""
    if kind == "size_t" and value == "MEMORY":
        yield "0", "0", ""
        yield "8", "8", ""
    elif kind == "size_t":
        yield "0", "0", ""
        if name == "n":
            yield "huge", "SIZE_MAX", ""
    if kind == "unsigned" or re.fullmatch(ENUMS, kind):
        yield "1000", f"({kind})1000", ""
        yield "-1", f"({kind})-1", ""
    if kind == "uint64_t":
        yield "1", "1", ""
        yield "-1", "UINT64_MAX", ""
    if kind == "kt_coordinate_list":
        for what in ("{NULL, 1}", "{f->index, -1}", "{f->index, INT_MAX}", "{f->bad_index, 1}", "{f->index, 0}"):
            yield what, f"(kt_coordinate_list){what}", ""
    if kind in ("void *", "const void *") and name in ("memory", "work"):
        yield "misaligned", "(char *)f->memory + 8", ""


def write(result, name, arguments):
    outputs = []
    values = [right(name, kind, argument, outputs) for kind, argument in arguments]
    calls = [] if name in SLOW else [("right", values, "")]
    for i, (kind, argument) in enumerate(arguments):
        for what, value, setup in wrong(name, kind, argument, values[i]):
            if name in SLOW and (what != "NULL" or argument in ("options", "error")):
                continue
            calls.append((f"{argument} {what}", values[:i] + [value] + values[i + 1:], setup))
    pointers = [i for i, (kind, _) in enumerate(arguments) if kind.endswith("*")]
    if len(pointers) > 1:
        calls.append(("all pointers NULL", ["NULL" if i in pointers else v for i, v in enumerate(values)], ""))
    print(f"static void call_{name}(fixture *f) {{")
    for what, values, setup in calls:
        call = f"{name}({', '.join(values)})"
        print(f'    begin(f, "{what}");')
        if setup:
            print(f"    {setup}")
        print("    keep(f);")
        if result == "kt_status":
            print(f"    end(f, {call});")
        elif result == "void":
            print(f"    {call};")
        else:
            print(f"    (void){call};")
    print("}\n")


functions = [f for header in HEADERS for f in read(header)]
for function in functions:
    write(*function)
print("static const call calls[] = {")
for _, name, _ in functions:
    print(f'    {{"{name}", call_{name}}},')
print("};")
