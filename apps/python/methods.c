/* Functions of the module that take arrays of numpy, and the iterator of control loops: a call of cffi for each array,
 * and a generator of Python, would take longer than the dynamics.
 *
 * The head of an array is that of PyArrayObject_fields in numpy/ndarraytypes.h. The macros of numpy compile to it, so
 * that it is part of the binary interface of numpy 1 and 2. The headers of numpy are not used: a module that includes
 * them works with one of the two, and Debian 13 has them in a package of their own. Before any other array,
 * kt_python_learn reads one that it knows. If a field differs, all calls take the way through cffi. */
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
    return object == Py_None ? own : kt_python_vector(object, count, 0);
}

/* ---- dynamics at a state ----------------------------------------------------------------------------------------- */

/* What a function is bound to: the address of its kt_python_data, the shape of results, the array of accelerations, and
 * owners of the memory. */
enum { KT_PYTHON_BOUND_DATA, KT_PYTHON_BOUND_SHAPE, KT_PYTHON_BOUND_RESULT };

/* f(t, q, v, tau or a, out): the result; a status if the call failed; None if an array has to be converted or
 * rejected. */
static PyObject *kt_python_evaluate(PyObject *bound, PyObject *args, bool is_inverse) {
    const kt_python_data *at = PyCapsule_GetPointer(PyTuple_GetItem(bound, KT_PYTHON_BOUND_DATA), NULL);
    PyObject *t, *given[3], *out;
    if (!at || !PyArg_UnpackTuple(args, "evaluate", 5, 5, &t, given, given + 1, given + 2, &out))
        return NULL;
    const double time = PyFloat_AsDouble(t);
    if (time == -1.0 && PyErr_Occurred())
        return NULL;
    const double *q = kt_python_input(given[0], at->nq, at->q), *v = kt_python_input(given[1], at->nv, at->v);
    const double *third = kt_python_input(given[2], at->nv, is_inverse ? at->a : at->tau);
    if (!kt_python_numpy.type || !q || !v || !third)
        Py_RETURN_NONE;
    const bool is_in_place = !is_inverse && given[0] == Py_None && given[1] == Py_None && given[2] == Py_None;
    if (out != Py_None || is_in_place) {
        out = out == Py_None ? PyTuple_GetItem(bound, KT_PYTHON_BOUND_RESULT) : out;
        Py_INCREF(out);
    } else if (!(out = PyObject_CallFunctionObjArgs(kt_python_numpy.empty,
                                                    PyTuple_GetItem(bound, KT_PYTHON_BOUND_SHAPE), NULL)))
        return NULL;
    double *result = kt_python_vector(out, at->nv, KT_PYTHON_WRITEABLE);
    int status = KT_OK;
    if (result) {
        Py_BEGIN_ALLOW_THREADS status =
            is_inverse ? kt_python_inverse(at, q, v, third, result) : kt_python_forward(at, time, q, v, third, result);
        Py_END_ALLOW_THREADS
    }
    if (result && status == KT_OK)
        return out;
    Py_DECREF(out);
    if (result)
        return PyLong_FromLong(status);
    Py_RETURN_NONE;
}

static PyObject *kt_python_evaluate_forward(PyObject *bound, PyObject *args) {
    return kt_python_evaluate(bound, args, false);
}

static PyObject *kt_python_evaluate_inverse(PyObject *bound, PyObject *args) {
    return kt_python_evaluate(bound, args, true);
}

/* bind(address of kt_python_data, shape, array of accelerations, owners): the functions of forward and of inverse
 * dynamics. */
static PyObject *kt_python_bind(PyObject *module, PyObject *args) {
    static PyMethodDef forward = {"forward", kt_python_evaluate_forward, METH_VARARGS, NULL};
    static PyMethodDef inverse = {"inverse", kt_python_evaluate_inverse, METH_VARARGS, NULL};
    PyObject *shape, *result, *owners;
    Py_ssize_t address;
    (void)module;
    if (!PyArg_ParseTuple(args, "nOOO", &address, &shape, &result, &owners))
        return NULL;
    PyObject *capsule = PyCapsule_New((void *)(intptr_t)address, NULL, NULL);
    PyObject *bound = capsule ? Py_BuildValue("(NOOO)", capsule, shape, result, owners) : NULL;
    if (!bound)
        return NULL;
    PyObject *both =
        Py_BuildValue("(NN)", PyCFunction_NewEx(&forward, bound, NULL), PyCFunction_NewEx(&inverse, bound, NULL));
    Py_DECREF(bound);
    return both;
}

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

/* The end of the loop. A fault becomes the exception that Simulation._check raises. */
static PyObject *kt_python_turns_stop(kt_python_turns *turns, int status) {
    turns->has_ended = true;
    if (status != KT_PYTHON_ENDED)
        Py_XDECREF(PyObject_CallMethod(turns->simulation, "_check", "i", status));
    return NULL;
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
    if (status != KT_OK)
        return kt_python_turns_stop(turns, status);
    Py_INCREF(turns->simulation);
    return turns->simulation;
}

static void kt_python_turns_free(PyObject *self) {
    PyTypeObject *type = Py_TYPE(self);
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
                                          {"bind", kt_python_bind, METH_VARARGS, NULL},
                                          {"turns", kt_python_turns_new, METH_VARARGS, NULL},
                                          {NULL, NULL, 0, NULL}};

static PyType_Slot kt_python_turns_slots[] = {{Py_tp_dealloc, (void *)kt_python_turns_free},
                                              {Py_tp_iter, (void *)PyObject_SelfIter},
                                              {Py_tp_iternext, (void *)kt_python_turns_next},
                                              {0, NULL}};

static PyType_Spec kt_python_turns_spec = {"kinetree.Turns", sizeof(kt_python_turns), 0, Py_TPFLAGS_DEFAULT,
                                           kt_python_turns_slots};

/* Adds the functions to the module that cffi made. */
static PyObject *kt_python_module(PyObject *module) {
    if (!module || PyModule_AddFunctions(module, kt_python_methods) != 0)
        return NULL;
    kt_python_turns_type = PyType_FromSpec(&kt_python_turns_spec);
    return kt_python_turns_type ? module : NULL;
}
