/* Groups of three links in a plane that one pin closes. Forward dynamics solves them at once. The reference is the
 * spatial kernels, which factor and solve. The states are on the manifold and off it. The groups are on the ground and
 * on a moving link. The number of links on the first end's path takes every value. There are turns about n and -n,
 * slides, and bars that hang on the group. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"

#include "kinetree/dynamics.h"
#include "mechanics/constraint/tangle.h"
#include "model/model.h"

#include <string.h>

enum { WAYS = 3, NV = 8 }; /* in the plane, in space, and in the plane by the baseline's instructions */

static const char *const names[3] = {"link0", "link1", "link2"};

typedef struct seen {
    int all, on_ground, on_link, slides, path[4];
} seen;

static void note_pins(const kt_model *model, seen *s) {
    const kt_group *group = &model->group[0];
    s->all += group->form == KT_FORM_PIN;
    s->on_ground += group->form == KT_FORM_PIN && group->parent == 0;
    s->on_link += group->form == KT_FORM_PIN && group->parent != 0;
    s->path[model->loop[0].length[0]] += group->form == KT_FORM_PIN;
    for (int l = 0; l < 3; l++)
        s->slides +=
            group->form == KT_FORM_PIN && model->link[model->group_link[group->link + l]].motion == KT_MOTION_PRISMATIC;
}

static kt_vec3 draw_along(kt_random *random, double most) {
    return kt_vec3_make(kt_random_uniform(random, -most, most), kt_random_uniform(random, -most, most), 0.0);
}

static kt_body *draw_bar(linkage *l, const char *name, const char *parent, bool slides, kt_random *random) {
    kt_body *b = linkage_bar(l, name, parent, draw_along(random, 1.0), draw_along(random, 1.0),
                             kt_random_uniform(random, -2.0, 2.0), kt_random_uniform(random, -2.0, 2.0));
    b->mass = kt_random_uniform(random, 0.1, 2.0);
    if (slides) {
        b->joint.type = KT_JOINT_PRISMATIC;
        b->joint.axis = draw_along(random, 1.0);
    } else if (kt_random_uniform(random, 0.0, 1.0) < 0.3) {
        b->joint.axis = kt_vec3_make(0.0, 0.0, -1.0);
    }
    return b;
}

/* The position of a point of the plane in a body's frame (NULL: the world), in the mechanism without the pin. */
static kt_vec3 seen_from(const linkage *l, const char *body, kt_vec3 point) {
    if (!body)
        return point;
    const kt_pose p = kt_body_pose(l->model, l->data, kt_body_find(l->model, body));
    return kt_mat3_apply_transposed(p.rotation, kt_vec3_sub(point, p.position));
}

/* `first` links from the parent to one end of the pin, the rest to the other. */
static void draw_mechanism(linkage *l, int i, kt_random *random) {
    static const char *const hanging[3] = {"hang0", "hang1", "hang2"};
    const int first = i % 4, slider = kt_random_int(random, -3, 2);
    const char *base = i / 4 % 2 ? "base" : NULL, *end[2] = {base, base};
    kt_error e = {0};
    linkage_begin(l);
    if (base)
        (void)draw_bar(l, base, NULL, false, random);
    for (int k = 0; k < 3; k++) {
        const char **parent = &end[k >= first];
        (void)draw_bar(l, names[k], *parent, k == slider, random);
        *parent = names[k];
        if (kt_random_uniform(random, 0.0, 1.0) < 0.3)
            (void)draw_bar(l, hanging[k], names[k], false, random);
    }
    linkage_compile(l);
    kt_need_fine("kinematics", kt_kinematics_update(l->model, l->data, l->q, l->v, NULL, &e), &e);
    const kt_vec3 point = draw_along(random, 1.5);
    (void)linkage_close(l, "pin", KT_LOOP_REVOLUTE, end[0], seen_from(l, end[0], point), end[1],
                        seen_from(l, end[1], point));
    l->description.loop_count = 1;
    linkage_build(l, 0.0);
}

static void make_others(linkage *l, kt_model *model[WAYS], kt_data *data[WAYS]) {
    model[0] = l->model;
    data[0] = l->data;
    for (int k = 1; k < WAYS; k++) {
        kt_model_options options = kt_model_options_default();
        options.plan = k == 1 ? KT_PLAN_SPATIAL : KT_PLAN_AUTO;
        options.isa = k == 2 ? KT_ISA_BASE : KT_ISA_AUTO;
        model[k] = kt_test_model(&l->description, &options);
        data[k] = kt_test_data(model[k]);
    }
}

/* One state, by all ways. */
static void compare(const linkage *l, kt_model *const model[WAYS], kt_data *const data[WAYS], const double *q,
                    const double *v, kt_random *random, kt_worst *worst, int *different, int *compared) {
    double a[WAYS][NV], tau[NV];
    kt_wrench external[NV];
    kt_error e = {0};
    for (int i = 0; i < l->nv; i++)
        tau[i] = kt_random_uniform(random, -5.0, 5.0);
    for (int i = 0; i < NV; i++)
        external[i] = (kt_wrench){kt_tree_vector(random, -5.0, 5.0), kt_tree_vector(random, -5.0, 5.0)};
    for (int k = 0; k < WAYS; k++)
        kt_need_fine("acceleration", kt_acceleration_evaluate(model[k], data[k], 0.0, q, v, tau, external, a[k], &e),
                     &e);
    if (data[1]->near[0])
        return;
    /* the growth of rounding errors, twice: in the equations, and in the freedom that they leave */
    const double size = kt_tree_largest(a[1], l->nv), worse = model[1]->group[0].usual[KT_ROWS_ALL] / data[1]->last[0];
    for (int i = 0; i < l->nv; i++)
        kt_worst_near(worst, a[0][i], a[1][i], 4e-13 * worse * worse * size, "%d: %d", *compared, i);
    *different += memcmp(a[0], a[2], sizeof *a[0] * (size_t)l->nv) != 0;
    ++*compared;
}

/* The bound was measured: 1.5e-13 over seven seeds. */
KT_TEST(pin_at_one_go_is_as_by_factoring) {
    static linkage l;
    kt_random random = kt_random_of_test();
    KT_WORST on = kt_worst_make("on the manifold"), off = kt_worst_make("off the manifold");
    seen s = {0};
    int different = 0, compared = 0;
    for (int i = 0; i < 400; i++) {
        kt_model *model[WAYS];
        kt_data *data[WAYS];
        draw_mechanism(&l, i, &random);
        make_others(&l, model, data);
        double q[NV], v[NV];
        note_pins(model[0], &s);
        compare(&l, model, data, l.q, l.v, &random, &on, &different, &compared);
        for (int k = 0; k < l.nv; k++) {
            q[k] = l.q[k] + kt_random_uniform(&random, -0.1, 0.1);
            v[k] = l.v[k] + kt_random_uniform(&random, -0.5, 0.5);
        }
        compare(&l, model, data, q, v, &random, &off, &different, &compared);
    }
    kt_check_equal_int("whose bits are not the baseline's", different, 0);
    kt_check_above("compared", compared, 700.0);
    kt_check_above("pins", s.all, 380.0);
    kt_check_above("on the ground", s.on_ground, 180.0);
    kt_check_above("on a link", s.on_link, 180.0);
    kt_check_above("slides", s.slides, 150.0);
    for (int k = 0; k < 4; k++)
        kt_check_above("of one split of the links", s.path[k], 80.0);
}
