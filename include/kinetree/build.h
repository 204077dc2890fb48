/* Experimental. Parts of mechanisms: beams of elastic segments, chains and trees of links, and graphs of bodies and
 * joints. A builder collects bodies, loops and effects in a description:
 *
 *     kt_beam blade = kt_beam_default();
 *     blade.name = "blade";
 *     blade.segments = 20;
 *     blade.length = 2.0;
 *     blade.mass.value = 0.8;
 *     blade.EI[1].value = 50.0;
 *     kt_builder *builder;
 *     kt_model *compiled;
 *     if (kt_builder_create(&builder, &error) == KT_OK && kt_builder_add_beam(builder, &blade, &error) == KT_OK) {
 *         kt_description description = kt_builder_describe(builder);
 *         status = kt_model_compile(&description, NULL, &compiled, &error);
 *     }
 *
 * Everything may be released once the model is compiled. The page "Scene files" describes the same beams as a section
 * of a file.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_BUILD_H
#define KINETREE_BUILD_H

#include "kinetree/description.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- beams ------------------------------------------------------------------------------------------------------- */

/* A number along a beam. The number is `value`, or linear between evenly spaced stations, the first at the beginning
 * and the last at the end. A struct of zeros means that the number is not given. */
typedef struct kt_beam_property {
    double value;           /* the same everywhere */
    const double *stations; /* the caller's, used in place of `value`; NULL: none */
    int station_count;      /* length of stations, 2 or more */
} kt_beam_property;

/* How an end of a beam is attached. */
typedef enum kt_beam_end {
    KT_BEAM_CLAMPED = 0, /* neither displaced nor turned */
    KT_BEAM_HINGED,      /* not displaced; no moment */
    KT_BEAM_FREE,        /* not attached */
} kt_beam_end;

/* The largest number of segments of a beam. */
enum { KT_BEAM_SEGMENTS_MAX = 10000 /* segments */ };

/* A beam along x, as a chain of rigid segments NAME-1, NAME-2, ... with elastic joints between them (effects
 * NAME-joint-1, ...). Its frequencies and deflections converge with the second order in the length of a segment. Each
 * segment has a marker `end`.
 *
 * The given stiffnesses determine how the segments move on one another:
 *   EI[1] alone: the beam bends about z, in a plane.
 *   EI and GJ: the beam bends and twists, with constant length.
 *   EA, GA, GJ and EI: the beam stretches and shears as well. */
typedef struct kt_beam {
    const char *name;      /* as a body's */
    kt_end from;           /* where the beam begins, along x of this frame; default: the world's origin */
    kt_end to;             /* where the beam ends; required unless that end is free */
    kt_beam_end ends[2];   /* default: clamped, free */
    int segments;          /* 2 to KT_BEAM_SEGMENTS_MAX */
    double length;         /* along the axis, m */
    kt_beam_property mass; /* per length, kg/m */
    double polar_inertia; /* per length about the axis, kg m. 0: that of the section, which EA, EI and the mass imply */
    kt_beam_property EA;  /* extension, N */
    kt_beam_property GA[2]; /* shear along y and z, N */
    kt_beam_property GJ;    /* torsion, N m^2 */
    kt_beam_property EI[2]; /* bending about y and z, N m^2 */
    kt_vec3 curvature;      /* of the unloaded beam: turns about x, y, z for each length, rad/m; default 0. In a
                               plane: about z alone */
    double damping;         /* s; it multiplies each stiffness; default 0 */
} kt_beam;

/* Returns a struct with the default values. */
KT_API kt_beam kt_beam_default(void);

/* Checks all numbers of a beam. error.where is the key of the number in a scene file, or empty if numbers do not go
 * together.
 * Errors: KT_ERROR_MODEL.
 * Cost: O(stations). */
KT_API KT_CHECKED kt_status kt_beam_check(const kt_beam *beam, kt_error *error);

/* ---- chains and trees -------------------------------------------------------------------------------------------- */

/* Links NAME1, NAME2, ... Each link carries `branching` links at its end, until the tree has `count` links. The joint
 * of link i lies at the end of link (i - 2) / branching + 1. */
typedef struct kt_link_tree {
    const char *name;   /* as a body's */
    const char *parent; /* the body that carries the first link; NULL: the world */
    int count;          /* of links */
    int branching;      /* 1 (default): a chain */
    double fan;         /* rad; the links on one end are turned about z, evenly over this angle; default: pi/2 */
    kt_vec3 end;        /* of a link in its body frame: where its children have their joints, m; default (1, 0, 0) */
    kt_body link;       /* what each link is. The builder sets its name; of all links but the first also the parent, and
                           the joint's place, and if there are several on one end, the joint's rotation */
} kt_link_tree;

/* Returns a struct with the default values. */
KT_API kt_link_tree kt_link_tree_default(void);

/* ---- bodies and joints as a graph -------------------------------------------------------------------------------- */

/* A joint between two bodies, of which none is the parent. CAD systems export bodies and joints in this form. */
typedef struct kt_graph_joint {
    kt_joint joint;     /* its name, which is required, its type, axes, start, armature and limits. `at` and `rotation`
                           must be zero, because the first end gives the joint frame. Axes are in both ends' frames */
    kt_end between[2];  /* the joint moves the frame of the second end relative to that of the first end; both frames
                           coincide at position zero */
    bool is_coordinate; /* the joint should have a coordinate, because an item reads or drives it: a coupling, a motion,
                           a held joint, a formula; default: false */
} kt_graph_joint;

/* The reason for which a joint carries a body or closes a loop. X(id, words) */
#define KT_GRAPH_REASON_LIST(X)                                                                                        \
    X(KT_GRAPH_CARRIES, "carries a body")                                                                              \
    X(KT_GRAPH_RIGID, "its bodies are parts of one rigid body, in which it cannot move")                               \
    X(KT_GRAPH_CUT_OF_COORDINATES, "the other joints of its loop are needed as coordinates")                           \
    X(KT_GRAPH_CUT_OF_STARTS, "the other joints of its loop have given start values")                                  \
    X(KT_GRAPH_CUT_OF_FREEDOMS, "it has the most coordinates of its loop, which leaves the fewest equations")          \
    X(KT_GRAPH_CUT_OF_LENGTHS, "it is farthest from the ground, which makes the loops short")

/* The reasons of KT_GRAPH_REASON_LIST. */
typedef enum kt_graph_reason {
#define KT_GRAPH_REASON_ENUM(id, words) id,
    KT_GRAPH_REASON_LIST(KT_GRAPH_REASON_ENUM)
#undef KT_GRAPH_REASON_ENUM
        KT_GRAPH_REASON_COUNT /* how many */
} kt_graph_reason;

/* The choice for a joint of a graph. */
typedef struct kt_graph_choice {
    const char *joint;      /* its name */
    const char *body;       /* the body that the joint carries; NULL: it closes a loop, or joins parts of one rigid
                               body, so that it is left out */
    bool is_reversed;       /* it carries the body of its first end. A joint of one or two coordinates has the same
                               position; other joints have the coordinates of the first end relative to the second */
    bool loses_start;       /* it closes a loop, so that its given start values are not used */
    kt_graph_reason reason; /* why */
    int length;             /* joints of its loop, itself included; 0: it carries a body */
} kt_graph_choice;

/* Returns a struct with the default values: a fixed joint between the origins of the world and of the world. */
KT_API kt_graph_joint kt_graph_joint_default(void);

/* Returns the words of a reason; "" for any other number. */
KT_API const char *kt_graph_reason_words(kt_graph_reason reason);

/* ---- the builder ------------------------------------------------------------------------------------------------- */

/* Bodies, loops and effects, in the order in which they are added. */
typedef struct kt_builder kt_builder;

/* The first function allocates an empty builder. The second function releases a builder with all its descriptions. */
KT_API KT_CHECKED kt_status kt_builder_create(kt_builder **builder, kt_error *error);
KT_API void kt_builder_free(kt_builder *builder);

/* Add a copy of an item. Its names and arrays remain the caller's. Nothing is checked before the description is.
 * Errors: KT_ERROR_MEMORY; the builder is then unchanged.
 * Cost: O(1) on average. */
KT_API KT_CHECKED kt_status kt_builder_add_body(kt_builder *builder, const kt_body *body, kt_error *error);
KT_API KT_CHECKED kt_status kt_builder_add_loop(kt_builder *builder, const kt_loop *loop, kt_error *error);
KT_API KT_CHECKED kt_status kt_builder_add_effect(kt_builder *builder, const kt_effect *effect, kt_error *error);

/* Add the parts of a beam, or the links of a tree. If the beam begins at a marker, the body with the marker must have
 * been added before.
 * Errors: KT_ERROR_MODEL for numbers that make no beam or tree, or a marker that does not exist. KT_ERROR_MEMORY. The
 * builder is then unchanged.
 * Cost: O(segments), O(count). */
KT_API KT_CHECKED kt_status kt_builder_add_beam(kt_builder *builder, const kt_beam *beam, kt_error *error);
KT_API KT_CHECKED kt_status kt_builder_add_tree(kt_builder *builder, const kt_link_tree *tree, kt_error *error);

/* Adds bodies, and the joints of a graph between them and the world. A body with a parent, or with a joint other than a
 * fixed one, keeps its place. All others are carried by joints of the graph. The carrying joints make a tree: joints
 * that are needed as coordinates and joints with given start values are preferred, then joints with few coordinates,
 * which makes the constraint groups as small as possible, then joints near the ground. The other joints become loops of
 * the same name with coordinates (kt_loop.coordinates). A joint between parts of one rigid body is left out. If the end
 * of a carrying joint is away from the origin of its body, a massless body is added between them. It has the name of
 * the joint, or NAME-frame if a body has this name. choices: joint_count structs, or NULL. Their names belong to the
 * builder or the caller.
 * Errors: KT_ERROR_MODEL, with error.where "joint 'NAME'" or "body 'NAME'": an end that does not exist, a body that no
 * joint connects with the world, an axis of zeros. KT_ERROR_MEMORY. The builder is then unchanged.
 * Cost: O(joints log joints + loops length). */
KT_API KT_CHECKED kt_status kt_builder_add_graph(kt_builder *builder, const kt_body *bodies, int body_count,
                                                 const kt_graph_joint *joints, int joint_count,
                                                 kt_graph_choice *choices, kt_error *error);

/* Returns the i-th body so far, which may be changed, from 0; NULL if there is none. The pointer is valid until the
 * next body is added.
 * Cost: O(1). */
KT_API kt_body *kt_builder_body(kt_builder *builder, int i);

/* Returns a description with everything that has been added, and default values. The description is valid until the
 * next item is added.
 * Cost: O(1). */
KT_API kt_description kt_builder_describe(const kt_builder *builder);

#ifdef __cplusplus
}
#endif
#endif
