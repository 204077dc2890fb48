/* Spatial tendons around spheres and cylinders, read here and by MuJoCo itself, in random models and states. They have
 * the same lengths, rates and forces. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mujoco_pair.h"

#include "kinetree/export.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MODELS = 150, STATES = 10, TENDONS = 4, NV = 8 };

static void write_surface(FILE *to, kt_random *random, int index) {
    const bool is_cylinder = kt_random_int(random, 0, 1) == 1;
    const double r = kt_random_uniform(random, 0.05, 0.2);
    double d[3], axis[3];
    kt_random_direction(random, 3, d);
    kt_random_direction(random, 3, axis);
    const double far =
        kt_random_int(random, 0, 1) ? kt_random_uniform(random, 1.1, 4.0) : kt_random_uniform(random, 0.0, 0.9);
    const double at[3] = {kt_random_uniform(random, -0.2, 0.2), kt_random_uniform(random, -0.2, 0.2),
                          kt_random_uniform(random, -0.2, 0.2)};
    fprintf(to,
            "<geom name='g%d' type='%s' size='%.17g 0.3' pos='%.17g %.17g %.17g' zaxis='%.17g %.17g %.17g' mass='0'/>",
            index, is_cylinder ? "cylinder" : "sphere", r, at[0], at[1], at[2], axis[0], axis[1], axis[2]);
    fprintf(to, "<site name='side%d' pos='%.17g %.17g %.17g'/>", index, at[0] + far * r * d[0], at[1] + far * r * d[1],
            at[2] + far * r * d[2]);
}

static void write_body(FILE *to, kt_random *random, int index) {
    for (int k = 0; k < 2; k++)
        fprintf(to, "<site name='s%d_%d' pos='%.17g %.17g %.17g'/>", index, k, kt_random_uniform(random, -0.5, 0.5),
                kt_random_uniform(random, -0.5, 0.5), kt_random_uniform(random, -0.5, 0.5));
    write_surface(to, random, index);
}

static void write_wrap(FILE *to, kt_random *random) {
    const int surface = kt_random_int(random, 0, 3);
    fprintf(to, "<geom geom='g%d'", surface);
    if (kt_random_int(random, 0, 1))
        fprintf(to, " sidesite='side%d'", surface);
    fputs("/>", to);
}

static void write_tendon(FILE *to, kt_random *random, int index) {
    fprintf(to, "<spatial name='t%d' stiffness='%.17g' damping='%.17g'>", index, kt_random_uniform(random, 1.0, 20.0),
            kt_random_uniform(random, 0.1, 2.0));
    const int count = kt_random_int(random, 2, 4);
    for (int k = 0; k < count; k++) {
        fprintf(to, "<site site='s%d_%d'/>", k, kt_random_int(random, 0, 1));
        if (k + 1 < count && kt_random_int(random, 0, 3) > 0)
            write_wrap(to, random);
        else if (k == 1 && count == 4)
            fprintf(to, "<pulley divisor='%.17g'/>", kt_random_uniform(random, 0.5, 3.0));
    }
    fputs("</spatial>", to);
}

/* An arm of two bodies with a ball joint between them, and a slider. */
static void write_model(FILE *to, kt_random *random) {
    fputs("<mujoco><compiler angle='radian'/><default><geom contype='0' conaffinity='0'/></default><worldbody>", to);
    write_body(to, random, 0);
    fputs("<body name='a' pos='0 0 0.3'><joint name='a' axis='0 1 0.2'/><inertial pos='0 0 0' mass='1' diaginertia='1 "
          "1 1'/>",
          to);
    write_body(to, random, 1);
    fputs("<body name='b' pos='0.4 0 0'><joint name='b' type='ball'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 "
          "1'/>",
          to);
    write_body(to, random, 2);
    fputs(
        "</body></body><body name='c' pos='0 0.5 0'><joint name='c' type='slide' axis='1 0.2 0'/><inertial pos='0 0 0' "
        "mass='1' diaginertia='1 1 1'/>",
        to);
    write_body(to, random, 3);
    fputs("</body></worldbody><tendon>", to);
    for (int i = 0; i < TENDONS; i++)
        write_tendon(to, random, i);
    fputs("</tendon></mujoco>", to);
}

static bool load(mujoco_pair *p, const char *path) {
    load_mujoco_pair(p, path, NULL);
    mj_fwdPosition(p->m, p->d); /* where the springs have no force */
    return kt_check_equal_int("velocities", kt_model_nv(p->model), p->m->nv);
}

/* The joints have the same order in both. */
static void set_state(mujoco_pair *p, kt_random *random) {
    for (int i = 0; i < p->m->nq; i++)
        p->d->qpos[i] = kt_random_uniform(random, -1.0, 1.0);
    mj_normalizeQuat(p->m, p->d->qpos);
    for (int i = 0; i < p->m->nv; i++)
        p->d->qvel[i] = kt_random_uniform(random, -1.0, 1.0);
    mj_fwdPosition(p->m, p->d);
    mj_fwdVelocity(p->m, p->d);
}

/* The length and the rate of a tendon, by its effect. */
static void find_motion(mujoco_pair *p, const char *name, double found[2]) {
    double values[64];
    int at = 0;
    kt_error error = {0};
    found[0] = found[1] = (double)NAN;
    if (kt_kinematics_update(p->model, p->data, p->d->qpos, p->d->qvel, NULL, &error) != KT_OK ||
        kt_effect_quantities_evaluate(p->model, p->data, 0.0, p->d->qpos, p->d->qvel, values, &error) != KT_OK)
        return;
    for (int i = 0; i < p->scene->description.effect_count; i++)
        for (int k = 0; k < kt_effect_quantity_count(p->model, i); k++, at++) {
            const kt_effect_quantity quantity = kt_effect_quantity_at(p->model, i, k);
            if (strcmp(p->scene->description.effects[i].name, name) != 0)
                continue;
            if (quantity == KT_QUANTITY_LENGTH || quantity == KT_QUANTITY_LENGTH_RATE)
                found[quantity == KT_QUANTITY_LENGTH_RATE] = values[at];
        }
}

static kt_vec3 vector_at(const mjtNum *x) { return kt_vec3_make(x[0], x[1], x[2]); }

/* Whether a side site is outside of the surface, but inside of the circle around which the path leads: MuJoCo 2.2 has a
 * ring there, and later versions a surface, as we have. */
static bool is_ambiguous(const mujoco_pair *p, int wrap) {
    const mjModel *m = p->m;
    const int side = (int)m->wrap_prm[wrap], geom = m->wrap_objid[wrap];
    if ((m->wrap_type[wrap] != mjWRAP_SPHERE && m->wrap_type[wrap] != mjWRAP_CYLINDER) || side < 0)
        return false;
    const kt_vec3 centre = vector_at(p->d->geom_xpos + 3 * geom);
    const kt_vec3 s = kt_vec3_sub(vector_at(p->d->site_xpos + 3 * side), centre);
    const kt_vec3 a = kt_vec3_sub(vector_at(p->d->site_xpos + 3 * m->wrap_objid[wrap - 1]), centre);
    const kt_vec3 b = kt_vec3_sub(vector_at(p->d->site_xpos + 3 * m->wrap_objid[wrap + 1]), centre);
    const mjtNum *x = p->d->geom_xmat + 9 * geom;
    const bool is_sphere = m->wrap_type[wrap] == mjWRAP_SPHERE;
    const kt_vec3 n = kt_vec3_normalize(is_sphere ? kt_vec3_cross(a, b) : kt_vec3_make(x[2], x[5], x[8]));
    const double r = m->geom_size[3 * geom];
    return kt_vec3_norm(s) >= r && kt_vec3_norm(kt_vec3_cross(n, s)) < r;
}

static bool is_compared(const mujoco_pair *p) {
    for (int i = 0; i < p->m->nwrap; i++)
        if (is_ambiguous(p, i))
            return false;
    return true;
}

/* Whether all tendons have the length that MuJoCo finds; counts those that have not. MuJoCo takes a default point of a
 * ring that a line nearly touches, within some 1e-4 rad, as its iteration would begin beyond the solution there. */
static bool have_lengths(mujoco_pair *p, kt_worst *length, int *lost) {
    bool all = true;
    for (int t = 0; t < TENDONS; t++) {
        double found[2];
        char name[8];
        (void)snprintf(name, sizeof name, "t%d", t);
        find_motion(p, name, found);
        if (isnan(found[0])) /* all on one body */
            continue;
        const bool is_longer = found[0] < p->d->ten_length[t] - 1e-12;
        all = all && !is_longer;
        *lost += is_longer;
        if (!is_longer)
            kt_worst_near(length, found[0], p->d->ten_length[t], 1e-12, "%s", name);
    }
    return all;
}

static void compare_forces(mujoco_pair *p, kt_worst *rate, kt_worst *force) {
    double ours[NV];
    kt_error error = {0};
    for (int t = 0; t < TENDONS; t++) {
        double found[2];
        char name[8];
        (void)snprintf(name, sizeof name, "t%d", t);
        find_motion(p, name, found);
        if (!isnan(found[0]))
            kt_worst_near(rate, found[1], p->d->ten_velocity[t], 1e-6, "%s", name);
    }
    if (kt_effect_forces(p->model, p->data, 0.0, p->d->qpos, p->d->qvel, ours, &error) != KT_OK)
        kt_check_text("forces", error.message, "");
    for (int j = 0; j < p->m->nv; j++)
        kt_worst_near(force, ours[j], p->d->qfrc_passive[j], 1e-4, "%d", j);
}

/* MuJoCo ends its iteration at a ring at 1e-6, which changes the directions there, and the length to
 * second order. Tensions are up to some 50 N. */
KT_TEST(tendons_around_geoms_are_those_of_mujoco) {
    kt_random random = kt_random_of_test();
    KT_WORST length = kt_worst_make("length"), rate = kt_worst_make("rate"), force = kt_worst_make("force");
    char path[] = "/tmp/kinetree-wrap-XXXXXX.xml";
    const int file = mkstemps(path, 4);
    int bent = 0, states = 0, lost = 0;
    kt_need(kt_check_true("there is a file", file >= 0));
    for (int i = 0; i < MODELS; i++) {
        mujoco_pair p;
        FILE *to = fopen(path, "w");
        write_model(to, &random);
        fclose(to);
        const bool is_fine = load(&p, path) && is_compared(&p) && have_lengths(&p, &length, &lost);
        for (int k = 0; is_fine && k < STATES; k++) {
            set_state(&p, &random);
            if (!is_compared(&p) || !have_lengths(&p, &length, &lost))
                continue;
            states++;
            for (int t = 0; t < TENDONS; t++)
                bent += p.d->ten_wrapnum[t] > 4;
            compare_forces(&p, &rate, &force);
        }
    }
    (void)remove(path);
    kt_check_below("tendons at a default point of MuJoCo", (double)lost, 5.0);
    kt_check_above("states", (double)states, 300.0);
    kt_check_above("tendons with contact", (double)bent, 100.0);
}

/* Writes what we have read, and lets MuJoCo read it. Returns NULL after reporting. */
static mjModel *give_back(mujoco_pair *p, const char *path) {
    char said[1000] = "";
    kt_error error = {0};
    FILE *to = fopen(path, "w");
    const kt_status status = kt_robot_write_scene(p->scene, KT_ROBOT_MJCF, NULL, to, NULL, NULL, &error);
    fclose(to);
    mjModel *m = status == KT_OK ? mj_loadXML(path, NULL, said, sizeof said) : NULL;
    if (m == NULL)
        kt_check_text("MuJoCo reads what is written", status == KT_OK ? said : error.message, "");
    return m;
}

/* Springs and dampers along paths are written as tendons. MuJoCo has the same passive forces for both files. */
KT_TEST(tendons_that_are_written_are_those_that_were_read) {
    kt_random random = kt_random_of_test();
    KT_WORST force = kt_worst_make("force");
    char path[] = "/tmp/kinetree-wrap-XXXXXX.xml";
    const int file = mkstemps(path, 4);
    int tendons = 0;
    kt_need(kt_check_true("there is a file", file >= 0));
    for (int i = 0; i < MODELS / 5; i++) {
        mujoco_pair p;
        FILE *to = fopen(path, "w");
        write_model(to, &random);
        fclose(to);
        const bool is_fine = load(&p, path) && is_compared(&p);
        mjModel *m = is_fine ? give_back(&p, path) : NULL;
        mjData *d = m != NULL ? mj_makeData(m) : NULL;
        tendons += m != NULL ? m->ntendon : 0;
        for (int k = 0; d != NULL && k < STATES; k++) {
            set_state(&p, &random);
            if (!is_compared(&p))
                continue;
            memcpy(d->qpos, p.d->qpos, (size_t)m->nq * sizeof *d->qpos);
            memcpy(d->qvel, p.d->qvel, (size_t)m->nv * sizeof *d->qvel);
            mj_fwdPosition(m, d);
            mj_fwdVelocity(m, d);
            for (int j = 0; j < m->nv; j++)
                kt_worst_near(&force, d->qfrc_passive[j], p.d->qfrc_passive[j], 1e-11, "model %d, %d", i, j);
        }
        if (d != NULL)
            mj_deleteData(d);
        if (m != NULL)
            mj_deleteModel(m);
    }
    (void)remove(path);
    kt_check_above("tendons", (double)tendons, 40.0);
}
