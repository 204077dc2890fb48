/* The recursions' inner loops, compiled once for each instruction set (KT_ISA names it).
 *
 * A kernel does not check its arguments: no pointer is NULL, and outputs are scratch memory of the data. A kernel that
 * can fail returns the link at which it failed, or 0.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DYNAMICS_DYNAMICS_H
#define KT_DYNAMICS_DYNAMICS_H

#include "algebra/finite.h"
#include "base/isa.h"
#include "model/model.h"

typedef struct kt_kernels {
    const char *name;
    /* Articulated bodies: a; external may be NULL. Returns a link without inertia along a degree of freedom. */
    size_t (*forward)(const kt_model *model, kt_data *data, const double *q, const double *v, const double *tau,
                      const kt_wrench *external, double *a);
    /* Newton-Euler: tau. */
    void (*inverse)(const kt_model *model, kt_data *data, const double *q, const double *v, const double *a,
                    const kt_wrench *external, double *tau);
    /* Composite bodies: the lower triangle of the mass matrix. Above the diagonal some entries become zero, others
     * stay. Returns a link that carries an inertia which is not finite; the matrix is then unchanged. */
    size_t (*mass)(const kt_model *model, kt_data *data, const double *q, double *mass);
    /* Copies the lower triangle of an n x n matrix to the upper one. */
    void (*mirror)(size_t n, double *mass);
    /* Motion of all links into data->motion, with positions and velocities; accelerations without gravity. Returns 0 if
     * all of it is finite, otherwise the first link whose motion is not. */
    size_t (*kinematics)(const kt_model *model, kt_data *data, const double *q, const double *v, const double *a);
    /* As `kinematics`, if data already hold the poses of q, from any recursion or projection; the bits are equal. */
    size_t (*follow)(const kt_model *model, kt_data *data, const double *q, const double *v, const double *a);
    /* Motion of the links that carry forces. */
    void (*force_links)(const kt_model *model, kt_data *data, const double *q, const double *v);
} kt_kernels;

/* The kernels of an instruction set. There is one table each for spatial, planar and mixed models (kt_sweep), and the
 * same for models with armature. The functions in the tables follow; the planar ones compute the planar links. A mass
 * matrix takes two steps: the composites, of which one may not be finite, and the columns. If velocity coordinates have
 * the order of the links, the columns set the whole lower triangle. Otherwise the columns must be zero already.
 *
 * KT_RECURSIONS_DECLARE has the functions that are also compiled in lanes. The numbers of all states of a coordinate
 * are neighbours in these functions, q[coordinate][lane], and data->sound excludes states that are rejected. */
#define KT_KERNELS_DECLARE(isa)                                                                                        \
    extern const kt_kernels kt_kernels_##isa[2 * KT_SWEEP_COUNT];                                                      \
    size_t kt_mass_compose_##isa(const kt_model *model, kt_data *data, const double *q);                               \
    void kt_mass_columns_##isa(const kt_model *model, const kt_data *data, double *mass);                              \
    void kt_mass_mirror_##isa(size_t n, double *mass);                                                                 \
    size_t kt_planar_mass_compose_##isa(const kt_model *model, kt_data *data, const double *q);                        \
    void kt_planar_mass_columns_##isa(const kt_model *model, const kt_data *data, double *mass);
#define KT_RECURSIONS_DECLARE(isa)                                                                                     \
    size_t kt_forward_##isa(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v,                \
                            const kt_real1 *tau, const kt_external *external, kt_real1 *a);                            \
    kt_condition kt_project_armature_##isa(const kt_model *model, kt_data *data, size_t i, const kt_real1 *tau,        \
                                           kt_articulated *x);                                                         \
    size_t kt_armature_forward_##isa(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v,       \
                                     const kt_real1 *tau, const kt_external *external, kt_real1 *a);                   \
    size_t kt_planar_armature_forward_##isa(const kt_model *model, kt_data *data, const kt_real1 *q,                   \
                                            const kt_real1 *v, const kt_real1 *tau, const kt_external *external,       \
                                            kt_real1 *a);                                                              \
    void kt_inverse_##isa(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v,                  \
                          const kt_real1 *a, const kt_external *external, kt_real1 *tau);                              \
    size_t kt_kinematics_##isa(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v,             \
                               const kt_real1 *a);                                                                     \
    size_t kt_follow_##isa(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v,                 \
                           const kt_real1 *a);                                                                         \
    void kt_force_links_##isa(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v);             \
    size_t kt_planar_forward_##isa(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v,         \
                                   const kt_real1 *tau, const kt_external *external, kt_real1 *a);                     \
    void kt_planar_inverse_##isa(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v,           \
                                 const kt_real1 *a, const kt_external *external, kt_real1 *tau);                       \
    size_t kt_planar_kinematics_##isa(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v,      \
                                      const kt_real1 *a);                                                              \
    size_t kt_planar_follow_##isa(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v,          \
                                  const kt_real1 *a);

const kt_kernels *kt_kernels_of(kt_isa isa, kt_sweep sweep, bool has_armature);

/* link_inertia.c: adds a body's inertia to its link's, about the link's origin and in its axes. */
void kt_link_load(kt_model *model, const kt_body_record *body);
/* Sums the inertias of all bodies on a link again, and projects the inertias of a planar link into its plane.
 * O(bodies). */
void kt_link_add_inertia(kt_model *model, int32_t index);
/* Sets the part of a planar link that follows from the inertia of its link. */
void kt_planar_link_set_inertia(kt_model *model, size_t index);
/* Sets gravity along the axes of a plane. */
void kt_plane_set_weights(const kt_model *model, kt_plane *plane);

/* ---- masses that are functions of time (variable_mass.c) ---- */

/* Returns the model with the masses at the time data->mass_time. The returned model is built in the data, and valid
 * until the next call. For a model of constant masses, returns the model itself. */
const kt_model *kt_model_of_instant(const kt_model *model, const kt_data *data);
static inline const kt_model *kt_model_now(const kt_model *model, const kt_data *data) {
    if (model->n.varying)
        return kt_model_of_instant(model, data);
    (void)data;
    return model;
}

/* Makes a model whose masses vary evaluate the model of the instant. Replaces its `forward` and `kernels`, which are
 * complete. Other models do not change. */
void kt_masses_attach(kt_model *model);

/* Returns the change of energy due to the masses at fixed q and v, W: the partial derivative of T + V by time. */
double kt_masses_power(const kt_model *model, kt_data *data, double t, const double *q, const double *v);

/* Adds wrenches on bodies whose joint forces are -(dM/dt a + dh/dt) at t. Errors: as kt_links_update. */
KT_CHECKED kt_status kt_masses_add_rates(const kt_model *model, kt_data *data, double t, const double *q,
                                         const double *v, const double *a, kt_wrench *wrenches, kt_error *error);

/* Rejects a model of variable masses with KT_ERROR_UNSUPPORTED at `where`, for a calculation that does not support
 * variable masses. */
KT_INNER KT_CHECKED kt_status kt_masses_reject(const kt_model *model, const char *where, const char *what,
                                               kt_error *error);

/* ---- coordinates that move no mass (massless_recursion.c) ---- */

/* Makes inverse dynamics and the mass matrix leave out the armature that replaces the mass. Other models do not
 * change. */
void kt_massless_attach(kt_model *model);

/* Rejects a model with massless coordinates, with KT_ERROR_UNSUPPORTED at `where`, for a calculation that does not
 * support such coordinates. */
KT_INNER KT_CHECKED kt_status kt_massless_reject(const kt_model *model, const char *where, const char *what,
                                                 kt_error *error);

/* Updates links, groups and kernels of a model for its armatures (model->armature). Planar links have been filled.
 * Cost: O(links). */
void kt_armature_update_flags(kt_model *model);

/* Returns the kinetic energy of the rotors, from data->kinematics; J. */
double kt_armature_energy(const kt_model *model, const kt_data *data);

/* Returns the instruction set that is used on this processor, or KT_ISA_AUTO if the processor lacks the requested
 * set. */
kt_isa kt_isa_resolve(kt_isa asked);

/* Finds the links that have no inertia along one of their degrees of freedom at q; returns their number. Links whose
 * verdict is KT_INERTIA_UNKNOWN at the call are not tested, nor are links that carry a link without inertia or an
 * untested link. */
typedef enum kt_inertia_verdict { KT_INERTIA_THERE = 0, KT_INERTIA_NONE, KT_INERTIA_UNKNOWN } kt_inertia_verdict;
size_t kt_singular_links(const kt_model *model, kt_data *data, const double *q, unsigned char *verdict);

/* The inputs of a call; all but q may be NULL. x are nv numbers, and `what` names them in messages. */
typedef struct kt_input {
    const double *q, *v, *x;
    const char *what;
    const kt_wrench *external;
} kt_input;

/* Checks the inputs of a call. Errors: KT_ERROR_NOT_FINITE, or KT_ERROR_ARGUMENT for a quaternion of zeros, naming the
 * first joint or body at fault. */
kt_status kt_input_check(const kt_model *model, const kt_input *input, kt_error *error);

/* Returns the error of a state at time t that is not finite. The message names the number at fault, or reports that a
 * number is too large. */
kt_status kt_input_reject_not_finite(const kt_model *model, double t, const kt_input *input, kt_error *error);
/* Sets the error for a degree of freedom that loops permit and that has no inertia, with the remedy. The remedy names a
 * slender rod that may turn about its own axis. */
kt_status kt_inertia_reject_motion(const kt_model *model, const char *where, kt_error *error);

/* Returns a number that distinguishes states of a model; two states have equal numbers with a probability of 1 in 2^64.
 * v may be NULL (zero). Cost: O(nq). */
uint64_t kt_state_hash(const kt_model *model, const double *q, const double *v);

/* Checks n x columns numbers that a call replaces by a solution.
 *
 * Errors: KT_ERROR_ARGUMENT if there are fewer columns than 0 or x is NULL. KT_ERROR_NOT_FINITE if a number is not
 * finite or so large that a solution might not be (KT_COLUMN_MOST). */
#define KT_COLUMN_MOST 1e150
KT_CHECKED kt_status kt_columns_check(size_t n, int columns, const double *x, kt_error *error);

/* Whether the wrenches of all bodies except the world are finite. */
bool kt_wrenches_are_finite(const kt_model *model, const kt_wrench *external);

/* kt_dynamics_forward and kt_dynamics_inverse without a check of the wrenches, which must be finite. The result does
 * not reveal a component normal to a joint's degrees of freedom, or to a plane. */
kt_forward_call kt_forward_tree; /* t is not used */
kt_status kt_inverse_trusted(const kt_model *model, kt_data *data, const double *q, const double *v, const double *a,
                             const kt_wrench *external, double *tau, kt_error *error);

/* The error of a result of nv numbers that is not finite, at the first joint at which it is not; `what` names the
 * result. */
kt_status kt_result_reject(const kt_model *model, const double *result, const char *what, kt_error *error);

/* Copies a result of nv numbers if it is finite. Otherwise the error reports the input that is at fault (NULL: no input
 * is checked), or names the joint at which the result is not finite. */
kt_status kt_commit(const kt_model *model, const kt_input *input, const double *from, double *to, const char *what,
                    kt_error *error);

/* Does the same as kt_kinematics_update, but writes to `links` instead of data->kinematics. If links is NULL, writes to
 * data->motion alone. posed: the data already hold the poses of q. Outputs are unchanged on failure. */
KT_CHECKED kt_status kt_links_update(const kt_model *model, kt_data *data, const double *q, const double *v,
                                     const double *a, bool posed, kt_link_kinematics *links, kt_error *error);

/* Computes the motion of links at (q, v, a) into data->motion alone. v and a may be NULL (zero). */
KT_CHECKED static inline kt_status kt_motion_update(const kt_model *model, kt_data *data, const double *q,
                                                    const double *v, const double *a, kt_error *error) {
    return kt_links_update(model, data, q, v, a, false, NULL, error);
}

/* As kt_links_update without accelerations, and without checking that the numbers are finite. */
void kt_links_sweep(const kt_model *model, kt_data *data, const double *q, const double *v, kt_link_kinematics *links);

/* Memory for kinematics other than those of the last kt_kinematics_update. This is the memory of the links' motion,
 * which is unused while no recursion is in progress. In this memory, kt_links_update and kt_links_sweep replace the
 * motion by the kinematics, link by link. This is safe because a link's kinematics end before the next link's motion
 * begins. */
_Static_assert(sizeof(kt_link_kinematics) <= sizeof(kt_link_motion), "a link's kinematics fit");
static inline kt_link_kinematics *kt_links_scratch(kt_data *data) { return (kt_link_kinematics *)data->motion; }

/* kt_point_acceleration and kt_body_twist from such kinematics. */
kt_vec3 kt_links_acceleration(const kt_model *model, const kt_link_kinematics *links, int body, kt_vec3 at);
kt_twist kt_links_twist(const kt_model *model, const kt_link_kinematics *links, int body);

/* kt_joint_reactions from such kinematics into data->wrench; the result may not be finite. */
const kt_wrench *kt_joint_reactions_find(const kt_model *model, kt_data *data, const kt_link_kinematics *links,
                                         const kt_wrench *external);

/* Motion of the links that carry forces, into the data. */
void kt_force_frames_sweep(const kt_model *model, kt_data *data, const double *q, const double *v);

KT_EACH_ISA(KT_KERNELS_DECLARE)
KT_EACH_KERNEL(KT_RECURSIONS_DECLARE)

#endif
