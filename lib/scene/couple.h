/* FMUs in a simulation: their communication points, inputs and outputs (couple.c). */
#ifndef KT_SCENE_COUPLE_H
#define KT_SCENE_COUPLE_H

#include "scene/assignment.h"
#include "scene/bound.h"

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
