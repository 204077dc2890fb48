/* FMUs in a simulation: their communication points, inputs and outputs (couple.c). */
#ifndef KT_SCENE_COUPLE_H
#define KT_SCENE_COUPLE_H

#include "base/pool.h"
#include "kinetree/expression.h"
#include "kinetree/scene.h"
#include "scene/assignment.h"
#include "scene/response.h"

/* A variable of a formula in a model. */
typedef struct kt_bound {
    kt_variable_type type;
    int body, at, component; /* at: in q, v or gravity forces, or of auxiliary states */
    kt_vec3 point;           /* of a marker, in the body's frame */
    bool responds;           /* the variable is `response` instead */
    kt_event_response response;
} kt_bound;

typedef struct kt_bound_formula {
    kt_expression *expression; /* of a comparison: its difference */
    double sign;               /* of the value that is watched */
    kt_bound *variables;
    double *values;
    int count;
    bool moves;        /* a marker or another quantity that needs data is among them */
    double *gravity;   /* gravity forces of all joints; NULL: none is among them */
    unsigned responds; /* bits of accelerations and reactions among them (kt_response_bit) */
    kt_responses *responses;
    kt_expression **parts; /* those that depend on time alone */
    int part_count;
} kt_bound_formula;

/* The parts that all formulas of one simulation share. */
typedef struct kt_binding {
    kt_pool *pool;
    const kt_model *model;
    kt_responses *responses; /* `a` is NULL until a formula has any */
} kt_binding;

/* Binds a variable of a description to a model. */
KT_CHECKED kt_status kt_variable_bind(const kt_description *description, const kt_model *model,
                                      const kt_variable *variable, kt_bound *to, kt_error *error);

/* Reads a formula of the scene, and binds its variables to the model. For a comparison that is watched, it takes the
 * difference of both sides. */
KT_CHECKED kt_status kt_formula_bind(const kt_binding *in, const kt_scene *scene, const char *text, bool is_watched,
                                     kt_bound_formula *to, kt_error *error);

/* Evaluates a formula. The data of `at` are scratch. Returns 0, or 1 after an error. */
int kt_bound_evaluate(kt_bound_formula *f, const kt_instant *at, double *value, kt_error *error);

/* An FMU of a scene in a simulation. */
typedef struct kt_coupled_fmu {
    double step;    /* s */
    uint64_t point; /* the number of the last communication point */
    kt_bound_formula *formulas;
    double *inputs, *outputs; /* their values */
    int *states;              /* auxiliary states that hold the outputs */
    int input_count, output_count;
    kt_assignments *assignments; /* of the watch; NULL: there are no outputs */
    kt_scene_coupling with;
    bool is_coupled;
    kt_event *event; /* the event of an FMU that has ended the run, in the simulation; NULL: it has not */
} kt_coupled_fmu;

/* Binds the inputs and outputs of an FMU. *moves: whether inputs need data of the model. */
KT_CHECKED kt_status kt_coupled_bind(const kt_binding *in, const kt_scene *scene, const kt_scene_fmu *fmu,
                                     kt_assignments *assignments, kt_coupled_fmu *to, bool *moves, kt_error *error);

/* The value of the event: it rises through zero at the next communication point. Returns 1 after an error. */
int kt_coupled_clock(const kt_coupled_fmu *coupled, const kt_instant *at, double *value, kt_error *error);

/* Samples a communication point in a state. Returns as a kt_event_action. */
int kt_coupled_sample(kt_coupled_fmu *coupled, uint64_t number, const kt_instant *at, kt_simulation *simulation,
                      kt_error *error);

/* Continues behind `count` communication points, in a simulation at time t. */
void kt_coupled_sync(kt_coupled_fmu *coupled, uint64_t count, double t);

/* Takes a program's FMU in place of an earlier one; NULL: of none. */
void kt_coupled_take(kt_coupled_fmu *coupled, const kt_scene_coupling *with);

#endif
