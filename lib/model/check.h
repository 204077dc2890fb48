/* What collects the faults of a description, and the rules that items of all kinds have in common: of numbers, functions,
 * names and ends. The check itself is the compiler's (compile/check.c), and types add rules of their own.
 *
 * Every rule reports through kt_checker_fault and goes on; what depends on something at fault is not reported as well.
 */
#ifndef KT_MODEL_CHECK_H
#define KT_MODEL_CHECK_H

#include "base/names.h"
#include "kinetree/descriptor.h"
#include "kinetree/model.h"

#include <stdint.h>

/* Scopes in the table of names; the markers of body i have scope i. */
enum { KT_SCOPE_BODY = -1, KT_SCOPE_LOOP = -2, KT_SCOPE_EFFECT = -3 };

/* Bodies, as indices in the description. */
enum { KT_BODY_WORLD = -1, KT_BODY_UNKNOWN = -2 };

/* The range of numbers: wide enough for anything that moves, and such that no product that the equations form of them
 * (m l^2 w^2, and twice m l^2) leaves the range of double. Smaller masses and inertias would leave subnormal products,
 * of which no digit holds. */
#define KT_NUMBER_MOST 1e50
#define KT_MASS_LEAST 1e-50
#define KT_INERTIA_MOST 1e150
#define KT_INERTIA_LEAST 1e-150
enum {
    KT_COUNT_MOST = 100000000
}; /* of bodies, markers, loops, effects: indices are ints, and stay far from their end */

typedef struct kt_checker {
    const kt_description *description;
    kt_report *report;
    void *user;
    kt_item item; /* what is being checked */
    int index;
    kt_error first; /* the first fault; code KT_OK: none yet */
    kt_names names;
    int *parent;    /* of each body: index, KT_BODY_WORLD or KT_BODY_UNKNOWN */
    int *mark;      /* of each body: for whoever needs one */
    int stamp;      /* the last value in mark */
    int64_t effort; /* what suggestions may still cost */
} kt_checker;

/* ---- check_fault.c ----------------------------------------------------------------------------------------------------- */

/* A checker that has found nothing and has no memory: enough for the rules of numbers and shapes. */
kt_checker kt_checker_make(const kt_description *description, kt_report *report, void *user);

/* Whether nobody wants to hear of more faults. */
bool kt_checker_is_done(const kt_checker *checker);

/* Reports a fault of the item being checked. */
void kt_checker_fault(kt_checker *checker, const char *field, int sub, const char *format, ...) KT_PRINTF(4, 5);

/* The markers of a body that can be read: none where their list is at fault. */
int kt_checker_marker_count(const kt_body *body);

/* ---- check_number.c: those that return tell whether it is right; `sub` as in kt_place -------------------------------
 */

/* Finite, and within KT_NUMBER_MOST. */
bool kt_number_is_fine(double value);

/* The same, reported. Messages call the number FIELD SUFFIX [component]; suffix "", component -1: nothing more. */
bool kt_checker_value(kt_checker *checker, const char *field, int sub, const char *suffix, int component, double value);
bool kt_checker_values(kt_checker *checker, const char *field, int sub, const char *suffix, const double *values,
                       int count);
bool kt_checker_number(kt_checker *checker, const char *field, double value);
bool kt_checker_vector(kt_checker *checker, const char *field, int sub, const char *suffix, kt_vec3 value);
/* And > 0, >= 0. */
void kt_checker_positive(kt_checker *checker, const char *field, double value);
bool kt_checker_not_negative(kt_checker *checker, const char *field, const char *suffix, double value);
/* A direction: finite and not zero. */
bool kt_axis_is_fine(kt_vec3 axis);
bool kt_checker_axis(kt_checker *checker, const char *field, kt_vec3 axis);
void kt_checker_rotation(kt_checker *checker, const char *field, int sub, const char *suffix,
                         const kt_rotation *rotation);

/* ---- check_function.c -------------------------------------------------------------------------------------------- */

/* `field` is the key where the function stands. KT_FUNCTION_NONE is right. */
bool kt_checker_function(kt_checker *checker, const char *field, const kt_function *function);
/* And, as far as can be told without running it, > 0 at all times. */
void kt_checker_positive_function(kt_checker *checker, const char *field, const kt_function *function);

/* ---- check_name.c ------------------------------------------------------------------------------------------------ */

/* The name of an item and of one used twice. `name` may be missing where `optional`. */
void kt_checker_name(kt_checker *checker, int scope, const char *list, const char *name, bool optional);
/* The index of a body of that name, KT_BODY_WORLD, or KT_BODY_UNKNOWN after reporting it. NULL is the world. */
int kt_checker_body(kt_checker *checker, const char *field, int sub, const char *what, const char *name);
/* The index of the body that bears a joint, or KT_BODY_UNKNOWN after reporting it. */
int kt_checker_joint(kt_checker *checker, const char *field, int sub, const char *name);
/* The same for a joint of one coordinate. */
int kt_checker_scalar_joint(kt_checker *checker, const char *field, int sub, const char *name);
/* An end; returns the index of its body, KT_BODY_WORLD, or KT_BODY_UNKNOWN after reporting it. `sub`: 0 or 1 in a list of
 * two, else -1. */
int kt_checker_end(kt_checker *checker, const char *field, int sub, const kt_end *end);

/* ---- check_key.c ------------------------------------------------------------------------------------------------- */

/* The members of an item that the keys of its type stand for. `standard` is the struct that such an item starts from. Two
 * ends must lie on two bodies. */
void kt_checker_keys(kt_checker *checker, const kt_descriptor *descriptor, const void *object, const void *standard);

#endif
