/* Explains which drives contradict each other. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "advice/advice.h"

#include <stdio.h>
#include <string.h>

enum { TRIALS = 6 }; /* loops without which the assembly is tried */

int kt_say_double_motions(const char *before, const kt_scene *scene) {
    const kt_description *d = &scene->description;
    int found = 0;
    for (int i = 0; i < d->loop_count; i++)
        for (int k = 0; k < i && d->loops[i].type == KT_LOOP_MOTION; k++)
            if (d->loops[k].type == KT_LOOP_MOTION && strcmp(d->loops[i].joint, d->loops[k].joint) == 0) {
                kt_print("%sloops '%s' and '%s' both prescribe the motion of joint '%s'; leave one of them out\n",
                         before, d->loops[k].name, d->loops[i].name, d->loops[i].joint);
                found++;
            }
    return found;
}

static bool prescribes_motion(const kt_loop *loop) {
    return loop->function.type != KT_FUNCTION_NONE && (loop->type == KT_LOOP_MOTION || loop->type == KT_LOOP_RATES);
}

int kt_say_doubly_driven(kt_trials *trials) {
    const kt_description *d = &trials->scene->description;
    int listed[TRIALS], count = 0, found = 0;
    for (int i = 0; i < d->loop_count && count < TRIALS; i++)
        if (prescribes_motion(&d->loops[i]) && kt_closes_without(trials, i) && trials->left == trials->dof)
            listed[count++] = i;
    for (int k = 1; k < count; k++) {
        const kt_loop *one = &d->loops[listed[0]], *other = &d->loops[listed[k]];
        if (one->type == KT_LOOP_MOTION && other->type == KT_LOOP_MOTION && strcmp(one->joint, other->joint) == 0)
            continue;
        kt_print("  drives '%s' and '%s' determine the same degree of freedom; leave one of them out\n", one->name,
                 other->name);
        found++;
    }
    return found;
}

/* Prints the loops without which the others agree. Motions of joints are tried first. */
static void advise_on_contradicting_loops(kt_trials *trials) {
    const kt_description *d = &trials->scene->description;
    int tried = 0;
    for (int others = 0; others < 2; others++)
        for (int i = 0; i < d->loop_count && d->loop_count > 1; i++)
            if ((d->loops[i].type != KT_LOOP_MOTION) == (others == 1) && tried++ < TRIALS &&
                kt_closes_without(trials, i))
                kt_print("  the others agree without loop '%s'\n", d->loops[i].name);
}

void kt_say_contradicting_velocities(kt_trials *trials) {
    fputs(
        "  the positions close, but loops and held joints prescribe velocities that contradict each other at t = 0 s; "
        "make the rates of drives and the velocities of held joints agree\n",
        stderr);
    (void)kt_say_double_motions("  ", trials->scene);
    (void)kt_say_doubly_driven(trials);
    advise_on_contradicting_loops(trials);
}
