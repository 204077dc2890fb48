/* The library and Pinocchio, in turns, in one run, on the same trees: chains of links, the arm of seven axes and the
 * humanoid. Pinocchio's headers are compiled here with -march=native, which it recommends. Of its two conventions,
 * axes of the world and of the bodies, the one that was faster counts.
 *
 *   forward      ABA against aba
 *   inverse      RNEA against rnea
 *   mass         CRBA, the whole matrix, against crba and a copy of its upper triangle
 *   derivatives  da/dq, da/dv and M^-1 against computeABADerivatives
 *
 * A line is trusted if Pinocchio's accelerations need the given torques by RNEA of the library, and if its torques for
 * the library's accelerations are the given ones. The bound is (4 + bodies) eps of the largest bias force. The mass
 * matrices agree to the same bound of their largest entry. Derivatives are compared for trees without free bodies,
 * since those by the rotation of a free body have another meaning there. */
/* SPDX-License-Identifier: Apache-2.0 */
#include <pinocchio/algorithm/aba-derivatives.hpp>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/multibody/data.hpp>
#include <pinocchio/multibody/model.hpp>

#include <cfloat>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <map>
#include <string>
#include <vector>

extern "C" {
#include "chain.h"
#include "kinetree/scene.h"
#include "report.h"
}

namespace {

namespace pin = pinocchio;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/* The first coordinates of a joint whose coordinates differ. */
struct pin_joint_at {
    int q, v;
    bool is_free;
};

/* Where a body is: on a joint, at a place in its frame. Fixed bodies are parts of their parents. */
struct pin_place {
    pin::JointIndex joint = 0;
    pin::SE3 at = pin::SE3::Identity();
};

/* What both sides share with the timer. */
struct pin_twin {
    kt_chain chain = {};
    int bodies = 0;
    pin::Model model;
    std::map<std::string, pin_place> known;
    std::vector<pin_joint_at> turned;
    pin::Data data;
    VectorXd q, v, tau, a;
    MatrixXd mass;
};

Vector3d pin_vector(kt_vec3 u) { return {u.x, u.y, u.z}; }

/* ---- the same tree ----------------------------------------------------------------------------------------------- */

/* A joint about an axis of its frame has kernels of its own there. */
pin::JointIndex add_hinge(pin::Model &m, pin::JointIndex parent, kt_vec3 axis, const pin::SE3 &at,
                          const std::string &name) {
    const Vector3d e = pin_vector(axis).normalized();
    if (e == Vector3d::UnitX())
        return m.addJoint(parent, pin::JointModelRX(), at, name);
    if (e == Vector3d::UnitY())
        return m.addJoint(parent, pin::JointModelRY(), at, name);
    if (e == Vector3d::UnitZ())
        return m.addJoint(parent, pin::JointModelRZ(), at, name);
    return m.addJoint(parent, pin::JointModelRevoluteUnaligned(e), at, name);
}

kt_status add_pin_joint(pin_twin &t, const kt_body &b, const pin_place &parent, pin_place *place, kt_error *error) {
    const std::string name = b.name;
    const kt_joint &j = b.joint;
    *place = {};
    switch (j.type) {
    case KT_JOINT_FIXED:
        *place = parent;
        return KT_OK;
    case KT_JOINT_REVOLUTE:
        place->joint = add_hinge(t.model, parent.joint, j.axis, parent.at, name);
        return KT_OK;
    case KT_JOINT_UNIVERSAL:
        place->joint = add_hinge(t.model, parent.joint, j.axis, parent.at, name + " first");
        place->joint = add_hinge(t.model, place->joint, j.axis2, pin::SE3::Identity(), name);
        return KT_OK;
    case KT_JOINT_SPHERICAL:
        place->joint = t.model.addJoint(parent.joint, pin::JointModelSpherical(), parent.at, name);
        break;
    case KT_JOINT_FREE:
        place->joint = t.model.addJoint(parent.joint, pin::JointModelFreeFlyer(), parent.at, name);
        break;
    default:
        return kt_error_set(error, KT_ERROR_UNSUPPORTED, b.name, "a joint of this type has no twin here");
    }
    t.turned.push_back({t.model.idx_qs[place->joint], t.model.idx_vs[place->joint], j.type == KT_JOINT_FREE});
    return KT_OK;
}

kt_status add_pin_body(pin_twin &t, const kt_body &b, kt_error *error) {
    kt_vec3 com;
    kt_sym3 j;
    kt_mat3 rest;
    if (kt_body_inertia(&b, &com, &j, error) != KT_OK || kt_rotation_evaluate(&b.joint.rotation, &rest, error) != KT_OK)
        return error->code;
    const kt_quat r = kt_quat_from_mat3(rest);
    const pin::SE3 at(Eigen::Quaterniond(r.w, r.x, r.y, r.z).toRotationMatrix(), pin_vector(b.joint.at));
    pin_place parent, place;
    if (b.parent != nullptr && std::strcmp(b.parent, "world") != 0)
        parent = t.known.at(b.parent);
    parent.at = parent.at * at;
    if (add_pin_joint(t, b, parent, &place, error) != KT_OK)
        return error->code;
    Eigen::Matrix3d inertia;
    inertia << j.xx, j.xy, j.xz, j.xy, j.yy, j.yz, j.xz, j.yz, j.zz;
    t.model.appendBodyToJoint(place.joint, pin::Inertia(b.mass, pin_vector(com), inertia), place.at);
    t.known[b.name] = place;
    return KT_OK;
}

/* The library, as MuJoCo, has the velocity of a free body in axes of the world and its quaternion as w, x, y, z. */
Eigen::Matrix3d pin_rotation(const pin_twin &t, const pin_joint_at &at) {
    const double *r = t.chain.q + at.q + (at.is_free ? 3 : 0);
    return Eigen::Quaterniond(r[0], r[1], r[2], r[3]).toRotationMatrix();
}

void turn_in(const pin_twin &t, VectorXd &x) {
    for (const pin_joint_at &at : t.turned)
        if (at.is_free)
            x.segment<3>(at.v) = pin_rotation(t, at).transpose() * x.segment<3>(at.v).eval();
}

void turn_out(const pin_twin &t, VectorXd &x) {
    for (const pin_joint_at &at : t.turned)
        if (at.is_free)
            x.segment<3>(at.v) = pin_rotation(t, at) * x.segment<3>(at.v).eval();
}

/* dv/dt in axes of the body is without the turning of the axes. */
void add_turning(const pin_twin &t, VectorXd &a, double sign) {
    for (const pin_joint_at &at : t.turned)
        if (at.is_free)
            a.segment<3>(at.v) += sign * t.v.segment<3>(at.v + 3).cross(t.v.segment<3>(at.v));
}

void take_state(pin_twin &t) {
    t.q = Eigen::Map<const VectorXd>(t.chain.q, t.chain.nq);
    t.v = Eigen::Map<const VectorXd>(t.chain.v, t.chain.n);
    t.tau = Eigen::Map<const VectorXd>(t.chain.tau, t.chain.n);
    for (const pin_joint_at &at : t.turned) {
        const int first = at.q + (at.is_free ? 3 : 0);
        const double *r = t.chain.q + first;
        t.q.segment<4>(first) << r[1], r[2], r[3], r[0];
    }
    turn_in(t, t.v);
    turn_in(t, t.tau);
}

kt_status make_pin_twin(const kt_description &d, kt_isa isa, pin_twin &t, kt_error *error) {
    kt_status status = kt_chain_of(&d, isa, true, &t.chain, error);
    if (status == KT_OK)
        status = kt_chain_make_derivatives(&t.chain, error);
    t.bodies = d.body_count;
    t.model.gravity.linear(pin_vector(d.gravity));
    for (int i = 0; i < d.body_count && status == KT_OK; i++)
        status = add_pin_body(t, d.bodies[i], error);
    if (status != KT_OK)
        return status;
    if (t.model.nv != t.chain.n || t.model.nq != t.chain.nq)
        return kt_error_set(error, KT_ERROR_MODEL, "Pinocchio", "it has %d freedoms, not %d", t.model.nv, t.chain.n);
    t.data = pin::Data(t.model);
    t.mass = MatrixXd::Zero(t.chain.n, t.chain.n);
    take_state(t);
    return KT_OK;
}

/* ---- the same work ----------------------------------------------------------------------------------------------- */

template <pin::Convention convention> void pin_forward(void *twin, long repetitions) {
    pin_twin &t = *static_cast<pin_twin *>(twin);
    for (long k = 0; k < repetitions; k++)
        pin::aba(t.model, t.data, t.q, t.v, t.tau, convention);
}

void pin_inverse(void *twin, long repetitions) {
    pin_twin &t = *static_cast<pin_twin *>(twin);
    for (long k = 0; k < repetitions; k++)
        pin::rnea(t.model, t.data, t.q, t.v, t.a);
}

template <pin::Convention convention> void pin_mass(void *twin, long repetitions) {
    pin_twin &t = *static_cast<pin_twin *>(twin);
    for (long k = 0; k < repetitions; k++) {
        pin::crba(t.model, t.data, t.q, convention);
        t.mass = t.data.M.selfadjointView<Eigen::Upper>();
    }
}

void pin_derivatives(void *twin, long repetitions) {
    pin_twin &t = *static_cast<pin_twin *>(twin);
    for (long k = 0; k < repetitions; k++)
        pin::computeABADerivatives(t.model, t.data, t.q, t.v, t.tau);
}

/* ---- the comparison ---------------------------------------------------------------------------------------------- */

/* max |x - y| / scale; NaN stays. */
double pin_difference(const VectorXd &x, const double *y, double scale) {
    double most = 0.0;
    for (int i = 0; i < x.size(); i++) {
        const double d = std::fabs(x[i] - y[i]) / scale;
        most = d <= most ? most : d;
    }
    return most;
}

/* The largest difference over its bound. The largest bias force is the scale of torques. */
double pin_disagreement(pin_twin &t, kt_error *error) {
    kt_chain &c = t.chain;
    const double eps = (4.0 + t.bodies) * DBL_EPSILON;
    VectorXd bias(c.n), back(c.n);
    kt_chain_forward(&c, 1);
    kt_chain_mass(&c, 1);
    kt_chain_derivatives(&c, 1);
    pin_forward<pin::Convention::WORLD>(&t, 1);
    VectorXd a = t.data.ddq;
    add_turning(t, a, 1.0);
    turn_out(t, a);
    if (kt_dynamics_inverse(c.model, c.data, c.q, c.v, nullptr, nullptr, bias.data(), error) != KT_OK ||
        kt_dynamics_inverse(c.model, c.data, c.q, c.v, a.data(), nullptr, back.data(), error) != KT_OK)
        return NAN;
    const double scale = std::fmax(1.0, bias.cwiseAbs().maxCoeff());
    double most = pin_difference(back, c.tau, scale) / eps;
    t.a = Eigen::Map<const VectorXd>(c.a, c.n);
    turn_in(t, t.a);
    add_turning(t, t.a, -1.0);
    pin_inverse(&t, 1);
    VectorXd torque = t.data.tau;
    turn_out(t, torque);
    most = std::fmax(most, pin_difference(torque, c.tau, scale) / eps);
    bool has_free = false;
    for (const pin_joint_at &at : t.turned)
        has_free |= at.is_free;
    if (has_free)
        return most;
    pin_mass<pin::Convention::WORLD>(&t, 1);
    pin_derivatives(&t, 1);
    const Eigen::Map<const MatrixXd> mass(c.mass, c.n, c.n), by_q(c.da_dq, c.n, c.n), by_v(c.da_dv, c.n, c.n);
    most = std::fmax(most, (t.mass - mass).cwiseAbs().maxCoeff() / mass.cwiseAbs().maxCoeff() / eps);
    most = std::fmax(most, (t.data.ddq_dq - by_q).cwiseAbs().maxCoeff() / by_q.cwiseAbs().maxCoeff() / 1e-9);
    return std::fmax(most, (t.data.ddq_dv - by_v).cwiseAbs().maxCoeff() / by_v.cwiseAbs().maxCoeff() / 1e-9);
}

/* ---- the table --------------------------------------------------------------------------------------------------- */

enum { FORWARD, INVERSE, MASS, DERIVATIVES, CALLS, TASKS = 2 * CALLS + 2 };
const char *const call_name[CALLS] = {"forward", "inverse", "mass", "derivatives"};

struct pin_subject {
    const char *name, *scene; /* scene: nullptr: a chain of n links */
    int n;
};
const pin_subject subjects[] = {{"chain", nullptr, 8},
                                {"chain", nullptr, 32},
                                {"chain", nullptr, 128},
                                {"arm", "arm7.yaml", 0},
                                {"humanoid", "humanoid.yaml", 0}};

/* The faster of two. */
const kt_bench_times &faster(const kt_bench_times &a, const kt_bench_times &b) { return a.low < b.low ? a : b; }

int measure_twin(pin_twin &t, const char *name, const kt_bench_options *options, kt_csv *csv) {
    kt_error error = {};
    const double off = pin_disagreement(t, &error);
    const kt_bench_task tasks[TASKS] = {{kt_chain_forward, &t.chain},
                                        {pin_forward<pin::Convention::WORLD>, &t},
                                        {pin_forward<pin::Convention::LOCAL>, &t},
                                        {kt_chain_inverse, &t.chain},
                                        {pin_inverse, &t},
                                        {kt_chain_mass, &t.chain},
                                        {pin_mass<pin::Convention::WORLD>, &t},
                                        {pin_mass<pin::Convention::LOCAL>, &t},
                                        {kt_chain_derivatives, &t.chain},
                                        {pin_derivatives, &t}};
    static kt_bench_times times[TASKS];
    kt_bench_measure(tasks, TASKS, options->seconds, times);
    const kt_bench_times *const own[CALLS] = {&times[0], &times[3], &times[5], &times[8]};
    const kt_bench_times *const peer[CALLS] = {&faster(times[1], times[2]), &times[4], &faster(times[6], times[7]),
                                               &times[9]};
    printf("%-9s %4d", name, t.chain.n);
    for (int i = 0; i < CALLS; i++) {
        const kt_bench_ratio ratio = kt_bench_compare(own[i], peer[i]);
        printf(" |%8.4g%8.4g%6.2f [%.2f %.2f]", 1e6 * own[i]->low, 1e6 * peer[i]->low, ratio.median, ratio.low,
               ratio.high);
        kt_csv_text(csv, name);
        kt_csv_number(csv, t.chain.n);
        kt_csv_text(csv, call_name[i]);
        kt_csv_number(csv, own[i]->low);
        kt_csv_number(csv, peer[i]->low);
        kt_csv_number(csv, ratio.median);
        kt_csv_number(csv, off);
        kt_csv_origin(csv, kt_model_isa(t.chain.model));
        kt_csv_line(csv);
    }
    printf(" |%8.2g%s\n", off, off <= 1.0 ? "" : "  THE TWO DISAGREE");
    return off <= 1.0 ? KT_BENCH_DONE : KT_BENCH_FAILED;
}

int measure_description(const kt_description &d, const char *name, const kt_bench_options *options, kt_csv *csv) {
    kt_error error = {};
    pin_twin t;
    const int result = make_pin_twin(d, options->isa, t, &error) == KT_OK ? measure_twin(t, name, options, csv)
                                                                          : kt_bench_tell(&error);
    kt_chain_free(&t.chain);
    return result;
}

int measure_subject(size_t index, const kt_bench_options *options, kt_csv *csv) {
    const pin_subject &s = subjects[index];
    kt_error error = {};
    if (s.scene != nullptr) {
        kt_scene scene = kt_scene_default();
        const std::string path = std::string(KT_SCENES "/") + s.scene;
        if (kt_scene_read(path.c_str(), &scene, nullptr, nullptr, &error) != KT_OK)
            return kt_bench_tell(&error);
        const int result = measure_description(scene.description, s.name, options, csv);
        kt_scene_free(&scene);
        return result;
    }
    kt_chain_description d;
    if (kt_chain_describe(s.n, 1, &d, &error) != KT_OK)
        return kt_bench_tell(&error);
    const int result = measure_description(d.description, s.name, options, csv);
    kt_chain_describe_free(&d);
    return result;
}

void print_pin_head() {
    printf("Pinocchio %s. us a call (lower quartile of the rounds); the ratio round by round: median [quartiles]; the "
           "largest\ndifference over its bound.\n\n%-9s %4s",
           PINOCCHIO_VERSION, "", "n");
    for (const char *name : call_name)
        printf(" |%11s%26s", name, "Pinocchio, ratio");
    printf(" |%8s\n", "off");
}

} // namespace

int main(int argc, char **argv) {
    const kt_bench_table table = {"Times kinetree and Pinocchio in turns, for chains, an arm and a human figure.\n",
                                  "tree,n,call,own_s,pinocchio_s,ratio_median,difference_over_bound," KT_CSV_ORIGIN,
                                  "Kinetree and Pinocchio on trees",
                                  print_pin_head,
                                  sizeof subjects / sizeof *subjects,
                                  measure_subject};
    return kt_bench_run(&table, argc, argv);
}
