/* Muscles of MJCF, read here and by MuJoCo itself, in random models and states: forces, and rates of activations. The
 * ranges of lengths that are found are those that a search with MuJoCo's kinematics finds. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mujoco_pair.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MODELS = 60, STATES = 20, NV = 3, MUSCLES = 5 };

/* ---- random models ----------------------------------------------------------------------------------------------- */

static double between(kt_random *random, double lower, double upper) { return kt_random_uniform(random, lower, upper); }

static void write_link(FILE *to, kt_random *random, const char *name, const char *joint, double most) {
    fprintf(to, "<body name='%s' pos='%.17g 0 -0.4'><joint name='%s' %s axis='%.17g 1 0.1' armature='0.02' ", name,
            between(random, -0.05, 0.05), name, joint, between(random, -0.3, 0.3));
    fprintf(to, "limited='true' range='%.17g %.17g' ref='%.17g'/>", between(random, -most, -0.3),
            between(random, 0.2, most), between(random, -0.1, 0.1));
    fprintf(to, "<geom type='capsule' fromto='0 0 0 0 0 -.4' size='.03' mass='%.17g'/>", between(random, 0.5, 2.0));
    fprintf(to, "<geom name='wrap_%s' type='cylinder' size='%.17g .2' zaxis='0 1 0' mass='0'/>", name,
            between(random, 0.03, 0.08));
    fprintf(to, "<site name='%s' pos='%.17g %.17g %.17g'/><site name='side_%s' pos='.3 0 0'/>", name,
            between(random, 0.05, 0.15), between(random, -0.05, 0.05), between(random, -0.3, -0.1), name);
}

/* With the numbers of <muscle>, or the same as those of <general>. */
static void write_muscle(FILE *to, kt_random *random, const char *name, const char *line, bool has_range) {
    double n[9] = {between(random, 0.6, 0.9),    between(random, 1.0, 1.3), between(random, 0.0, 100.0),
                   between(random, 50.0, 300.0), between(random, 0.1, 0.3), between(random, 1.4, 2.0),
                   between(random, 0.5, 2.0),    between(random, 0.5, 2.0), between(random, 1.0, 1.5)};
    const double tau[2] = {between(random, 0.005, 0.1), between(random, 0.01, 0.1)};
    const bool is_general = kt_random_int(random, 0, 1) == 1, is_scaled = kt_random_int(random, 0, 1) == 1;
    n[2] = is_scaled ? -1.0 : n[2];
    fprintf(to, "<%s name='%s' %s gear='%.17g' ", is_general ? "general" : "muscle", name, line,
            copysign(between(random, 0.5, 1.5), between(random, -1.0, 1.0)));
    if (has_range)
        fprintf(to, "lengthrange='%.17g %.17g' ", between(random, -1.8, -1.0), between(random, 1.0, 1.8));
    if (kt_random_int(random, 0, 3) == 0)
        fprintf(to, "forcelimited='true' forcerange='%.17g 0' ", between(random, -50.0, -5.0));
    if (is_general) {
        fprintf(to, "dyntype='muscle' gaintype='muscle' biastype='muscle' dynprm='%.17g %.17g' gainprm='", tau[0],
                tau[1]);
        for (int k = 0; k < 18; k++)
            fprintf(to, "%s %.17g", k == 9 ? "' biasprm='" : "", n[k % 9]);
        fputs("'/>", to);
        return;
    }
    fprintf(to, "timeconst='%.17g %.17g' range='%.17g %.17g' force='%.17g' scale='%.17g' lmin='%.17g' ", tau[0], tau[1],
            n[0], n[1], n[2], n[3], n[4]);
    fprintf(to, "lmax='%.17g' vmax='%.17g' fpmax='%.17g' fvmax='%.17g'/>", n[5], n[6], n[7], n[8]);
}

static void write_path(FILE *to, const char *name, const char *wrap) {
    fprintf(to, "<spatial name='%s'><site site='base'/>", name);
    fprintf(to, "<geom geom='wrap_a' sidesite='side_a'/><site site='a'/>%s<site site='b'/></spatial>", wrap);
}

/* The ranges of lengths: of the file, or those that MuJoCo finds. */
typedef enum ranges { GIVEN, FOUND } ranges;

/* An arm of two hinges and a slider, with muscles in joints, along fixed tendons and along spatial ones. */
static void write_model(FILE *to, kt_random *random, ranges kind) {
    const double most = 1.2;
    static const char *const lines[MUSCLES] = {"joint='a'", "joint='c'", "tendon='f'", "tendon='s'", "tendon='w'"};
    static const char *const names[MUSCLES] = {"m0", "m1", "m2", "m3", "m4"};
    fputs("<mujoco><compiler angle='radian'/><default><geom contype='0' conaffinity='0'/></default><worldbody>", to);
    fprintf(to, "<site name='base' pos='%.17g 0 .3'/>", between(random, -0.2, 0.2));
    write_link(to, random, "a", "type='hinge'", most);
    write_link(to, random, "b", "type='hinge'", most);
    write_link(to, random, "c", "type='slide'", 1.2);
    fputs("</body></body></body></worldbody><tendon>", to);
    fprintf(to, "<fixed name='f'><joint joint='a' coef='%.17g'/><joint joint='b' coef='%.17g'/></fixed>",
            between(random, 0.2, 1.0), between(random, -1.0, -0.2));
    write_path(to, "s", "");
    write_path(to, "w", "<geom geom='wrap_b' sidesite='side_b'/>");
    fputs("</tendon><actuator>", to);
    for (int i = 0; i < MUSCLES; i++)
        write_muscle(to, random, names[i], lines[i], kind == GIVEN);
    fputs("</actuator></mujoco>", to);
}

/* ---- both readers ------------------------------------------------------------------------------------------------ */

/* Without contacts and constraints. */
static bool load(mujoco_pair *p, const char *path) {
    load_mujoco_pair(p, path, NULL);
    p->m->opt.disableflags |= mjDSBL_CONTACT | mjDSBL_CONSTRAINT;
    return kt_check_equal_int("velocities", kt_model_nv(p->model), NV);
}

/* Lets MuJoCo read a model, and write it to the same file. */
static void save_by_mujoco(const char *path) {
    char error[300] = "";
    mjModel *m = mj_loadXML(path, NULL, error, sizeof error);
    kt_check_true(error, m != NULL && mj_saveLastXML(path, m, error, sizeof error) != 0);
    mj_deleteModel(m);
}

/* Reads a random model from a file of its own. */
static bool load_random(mujoco_pair *p, kt_random *random, ranges kind) {
    char path[] = "/tmp/kinetree-muscle-XXXXXX.xml";
    const int file = mkstemps(path, 4);
    FILE *to = file >= 0 ? fdopen(file, "w") : NULL;
    memset(p, 0, sizeof *p);
    if (!kt_check_true("there is a file", to != NULL))
        return false;
    write_model(to, random, kind);
    fclose(to);
    if (kind == FOUND)
        save_by_mujoco(path);
    const bool is_fine = load(p, path);
    (void)remove(path);
    return is_fine;
}

/* The controls are zero in both. */
static void set_state(mujoco_pair *p, kt_random *random) {
    for (int i = 0; i < NV; i++) {
        p->d->qpos[i] = between(random, p->m->jnt_range[2 * i] - 0.1, p->m->jnt_range[2 * i + 1] + 0.1);
        p->d->qvel[i] = between(random, -3.0, 3.0);
    }
    for (int i = 0; i < p->m->na; i++)
        p->d->act[i] = kt_auxiliary_states(p->model, p->data)[i] = between(random, -0.1, 1.2);
    mj_forward(p->m, p->d);
}

/* Whether all muscles are long enough for MuJoCo 2.2, whose active force turns round below the shortest length. */
static bool is_compared(const mujoco_pair *p) {
    bool all = true;
    for (int i = 0; i < p->m->nu; i++) {
        const mjtNum *range = p->m->actuator_lengthrange + 2 * i, *n = p->m->actuator_gainprm + mjNGAIN * i;
        const double unit = (range[1] - range[0]) / (n[1] - n[0]);
        all = all && n[0] + (p->d->actuator_length[i] - range[0]) / unit >= n[4];
    }
    return all;
}

static void compare_forces(mujoco_pair *p, double bound, kt_worst *force, kt_worst *rate) {
    double forces[NV], rates[MUSCLES], most = 1.0;
    kt_error error = {0};
    for (int i = 0; i < NV; i++)
        most = fmax(most, fabs(p->d->qfrc_actuator[i]));
    if (kt_effect_forces(p->model, p->data, 0.0, p->d->qpos, p->d->qvel, forces, &error) != KT_OK ||
        kt_auxiliary_state_rates(p->model, p->data, 0.0, p->d->qpos, p->d->qvel, rates, &error) != KT_OK)
        kt_check_text("forces", error.message, "");
    for (int i = 0; i < NV; i++)
        kt_worst_near(force, forces[i], p->d->qfrc_actuator[i], bound * most, "%d", i);
    for (int i = 0; i < p->m->na && rate != NULL; i++)
        kt_worst_near(rate, rates[i], p->d->act_dot[i], 1e-12 * fmax(1.0, fabs(p->d->act_dot[i])), "%d", i);
}

KT_TEST(muscles_with_given_ranges_pull_as_those_of_mujoco) {
    kt_random random = kt_random_of_test();
    KT_WORST force = kt_worst_make("force"), rate = kt_worst_make("rate of activation");
    int states = 0;
    for (int i = 0; i < MODELS; i++) {
        mujoco_pair p;
        const bool is_fine = load_random(&p, &random, GIVEN);
        for (int k = 0; k < STATES && is_fine; k++) {
            set_state(&p, &random);
            if (!is_compared(&p))
                continue;
            states++;
            compare_forces(&p, 1e-12, &force, &rate);
        }
    }
    kt_check_above("states", (double)states, 0.8 * MODELS * STATES);
}

/* MuJoCo finds the ranges by a simulation, and writes them with the model. */
KT_TEST(models_that_mujoco_has_written_have_the_ranges_of_their_muscles) {
    kt_random random = kt_random_of_test();
    KT_WORST force = kt_worst_make("force"), rate = kt_worst_make("rate of activation");
    int states = 0, found = 0;
    for (int i = 0; i < MODELS / 4; i++) {
        mujoco_pair p;
        const bool is_fine = load_random(&p, &random, FOUND);
        for (int k = 0; k < p.m->nu && is_fine; k++)
            found += p.m->actuator_lengthrange[2 * k] < p.m->actuator_lengthrange[2 * k + 1];
        for (int k = 0; k < STATES && is_fine; k++) {
            set_state(&p, &random);
            if (!is_compared(&p))
                continue;
            states++;
            compare_forces(&p, 1e-11, &force, &rate);
        }
    }
    kt_check_equal_int("ranges", found, MODELS / 4 * MUSCLES);
    kt_check_above("states", (double)states, 0.5 * MODELS / 4 * STATES);
}
