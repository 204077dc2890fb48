/* SPDX-License-Identifier: Apache-2.0 */
#include "draw.h"

#include <stdbool.h>

enum { BODIES = 5, JOINTS = 2 * BODIES, TENDONS = 2, ACTUATORS = 6, MESHES = 3, EQUALITIES = 3 };

/* The elements written so far: the scalar joints and tendons that others refer to. */
typedef struct drawing {
    FILE *to;
    kt_random *random;
    int body_count, joint_count, tendon_count, fixed_count, actuator_count;
    int parent[BODIES], body_of[JOINTS];
    bool is_scalar[JOINTS], is_bounded[BODIES], has_meshes; /* of bodies: by actuatorfrcrange of a joint */
    bool is_repeated[TENDONS];                              /* has a joint twice */
} drawing;

static double real(drawing *d, double lower, double upper) { return kt_random_uniform(d->random, lower, upper); }
static bool chance(drawing *d, int of) { return kt_random_int(d->random, 1, of) == 1; }

static void put(drawing *d, const char *name, int count, double lower, double upper) {
    fprintf(d->to, " %s=\"", name);
    for (int i = 0; i < count; i++)
        fprintf(d->to, "%s%.6g", i > 0 ? " " : "", real(d, lower, upper));
    fprintf(d->to, "\"");
}

/* Two numbers, the first below the second. */
static void put_range(drawing *d, const char *name, double size) {
    fprintf(d->to, " %s=\"%.6g %.6g\"", name, -real(d, 0.05, 1.0) * size, real(d, 0.05, 1.0) * size);
}

/* ---- meshes ------------------------------------------------------------------------------------------------------ */

/* Numbers that single precision has, which is MuJoCo's of vertices. */
static void put_vector(drawing *d, const char *name, int first, int last) {
    fprintf(d->to, " %s=\"", name);
    for (int k = 0; k < 3; k++)
        fprintf(d->to, "%s%.10g", k > 0 ? " " : "", (double)kt_random_int(d->random, first, last) / 64.0);
    fprintf(d->to, "\"");
}

/* A mesh of vertices alone, whose faces are those of their hull. Or a cube with corners at random distances, a star
 * that encloses less than its hull does. */
static void write_mesh(drawing *d, int index) {
    static const char *const rules[] = {"legacy", "exact", "convex", "shell"};
    const bool is_cloud = chance(d, 2);
    const int rule = kt_random_int(d->random, 0, 3);
    const int count = is_cloud ? kt_random_int(d->random, 5, 40) : 8;
    fprintf(d->to, "<mesh name=\"m%d\"", index);
    if (rule > 0 || chance(d, 2))
        fprintf(d->to, " inertia=\"%s\"", rules[rule]);
    if (is_cloud || rule == 2 || chance(d, 2))
        put_vector(d, "scale", 16, 64);
    else
        put_vector(d, "scale", -64, -16); /* MuJoCo rejects a hull in a mirror */
    if (chance(d, 2))
        put_vector(d, "refpos", -32, 32);
    if (chance(d, 3))
        fprintf(d->to, " refquat=\"0 0 1 0\"");
    fprintf(d->to, " vertex=\"");
    for (int i = 0; i < count; i++) {
        const double radius = (double)kt_random_int(d->random, 8, 24) / 64.0;
        for (int k = 0; k < 3; k++)
            fprintf(d->to, "%.10g ",
                    is_cloud            ? (double)kt_random_int(d->random, -20, 20) / 64.0
                    : (i >> k & 1) != 0 ? radius
                                        : -radius);
    }
    if (!is_cloud) /* the corners' bits are x, y and z */
        fprintf(d->to, "\" face=\"0 2 3 0 3 1 4 5 7 4 7 6 0 1 5 0 5 4 2 6 7 2 7 3 0 4 6 0 6 2 1 3 7 1 7 5");
    fprintf(d->to, "\"/>\n");
}

/* ---- bodies ------------------------------------------------------------------------------------------------------ */

/* `can_be_any`: a shell, a mesh, or a solid that is fitted to a mesh, too. */
static void write_geom(drawing *d, bool can_be_any) {
    static const char *const types[] = {"sphere", "capsule", "ellipsoid", "cylinder", "box"};
    const int type = kt_random_int(d->random, 0, 4);
    const bool has_mesh = can_be_any && d->has_meshes && chance(d, 3), is_mesh = has_mesh && !chance(d, 3);
    fprintf(d->to, "<geom type=\"%s\"", is_mesh ? "mesh" : types[type]);
    if (has_mesh)
        fprintf(d->to, " mesh=\"m%d\"", kt_random_int(d->random, 0, MESHES - 1));
    else
        put(d, "size", 3, 0.05, 0.3);
    if (has_mesh && chance(d, 2))
        put(d, "fitscale", 1, 0.5, 1.5);
    put(d, "pos", 3, -0.3, 0.3);
    put(d, "euler", 3, -90.0, 90.0);
    if (chance(d, 2))
        put(d, "mass", 1, 0.3, 2.0);
    if (can_be_any && chance(d, 3) && !is_mesh)
        fprintf(d->to, " shellinertia=\"true\"");
    fprintf(d->to, "/>");
}

/* stiffness and damping, of which newer versions take polynomials. */
static void write_springs(drawing *d, bool can_be_polynomial) {
    if (chance(d, 2))
        put(d, "stiffness", can_be_polynomial && chance(d, 3) ? 3 : 1, 0.5, 10.0);
    if (chance(d, 2))
        put(d, "damping", can_be_polynomial && chance(d, 3) ? 3 : 1, 0.1, 2.0);
}

static void write_joint(drawing *d, int body, bool is_alone) {
    static const char *const types[] = {"hinge", "slide", "ball"};
    const int kind = kt_random_int(d->random, 0, is_alone ? 7 : 5), type = kind < 4 ? 0 : kind < 6 ? 1 : 2;
    const int index = d->joint_count++;
    d->is_scalar[index] = type < 2;
    d->body_of[index] = body;
    fprintf(d->to, "<joint name=\"j%d\" type=\"%s\"", index, types[type < 2 ? type : 2]);
    put(d, "pos", 3, -0.2, 0.2);
    if (type < 2)
        put(d, "axis", 3, -1.0, 1.0);
    write_springs(d, type < 2);
    if (type < 2 && chance(d, 2))
        put(d, "springref", 1, -0.5, 0.5);
    if (type < 2 && chance(d, 2))
        put(d, "ref", 1, -0.5, 0.5);
    if (chance(d, 3))
        put(d, "armature", 1, 0.01, 0.5);
    if (chance(d, 4))
        fprintf(d->to, " springdamper=\"%.6g %.6g\"", real(d, 0.05, 0.5), real(d, 0.3, 2.0));
    if (type < 2 && chance(d, 2)) {
        put_range(d, "actuatorfrcrange", 20.0);
        d->is_bounded[body] = true;
    }
    fprintf(d->to, "/>");
}

static void begin_body(drawing *d, int parent) {
    d->parent[d->body_count] = parent;
    fprintf(d->to, "<body name=\"b%d\"", d->body_count++);
    put(d, "pos", 3, -0.5, 0.5);
    put(d, "euler", 3, -180.0, 180.0);
    if (chance(d, 4))
        put(d, "gravcomp", 1, 0.0, 1.0);
    fprintf(d->to, "><site name=\"s%d\"", d->body_count - 1);
    put(d, "pos", 3, -0.3, 0.3);
    put(d, "euler", 3, -180.0, 180.0);
    fprintf(d->to, "/>");
}

/* A body of one or two joints, with one or two geoms, and those that it carries. */
static void write_body(drawing *d, int parent, int depth) {
    const int body = d->body_count;
    begin_body(d, parent);
    const bool has_two = chance(d, 4);
    for (int i = 0; i < (has_two ? 2 : 1); i++)
        write_joint(d, body, !has_two);
    for (int i = kt_random_int(d->random, 1, 2); i > 0; i--)
        write_geom(d, true);
    while (d->body_count < BODIES - 1 && depth < 3 && chance(d, 2))
        write_body(d, body, depth + 1);
    fprintf(d->to, "</body>\n");
}

/* One that flies, whose frame is perhaps that of its inertia. */
static void write_free_body(drawing *d) {
    begin_body(d, -1);
    fprintf(d->to, "<freejoint name=\"free\"%s/>", chance(d, 2) ? " align=\"true\"" : "");
    write_geom(d, false);
    fprintf(d->to, "</body>\n");
}

/* ---- tendons and actuators --------------------------------------------------------------------------------------- */

static int any_scalar(drawing *d) {
    int joint = kt_random_int(d->random, 0, d->joint_count - 1);
    for (int i = 0; i < d->joint_count && !d->is_scalar[joint]; i++)
        joint = (joint + 1) % d->joint_count;
    return d->is_scalar[joint] ? joint : -1;
}

/* Whether one of two bodies carries the other, or they are one. */
static bool is_chain(const drawing *d, int a, int b) {
    int up = a > b ? a : b;
    while (up > (a > b ? b : a))
        up = d->parent[up];
    return up == (a > b ? b : a);
}

/* A tendon's armature couples branches of the tree, which MuJoCo leaves out: there it has none. */
static void write_tendon(drawing *d) {
    const int count = kt_random_int(d->random, 1, 3);
    int joints[3];
    bool is_one = true;
    for (int i = 0; i < count; i++) {
        joints[i] = any_scalar(d);
        if (joints[i] < 0)
            return;
        for (int k = 0; k < i; k++) {
            d->is_repeated[d->tendon_count] |= joints[i] == joints[k];
            is_one = is_one && is_chain(d, d->body_of[joints[i]], d->body_of[joints[k]]);
        }
    }
    fprintf(d->to, "<fixed name=\"t%d\"", d->tendon_count);
    write_springs(d, true);
    if (is_one && chance(d, 2))
        put(d, "armature", 1, 0.05, 0.5);
    if (chance(d, 3))
        put(d, "springlength", 1, 0.0, 0.5);
    else if (chance(d, 2))
        fprintf(d->to, " springlength=\"%.6g %.6g\"", real(d, 0.0, 0.3), real(d, 0.3, 0.6));
    if (chance(d, 2))
        put_range(d, "actuatorfrcrange", 5.0);
    fprintf(d->to, ">");
    for (int i = 0; i < count; i++) {
        fprintf(d->to, "<joint joint=\"j%d\"", joints[i]);
        put(d, "coef", 1, 0.3, 2.0);
        fprintf(d->to, "/>");
    }
    fprintf(d->to, "</fixed>\n");
    d->tendon_count++;
}

/* Two or three sites. MuJoCo takes no site twice in a row. */
static void write_spatial(drawing *d) {
    const int first = kt_random_int(d->random, 0, d->body_count - 1);
    if (d->body_count < 2)
        return;
    fprintf(d->to, "<spatial name=\"t%d\"", d->tendon_count++);
    write_springs(d, false);
    if (chance(d, 3))
        put(d, "springlength", 1, 0.0, 1.5);
    fprintf(d->to, ">");
    for (int i = kt_random_int(d->random, 1, 2); i >= 0; i--)
        fprintf(d->to, "<site site=\"s%d\"/>", (first + i) % d->body_count);
    fprintf(d->to, "</spatial>\n");
}

/* -1: none. */
static int any_tendon(drawing *d) {
    return d->tendon_count > 0 && chance(d, 2) ? kt_random_int(d->random, 0, d->tendon_count - 1) : -1;
}

/* A motor of a site, with a force and a moment. The bounds of joints apply to these, too; the reader reports this and
 * leaves the bounds out. */
static void write_thruster(drawing *d) {
    const int body = kt_random_int(d->random, 0, d->body_count - 1);
    for (int i = body; i >= 0; i = d->parent[i])
        if (d->is_bounded[i])
            return;
    fprintf(d->to, "<motor name=\"a%d\" site=\"s%d\"", d->actuator_count++, body);
    put(d, "gear", 6, -2.0, 2.0);
    if (chance(d, 2))
        put_range(d, "forcerange", 3.0);
    fprintf(d->to, "/>\n");
}

static void write_actuator(drawing *d) {
    static const char *const kinds[] = {"motor", "position", "velocity", "damper", "general"};
    const int kind = kt_random_int(d->random, 0, 4), joint = any_scalar(d);
    if (joint < 0 || chance(d, 5)) {
        write_thruster(d);
        return;
    }
    int tendon = any_tendon(d);
    for (int i = 0; i < d->body_count; i++) /* bounds of joints do not bound spatial tendons here, which is reported */
        tendon = tendon >= d->fixed_count && d->is_bounded[i] ? -1 : tendon;
    fprintf(d->to, "<%s name=\"a%d\" %s=\"%c%d\"", kinds[kind], d->actuator_count++, tendon >= 0 ? "tendon" : "joint",
            tendon >= 0 ? 't' : 'j', tendon >= 0 ? tendon : joint);
    if (chance(d, 3))
        fprintf(d->to, " gear=\"1.5\"");
    else
        put(d, "gear", 1, chance(d, 2) ? -3.0 : 0.5, chance(d, 2) ? -0.5 : 3.0);
    if (chance(d, 2) || kind == 3)
        fprintf(d->to, " ctrlrange=\"%.6g %.6g\"", kind == 3 ? 0.0 : -real(d, 0.1, 2.0), real(d, 0.1, 2.0));
    if (chance(d, 2))
        put_range(d, "forcerange", 5.0);
    if (chance(d, 4))
        fprintf(d->to, " group=\"%d\"", kt_random_int(d->random, 0, 3));
    if (kind == 1)
        put(d, "kp", 1, 1.0, 40.0);
    if (kind == 1 || kind == 2 || kind == 3)
        put(d, "kv", 1, 0.1, 3.0);
    if (kind == 4) {
        fprintf(d->to, " gaintype=\"%s\" biastype=\"affine\"", chance(d, 2) ? "fixed" : "affine");
        put(d, "gainprm", 3, -3.0, 3.0);
        put(d, "biasprm", 3, -5.0, 2.0);
    }
    fprintf(d->to, "/>\n");
}

/* ---- equalities, options ----------------------------------------------------------------------------------------- */

/* A connect or a weld of two bodies, of a body and the world, or of two sites. */
static void write_tie(drawing *d, int index) {
    const int a = kt_random_int(d->random, 0, d->body_count - 1), b = (a + 1) % d->body_count;
    const bool is_weld = !chance(d, 3), has_sites = a != b && chance(d, 3);
    fprintf(d->to, "<%s name=\"e%d\"", is_weld ? "weld" : "connect", index);
    if (has_sites)
        fprintf(d->to, " site1=\"s%d\" site2=\"s%d\"", a, b);
    else
        fprintf(d->to, " body1=\"b%d\"", a);
    if (!has_sites && a != b && !chance(d, 4))
        fprintf(d->to, " body2=\"b%d\"", b);
    if (!has_sites && (!is_weld || chance(d, 2)))
        put(d, "anchor", 3, -0.5, 0.5);
    if (!has_sites && is_weld && chance(d, 2))
        put(d, "relpose", 7, -1.0, 1.0);
    if (is_weld && chance(d, 3))
        fprintf(d->to, " torquescale=\"0\"");
    else if (is_weld && chance(d, 3))
        put(d, "torquescale", 1, 0.01, 3.0);
    fprintf(d->to, "/>\n");
}

/* An equality of one joint or tendon, or of two. */
static void write_polynomial(drawing *d, int index, char kind, int first, int second) {
    const char *type = kind == 't' ? "tendon" : "joint";
    fprintf(d->to, "<%s name=\"e%d\" %s1=\"%c%d\"", type, index, type, kind, first);
    if (first != second)
        fprintf(d->to, " %s2=\"%c%d\"", type, kind, second);
    if (chance(d, 2))
        put(d, "polycoef", kt_random_int(d->random, 1, 5), -1.0, 1.0);
    fprintf(d->to, "/>\n");
}

/* MuJoCo leaves out an equality of a tendon that has a joint twice. */
static void write_equality(drawing *d, int index) {
    const int a = any_scalar(d), b = any_scalar(d);
    const int other = d->fixed_count > 0 ? kt_random_int(d->random, 0, d->fixed_count - 1) : 0;
    if (chance(d, 2))
        write_tie(d, index);
    else if (d->fixed_count > 0 && !d->is_repeated[0] && !d->is_repeated[other] && chance(d, 2))
        write_polynomial(d, index, 't', 0, other);
    else if (a >= 0)
        write_polynomial(d, index, 'j', a, b);
}

static void write_options(drawing *d) {
    static const char *const flags[] = {"gravity", "spring", "damper", "actuation", "clampctrl"};
    fprintf(d->to, "<option");
    put(d, "gravity", 3, -9.0, 9.0);
    if (chance(d, 3))
        fprintf(d->to, " actuatorgroupdisable=\"1 3\"");
    fprintf(d->to, "><flag");
    for (int i = 0; i < 5; i++)
        if (chance(d, 8))
            fprintf(d->to, " %s=\"disable\"", flags[i]);
    fprintf(d->to, "/></option>\n");
}

bool draw_mjcf(FILE *to, kt_random *random, bool has_meshes) {
    drawing d = {.to = to, .random = random, .has_meshes = has_meshes};
    fprintf(to, "<mujoco model=\"random\">\n<compiler angle=\"degree\"/>\n");
    write_options(&d);
    fprintf(to, "<asset>\n");
    for (int i = 0; i < MESHES && has_meshes; i++)
        write_mesh(&d, i);
    fprintf(to, "</asset>\n<worldbody>\n");
    do
        write_body(&d, -1, 0);
    while (d.body_count < BODIES - 1 && chance(&d, 2));
    if (chance(&d, 2))
        write_free_body(&d);
    fprintf(to, "</worldbody>\n<tendon>\n");
    for (int i = kt_random_int(random, 0, TENDONS); i > 0; i--)
        write_tendon(&d);
    d.fixed_count = d.tendon_count;
    if (chance(&d, 2))
        write_spatial(&d);
    fprintf(to, "</tendon>\n<actuator>\n");
    for (int i = kt_random_int(random, 0, ACTUATORS); i > 0; i--)
        write_actuator(&d);
    fprintf(to, "</actuator>\n<equality>\n");
    for (int i = kt_random_int(random, 0, EQUALITIES); i > 0; i--)
        write_equality(&d, i);
    fprintf(to, "</equality>\n<keyframe><key name=\"k\"");
    if (d.actuator_count > 0)
        put(&d, "ctrl", d.actuator_count, -3.0, 3.0);
    fprintf(to, "/></keyframe>\n</mujoco>\n");
    return !ferror(to);
}
