/* Collects the faults of a description, and checks the rules for numbers, functions, names and ends, which all kinds of
 * items share. The check itself is the compiler's (compile/check_description.c), and types add rules of their own.
 *
 * Every rule reports through kt_checker_fault and continues. A mere consequence of a reported fault is not reported.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_MODEL_CHECK_H
#define KT_MODEL_CHECK_H

#include "base/names.h"
#include "kinetree/descriptor.h"
#include "kinetree/model.h"

#include <stdint.h>

/* Scopes in the table of names; the markers of body i have scope i. */
enum { KT_SCOPE_BODY = -1, KT_SCOPE_LOOP = -2, KT_SCOPE_EFFECT = -3, KT_SCOPE_STATE = -5 };
/* ... and KT_NAMES_OF_JOINTS, of names of their own */

/* Special values of a body's index in the description. */
enum { KT_BODY_WORLD = -1, KT_BODY_UNKNOWN = -2 };

/* The range of numbers is wide enough for any mechanism. The products that the equations form, such as m l^2 w^2, do
 * not overflow, nor does twice m l^2. Smaller masses and inertias would make products subnormal, without a
 * correct digit. */
#define KT_NUMBER_MOST 1e50
#define KT_MASS_LEAST 1e-50
#define KT_INERTIA_MOST 1e150
#define KT_INERTIA_LEAST 1e-150
enum {
    KT_COUNT_MOST = 100000000
}; /* limit of bodies, markers, loops, effects: indices are ints, and stay far below INT_MAX */

typedef struct kt_checker {
    const kt_description *description;
    kt_report *report;
    void *user;
    kt_item item; /* the item being checked */
    int index;
    bool set;       /* a number of an existing item is being set: a zero or infinite value is intended, not forgotten */
    kt_error first; /* the first fault; code KT_OK: none yet */
    kt_names names;
    int *parent;    /* parent of each body: index, KT_BODY_WORLD or KT_BODY_UNKNOWN */
    int *mark;      /* for each body: scratch for the rules that need it */
    int stamp;      /* the last value that was used in mark */
    int64_t effort; /* operations that suggestions may still take */
} kt_checker;

/* ---- check_fault.c ----------------------------------------------------------------------------------------------- */

/* Returns a checker without faults and without memory: such a checker suffices for the rules of numbers and shapes. */
kt_checker kt_checker_make(const kt_description *description, kt_report *report, void *user);

/* Whether the check may end: a fault has been found, and no report is wanted. */
bool kt_checker_is_done(const kt_checker *checker);

/* The status of the check so far: of the first fault, which *error then is. */
kt_status kt_checker_result(const kt_checker *checker, kt_error *error);

/* Reports a fault of the item being checked. */
void kt_checker_fault(kt_checker *checker, const char *field, int sub, const char *format, ...) KT_PRINTF(4, 5);

/* Returns the number of markers of a body that can be read: 0 if their list is at fault. */
int kt_checker_marker_count(const kt_body *body);

/* ---- check_number.c ---------------------------------------------------------------------------------------------- */

/* A function that returns a bool returns whether the value is valid; `sub` is as in kt_place. */

/* Whether the magnitude of a value is at most KT_NUMBER_MOST; false for NaN. */
bool kt_number_is_fine(double value);

/* Checks the magnitude as kt_number_is_fine does, and reports. Messages name the number FIELD SUFFIX [component];
 * suffix "" and component -1 add nothing. */
bool kt_checker_value(kt_checker *checker, const char *field, int sub, const char *suffix, int component, double value);
bool kt_checker_values(kt_checker *checker, const char *field, int sub, const char *suffix, const double *values,
                       int count);
bool kt_checker_number(kt_checker *checker, const char *field, double value);
bool kt_checker_vector(kt_checker *checker, const char *field, int sub, const char *suffix, kt_vec3 value);
/* Check the magnitude, and that the value is > 0, or >= 0. */
void kt_checker_positive(kt_checker *checker, const char *field, double value);
bool kt_checker_not_negative(kt_checker *checker, const char *field, const char *suffix, double value);
/* A direction must be finite and not zero. */
bool kt_axis_is_fine(kt_vec3 axis);
bool kt_checker_axis(kt_checker *checker, const char *field, kt_vec3 axis);
void kt_checker_rotation(kt_checker *checker, const char *field, int sub, const char *suffix,
                         const kt_rotation *rotation);

/* ---- check_function.c -------------------------------------------------------------------------------------------- */

/* `field` is the key of the function. KT_FUNCTION_NONE is valid. */
bool kt_checker_function(kt_checker *checker, const char *field, const kt_function *function);
/* Checks a function that must also be > 0 at all times. The check uses a lower bound that needs no evaluation: the
 * value at t = 0 for a polynomial, the values of the rows for a table. */
void kt_checker_positive_function(kt_checker *checker, const char *field, const kt_function *function);

/* ---- check_name.c ------------------------------------------------------------------------------------------------ */

/* Checks the name of an item, which must be unique in its scope. Messages name the list with its key, `list`. `name`
 * may be NULL if `optional`. */
void kt_checker_name(kt_checker *checker, int scope, const char *list, const char *name, bool optional);
/* Returns the index of the body of that name, KT_BODY_WORLD, or KT_BODY_UNKNOWN after reporting that there is none.
 * NULL is the world. */
int kt_checker_body(kt_checker *checker, const char *field, int sub, const char *what, const char *name);
/* Returns the index of the body that has the joint, or KT_BODY_UNKNOWN after reporting that there is none. */
int kt_checker_joint(kt_checker *checker, const char *field, int sub, const char *name);
/* Returns the index as kt_checker_joint does, for a joint that must have one coordinate. */
int kt_checker_scalar_joint(kt_checker *checker, const char *field, int sub, const char *name);
/* Checks the name of the coordinate in which an effect acts (model/relative.h). */
void kt_checker_coordinate(kt_checker *checker, const char *field, const char *text);
/* Checks an end. Returns the index of its body, KT_BODY_WORLD, or KT_BODY_UNKNOWN after reporting that there is none.
 * For an end in a list of two, `sub` is its index, otherwise -1. */
int kt_checker_end(kt_checker *checker, const char *field, int sub, const kt_end *end);

/* ---- check_key.c ------------------------------------------------------------------------------------------------- */

/* Checks the members of an item to which the keys of its type refer. `standard` is the default struct of such an item.
 * Two ends must lie on two bodies. */
void kt_checker_keys(kt_checker *checker, const kt_descriptor *descriptor, const void *object, const void *standard);
/* Checks the members to which one key of numbers refers. */
void kt_checker_key(kt_checker *checker, const kt_key *key, const void *object, const void *standard);

#endif
