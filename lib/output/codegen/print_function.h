/* Prints functions of a graph as C. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CODEGEN_PRINT_FUNCTION_H
#define KT_CODEGEN_PRINT_FUNCTION_H

#include "codegen/roll.h"

#include <stdio.h>

/* A function: its outputs, and the conditions that the function checks. */
typedef struct kt_code_function {
    kt_op *out;
    int out_count;
    int output[3]; /* up to three arrays: how many of the outputs each has */
    kt_code_guard *guard;
    int guard_count;
    bool writes_at_once; /* if it is long: no output can be an input, and no guard stops it */
    bool may_roll;       /* steps of the function may become loops; otherwise it is straight lines */
} kt_code_function;

/* The names of the arrays of a function. */
typedef struct kt_code_arrays {
    const char *given;     /* name of the array of KT_OP_GIVEN */
    const char *output[3]; /* NULL: no more */
} kt_code_arrays;

typedef struct kt_code_printer {
    const kt_code_tree *tree;
    const kt_graph *graph;
    kt_pool pool; /* memory of the arrays, but for those of `roll` */
    FILE *file;
    int origin;         /* origin of the nodes that are statements */
    int32_t *uses;      /* uses of each node, in the function that is printed */
    int32_t *user;      /* the node that uses it last; -1: an output */
    int32_t *width;     /* width of the node's text, where it is written into its user; 0: it is a statement */
    int32_t *temporary; /* the number of its variable */
    int32_t *prepared;  /* the node's index among the prepared numbers; -1: none yet */
    kt_op *list;        /* the prepared numbers, of which loops may have some twice */
    size_t list_room;
    int prepared_count;
    const kt_code_arrays *arrays;
    int part_count, at_part; /* number of parts of the function; the part that is printed */
    int32_t *part;           /* part of each node; `part_count` is the function itself */
    int32_t *place;          /* place of a number that another part reads, in `w`; -1: none */
    int32_t *needs;          /* for each part: bits of its arguments */
    int place_count;
    kt_code_roll roll;     /* the loops of the function */
    int32_t *loop_of_part; /* for each part: its loop; -1: none */
    kt_code_slot **slot;   /* for each node: how the loop that is printed reads it; NULL: otherwise */
    bool has_parts;        /* any function has them */
    bool failed;           /* memory was insufficient: the text is of no use */
} kt_code_printer;

/* Begins for a complete graph. Returns false if memory is insufficient; kt_code_printer_free in any case. */
bool kt_code_printer_init(kt_code_printer *p, const kt_code_tree *tree, FILE *file);
void kt_code_printer_free(kt_code_printer *p);

/* Prints the parts of a long function `name`, each a static function. Must be called before the next function is
 * generated. */
void kt_code_print_parts(kt_code_printer *p, const kt_code_function *f, const kt_code_arrays *arrays, const char *name);

/* Prints the statements of a function, or the calls of its parts. */
void kt_code_print_function(kt_code_printer *p, const kt_code_function *f, const char *name);

/* Prints the statements that compute all prepared numbers; must follow all functions. */
void kt_code_print_prepared(kt_code_printer *p);

/* Whether a function reads an array. */
bool kt_code_reads(kt_code_printer *p, const kt_code_function *f, kt_op_array array);

/* Whether a function calls the C library. */
bool kt_code_calls(kt_code_printer *p, const kt_code_function *f);

/* Prints lines of text, each with its end. */
void kt_code_print_lines(FILE *file, const char *const *line, size_t count);

/* Prints the types `number` and `real`, and the definitions that functions in lanes need (generated_lanes.c). */
void kt_code_print_lanes(FILE *file, const char *name, const char *functions);

/* Prints the sines and cosines of the file, whose names begin with `name`, and the list `place` of the angles. */
void kt_code_print_sincos(FILE *file, const char *name, const kt_model *model);

/* The beginning of the names of a file, and its model in the lists of parameters and arguments: empty if all numbers
 * are fixed. */
typedef struct kt_code_names {
    const char *name, *take, *pass;
    bool effects_have_time, loops_have_time; /* as an argument of forces, and of equations */
} kt_code_names;

/* The time, as a parameter and as an argument of steps; as an argument of forces, and of equations. */
static inline bool kt_code_steps_have_time(const kt_code_names *n) {
    return n->effects_have_time || n->loops_have_time;
}
static inline const char *kt_code_take_time(const kt_code_names *n) {
    return kt_code_steps_have_time(n) ? "number t, " : "";
}
static inline const char *kt_code_pass_time(const kt_code_names *n) { return kt_code_steps_have_time(n) ? "t, " : ""; }
static inline const char *kt_code_pass_effect_time(const kt_code_names *n) { return n->effects_have_time ? "t, " : ""; }
static inline const char *kt_code_pass_loop_time(const kt_code_names *n) { return n->loops_have_time ? "t, " : ""; }

/* The heads of project, heun, rk4 and semi_implicit, and of A and B of the steps. */
enum { KT_CODE_STEPS = 7 };

/* Prints the steps among the functions. */
void kt_code_print_steps(FILE *file, const kt_code_names *names, const kt_model *model, unsigned functions,
                         const char *const signature[KT_CODE_STEPS]);

/* Prints the derivatives of accelerations of a state with effects, which A and B of all steps need. */
void kt_code_print_jacobians(FILE *file, const kt_code_names *names, const kt_model *model);

/* Prints the common function of A and B of explicit steps, and a method with its tables; and the common function of
 * semi-implicit steps. */
void kt_code_print_explicit_changes(FILE *file, const kt_code_names *names, const kt_model *model);
void kt_code_print_method_changes(FILE *file, const kt_code_names *names, const char *signature, int stages,
                                  const char *tables);
void kt_code_print_semi_implicit_changes(FILE *file, const kt_code_names *names, const kt_model *model,
                                         const char *signature);

/* Prints the projection of a state onto the loops, and the function `project` if requested. */
void kt_code_print_projection(FILE *file, const kt_code_names *names, const kt_model *model, unsigned functions,
                              const char *signature);

/* Whether the steps among the functions need sines, or sqrt of math.h. */
bool kt_code_steps_read_sines(const kt_model *model, unsigned functions);
bool kt_code_steps_read_roots(const kt_model *model, unsigned functions);

#endif
