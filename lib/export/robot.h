/* A mechanism while it is written as a robot. */
#ifndef KT_EXPORT_ROBOT_H
#define KT_EXPORT_ROBOT_H

#include "kinetree/export.h"

#include "base/names.h"
#include "scene/pool.h"

/* What acts in a joint of one coordinate. */
typedef struct kt_export_forces {
    double damping, friction, stiffness, rest;
} kt_export_forces;

/* A coupling as a joint's: q = a0 + a1 q' + a2 q'^2 + ..., with q' of another body's joint; -1: it follows none. */
typedef struct kt_export_follower {
    int master;
    double a[5];
} kt_export_follower;

enum { KT_LOST_MOST = 64 };

typedef struct kt_export {
    const kt_description *d;
    FILE *stream;
    kt_pool pool;
    kt_names names;                         /* of bodies (scope 0), joints (1), and markers (2: to the first body) */
    int *parent, *first_child, *next_child; /* of bodies; -1: the world, none */
    int first_root;                         /* the first body on the world */
    kt_export_forces *forces;               /* of bodies' joints */
    kt_export_follower *followers;
    struct {
        const char *what;
        int count;
    } lost[KT_LOST_MOST];
    int lost_count;
} kt_export;

/* One joint of those that a joint of several coordinates becomes. */
typedef struct kt_export_step {
    kt_joint_type type; /* revolute, prismatic, spherical, free */
    kt_vec3 axis;
} kt_export_step;

enum { KT_EXPORT_STEPS = 3 };

/* How many joints a joint becomes, one after the other; 0 of a fixed one. */
int kt_export_steps(const kt_joint *joint, kt_export_step steps[KT_EXPORT_STEPS]);

/* Counts what the format does not have. */
void kt_export_lose(kt_export *x, const char *what);

/* A coupling of two joints as the polynomial by which that of the term `own` follows the other; false: it is none. */
bool kt_export_polynomial(kt_export *x, const kt_loop *loop, int own, double a[5]);

/* Writes ` name="1 2 3"`. */
void kt_export_numbers(kt_export *x, const char *name, const double *values, int count);
void kt_export_vector(kt_export *x, const char *name, kt_vec3 v);

/* Writes a text with what XML would read as its own replaced. */
void kt_export_text(kt_export *x, const char *text);

static inline const kt_body *kt_export_body(const kt_export *x, int i) { return &x->d->bodies[i]; }
kt_mat3 kt_export_matrix(const kt_rotation *rotation);

/* Mass, com and inertia as they are in the end. */
void kt_export_mass(const kt_body *body, kt_vec3 *com, kt_sym3 *inertia);

/* A shape as a box, sphere or cylinder along z; a rod is a cylinder between its ends. Returns false, and counts it,
 * where it has no size or is a point. */
bool kt_export_solid(kt_export *x, kt_shape *shape);

/* The point of an end, in its body's frame. */
kt_pose kt_export_end(const kt_export *x, const kt_end *end);

/* A number with as many digits as its bits need. */
enum { KT_EXPORT_NUMBER = 32 };
void kt_export_number(char *text, double value);

/* What is done at each body; `depth` is the number of bodies around it. */
typedef void kt_export_visit(kt_export *x, int body, int depth);

/* The formats. */
void kt_export_urdf(kt_export *x);
void kt_export_mjcf(kt_export *x);

#endif
