/* Assemblies of changed scenes, which show what closes their loops. */
#include "advice/advice.h"

#include <stdlib.h>
#include <string.h>

bool kt_closes_described(const kt_scene *scene, const kt_description *description) {
    const kt_model_options options = kt_compile_options(scene);
    kt_model *model = NULL;
    kt_data *data = NULL;
    if (kt_model_compile(description, &options, &model, NULL) != KT_OK)
        return false;
    double *state = kt_given_state(model);
    const bool closed = state != NULL && kt_data_create(model, &data, NULL) == KT_OK &&
                        kt_state_assemble(model, data, 0.0, state, state + kt_model_nq(model), NULL) == KT_OK;
    kt_data_free(data);
    free(state);
    kt_model_free(model);
    return closed;
}

bool kt_closes_holding(const kt_scene *scene, int out, const char *in) {
    kt_description d = scene->description;
    const char **hold = malloc(((size_t)d.hold_count + 1) * sizeof *hold);
    int count = 0;
    if (hold == NULL)
        return false;
    for (int i = 0; i < d.hold_count; i++)
        if (i != out)
            hold[count++] = d.hold[i];
    if (in != NULL)
        hold[count++] = in;
    d.hold = hold;
    d.hold_count = count;
    const bool closed = kt_closes_described(scene, &d);
    free(hold);
    return closed;
}

bool kt_closes_with_loop(const kt_scene *scene, int loop, const kt_loop *changed) {
    kt_description d = scene->description;
    kt_loop *loops = malloc((size_t)d.loop_count * sizeof *loops);
    if (loops == NULL)
        return false;
    memcpy(loops, d.loops, (size_t)d.loop_count * sizeof *loops);
    if (changed != NULL)
        loops[loop] = *changed;
    else
        memmove(loops + loop, loops + loop + 1, (size_t)(d.loop_count - loop - 1) * sizeof *loops);
    d.loops = loops;
    d.loop_count -= changed == NULL;
    const bool closed = kt_closes_described(scene, &d);
    free(loops);
    return closed;
}

bool kt_closes_without(const kt_scene *scene, int loop) { return kt_closes_with_loop(scene, loop, NULL); }

bool kt_closes_with_joint(const kt_scene *scene, int body, const kt_joint *changed) {
    kt_description d = scene->description;
    kt_body *bodies = malloc((size_t)d.body_count * sizeof *bodies);
    if (bodies == NULL)
        return false;
    memcpy(bodies, d.bodies, (size_t)d.body_count * sizeof *bodies);
    bodies[body].joint = *changed;
    d.bodies = bodies;
    const bool closed = kt_closes_described(scene, &d);
    free(bodies);
    return closed;
}
