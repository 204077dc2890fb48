/* The calls of dynamics.h. The calls call the kernels of the model's instruction set and sweep, replace missing inputs
 * by zeros, and write results only when these are complete. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/dynamics.h"
#include "base/where.h"
#include "dynamics/aba_inverse.h"
#include "dynamics/dynamics.h"
#include "joint/joint.h"

#include <assert.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

const kt_kernels *kt_kernels_of(kt_isa isa, kt_sweep sweep, bool has_armature) {
    const int table = (int)sweep + (has_armature ? (int)KT_SWEEP_COUNT : 0);
    KT_BY_ISA(isa, return &, kt_kernels, [table]);
}

#ifdef KT_ISAS
/* Whether valgrind emulates the processor. Valgrind reports all of x86-64-v3, but version 3.19 rejects an instruction
 * of this level (vmovq between two registers). The request for valgrind's version consists of four rotations that
 * together change nothing, and the exchange of a register with itself; see "client requests" in valgrind's manual. */
static bool is_emulated_by_valgrind(void) {
    const uint64_t request[6] = {0x1001};
    uint64_t depth = 0;
    __asm__ volatile("rolq $3, %%rdi\n\trolq $13, %%rdi\n\trolq $61, %%rdi\n\trolq $51, %%rdi\n\txchgq %%rbx, %%rbx"
                     : "=d"(depth)
                     : "a"(request), "0"(UINT64_C(0))
                     : "cc", "memory");
    return depth != 0;
}
#endif

kt_isa kt_isa_resolve(kt_isa asked) {
    kt_isa best = KT_ISA_BASE;
    /* GCOVR_EXCL_BR_START: no input changes the features of the processor */
#ifdef KT_ISAS
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2"))
        best = KT_ISA_V3;
    if (asked == KT_ISA_AUTO && is_emulated_by_valgrind())
        return KT_ISA_BASE;
    if (best == KT_ISA_V3 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
        __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512cd"))
        best = KT_ISA_V4;
#endif
    /* GCOVR_EXCL_BR_STOP */
    if (asked == KT_ISA_AUTO)
        return best;
    return asked <= best ? asked : KT_ISA_AUTO;
}

static const char *body_of_velocity(const kt_model *model, size_t v) {
    size_t best = 0;
    for (size_t b = 1; b < model->n.body; b++)
        if ((size_t)model->body[b].v <= v && kt_joint_sizes[model->body[b].type].nv > 0)
            best = b;
    return model->text + model->body[best].name;
}

kt_status kt_result_reject(const kt_model *model, const double *result, const char *what, kt_error *error) {
    size_t i = 0;
    while (i < model->n.v - 1 && isfinite(result[i]))
        i++;
    return kt_error_set(error, KT_ERROR_NOT_FINITE, kt_where_format("joint '%.100s'", body_of_velocity(model, i)).text,
                        "its %s is %g; look for a position, velocity, force or torque that is not finite or is huge",
                        what, result[i]);
}

kt_status kt_commit(const kt_model *model, const kt_input *input, const double *from, double *to, const char *what,
                    kt_error *error) {
    if (kt_all_finite(from, model->n.v)) {
        if (model->n.v > 0) /* `to` may be NULL otherwise */
            memcpy(to, from, model->n.v * sizeof *to);
        return KT_OK;
    }
    const kt_status status = input ? kt_input_check(model, input, error) : KT_OK;
    return status == KT_OK ? kt_result_reject(model, from, what, error) : status;
}

/* The joint of a link. */
static kt_where_text name_joint(const kt_model *model, size_t link) {
    return kt_where_format("joint '%.100s'", model->text + model->body[model->link[link].body].joint_name);
}

/* Whether a link turns on a hinge through the origin of its parent, and the parent carries this link alone. */
static bool is_next_hinge(const kt_model *model, size_t link) {
    const kt_link *own = &model->link[link], *parent = &model->link[own->parent];
    return own->parent > 0 && own->follows && own->motion == KT_MOTION_REVOLUTE &&
           parent->motion == KT_MOTION_REVOLUTE && !parent->branches && parent->mass == 0.0 &&
           parent->inertia.xx + parent->inertia.yy + parent->inertia.zz == 0.0 && own->at.x == 0.0 &&
           own->at.y == 0.0 && own->at.z == 0.0;
}

size_t kt_link_first_of_hinges(const kt_model *model, size_t link) {
    for (size_t i = link; i > 0 && i + 2 < model->n.spatial && link - i < 3; i--)
        if (is_next_hinge(model, i + 1) && is_next_hinge(model, i + 2))
            return i;
    return 0;
}

kt_gimbal_text kt_link_gimbal_advice(const kt_model *model, size_t first) {
    kt_gimbal_text out = {.text = ""};
    const char *name[3];
    for (size_t k = 0; k < 3; k++)
        name[k] = model->text + model->body[model->link[first + k].body].joint_name;
    (void)snprintf(out.text, sizeof out.text,
                   "the hinges '%.40s', '%.40s' and '%.40s' are next to gimbal lock, where two of their axes coincide; "
                   "give the body that they turn one joint in their place: spherical, or free if it moves freely",
                   name[0], name[1], name[2]);
    return out;
}

kt_status kt_link_reject_inertia(const kt_model *model, size_t link, kt_error *error) {
    static const char what[] =
        "the bodies it moves have no positive inertia along one of its degrees of freedom at this position";
    const size_t first = kt_link_first_of_hinges(model, link);
    return first > 0 ? kt_error_set(error, KT_ERROR_SINGULAR, name_joint(model, link).text, "%s: %s", what,
                                    kt_link_gimbal_advice(model, first).text)
                     : kt_error_set(error, KT_ERROR_SINGULAR, name_joint(model, link).text, "%s", what);
}

/* Inputs are checked only if the result is not finite, or no inertia is found, so that correct calls do not pay. */
kt_status kt_forward_tree(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a,
                          kt_error *error) {
    assert(kt_data_serve(model, data));
    const kt_input input = {.q = at->q, .v = at->v, .x = at->tau, .what = "force", .external = at->external};
    const size_t failed = model->kernels->forward(model, data, at->q, at->v ? at->v : model->zero,
                                                  at->tau ? at->tau : model->zero, at->external, data->scratch);
    if (!failed)
        return kt_commit(model, &input, data->scratch, a, "acceleration", error);
    const kt_status status = kt_input_check(model, &input, error);
    return status == KT_OK ? kt_link_reject_inertia(model, failed, error) : status;
}

kt_status kt_inverse_trusted(const kt_model *model, kt_data *data, const double *q, const double *v, const double *a,
                             const kt_wrench *external, double *tau, kt_error *error) {
    assert(kt_data_serve(model, data));
    const kt_input input = {.q = q, .v = v, .x = a, .what = "acceleration", .external = external};
    model->kernels->inverse(model, data, q, v ? v : model->zero, a ? a : model->zero, external, data->scratch);
    return kt_commit(model, &input, data->scratch, tau, "force", error);
}

kt_status kt_dynamics_forward(const kt_model *model, kt_data *data, const double *q, const double *v, const double *tau,
                              const kt_wrench *external, double *a, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, q || !model->n.q, a || !model->n.v))
        return KT_ERROR_ARGUMENT;
    const kt_input input = {.q = q, .v = v, .x = tau, .what = "force", .external = external};
    if (external && !kt_wrenches_are_finite(model, external))
        return kt_input_check(model, &input, error);
    return kt_forward_tree(model, data, &(kt_dynamic_state){.q = q, .v = v, .tau = tau, .external = external}, a,
                           error);
}

kt_status kt_dynamics_inverse(const kt_model *model, kt_data *data, const double *q, const double *v, const double *a,
                              const kt_wrench *external, double *tau, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, q || !model->n.q, tau || !model->n.v))
        return KT_ERROR_ARGUMENT;
    const kt_input input = {.q = q, .v = v, .x = a, .what = "acceleration", .external = external};
    if (external && !kt_wrenches_are_finite(model, external))
        return kt_input_check(model, &input, error);
    return kt_inverse_trusted(model, data, q, v, a, external, tau, error);
}

kt_status kt_dynamics_mass_lower(const kt_model *model, kt_data *data, const double *q, double *mass, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, q || !model->n.q, mass || !model->n.v))
        return KT_ERROR_ARGUMENT;
    const kt_input input = {.q = q};
    const kt_status status = kt_input_check(model, &input, error);
    if (status != KT_OK)
        return status;
    const size_t failed = model->kernels->mass(model, data, q, mass);
    if (failed)
        return kt_error_set(error, KT_ERROR_NOT_FINITE, name_joint(model, failed).text,
                            "the inertia that it carries overflows: look for a position that is huge");
    return KT_OK;
}

kt_status kt_dynamics_mass(const kt_model *model, kt_data *data, const double *q, double *mass, kt_error *error) {
    const kt_status status = kt_dynamics_mass_lower(model, data, q, mass, error);
    if (status == KT_OK)
        model->kernels->mirror(model->n.v, mass);
    return status;
}

/* FNV-1a, eight bytes at a time. */
static uint64_t hash_numbers(uint64_t sum, const double *x, size_t n) {
    for (size_t i = 0; i < n; i++) {
        uint64_t bits;
        memcpy(&bits, &x[i], sizeof bits);
        sum = (sum ^ bits) * 1099511628211U;
    }
    return sum;
}

uint64_t kt_state_hash(const kt_model *model, const double *q, const double *v) {
    return hash_numbers(hash_numbers(14695981039346656037U, q, model->n.q), v ? v : model->zero, model->n.v);
}

static void copy_links(const kt_model *model, const kt_data *data, kt_link_kinematics *links) {
    for (size_t i = 0; i < model->n.link; i++) {
        const kt_link_motion *m = &data->motion[i];
        const kt_link_origin *at = &data->origin[i];
        links[i] = (kt_link_kinematics){.axes = kt_v4_mat3(m->axes),
                                        .offset = kt_v4_vec3(m->offset),
                                        .omega = kt_v4_vec3(m->omega),
                                        .alpha = kt_v4_vec3(m->alpha),
                                        .linear = kt_v4_vec3(m->linear),
                                        .position = kt_v4_vec3(at->position),
                                        .velocity = kt_v4_vec3(at->velocity)};
    }
}

kt_status kt_links_update(const kt_model *model, kt_data *data, const double *q, const double *v, const double *a,
                          bool posed, kt_link_kinematics *links, kt_error *error) {
    const kt_kernels *kernels = model->kernels;
    const kt_input input = {.q = q, .v = v, .x = a, .what = "acceleration"};
    const kt_status status = kt_input_check(model, &input, error);
    if (status != KT_OK)
        return status;
    const size_t failed =
        (posed ? kernels->follow : kernels->kinematics)(model, data, q, v ? v : model->zero, a ? a : model->zero);
    if (!failed) {
        if (links)
            copy_links(model, data, links);
        if (links == data->kinematics)
            data->state = kt_state_hash(model, q, v);
        return KT_OK;
    }
    return kt_error_set(error, KT_ERROR_NOT_FINITE, name_joint(model, failed).text,
                        "its motion overflows: look for a position, velocity or acceleration that is huge");
}

kt_status kt_kinematics_update(const kt_model *model, kt_data *data, const double *q, const double *v, const double *a,
                               kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, q || !model->n.q))
        return KT_ERROR_ARGUMENT;
    return kt_links_update(model, data, q, v, a, false, data->kinematics, error);
}

void kt_links_sweep(const kt_model *model, kt_data *data, const double *q, const double *v, kt_link_kinematics *links) {
    (void)model->kernels->kinematics(model, data, q, v, model->zero);
    copy_links(model, data, links);
}

void kt_force_frames_sweep(const kt_model *model, kt_data *data, const double *q, const double *v) {
    model->kernels->force_links(model, data, q, v);
}
