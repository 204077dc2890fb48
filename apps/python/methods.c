/* Functions of the module that take arrays of numpy, the tick of a simulation, and the iterator of control loops: a
 * call of cffi for each array, and a generator of Python, would take longer than the dynamics.
 *
 * The head of an array is that of PyArrayObject_fields in numpy/ndarraytypes.h. The macros of numpy compile to it, so
 * that it is part of the binary interface of numpy 1 and 2. The headers of numpy are not used: a module that includes
 * them works with one of the two, and Debian 13 has them in a package of their own. Before any other array,
 * kt_python_learn reads one that it knows. If a field differs, all calls take the way through cffi. */
/* SPDX-License-Identifier: Apache-2.0 */
typedef struct kt_python_array {
    PyObject ob_base;
    char *data;
    int rank;
    intptr_t *shape, *strides;
    PyObject *base, *dtype;
    int flags;
} kt_python_array;

enum { KT_PYTHON_CONTIGUOUS = 0x1, KT_PYTHON_ALIGNED = 0x100, KT_PYTHON_WRITEABLE = 0x400 };

static struct {
    PyObject *type, *dtype, *empty; /* numpy.ndarray, the dtype of doubles, numpy.empty; NULL before kt_python_learn */
} kt_python_numpy;

/* learn(ndarray, float64, empty, array of shape (2, 3), its address, its flags): whether the head of arrays is as
 * above. */
static PyObject *kt_python_learn(PyObject *module, PyObject *args) {
    PyObject *type, *dtype, *empty, *known;
    Py_ssize_t address;
    int flags;
    (void)module;
    if (!PyArg_ParseTuple(args, "OOOOni", &type, &dtype, &empty, &known, &address, &flags))
        return NULL;
    const kt_python_array *array = (const kt_python_array *)known;
    if ((PyObject *)Py_TYPE(known) != type || (Py_ssize_t)(intptr_t)array->data != address || array->rank != 2 ||
        array->dtype != dtype || array->flags != flags || array->shape[0] != 2 || array->shape[1] != 3 ||
        array->strides[0] != 24 || array->strides[1] != 8)
        Py_RETURN_FALSE;
    Py_INCREF(type), Py_INCREF(dtype), Py_INCREF(empty);
    kt_python_numpy.type = type, kt_python_numpy.dtype = dtype, kt_python_numpy.empty = empty;
    Py_RETURN_TRUE;
}

/* The doubles of a vector of this length; NULL if the object is something else. */
static double *kt_python_vector(PyObject *object, size_t count, int flags) {
    const kt_python_array *array = (const kt_python_array *)object;
    const int needed = flags | KT_PYTHON_CONTIGUOUS | KT_PYTHON_ALIGNED;
    if ((PyObject *)Py_TYPE(object) != kt_python_numpy.type || array->dtype != kt_python_numpy.dtype ||
        array->rank != 1 || array->shape[0] != (intptr_t)count || (array->flags & needed) != needed)
        return NULL;
    return (double *)(void *)array->data;
}

static const double *kt_python_input(PyObject *object, size_t count, const double *own) {
    return object ? kt_python_vector(object, count, 0) : own;
}

/* ---- dynamics at a state ----------------------------------------------------------------------------------------- */

/* METH_FASTCALL is a part of CPython 3.7 and later, but of the limited interface from 3.10 on only. */
#ifndef METH_FASTCALL
#define METH_FASTCALL 0x0080
#endif

/* The base of the class Data: where its methods find the state and the memory of the engine. */
typedef struct kt_python_evaluator {
    PyObject ob_base;
    const kt_python_data *at; /* NULL before set_up */
    PyObject *shape, *result; /* of results, and the array of accelerations */
    PyObject *owners;         /* of the memory of `at` */
} kt_python_evaluator;

/* The arguments of an evaluation: three inputs by position or by name, two by name. */
enum { KT_PYTHON_Q, KT_PYTHON_V, KT_PYTHON_THIRD, KT_PYTHON_T, KT_PYTHON_OUT, KT_PYTHON_GIVEN };

/* A method with METH_FASTCALL | METH_KEYWORDS. */
typedef PyObject *kt_python_call(PyObject *self, PyObject *const *args, Py_ssize_t count, PyObject *keywords);

/* A method of C: names of its arguments, and the method of Python that converts or rejects all other arguments: those
 * that are no rows of doubles, or no float. */
typedef struct kt_python_method {
    const char *names[KT_PYTHON_GIVEN]; /* NULL: there is no such argument */
    const char *converting;
    PyObject *words[KT_PYTHON_GIVEN]; /* the interned names */
    PyObject *text;                   /* the documentation, in bytes */
    PyMethodDef definition;
} kt_python_method;

enum { KT_PYTHON_FORWARD, KT_PYTHON_INVERSE, KT_PYTHON_TICK, KT_PYTHON_METHODS };

static kt_python_method kt_python_quick[KT_PYTHON_METHODS] = {
    {.names = {"q", "v", "tau", "t", "out"}, .converting = "_convert_forward_dynamics"},
    {.names = {"q", "v", "a", NULL, "out"}, .converting = "_convert_inverse_dynamics"},
    {.converting = "_convert_tick"},
};

/* Puts the arguments into their places; false if Python has to sort them. A place without argument stays NULL. */
static bool kt_python_sort(const kt_python_method *method, PyObject *const *args, Py_ssize_t count, PyObject *keywords,
                           PyObject **given) {
    const Py_ssize_t named = keywords ? PyTuple_Size(keywords) : 0;
    if (count > KT_PYTHON_T)
        return false;
    for (Py_ssize_t i = 0; i < count; i++)
        given[i] = args[i];
    for (Py_ssize_t i = 0; i < named; i++) {
        PyObject *word = PyTuple_GetItem(keywords, i);
        size_t k = 0;
        while (k < KT_PYTHON_GIVEN && method->words[k] != word)
            k++;
        if (k == KT_PYTHON_GIVEN || given[k])
            return false;
        given[k] = args[count + i];
    }
    for (size_t k = 0; k < KT_PYTHON_GIVEN; k++)
        if (given[k] == Py_None)
            given[k] = NULL;
    return true;
}

/* The same call of the method of Python. */
static PyObject *kt_python_convert(const kt_python_method *method, PyObject *self, PyObject *const *args,
                                   Py_ssize_t count, PyObject *keywords) {
    PyObject *call = PyObject_GetAttrString(self, method->converting), *row = PyTuple_New(count);
    PyObject *named = PyDict_New(), *found = NULL;
    bool is_made = call && row && named;
    for (Py_ssize_t i = 0; i < count && is_made; i++) {
        Py_INCREF(args[i]);
        is_made = PyTuple_SetItem(row, i, args[i]) == 0;
    }
    for (Py_ssize_t i = 0; keywords && i < PyTuple_Size(keywords) && is_made; i++)
        is_made = PyDict_SetItem(named, PyTuple_GetItem(keywords, i), args[count + i]) == 0;
    if (is_made)
        found = PyObject_Call(call, row, named);
    Py_XDECREF(call), Py_XDECREF(row), Py_XDECREF(named);
    return found;
}

/* The array for the result, owned by the caller: the given one, that of the state, or a new one. */
static PyObject *kt_python_result(const kt_python_evaluator *self, PyObject *const *given, bool is_inverse) {
    const bool is_in_place = !is_inverse && !given[KT_PYTHON_Q] && !given[KT_PYTHON_V] && !given[KT_PYTHON_THIRD];
    PyObject *out = given[KT_PYTHON_OUT] ? given[KT_PYTHON_OUT] : self->result;
    if (!given[KT_PYTHON_OUT] && !is_in_place)
        return PyObject_CallFunctionObjArgs(kt_python_numpy.empty, self->shape, NULL);
    Py_INCREF(out);
    return out;
}

static PyObject *kt_python_evaluate(PyObject *object, PyObject *const *args, Py_ssize_t count, PyObject *keywords,
                                    bool is_inverse) {
    const kt_python_evaluator *self = (const kt_python_evaluator *)object;
    const kt_python_method *method = &kt_python_quick[is_inverse ? KT_PYTHON_INVERSE : KT_PYTHON_FORWARD];
    const kt_python_data *at = self->at;
    PyObject *given[KT_PYTHON_GIVEN] = {NULL}, *out = NULL;
    if (!at || !kt_python_numpy.type || !kt_python_sort(method, args, count, keywords, given))
        return kt_python_convert(method, object, args, count, keywords);
    const double *q = kt_python_input(given[KT_PYTHON_Q], at->nq, at->q);
    const double *v = kt_python_input(given[KT_PYTHON_V], at->nv, at->v);
    const double *third = kt_python_input(given[KT_PYTHON_THIRD], at->nv, is_inverse ? at->a : at->tau);
    const bool has_time =
        !given[KT_PYTHON_T] || (PyFloat_Check(given[KT_PYTHON_T]) && isfinite(PyFloat_AsDouble(given[KT_PYTHON_T])));
    if (!q || !v || !third || !has_time)
        return kt_python_convert(method, object, args, count, keywords);
    const double t = given[KT_PYTHON_T] ? PyFloat_AsDouble(given[KT_PYTHON_T]) : at->t;
    if (!(out = kt_python_result(self, given, is_inverse)))
        return NULL;
    double *result = kt_python_vector(out, at->nv, KT_PYTHON_WRITEABLE);
    int status = KT_OK;
    if (result) {
        Py_BEGIN_ALLOW_THREADS status =
            is_inverse ? kt_python_inverse(at, q, v, third, result) : kt_python_forward(at, t, q, v, third, result);
        Py_END_ALLOW_THREADS
    }
    if (result && status == KT_OK)
        return out;
    Py_DECREF(out);
    if (!result)
        return kt_python_convert(method, object, args, count, keywords);
    Py_XDECREF(PyObject_CallMethod(object, "_check", "i", status)); /* raises */
    return NULL;
}

static PyObject *kt_python_forward_dynamics(PyObject *self, PyObject *const *args, Py_ssize_t count,
                                            PyObject *keywords) {
    return kt_python_evaluate(self, args, count, keywords, false);
}

static PyObject *kt_python_inverse_dynamics(PyObject *self, PyObject *const *args, Py_ssize_t count,
                                            PyObject *keywords) {
    return kt_python_evaluate(self, args, count, keywords, true);
}

/* The base of the class Simulation: where its method tick finds the simulation. */
typedef struct kt_python_clock {
    PyObject ob_base;
    kt_python_guard *guard; /* NULL before set_up */
    kt_python_loop *loop;
    kt_error *error;
    PyObject *owners; /* of these three */
} kt_python_clock;

static PyObject *kt_python_clock_tick(PyObject *object, PyObject *const *args, Py_ssize_t count, PyObject *keywords) {
    const kt_python_clock *self = (const kt_python_clock *)object;
    int status;
    if (!self->guard || count != 1 || keywords || !PyFloat_Check(args[0]))
        return kt_python_convert(&kt_python_quick[KT_PYTHON_TICK], object, args, count, keywords);
    const double period = PyFloat_AsDouble(args[0]);
    Py_BEGIN_ALLOW_THREADS status = kt_python_tick(self->guard, self->loop, period, self->error);
    Py_END_ALLOW_THREADS if (status != KT_OK) return PyObject_CallMethod(object, "_check", "i",
                                                                         status); /* raises, or warns */
    Py_RETURN_NONE;
}

/* quicken(class, name, documentation): the method of C of this name, for a class that extends Evaluator or Clock. */
static PyObject *kt_python_quicken(PyObject *module, PyObject *args) {
    static const char *const names[KT_PYTHON_METHODS] = {"forward_dynamics", "inverse_dynamics", "tick"};
    static kt_python_call *const functions[KT_PYTHON_METHODS] = {kt_python_forward_dynamics, kt_python_inverse_dynamics,
                                                                 kt_python_clock_tick};
    PyObject *type, *text;
    const char *name;
    size_t i = 0;
    (void)module;
    if (!PyArg_ParseTuple(args, "OsS", &type, &name, &text))
        return NULL;
    while (i < KT_PYTHON_METHODS && strcmp(name, names[i]) != 0)
        i++;
    if (i == KT_PYTHON_METHODS || kt_python_quick[i].text)
        return PyErr_Format(PyExc_ValueError, "'%s' has been made, or cannot be made", name);
    kt_python_method *method = &kt_python_quick[i];
    for (size_t k = 0; k < KT_PYTHON_GIVEN; k++)
        if (method->names[k] && !(method->words[k] = PyUnicode_InternFromString(method->names[k])))
            return NULL;
    Py_INCREF(text);
    method->text = text;
    method->definition.ml_name = names[i];
    method->definition.ml_meth = (PyCFunction)(void (*)(void))functions[i];
    method->definition.ml_flags = METH_FASTCALL | METH_KEYWORDS;
    method->definition.ml_doc = PyBytes_AsString(text);
    return PyDescr_NewMethod((PyTypeObject *)type, &method->definition);
}

/* set_up(address of kt_python_data, shape, array of accelerations, owners) of an Evaluator, once. */
static PyObject *kt_python_evaluator_set_up(PyObject *object, PyObject *args) {
    kt_python_evaluator *self = (kt_python_evaluator *)object;
    PyObject *shape, *result, *owners;
    Py_ssize_t address;
    if (!PyArg_ParseTuple(args, "nOOO", &address, &shape, &result, &owners))
        return NULL;
    if (self->at)
        return PyErr_Format(PyExc_ValueError, "it is set up");
    Py_INCREF(shape), Py_INCREF(result), Py_INCREF(owners);
    self->shape = shape, self->result = result, self->owners = owners;
    self->at = (const kt_python_data *)(intptr_t)address;
    Py_RETURN_NONE;
}

static void kt_python_evaluator_free(PyObject *object) {
    kt_python_evaluator *self = (kt_python_evaluator *)object;
    PyTypeObject *type = Py_TYPE(object);
    Py_XDECREF(self->shape), Py_XDECREF(self->result), Py_XDECREF(self->owners);
    ((freefunc)PyType_GetSlot(type, Py_tp_free))(object);
    Py_DECREF(type);
}

static PyMethodDef kt_python_evaluator_methods[] = {{"_set_up", kt_python_evaluator_set_up, METH_VARARGS, NULL},
                                                    {NULL, NULL, 0, NULL}};

static PyType_Slot kt_python_evaluator_slots[] = {
    {Py_tp_dealloc, (void *)kt_python_evaluator_free}, {Py_tp_methods, kt_python_evaluator_methods}, {0, NULL}};

static PyType_Spec kt_python_evaluator_spec = {"kinetree.Evaluator", sizeof(kt_python_evaluator), 0,
                                               Py_TPFLAGS_DEFAULT | Py_TPFLAGS_BASETYPE, kt_python_evaluator_slots};

/* set_up(addresses of the guard, the loop and the error, their owners) of a Clock, once. */
static PyObject *kt_python_clock_set_up(PyObject *object, PyObject *args) {
    kt_python_clock *self = (kt_python_clock *)object;
    PyObject *owners;
    Py_ssize_t guard, loop, error;
    if (!PyArg_ParseTuple(args, "nnnO", &guard, &loop, &error, &owners))
        return NULL;
    if (self->guard)
        return PyErr_Format(PyExc_ValueError, "it is set up");
    Py_INCREF(owners);
    self->owners = owners;
    self->loop = (kt_python_loop *)(intptr_t)loop;
    self->error = (kt_error *)(intptr_t)error;
    self->guard = (kt_python_guard *)(intptr_t)guard;
    Py_RETURN_NONE;
}

static void kt_python_clock_free(PyObject *object) {
    PyTypeObject *type = Py_TYPE(object);
    Py_XDECREF(((kt_python_clock *)object)->owners);
    ((freefunc)PyType_GetSlot(type, Py_tp_free))(object);
    Py_DECREF(type);
}

static PyMethodDef kt_python_clock_methods[] = {{"_set_up", kt_python_clock_set_up, METH_VARARGS, NULL},
                                                {NULL, NULL, 0, NULL}};

static PyType_Slot kt_python_clock_slots[] = {
    {Py_tp_dealloc, (void *)kt_python_clock_free}, {Py_tp_methods, kt_python_clock_methods}, {0, NULL}};

static PyType_Spec kt_python_clock_spec = {"kinetree.Clock", sizeof(kt_python_clock), 0,
                                           Py_TPFLAGS_DEFAULT | Py_TPFLAGS_BASETYPE, kt_python_clock_slots};

/* ---- guards ------------------------------------------------------------------------------------------------------ */

/* The base of the class Guard. Python runs handlers of signals between two operations of its own. If `__enter__` and
 * `__exit__` were functions of Python, a KeyboardInterrupt could end one of them while the guard is held, and nothing
 * would release the guard. */
typedef struct kt_python_lock_object {
    PyObject ob_base;
    kt_python_guard *guard; /* belongs to the class Guard; NULL before hold */
} kt_python_lock_object;

static PyObject *kt_python_lock_hold(PyObject *object, PyObject *args) {
    Py_ssize_t address;
    if (!PyArg_ParseTuple(args, "n", &address))
        return NULL;
    ((kt_python_lock_object *)object)->guard = (kt_python_guard *)(intptr_t)address;
    Py_RETURN_NONE;
}

/* If the guard is held, the method `_reject` raises Busy. */
static PyObject *kt_python_lock_enter(PyObject *object, PyObject *none) {
    kt_python_guard *guard = ((kt_python_lock_object *)object)->guard;
    (void)none;
    if (!guard || !kt_python_lock(guard))
        return PyObject_CallMethod(object, "_reject", NULL);
    Py_RETURN_NONE;
}

static PyObject *kt_python_lock_exit(PyObject *object, PyObject *args) {
    kt_python_guard *guard = ((kt_python_lock_object *)object)->guard;
    (void)args;
    if (guard)
        kt_python_unlock(guard);
    Py_RETURN_NONE;
}

static PyMethodDef kt_python_lock_methods[] = {{"_hold", kt_python_lock_hold, METH_VARARGS, NULL},
                                               {"__enter__", kt_python_lock_enter, METH_NOARGS, NULL},
                                               {"__exit__", kt_python_lock_exit, METH_VARARGS, NULL},
                                               {NULL, NULL, 0, NULL}};

static void kt_python_lock_free(PyObject *object) {
    PyTypeObject *type = Py_TYPE(object);
    ((freefunc)PyType_GetSlot(type, Py_tp_free))(object);
    Py_DECREF(type);
}

static PyType_Slot kt_python_lock_slots[] = {
    {Py_tp_dealloc, (void *)kt_python_lock_free}, {Py_tp_methods, kt_python_lock_methods}, {0, NULL}};

static PyType_Spec kt_python_lock_spec = {"kinetree.Lock", sizeof(kt_python_lock_object), 0,
                                          Py_TPFLAGS_DEFAULT | Py_TPFLAGS_BASETYPE, kt_python_lock_slots};

/* ---- control loops ----------------------------------------------------------------------------------------------- */

/* Yields the simulation before each period, and then advances it. */
typedef struct kt_python_turns {
    PyObject ob_base;
    PyObject *simulation; /* owns all that follows; NULL if a program made this object by its type */
    kt_python_guard *guard;
    kt_python_loop *loop;
    kt_error *error;
    double period, end;
    bool has_begun, has_ended;
} kt_python_turns;

static PyObject *kt_python_turns_type;

/* The end of the loop. A fault becomes the exception that Simulation._check raises; the regular end has warnings. */
static PyObject *kt_python_turns_stop(kt_python_turns *turns, int status) {
    turns->has_ended = true;
    Py_XDECREF(status != KT_PYTHON_ENDED ? PyObject_CallMethod(turns->simulation, "_check", "i", status)
                                         : PyObject_CallMethod(turns->simulation, "_warn", NULL));
    return NULL;
}

/* The warnings of a turn. If the program turned them into exceptions, the loop ends, and the status is an error. */
static int kt_python_turns_warn(kt_python_turns *turns) {
    PyObject *none = PyObject_CallMethod(turns->simulation, "_warn", NULL);
    Py_XDECREF(none);
    return none ? kt_python_has_ended(turns->loop, turns->end) ? KT_PYTHON_ENDED : KT_OK : KT_PYTHON_WARNED;
}

static PyObject *kt_python_turns_next(PyObject *self) {
    kt_python_turns *turns = (kt_python_turns *)self;
    int status = KT_OK;
    if (!turns->simulation || turns->has_ended)
        return NULL;
    if (turns->has_begun) {
        Py_BEGIN_ALLOW_THREADS status =
            kt_python_turn(turns->guard, turns->loop, turns->period, turns->end, turns->error);
        Py_END_ALLOW_THREADS
    } else if (kt_python_has_ended(turns->loop, turns->end))
        status = KT_PYTHON_ENDED;
    turns->has_begun = true;
    if (status == KT_PYTHON_WARNED && (status = kt_python_turns_warn(turns)) == KT_PYTHON_WARNED) {
        turns->has_ended = true;
        return NULL;
    }
    if (status != KT_OK)
        return kt_python_turns_stop(turns, status);
    Py_INCREF(turns->simulation);
    return turns->simulation;
}

/* For the collector: a program may keep the loop in an object that the simulation owns, such as an action. */
static int kt_python_turns_traverse(PyObject *self, visitproc visit, void *arg) {
    Py_VISIT(((kt_python_turns *)self)->simulation);
    return 0;
}

static int kt_python_turns_clear(PyObject *self) {
    Py_CLEAR(((kt_python_turns *)self)->simulation);
    return 0;
}

static void kt_python_turns_free(PyObject *self) {
    PyTypeObject *type = Py_TYPE(self);
    PyObject_GC_UnTrack(self);
    Py_XDECREF(((kt_python_turns *)self)->simulation);
    ((freefunc)PyType_GetSlot(type, Py_tp_free))(self);
    Py_DECREF(type);
}

/* turns(simulation, addresses of its guard, loop and error, period, end): the iterator. */
static PyObject *kt_python_turns_new(PyObject *module, PyObject *args) {
    PyObject *simulation;
    Py_ssize_t guard, loop, error;
    double period, end;
    (void)module;
    if (!PyArg_ParseTuple(args, "Onnndd", &simulation, &guard, &loop, &error, &period, &end))
        return NULL;
    PyObject *made = PyType_GenericAlloc((PyTypeObject *)kt_python_turns_type, 0);
    kt_python_turns *turns = (kt_python_turns *)made;
    if (!made)
        return NULL;
    Py_INCREF(simulation);
    turns->simulation = simulation;
    turns->guard = (kt_python_guard *)(intptr_t)guard;
    turns->loop = (kt_python_loop *)(intptr_t)loop;
    turns->error = (kt_error *)(intptr_t)error;
    turns->period = period, turns->end = end;
    return made;
}

/* ---- the module -------------------------------------------------------------------------------------------------- */

static PyMethodDef kt_python_methods[] = {{"learn", kt_python_learn, METH_VARARGS, NULL},
                                          {"quicken", kt_python_quicken, METH_VARARGS, NULL},
                                          {"turns", kt_python_turns_new, METH_VARARGS, NULL},
                                          {NULL, NULL, 0, NULL}};

static PyType_Slot kt_python_turns_slots[] = {
    {Py_tp_dealloc, (void *)kt_python_turns_free},  {Py_tp_traverse, (void *)kt_python_turns_traverse},
    {Py_tp_clear, (void *)kt_python_turns_clear},   {Py_tp_iter, (void *)PyObject_SelfIter},
    {Py_tp_iternext, (void *)kt_python_turns_next}, {0, NULL}};

static PyType_Spec kt_python_turns_spec = {"kinetree.Turns", sizeof(kt_python_turns), 0,
                                           Py_TPFLAGS_DEFAULT | Py_TPFLAGS_HAVE_GC, kt_python_turns_slots};

/* Adds the functions to the module that cffi made. */
static PyObject *kt_python_module(PyObject *module) {
    if (!module || PyModule_AddFunctions(module, kt_python_methods) != 0)
        return NULL;
    PyObject *evaluator = PyType_FromSpec(&kt_python_evaluator_spec), *lock = PyType_FromSpec(&kt_python_lock_spec);
    PyObject *clock = PyType_FromSpec(&kt_python_clock_spec);
    kt_python_turns_type = PyType_FromSpec(&kt_python_turns_spec);
    return evaluator && lock && clock && kt_python_turns_type &&
                   PyModule_AddObject(module, "Evaluator", evaluator) == 0 &&
                   PyModule_AddObject(module, "Lock", lock) == 0 && PyModule_AddObject(module, "Clock", clock) == 0
               ? module
               : NULL;
}
