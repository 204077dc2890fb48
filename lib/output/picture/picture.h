/* The contents of a picture of a mechanism: solids, joints, loops, effects and planes. All contents are in the frames
 * of the bodies that carry them, so that only the poses of the bodies change from one picture to the next.
 *
 *     kt_picture *picture = NULL;
 *     status = kt_picture_create(&scene, model, poses, NULL, &picture, &error);
 *     for (int i = 0; i < picture->solid_count; i++)
 *         ok = ok && kt_mesh_add_solid(&mesh, &picture->solids[i], 24);
 *     kt_picture_free(picture);
 *
 * A picture belongs to the caller and refers to names in the model, which must outlive it. It is immutable. Bodies are
 * those of the model, 0 being the world; lengths are in metres. This room neither draws nor opens a picture file. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_PICTURE_PICTURE_H
#define KT_PICTURE_PICTURE_H

#include "kinetree/model.h"
#include "kinetree/scene.h"

struct kt_mesh;

/* A frame fixed to a body. */
typedef struct kt_body_frame {
    int body;
    kt_pose pose; /* in the body's frame */
} kt_body_frame;

typedef enum kt_solid_type {
    KT_SOLID_BOX,      /* half: half of its edges */
    KT_SOLID_SPHERE,   /* half: its radius, three times */
    KT_SOLID_CYLINDER, /* half: radius, radius, half of its length; along z */
    KT_SOLID_ROD,      /* a cylinder, with a hemisphere beyond each end */
} kt_solid_type;

/* The reason why a picture contains a solid. */
typedef enum kt_solid_source {
    KT_SOURCE_SHAPE,   /* the scene gives it, with all its dimensions */
    KT_SOURCE_SLENDER, /* the scene gives a rod without radius, or a point: its radius is that of the picture */
    KT_SOURCE_INERTIA, /* the box that has mass and inertia of the body */
    KT_SOURCE_IMPLIED, /* the body has no shape: a thin rod between its joints, or a point at its mass */
} kt_solid_source;

typedef struct kt_solid {
    kt_solid_type type;
    kt_solid_source source;
    int body;
    kt_pose pose; /* pose of the solid's frame, whose origin is its centre, in the body's frame */
    kt_vec3 half;
    const struct kt_mesh
        *mesh; /* a surface within the box, in the solid's frame, that is seen in place of it; or NULL */
} kt_solid;

/* The joint that carries a body, fixed joints left out. */
typedef struct kt_picture_joint {
    kt_joint_type type;
    int body;
    kt_body_frame frame; /* on the parent; z along the joint's axis (of spherical and free joints: the frame) */
    kt_vec3 axis2;       /* universal: the second axis, of unit length, in the body's frame */
    kt_mat3 child;       /* axes of the body in this frame at position 0, as columns */
    const char *name;
} kt_picture_joint;

/* A loop between two ends. Loops of joint positions (coupling, motion) are relations. */
/* A straight stroke of a curve or a surface. */
typedef struct kt_stroke {
    kt_vec3 from, to;
} kt_stroke;

enum { KT_STROKES_MOST = 512 /* strokes of a loop */ };

/* Writes the strokes of a curve or a surface in the frame of the loop's first end. Returns their number, 0 for loops of
 * other types. middle: the second end in that frame; reach: how far lines and planes extend around the second end. */
int kt_strokes_of(const kt_loop *loop, kt_vec3 middle, double reach, kt_stroke strokes[KT_STROKES_MOST]);

typedef struct kt_picture_loop {
    kt_loop_type type;
    int loop;                 /* in the model */
    kt_body_frame ends[2];    /* z along the loop's axis; rolling: the wheel's centre with z along the axle, and the
                                plane with z along its normal */
    double radius;            /* rolling */
    double radii[2];          /* gear, rack, worm, span, belt: of the wheels; signed as of spans (loop/span.h) */
    const kt_function *rope;  /* distance: the length of a rope, of the scene; NULL: none */
    double rope_given;        /* m, the length of a rope without a function: the distance in the first poses */
    const kt_stroke *strokes; /* curve, surface: in the frame of the first end */
    int stroke_count;
    const char *name;
} kt_picture_loop;

/* Hands over the strokes of pitch circles and pitch lines of wheels, and of the circles of pulleys, world axes. Loops
 * of other types have none. */
typedef void kt_stroke_each(void *user, kt_stroke stroke);
void kt_wheel_strokes(const kt_picture_loop *loop, const kt_pose *poses, kt_stroke_each *each, void *user);

/* Hands over the strokes of the rope of loop `index`, a span or a belt: the arcs on its pulleys, and then the straight
 * parts. An arc between two spans belongs to the first of them in the list. loops: all of the picture. */
void kt_rope_strokes(const kt_picture_loop *loops, int count, int index, const kt_pose *poses, kt_stroke_each *each,
                     void *user);

/* The length of a rope at a time, s; NaN: the loop is no rope, or its function has no value at this time. */
double kt_picture_rope_length(const kt_picture_loop *loop, double t);

/* A loop of joint positions or rates: a coupling of two joints (an entry for each pair of neighbouring terms), or a
 * motion of one joint. */
typedef struct kt_picture_relation {
    kt_loop_type type;
    int loop;  /* in the model */
    int joint; /* in picture->joints */
    int other; /* the other joint in picture->joints; motion: -1 */
    const char *name;
} kt_picture_relation;

/* An effect. */
typedef struct kt_picture_effect {
    kt_effect_type type;
    int effect;            /* in the description */
    int joint;             /* in picture->joints, coordinates of loops included; -1: none */
    int end_count;         /* 0, 1 (force, torque, drag) or 2 */
    kt_body_frame ends[2]; /* contact: the sphere's centre, and the plane with z along its normal; of others the frames
                                as given */
    double radius;         /* contact */
    double lower, upper;   /* joint_limit: positions of the joint; infinite where there is none */
    bool has_stiffness, has_damping; /* spring: its parts */
    bool has_plane;                  /* contact: with a plane, and not with a sphere */
    kt_vec3
        direction; /* force, torque: unit direction of a typical value; zero: none. In the world, or, if is_carried, in
                          the frame of the end */
    bool is_carried;
    int line_count;   /* along a path: of kt_picture_path; 0: it is along none */
    const char *name; /* NULL: none */
} kt_picture_effect;

/* A plane that something touches or rolls on; one for all that have the same. z is its normal. */
typedef struct kt_picture_plane {
    kt_body_frame frame;
    double half; /* half of the edge of the square that is shown */
} kt_picture_plane;

/* An axis-parallel box in the world's axes; empty where low > high. */
typedef struct kt_bounds {
    kt_vec3 low, high;
} kt_bounds;

/* Options of the contents. A struct of zeros, as NULL, yields the defaults. */
typedef struct kt_picture_options {
    bool boxes; /* boxes of uniform density that have mass and inertia of the bodies, in place of shapes and meshes */
    int triangles; /* triangles of all meshes together, at most about; 0: 400,000 */
} kt_picture_options;

typedef struct kt_picture {
    const kt_model *model;
    int body_count; /* the world included */
    kt_solid *solids;
    int solid_count;
    kt_picture_joint *joints;
    int joint_count;
    int coordinate_count; /* coordinates of loops in which effects act: these follow the joints */
    kt_picture_loop *loops;
    int loop_count;
    kt_stroke *strokes; /* strokes of these loops */
    kt_picture_relation *relations;
    int relation_count;
    kt_picture_effect *effects;
    int effect_count;
    kt_picture_plane *planes;
    int plane_count;
    int *part;   /* for each body: the rigid part that it belongs to, which bodies that fixed joints join have in
                    common; 0: the world */
    int *colour; /* for each body: 0, 1, ... 5; neighbours differ; -1: fixed to the world. One of a rigid part */
    struct kt_mesh *meshes; /* surfaces of solids */
    int mesh_count;
    int lost_meshes;                                       /* meshes that could not be read */
    char lost_reason[KT_WHERE_SIZE + KT_MESSAGE_SIZE + 2]; /* reason for the first lost mesh: which, and why */
    kt_vec3 gravity;
    bool is_planar; /* all motion is in one plane, whose unit normal in the world is */
    kt_vec3 normal; /* ... this, pointing as the joints' axes mostly do */
    double size;    /* m; diagonal of the box around the mechanism in the given poses, above zero */
    double radius;  /* m; of slender rods, half of that of joint symbols; it suits the size */
} kt_picture;

/* Lists the contents of a picture. poses: of all bodies at the start, from kt_body_pose, which determine the sizes of
 * symbols. The scene must be the checked scene of the model. Reads the scene's meshes. Errors: KT_ERROR_MEMORY. Cost:
 * O(size). */
kt_status kt_picture_create(const kt_scene *scene, const kt_model *model, const kt_pose *poses,
                            const kt_picture_options *options, kt_picture **picture, kt_error *error);
void kt_picture_free(kt_picture *picture);

/* The body that the joint of this name carries; -1 where there is none. */
int kt_body_of_joint(const kt_model *model, const char *name);

/* The pose in the world of a frame on a body; the position of a point of the body. */
static inline kt_pose kt_body_frame_pose(const kt_body_frame *frame, const kt_pose *poses) {
    return kt_pose_compose(poses[frame->body], frame->pose);
}

/* Calls `each` for the lines of the path of an effect, whose number is its line_count. poses: of all bodies. */
typedef void kt_picture_line(void *user, kt_vec3 from, kt_vec3 to);
void kt_picture_path(const kt_picture *p, const kt_picture_effect *effect, const kt_pose *poses, kt_picture_line *each,
                     void *user);

/* No room at all, to be widened. */
kt_bounds kt_bounds_empty(void);
/* Whether an end of an effect is shown. The plane of a contact is not, nor is a centre of attraction on the ground,
 * which may be far away. */
bool kt_picture_shows_end(const kt_picture_effect *effect, int end);

/* Returns the unit direction of a typical value of a force, a torque or a thrust, along its axes. The direction is zero
 * for other effects, and for a value without a direction. */
kt_vec3 kt_load_direction(const kt_effect *effect);

/* Fills the strokes of all loops of a picture; loops are the description's. */
void kt_strokes_list(kt_picture *picture, const kt_loop *loops, const kt_pose *poses, kt_bounds bounds);

/* Calls `each` for the points, in the world, through which joints, loops and effects are drawn: their frames, the ends
 * of strokes, and the corners of lines along paths. Points of solids and planes are not included. */
typedef void kt_picture_point(void *user, kt_vec3 point);
void kt_picture_points(const kt_picture *picture, const kt_pose *poses, kt_picture_point *each, void *user);

/* Whether a rope between ends at a and b is slack at the time t, s. A slack rope hangs as a parabola of its length.
 * `control` receives the inner control points of this parabola as a cubic curve. Without gravity, the rope hangs down
 * on the page. */
bool kt_picture_rope_curve(const kt_picture *picture, const kt_picture_loop *loop, double t, kt_vec3 a, kt_vec3 b,
                           kt_vec3 control[2]);

/* The box widened by all solids and points of the picture at these poses (planes left out). */
kt_bounds kt_picture_widen(const kt_picture *picture, const kt_pose *poses, kt_bounds bounds);
/* Lays the displayed squares of planes below the middle of a box. The size of the box determines the size of the
 * squares. The poses are those of the bodies that carry the planes. kt_picture_create uses its own poses; a run may
 * need more room. */
void kt_picture_fit_planes(kt_picture *picture, const kt_pose *poses, kt_bounds bounds);

#endif
