/* Loops and effects that are switched on and off. The results equal those of models compiled without the parts that are
 * off, to the last bit. Plastic impacts are compared with their conditions and a closed form. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/tangle.h"

#include "interpose.h"

#include "kinetree/loop.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { EFFECTS = 3, NV = KT_TREE_NV, ROWS = TANGLE_ROWS };

/* A closed mechanism whose loops and effects are switched; and the state, in which all of its loops are closed. */
typedef struct switched {
    tangle g;
    kt_effect effect[EFFECTS];
    kt_model *model;
    kt_data *data;
} switched;

static const kt_switching at_first[2] = {KT_SWITCHED_ON, KT_SWITCHED_OFF};

static void describe_effects(switched *s, kt_random *random) {
    static const kt_effect_type types[EFFECTS] = {KT_EFFECT_SPRING, KT_EFFECT_FORCE, KT_EFFECT_DRAG};
    static const char *const names[EFFECTS] = {"coil", "pull", "air"};
    for (int i = 0; i < EFFECTS; i++) {
        kt_effect *e = &s->effect[i];
        *e = kt_effect_of(types[i], NULL);
        e->name = names[i];
        for (int k = 0; k < 2; k++) {
            e->between[k].body =
                s->g.tree.body[kt_random_int(random, 0, s->g.tree.description.body_count / 2 - 1) * 2 + k].name;
            e->between[k].at = kt_tree_vector(random, -1.0, 1.0);
        }
        e->stiffness = 3.0;
        e->length = 0.7;
        e->damping = 0.2;
        e->linear = 0.3;
        for (int k = 0; k < 3; k++)
            e->value[k] = kt_function_constant(1.5 - k);
        e->switching = at_first[i % 2];
    }
    s->g.tree.description.effects = s->effect;
    s->g.tree.description.effect_count = EFFECTS;
}

static void grow(switched *s, const tangle_plan *plan, kt_random *random) {
    memset(s, 0, sizeof *s);
    tangle_grow(&s->g, plan, random);
    describe_effects(s, random);
    for (int i = 0; i < s->g.loops; i++)
        s->g.loop[i].switching = at_first[i % 2];
    s->model = kt_test_model(&s->g.tree.description, NULL);
    s->data = kt_test_data(s->model);
}

/* The model of a description that has only the parts that are on in the set. index: of its loops, in the whole. */
static kt_model *compile_alone(const switched *s, uint64_t set, int *index, kt_data **data) {
    kt_description d = s->g.tree.description;
    kt_loop loop[TANGLE_LOOPS];
    kt_effect effect[EFFECTS];
    d.loops = loop;
    d.effects = effect;
    d.loop_count = d.effect_count = 0;
    for (int i = 0; i < s->g.loops; i++)
        if (set >> i & 1) {
            index[d.loop_count] = i;
            loop[d.loop_count] = s->g.loop[i];
            loop[d.loop_count++].switching = KT_ALWAYS_ON;
        }
    for (int i = 0; i < EFFECTS; i++)
        if (set >> (s->g.loops + i) & 1) {
            effect[d.effect_count] = s->effect[i];
            effect[d.effect_count++].switching = KT_ALWAYS_ON;
        }
    kt_model *model = kt_test_model(&d, NULL);
    *data = kt_test_data(model);
    return model;
}

/* Everything that is computed of a state. */
typedef struct answers {
    kt_status status[9];
    double a[NV], jacobian[ROWS * NV], residual[ROWS], rate[ROWS], drift[ROWS], basis[NV * NV], multiplier[ROWS];
    double projected_q[KT_TREE_NQ], projected_v[NV], impact_v[NV], by_q[NV * NV], by_v[NV * NV], by_tau[NV * NV];
    int columns;
    kt_impact impact;
    kt_residual open;
    double energy;
    kt_wrench joint[KT_TREE_SLOTS], loop[TANGLE_LOOPS];
} answers;

static void answer(const kt_model *model, kt_data *data, const tangle *g, const double *wrong_v, void *work,
                   answers *out) {
    memset(out, 0, sizeof *out);
    const double *q = g->q, *v = g->v;
    kt_status *s = out->status;
    s[0] = kt_acceleration_evaluate(model, data, g->t, q, v, g->tau, g->external, out->a, NULL);
    s[1] = kt_loop_equations(model, data, g->t, q, v, out->jacobian, out->residual, out->rate, out->drift, NULL);
    s[2] = kt_loop_nullspace(model, data, g->t, q, out->basis, &out->columns, NULL);
    s[3] = kt_reaction_evaluate(model, data, g->t, q, v, g->tau, g->external, out->joint, out->loop, NULL);
    s[4] = kt_multiplier_evaluate(model, data, g->t, q, v, g->tau, g->external, out->multiplier, NULL);
    memcpy(out->projected_q, q, sizeof out->projected_q);
    memcpy(out->projected_v, wrong_v, sizeof out->projected_v);
    s[5] = kt_state_project(model, data, g->t, out->projected_q, out->projected_v, NULL, NULL);
    memcpy(out->impact_v, wrong_v, sizeof out->impact_v);
    s[6] = kt_velocity_impact(model, data, g->t, q, out->impact_v, &out->impact, NULL);
    s[7] = kt_acceleration_derivatives(model, data, work, kt_acceleration_work_size(model), g->t, q, v, g->tau,
                                       g->external, out->by_q, out->by_v, out->by_tau, NULL);
    s[8] = kt_loop_residual(model, data, g->t, q, v, &out->open, NULL);
    out->energy = kt_effect_energy(model, data, g->t, q, v);
}

static bool are_equal(const switched *s, const kt_model *model, const kt_model *alone, const int *index,
                      const answers *a, const answers *b) {
    static const kt_wrench none = {.moment = {0.0, 0.0, 0.0}};
    int k = 0;
    bool equal = offsetof(answers, loop) > 0 && memcmp(a, b, offsetof(answers, loop)) == 0;
    for (int i = 0; i < s->g.loops; i++) {
        const bool on = k < kt_loop_count(alone) && index[k] == i;
        const kt_loop_rows rows = kt_loop_rows_of(model, i), there = kt_loop_rows_of(alone, k);
        equal &= memcmp(&a->loop[i], on ? &b->loop[k] : &none, sizeof none) == 0;
        equal &= rows.count == (on ? there.count : 0) && (!on || rows.first == there.first);
        k += on;
    }
    return equal && kt_model_mobility(model).equations == kt_model_mobility(alone).equations &&
           kt_model_mobility(model).rank == kt_model_mobility(alone).rank &&
           strcmp(kt_model_plan(model), kt_model_plan(alone)) == 0;
}

/* All sets, each reached from the last by one call. */
static int count_unequal(switched *s, kt_random *random, int *sets) {
    static answers mine, theirs;
    const kt_model *model = s->model;
    const int switches = kt_switch_count(model);
    double wrong_v[NV];
    int unequal = 0;
    for (int i = 0; i < NV; i++)
        wrong_v[i] = s->g.v[i] + kt_random_uniform(random, -1.0, 1.0);
    for (unsigned n = 1; n <= 1u << switches; n++) {
        const uint64_t set = n & ((1u << switches) - 1), gray = set ^ set >> 1;
        kt_error e = {0};
        int index[TANGLE_LOOPS];
        kt_data *data = NULL;
        for (int k = 0; k < switches; k++)
            if ((kt_switch_set(model) ^ gray) >> k & 1)
                (void)kt_fine("switch",
                              k < s->g.loops ? kt_loop_set_on(&model, s->data, k, gray >> k & 1, &e)
                                             : kt_effect_set_on(&model, s->data, k - s->g.loops, gray >> k & 1, &e),
                              &e);
        kt_model *alone = compile_alone(s, gray, index, &data);
        void *work = aligned_alloc(KT_ALIGNMENT, kt_acceleration_work_size(s->model) * 4 + (1 << 20));
        if (work) {
            memset(work, 0, kt_acceleration_work_size(s->model) * 4);
            answer(model, s->data, &s->g, wrong_v, work, &mine);
            answer(alone, data, &s->g, wrong_v, work, &theirs);
            unequal += !are_equal(s, model, alone, index, &mine, &theirs);
            ++*sets;
        }
        free(work);
        kt_test_release(data);
        kt_test_release(alone);
    }
    return unequal;
}

KT_TEST(each_set_is_the_model_that_never_had_the_others) {
    kt_random random = kt_random_of_test();
    int unequal = 0, sets = 0;
    for (int n = 0; n < 12; n++) {
        tangle_plan plan = n % 2 ? tangle_plan_planar() : tangle_plan_default();
        static switched s;
        plan.loops = 3;
        plan.still = n % 3 == 0;
        grow(&s, &plan, &random);
        unequal += count_unequal(&s, &random, &sets);
    }
    kt_check_above("sets", sets, 700);
    kt_check_equal_int("sets whose model is another", unequal, 0);
}

/* The velocities v+ fit the loops, and M (v+ - v) is a combination of the loops' rows. It has no component along the
 * remaining freedoms. These conditions have one solution. The loss is d'M d / 2. */
KT_TEST(an_impact_is_nearest_in_the_mass_metric) {
    kt_random random = kt_random_of_test();
    KT_WORST fits = kt_worst_make("A v+ - b'"), normal = kt_worst_make("N' M (v+ - v)"),
             loss = kt_worst_make("energy lost");
    for (int n = 0; n < 60; n++) {
        tangle_plan plan = n % 2 ? tangle_plan_planar() : tangle_plan_default();
        static switched s;
        static double basis[NV * NV], mass[NV * NV], jacobian[ROWS * NV], rate[ROWS];
        double before[NV], after[NV], md[NV];
        kt_impact impact = {0.0, 0.0};
        kt_error e = {0};
        int columns = 0;
        grow(&s, &plan, &random);
        const kt_model *model = kt_model_switched(s.model, kt_switch_set(s.model) | ((1u << s.g.loops) - 1));
        const int nv = kt_model_nv(model), rows = kt_model_mobility(model).equations;
        for (int i = 0; i < nv; i++)
            before[i] = after[i] = kt_random_uniform(&random, -1.0, 1.0);
        kt_data *data = kt_test_data(model);
        if (tangle_reach(&s.g, false) < 1e3 &&
            kt_fine("impact", kt_velocity_impact(model, data, s.g.t, s.g.q, after, &impact, &e), &e) &&
            kt_fine("mass", kt_dynamics_mass(model, data, s.g.q, mass, &e), &e) &&
            kt_fine("rows", kt_loop_equations(model, data, s.g.t, s.g.q, NULL, jacobian, NULL, rate, NULL, &e), &e) &&
            kt_fine("basis", kt_loop_nullspace(model, data, s.g.t, s.g.q, basis, &columns, &e), &e)) {
            double twice = 0.0, kinetic = 0.0, size = 0.0;
            for (int i = 0; i < nv; i++) {
                md[i] = 0.0;
                for (int j = 0; j < nv; j++)
                    md[i] += mass[j * nv + i] * (after[j] - before[j]);
                size = fmax(size, fabs(md[i]));
                twice += md[i] * (after[i] - before[i]);
            }
            for (int j = 0; j < nv; j++)
                for (int i = 0; i < nv; i++)
                    kinetic += 0.5 * mass[j * nv + i] * (after[i] * after[j] - before[i] * before[j]);
            for (int c = 0; c < columns; c++) {
                double along = 0.0;
                for (int i = 0; i < nv; i++)
                    along += basis[c * nv + i] * md[i];
                kt_worst_near(&normal, along, 0.0, 1e-11 * size, "%d, direction %d", n, c);
            }
            for (int r = 0; r < rows; r++) {
                double sum = -rate[r], most = fabs(rate[r]);
                for (int i = 0; i < nv; i++) {
                    sum += jacobian[i * rows + r] * after[i];
                    most = fmax(most, fabs(jacobian[i * rows + r] * after[i]));
                }
                kt_worst_near(&fits, sum, 0.0, 1e-12 * fmax(most, 1.0), "%d, row %d", n, r);
            }
            kt_worst_near(&loss, impact.dissipated, 0.5 * twice, 1e-13 * twice, "%d", n);
            kt_worst_near(&loss, impact.supplied - impact.dissipated, kinetic, 1e-11 * twice, "%d, change", n);
        }
    }
}

/* A uniform rod flies across its length at v, and a pin catches its end. It then turns at `3 v / 2 L`, and loses a
 * quarter of its energy. */
KT_TEST(a_rod_that_is_caught_at_its_end_loses_a_quarter) {
    const double m = 1.3, l = 0.8, speed = 2.5;
    kt_impact impact = {0.0, 0.0};
    kt_error e = {0};
    kt_body rod = kt_body_of("rod", NULL, KT_JOINT_PLANAR, m);
    rod.inertia.yy = rod.inertia.zz = m * l * l / 12.0;
    kt_loop pin = kt_loop_of("pin", KT_LOOP_SPHERICAL);
    pin.between[0].at = (kt_vec3){-l / 2.0, 0.0, 0.0};
    pin.between[1].body = "rod";
    pin.between[1].at = (kt_vec3){-l / 2.0, 0.0, 0.0};
    pin.switching = KT_SWITCHED_OFF;
    kt_description d = kt_description_of(&rod, 1, &pin, 1, NULL, 0);
    kt_model *compiled = kt_test_model(&d, NULL);
    kt_data *data = kt_test_data(compiled);
    const kt_model *model = compiled;
    const double q[3] = {0.0, 0.0, 0.0};
    double v[3] = {0.0, speed, 0.0};
    kt_check_equal_int("off at first", (int)kt_switch_set(model), 0);
    kt_check_true("impact without it",
                  kt_velocity_impact(model, data, 0.0, q, v, &impact, &e) == KT_OK && impact.dissipated == 0.0);
    kt_interpose_start();
    kt_check_true("kinematics", kt_kinematics_update(model, data, q, NULL, NULL, &e) == KT_OK &&
                                    isfinite(kt_body_pose(model, data, 1).rotation.x.x));
    kt_check_true("switched on", kt_loop_set_on(&model, data, 0, true, &e) == KT_OK);
    kt_check_true("no poses of the model before", !isfinite(kt_body_pose(model, data, 1).rotation.x.x));
    kt_check_true("impact", kt_velocity_impact(model, data, 0.0, q, v, &impact, &e) == KT_OK);
    kt_check_equal_int("allocations", kt_interpose_stop(), 0);
    kt_check_near("turn", v[2], 1.5 * speed / l, 8.0 * DBL_EPSILON * speed / l);
    kt_check_near("speed", v[1], 0.75 * speed, 8.0 * DBL_EPSILON * speed);
    kt_check_near("loss", impact.dissipated, 0.125 * m * speed * speed, 8.0 * DBL_EPSILON * m * speed * speed);
    kt_check_near("supplied", impact.supplied, 0.0, 0.0);
}

/* A rod in its plane, and a pin above that plane, which it cannot reach. While the pin is off, the rod is computed in
 * the plane. If it is on, the rod is computed in space, which finds that the loop does not close. */
KT_TEST(a_loop_that_is_off_keeps_nothing_out_of_its_plane) {
    kt_body rod = kt_body_of("rod", NULL, KT_JOINT_PLANAR, 0.0);
    rod.mass = rod.inertia.yy = rod.inertia.zz = 1.0;
    kt_loop pin = kt_loop_of("pin", KT_LOOP_SPHERICAL);
    pin.between[0].at = (kt_vec3){0.0, 0.0, 0.3};
    pin.between[1].body = "rod";
    pin.switching = KT_SWITCHED_OFF;
    kt_description d = kt_description_of(&rod, 1, &pin, 1, NULL, 0);
    kt_model *model = kt_test_model(&d, NULL);
    kt_check_text("off", kt_model_plan(model), "planar");
    kt_check_text("on", kt_model_plan(kt_model_switched(model, 1)), "spatial");
}

/* A state off the loops takes iterations to project. They are reported after a switch, too. */
KT_TEST(a_switch_keeps_the_count_of_iterations) {
    kt_random random = kt_random_of_test();
    tangle_plan plan = tangle_plan_default();
    static switched s;
    kt_error e = {0};
    double q[KT_TREE_NQ], v[NV], apart[NV];
    plan.types = 1u << KT_LOOP_DISTANCE;
    grow(&s, &plan, &random);
    for (int i = 0; i < NV; i++)
        apart[i] = kt_random_uniform(&random, -1e-4, 1e-4);
    const kt_model *model = s.model;
    kt_iterations count[2];
    for (int k = 0; k < 2; k++) {
        kt_position_add(model, s.g.q, apart, q);
        memcpy(v, s.g.v, sizeof v);
        kt_need_fine("project", kt_state_project(model, s.data, s.g.t, q, v, NULL, &e), &e);
        if (k > 0)
            kt_need_fine("switch", kt_effect_set_on(&model, s.data, 1, true, &e), &e);
        count[k] = kt_data_iterations(s.data);
    }
    kt_check_true("another model", model != s.model);
    kt_check_above("iterations", count[0].position, 0.0);
    kt_check_equal_int("after a switch", count[1].position, count[0].position);
}

/* Mistakes of a caller, and the state that they leave unchanged. */
KT_TEST(switching_rejects_what_is_no_switch) {
    kt_random random = kt_random_of_test();
    tangle_plan plan = tangle_plan_default();
    static switched s;
    kt_error e = {0};
    grow(&s, &plan, &random);
    const kt_model *model = s.model;
    kt_check_true("no such loop", kt_loop_set_on(&model, s.data, 99, true, &e) == KT_ERROR_ARGUMENT);
    kt_check_true("of another mechanism",
                  kt_loop_set_on(&model, s.g.tree.data, 0, true, &e) == KT_ERROR_ARGUMENT && model == s.model);
    kt_check_true("not switched", kt_loop_switch(s.g.tree.model, 0) == -1 && kt_switch_count(s.g.tree.model) == 0);
    kt_check_true("no such set", kt_model_switched(model, (uint64_t)1 << kt_switch_count(model)) == NULL);
    kt_check_true("itself", kt_model_switched(s.g.tree.model, 0) == s.g.tree.model);
    kt_check_true("names", strcmp(kt_switch_name(model, 0), kt_loop_name(model, 0)) == 0 &&
                               strcmp(kt_switch_name(model, s.g.loops + 2), "air") == 0 &&
                               kt_switch_name(model, s.g.loops + 3) == NULL);
    kt_check_equal_int("effect", kt_effect_switch(model, 1), s.g.loops + 1);
    s.g.loop[0].switching = KT_SWITCHING_COUNT;
    kt_check_true("no kind of switching",
                  kt_description_check(&s.g.tree.description, NULL, NULL, &e) == KT_ERROR_MODEL);
}

/* A parameter is set in all models; those of effects in their own order, those of loops where they are on. */
KT_TEST(a_parameter_is_set_in_every_set) {
    kt_random random = kt_random_of_test();
    tangle_plan plan = tangle_plan_default();
    static switched s;
    kt_error e = {0};
    plan.types = 1u << KT_LOOP_DISTANCE;
    grow(&s, &plan, &random);
    const size_t size = kt_model_size(s.model);
    void *memory = aligned_alloc(KT_ALIGNMENT, size);
    kt_model *copy = NULL;
    kt_parameter p;
    char name[64];
    (void)snprintf(name, sizeof name, "loop %s.length", kt_loop_name(s.model, 0));
    const char *const names[3] = {"effect coil.stiffness", "effect air.linear", name};
    const double values[3][4] = {{17.0}, {0.9}, {3.25, 0.0, 0.0, 0.0}};
    int wrong = 0;
    if (memory && kt_fine("copy", kt_model_copy(s.model, memory, size, &copy, &e), &e))
        for (int k = 0; k < 3; k++) {
            kt_check_true("found", kt_parameter_find(copy, names[k], &p, &e) == KT_OK);
            kt_check_true("set", kt_parameter_set(copy, &p, values[k], &e) == KT_OK);
            for (uint64_t set = 0; set < (uint64_t)1 << kt_switch_count(copy); set++) {
                const kt_model *model = kt_model_switched(copy, set);
                double got[6] = {0.0};
                wrong += kt_parameter_find(model, names[k], &p, &e) != KT_OK ||
                         kt_parameter_get(model, &p, got, &e) != KT_OK || got[0] != values[k][0] ||
                         kt_switch_set(model) != set;
            }
        }
    kt_check_equal_int("sets with another number", wrong, 0);
    free(memory);
}

/* An arm is given at 0.3 rad, and a motion holds it at 0.5 rad. Two springs on its tip have no given length. Therefore
 * they store no energy at 0.5 rad, where the arm starts, in each set. */
KT_TEST(springs_without_a_length_start_unstretched_in_every_set) {
    static const double angle[] = {0.5, 0.9};
    kt_body arm = kt_body_of("arm", NULL, KT_JOINT_REVOLUTE, 1.0);
    kt_loop hold = kt_loop_of("hold", KT_LOOP_MOTION);
    kt_effect spring[2];
    kt_error e = {0};
    arm.joint.axis = kt_vec3_make(0.0, 0.0, 1.0);
    arm.joint.position[0] = 0.3;
    arm.inertia = kt_sym3_make(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
    hold.joint = "arm";
    hold.function = kt_function_constant(angle[0]);
    for (int i = 0; i < 2; i++) {
        spring[i] = kt_effect_of(KT_EFFECT_SPRING, NULL);
        spring[i].name = i == 0 ? "switched" : "always";
        spring[i].between[0].body = "arm";
        spring[i].between[0].at = kt_vec3_make(1.0, 0.0, 0.0);
        spring[i].between[1].at = kt_vec3_make(2.0, 3.0 * i, 0.0);
        spring[i].stiffness = 10.0;
        spring[i].initial_length = true;
    }
    spring[0].switching = KT_SWITCHED_ON;
    const kt_description d = kt_description_of(&arm, 1, &hold, 1, spring, 2);
    const kt_model *model = kt_test_model(&d, NULL);
    kt_data *data = kt_test_data(model);
    for (uint64_t set = 0; set < 2; set++) {
        const kt_model *one = kt_model_switched(model, set);
        for (int i = 0; i < 2; i++) {
            const double v = 0.0;
            kt_need_fine("kinematics", kt_kinematics_update(one, data, &angle[i], &v, NULL, &e), &e);
            const double energy = kt_effect_energy(one, data, 0.0, &angle[i], &v);
            if (i == 0)
                kt_check_near("energy at the start, J", energy, 0.0, 5.0 * pow(16.0 * DBL_EPSILON, 2.0));
            else
                kt_check_above("energy elsewhere, J", energy, 0.1);
        }
    }
}
