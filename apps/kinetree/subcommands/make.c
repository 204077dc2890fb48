/* kinetree make: writes scenes of chains, pendulums and trees of any size. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "command.h"
#include "sweep/sweep.h"
#include "text/arguments.h"

#include "kinetree/build.h"
#include "kinetree/descriptor.h"

#include <limits.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef enum kt_kind { KT_KIND_CHAIN, KT_KIND_PENDULUM, KT_KIND_TREE } kt_kind;

/* Options; NaN or -1 selects the default of the kind of mechanism. */
typedef struct kt_make_arguments {
    long links, branching, seed;
    double mass, length, angle;
    int joint, shape, axes;
} kt_make_arguments;

#define KT_AT(member) offsetof(kt_make_arguments, member)

/* The joints that can be in a chain: all but those with no or with all six degrees of freedom. */
#define JOINS_0(...)
#define JOINS_1(...) __VA_ARGS__
#define JOINS_2(...) __VA_ARGS__
#define JOINS_3(...) __VA_ARGS__
#define JOINS_4(...) __VA_ARGS__
#define JOINS_5(...) __VA_ARGS__
#define JOINS_6(...)
#define JOINT_NAME(id, name, nq, nv) JOINS_##nv(#name "|")
#define JOINT_TYPE(id, name, nq, nv) JOINS_##nv(id, )

static const kt_joint_type joints[] = {KT_JOINT_LIST(JOINT_TYPE)};
enum { JOINT_COUNT = sizeof joints / sizeof joints[0] }; /* index of "mixed": all types in turn */

static const kt_option options[] = {
    KT_OPTION(COUNT, "links", links, "N", "make N bodies; default: 10, of a pendulum 1"),
    KT_CHOICE("joint", joint, "TYPE", "set the type of all joints; mixed: all types in turn",
              KT_JOINT_LIST(JOINT_NAME) "mixed"),
    KT_CHOICE("axes", axes, "AXES", "set the joint axes: always z, or x, y, z in turn", "z|xyz"),
    KT_OPTION(POSITIVE, "mass", mass, "KG", "set the mass of each body; default: 1"),
    KT_OPTION(POSITIVE, "length", length, "M", "set the length of each body; default: 1"),
    KT_CHOICE("shape", shape, "SHAPE",
              "make uniform rods, or point masses at the end; default: rod, of a pendulum point", "rod|point"),
    KT_OPTION(COUNT, "branching", branching, "B", "attach B bodies to each body of a tree; default: 2"),
    KT_OPTION(ANGLE, "angle", angle, "A",
              "set the angle of the first joint at the start: 0.5, 30deg; default: 0, of a pendulum 90deg"),
    KT_OPTION(COUNT, "seed", seed, "S",
              "draw masses, lengths, axes and positions at random; equal seeds give equal scenes"),
};

const kt_usage kt_usage_make = {
    .command = "make",
    .examples = "  kinetree make pendulum --links 2 > double-pendulum.yaml\n"
                "  kinetree make chain --links 1000 | kinetree run - --duration 0.1\n"
                "  kinetree make tree --links 63 --joint spherical | kinetree info -\n"
                "  kinetree make tree --links 200 --joint mixed --seed 7 > random.yaml\n",
    .operands = "chain|pendulum|tree",
    .about = "Writes a scene to standard output. Gravity pulls along -y.\n"
             "  chain     rods one after the other along x, from the world's origin; slender, but where a joint\n"
             "            can turn them about their length\n"
             "  pendulum  point masses on massless links, one under the other; its angle is that from hanging\n"
             "  tree      every body carries --branching others at its end, fanned out\n"
             "The bodies are link1, link2, ...; the last has a marker 'tip' at its end.\n",
    KT_OPTIONS_OF(options),
};

/* ---- random numbers ---------------------------------------------------------------------------------------------- */

/* Returns a uniform random number. */
static double draw_between(uint64_t *state, double low, double high) {
    const uint64_t z = kt_mix_bits(*state);
    *state += KT_MIX_STEP;
    return low + (high - low) * ((double)(z >> 11) * 0x1p-53);
}

/* ---- one link ---------------------------------------------------------------------------------------------------- */

typedef struct kt_maker {
    kt_kind kind;
    kt_make_arguments settings; /* with the defaults of the kind filled in */
    uint64_t random;
    double *lengths;
} kt_maker;

static const double pi = 3.14159265358979323846;

/* Returns the end of a link of this length in the link's frame. */
static kt_vec3 link_end_of(kt_kind kind, double length) {
    return kind == KT_KIND_PENDULUM ? kt_vec3_make(0.0, -length, 0.0) : kt_vec3_make(length, 0.0, 0.0);
}

/* Sets the initial rotation `angle` about the joint's axis, if the joint rotates. */
static void turn_by(kt_joint *joint, double angle) {
    for (int k = 0; k < KT_JOINT_NQ_MAX; k++) {
        const kt_coordinate_kind kind = kt_joint_coordinate_kind(joint->type, k);
        if (kind == KT_COORDINATE_ROTATION) { /* a quaternion about z, the default axis of the others */
            joint->position[k] = cos(0.5 * angle);
            joint->position[k + 3] = sin(0.5 * angle);
            return;
        }
        if (kind == KT_COORDINATE_ANGLE || kind == KT_COORDINATE_TURNS) {
            joint->position[k] = angle;
            return;
        }
    }
}

static void set_axis(kt_maker *maker, kt_joint *joint, long i) {
    if (maker->settings.axes == 1)
        joint->axis = kt_vec3_make(i % 3 == 0 ? 1.0 : 0.0, i % 3 == 1 ? 1.0 : 0.0, i % 3 == 2 ? 1.0 : 0.0);
    if (kt_descriptor_key(kt_joint_descriptor(joint->type), "joint.pitch") != NULL)
        joint->pitch = 0.1;
}

static void make_random(kt_maker *maker, kt_body *body, double *length) {
    body->mass *= draw_between(&maker->random, 0.5, 2.0);
    *length *= draw_between(&maker->random, 0.5, 2.0);
    double z = draw_between(&maker->random, -1.0, 1.0), turn = draw_between(&maker->random, -pi, pi),
           r = sqrt(1.0 - z * z);
    body->joint.axis = kt_vec3_make(r * cos(turn), r * sin(turn), z);
    turn_by(&body->joint, draw_between(&maker->random, -pi, pi));
    if (kt_joint_coordinate_kind(body->joint.type, 0) == KT_COORDINATE_LENGTH)
        body->joint.position[0] = draw_between(&maker->random, -1.0, 1.0);
}

/* Returns the number of rotational degrees of freedom of a joint. */
static int rotations_of(kt_joint_type type) {
    int count = 0;
    for (int k = 0; k < KT_JOINT_NV_MAX; k++) {
        const kt_coordinate_kind kind = kt_joint_coordinate_kind(type, k);
        count += kind == KT_COORDINATE_ANGLE || kind == KT_COORDINATE_TURNS || kind == KT_COORDINATE_ROTATION;
    }
    return count;
}

/* Returns whether a joint can rotate a body about its long axis; the body then needs a moment of inertia about it. */
static bool needs_girth(const kt_make_arguments *settings) {
    return settings->axes == 1 || settings->joint == JOINT_COUNT || rotations_of(joints[settings->joint]) > 1;
}

/* Returns whether point masses give every degree of freedom of these joints an inertia: a point that can be displaced
 * turns without any. */
static bool allows_points(const kt_make_arguments *settings) {
    return !needs_girth(settings) && kt_joint_coordinate_kind(joints[settings->joint], 0) != KT_COORDINATE_TRANSLATION;
}

static void set_shape(const kt_maker *maker, kt_body *body, double length) {
    kt_vec3 end = link_end_of(maker->kind, length);
    body->shape.type = maker->settings.shape == 0 ? KT_SHAPE_ROD : KT_SHAPE_POINT;
    if (body->shape.type == KT_SHAPE_ROD)
        body->shape.to = end;
    else
        body->shape.at = end;
    if (needs_girth(&maker->settings))
        body->shape.radius = 0.05 * length;
    body->com_of_shape = true;
    body->inertia_of_shape = true;
}

/* Gives link i its joint, its shape and its numbers. The first link lies on the world, others on link `parent`. */
static void set_link(kt_maker *maker, long i, kt_body *body, long parent) {
    const int joint = maker->settings.joint;
    double *length = &maker->lengths[i];
    *length = maker->settings.length;
    body->joint.type = joints[joint == JOINT_COUNT ? (int)(i % JOINT_COUNT) : joint];
    set_axis(maker, &body->joint, i);
    if (i == 0)
        turn_by(&body->joint, maker->settings.angle);
    if (maker->settings.seed >= 0)
        make_random(maker, body, length);
    set_shape(maker, body, *length);
    if (i > 0)
        body->joint.at = link_end_of(maker->kind, maker->lengths[parent]);
}

/* ---- the scene --------------------------------------------------------------------------------------------------- */

static kt_status build_links(kt_maker *maker, kt_builder *builder, kt_marker *tip, kt_error *error) {
    const kt_make_arguments *settings = &maker->settings;
    kt_link_tree tree = kt_link_tree_default();
    tree.name = "link";
    tree.count = (int)settings->links;
    if (maker->kind == KT_KIND_TREE)
        tree.branching = settings->branching > INT_MAX ? INT_MAX : (int)settings->branching;
    tree.link.mass = settings->mass;
    const kt_status status = kt_builder_add_tree(builder, &tree, error);
    if (status != KT_OK)
        return status;
    for (long i = 0; i < settings->links; i++)
        set_link(maker, i, kt_builder_body(builder, (int)i), (i - 1) / tree.branching);
    kt_body *last = kt_builder_body(builder, tree.count - 1);
    *tip = (kt_marker){.name = "tip", .at = link_end_of(maker->kind, maker->lengths[tree.count - 1])};
    last->markers = tip;
    last->marker_count = 1;
    return KT_OK;
}

static int write_made_scene(const kt_builder *builder, const char *title) {
    kt_scene scene = kt_scene_default();
    kt_error error = {0};
    scene.description = kt_builder_describe(builder);
    scene.description.name = title;
    scene.description.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    if (kt_scene_write(&scene, stdout, &error) != KT_OK) {
        kt_say_error(&error);
        return KT_EXIT_INTEGRATION;
    }
    return kt_finish_output(KT_EXIT_DONE);
}

/* Checks the options and fills in the defaults of this kind. Returns -1 on success, else an exit code. */
static int complete_options(kt_maker *maker, const char *kind) {
    static const char *const kinds[] = {"chain", "pendulum", "tree"};
    kt_make_arguments *settings = &maker->settings;
    kt_nearest nearest = kt_nearest_make(kind, NULL);
    int found = -1;
    for (int i = 0; i < 3; i++) {
        found = strcmp(kinds[i], kind) == 0 ? i : found;
        (void)kt_nearest_try(&nearest, kinds[i]);
    }
    if (found < 0)
        return kt_misuse("make: there is no '%s' to make; chain, pendulum and tree%s", kind,
                         kt_ask(&nearest, "", "").text);
    maker->kind = (kt_kind)found;
    bool is_pendulum = maker->kind == KT_KIND_PENDULUM;
    settings->links = settings->links >= 0 ? settings->links : is_pendulum ? 1 : 10;
    if (settings->shape == 1 && !allows_points(settings))
        return kt_misuse(
            "make: these joints would turn point masses on the spot: take --joint revolute and --axes z, or rods");
    settings->shape = settings->shape >= 0 ? settings->shape : is_pendulum && allows_points(settings) ? 1 : 0;
    settings->angle = !isnan(settings->angle) ? settings->angle : is_pendulum ? 0.5 * pi : 0.0;
    if (settings->branching >= 0 && maker->kind != KT_KIND_TREE)
        return kt_misuse("make: --branching is for a tree");
    settings->branching = settings->branching >= 0 ? settings->branching : 2;
    if (settings->links < 1 || settings->links > 100000000)
        return kt_misuse("make: --links takes a number from 1 to 100000000");
    if (settings->branching < 1)
        return kt_misuse("make: --branching takes a number above zero");
    maker->random = (uint64_t)settings->seed;
    return -1;
}

int kt_command_make(int argc, char **argv) {
    kt_maker maker = {
        .settings = {
            .links = -1, .branching = -1, .seed = -1, .mass = 1.0, .length = 1.0, .angle = (double)NAN, .shape = -1}};
    int code = kt_arguments_read(&kt_usage_make, argc, argv, &maker.settings, NULL);
    if (code < 0)
        code = complete_options(&maker, argv[1]);
    if (code >= 0)
        return code;
    char title[64];
    size_t count = (size_t)maker.settings.links;
    kt_builder *builder = NULL;
    kt_marker tip;
    kt_error error = {0};
    snprintf(title, sizeof title, "%s of %ld link%s", argv[1], maker.settings.links, count == 1 ? "" : "s");
    maker.lengths = malloc(count * sizeof *maker.lengths);
    if (maker.lengths != NULL && kt_builder_create(&builder, &error) == KT_OK &&
        build_links(&maker, builder, &tip, &error) == KT_OK) {
        code = write_made_scene(builder, title);
    } else {
        if (error.code != KT_OK && error.code != KT_ERROR_MEMORY)
            kt_say_error(&error);
        else
            kt_say("there is not enough memory for %ld links", maker.settings.links);
        code = KT_EXIT_INTEGRATION;
    }
    kt_builder_free(builder);
    free(maker.lengths);
    return code;
}
