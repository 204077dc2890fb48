"""Write the C source of the extension module `_kinetree` from the public headers.

declarations.py INCLUDE-DIRECTORY CALLS.c METHODS.c OUTPUT.c DEPENDENCIES.d C-COMPILER...

cffi compiles one wrapper for each public function (API mode). The declarations are those of the headers themselves, as the
preprocessor leaves them: a new public function needs no line here.
"""
# SPDX-License-Identifier: Apache-2.0
import os
import pathlib
import re
import subprocess
import sys

HEADER = "#include <kinetree/experimental.h>\n#include <kinetree/kinetree.h>\n"
WATCH = '#include "advice/driven.h"\n'  # of apps/kinetree

# Functions of Python that C calls (callbacks.py).
CALLBACKS = """
extern "Python" {
    void kt_python_report(void *user, const kt_error *fault);
    int kt_python_recorder(const kt_record *record, void *user);
    bool kt_python_ensemble_next(void *user, bool may_block, kt_ensemble_member *member);
    void kt_python_ensemble_done(void *user, const kt_ensemble_member *member, kt_status status, const kt_error *error);
    int kt_python_event_value(const kt_instant *at, double *value, kt_error *error, void *user);
    int kt_python_event_action(kt_simulation *simulation, const kt_occurrence *what, kt_error *error, void *user);
    int kt_python_cost(const kt_cost_point *at, double *value, double *by_state, double *by_tau, void *user);
    int kt_python_control_law(void *user, double t, const double *q, const double *v, double *tau);
    int kt_python_joint_force(void *user, double t, double q, double v, double *force, kt_effect_balance *balance);
    int kt_python_wrench(void *user, double t, const kt_effect_end *ends, kt_wrench *wrenches, kt_effect_balance *balance);
}
"""

# One thread at a time may use an object. Memory of zeros is a guard that nobody holds.
GUARD = """
#include <stdatomic.h>
typedef struct kt_python_guard {
    atomic_flag is_held;
} kt_python_guard;
"""

# Types of calls.c that Python fills.
TYPES = """
/* Beside kt_status: another thread uses the object; a loop has ended; the step is done, and there are warnings. */
enum { KT_PYTHON_BUSY = -1, KT_PYTHON_ENDED = -2, KT_PYTHON_WARNED = -3 };

typedef struct kt_python_data {
    kt_python_guard *guard;
    const kt_model *model;
    kt_data *data;
    kt_error *error;
    size_t nq, nv;
    double *q, *v, *tau, *a; /* its own arrays */
    double t;                /* its own time, s */
    bool *has_a;             /* whether a call has computed `a` */
} kt_python_data;

typedef struct kt_python_records {
    double *rows;          /* count rows of `width` numbers: time, q, v, x, tau */
    size_t count, room, width;
    double interval, next; /* s; the time of the next record */
    bool is_short;         /* memory did not suffice */
    size_t names;          /* number of events of the simulation; 0: their times are not noted */
    uint64_t *seen;        /* how often each has happened */
    double *events;        /* event_count pairs: time, s, and the index of the event */
    size_t event_count, event_room;
} kt_python_records;

typedef struct kt_python_loop {
    kt_simulation *simulation;
    double *torque, *applied; /* nv: to be set before the next step; as the simulation has them */
    size_t nv;
    kt_driven *watch;
    kt_python_records *records; /* NULL: none */
} kt_python_loop;

typedef int kt_python_law(void *user, double t, const double *q, const double *v, double *tau);

typedef struct kt_python_feedback {
    const kt_model *model;
    size_t nv;
    double *gain, *q, *v, *torque, *error; /* nv x 2 nv by rows; nq; nv; nv; 2 nv, of the last call */
} kt_python_feedback;

typedef struct kt_python_rows {
    size_t states, nq, nv, nx;
    double t;
    double *q, *v, *tau, *a, *x;
} kt_python_rows;
"""
DRIVEN = """
typedef struct kt_driven kt_driven;
kt_driven *kt_driven_create(const kt_scene *scene, const kt_model *model, const kt_run *run, kt_simulation *simulation,
                            kt_scene_watch *events, bool calls);
void kt_driven_free(kt_driven *driven);
void kt_driven_begin(kt_driven *driven);
void kt_driven_supply(kt_driven *driven);
void kt_driven_record(kt_driven *driven, const kt_record *record);
void kt_driven_restart(kt_driven *driven);
char *kt_driven_warnings(kt_driven *driven, size_t from);
void kt_driven_text_free(char *text);
"""
CALLS = """
int kt_python_forward(const kt_python_data *at, double t, const double *q, const double *v, const double *tau, double *a);
int kt_python_inverse(const kt_python_data *at, const double *q, const double *v, const double *a, double *tau);
void kt_python_take_record(kt_python_loop *loop);
void kt_python_records_free(kt_python_records *records);
kt_status kt_python_apply(kt_python_loop *loop, kt_error *error);
int kt_python_step(kt_python_guard *guard, kt_python_loop *loop, double limit, kt_error *error);
int kt_python_advance(kt_python_guard *guard, kt_python_loop *loop, double end, kt_error *error);
int kt_python_tick(kt_python_guard *guard, kt_python_loop *loop, double period, kt_error *error);
bool kt_python_has_ended(const kt_python_loop *loop, double end);
int kt_python_turn(kt_python_guard *guard, kt_python_loop *loop, double period, double end, kt_error *error);
int kt_python_feedback_law(void *user, double t, const double *q, const double *v, double *tau);
void kt_python_feed_back(kt_python_feedback *feedback, kt_python_loop *loop);
int kt_python_control(kt_python_loop *loop, kt_python_law *law, void *user, double period, double end, kt_error *error);
void kt_python_batch_set(kt_batch *batch, const kt_python_rows *rows);
void kt_python_batch_get(kt_batch *batch, const kt_python_rows *rows);
"""

# The module is that of cffi with the functions of methods.c.
RENAMED = "#define PyInit__kinetree kt_python_cffi_module\n"
ENTRY = """
#undef PyInit__kinetree
PyMODINIT_FUNC PyInit__kinetree(void) {
    return kt_python_module(kt_python_cffi_module());
}
"""


def preprocessed(include, compiler):
    """The text of the public headers without that of others."""
    command = [*compiler, "-E", "-std=c17", f"-I{include}", "-x", "c", "-"]
    text = subprocess.run(command, input=HEADER, capture_output=True, text=True, check=True, env={**os.environ, "LC_ALL": "C"}).stdout
    kept, ours = [], False
    for line in text.splitlines():
        marker = re.match(r'# \d+ "(.*?)"', line)
        if marker:
            ours = "/kinetree/" in marker[1]
        elif ours:
            kept.append(line)
    return "\n".join(kept)


def without_bodies(text):
    """Inline functions become declarations: the compiler has their bodies from the headers."""
    out, at = [], 0
    for found in re.finditer(r"^static inline ([^;{]*?\))\s*\{", text, flags=re.M):
        if found.start() < at:
            continue
        depth, end = 1, found.end()
        while depth:
            depth += {"{": 1, "}": -1}.get(text[end], 0)
            end += 1
        out += [text[at:found.start()], found[1] + ";"]
        at = end
    return "".join(out + [text[at:]])


def attributes_removed(text):
    text = re.sub(r"__attribute__\s*\(\((?:[^()]|\([^()]*\))*\)\)", "", text)
    text = re.sub(r"_Static_assert\s*\((?:[^()]|\([^()]*\))*\)\s*;", "", text)
    return text.replace("_Bool", "bool").replace("_Noreturn", "")


def declarations(include, compiler):
    return attributes_removed(without_bodies(preprocessed(include, compiler)))


def builder(include, compiler):
    import cffi
    ffi = cffi.FFI()
    ffi.cdef(declarations(include, compiler))
    ffi.cdef("typedef struct kt_python_guard { ...; } kt_python_guard;" + DRIVEN + TYPES + CALLBACKS + CALLS)
    return ffi


def functions(ffi):
    """Names of all public functions."""
    return sorted(key.split()[1] for key in ffi._parser._declarations if key.startswith("function kt_") and "python" not in key and "driven" not in key)


def main():
    include, calls, methods, output, dependencies, *compiler = sys.argv[1:]
    ffi = builder(include, compiler)
    source = RENAMED + HEADER + WATCH + GUARD + TYPES + pathlib.Path(calls).read_text() + pathlib.Path(methods).read_text()
    ffi.set_source("kinetree._kinetree", source, py_limited_api=True)
    ffi.emit_c_code(output)
    with open(output, "a", encoding="utf8") as file:
        file.write(ENTRY)
    read = [*sorted(pathlib.Path(include).glob("kinetree/*.h")), calls, methods, __file__]
    pathlib.Path(dependencies).write_text(f"{output}: {' '.join(map(str, read))}\n")


if __name__ == "__main__":
    main()
