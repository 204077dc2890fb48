/* Simbody as a peer of `kinetree accuracy`. Like this library it has a tree of joints with loops as constraints, and
 * projects the state onto them. The twin has gravity as its only force. Revolute loops are only built in the plane of x
 * and y, as balls: in space their equations repeat each other in planar linkages, which Simbody does not resolve. */
/* SPDX-License-Identifier: Apache-2.0 */
#include <SimTKsimbody.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>

extern "C" {
#include "peer_scene.h"
}

using SimTK::MobilizedBody;
using SimTK::Rotation;
using SimTK::Transform;
using SimTK::Vec3;

namespace {

const peer_method methods[] = {{"Merson", true}, {"RungeKutta3", true}, {"CPodes", true}, {nullptr, false}};

Vec3 vector_of(kt_vec3 v) { return Vec3(v.x, v.y, v.z); }

Transform transform_of(kt_pose pose) {
    const kt_quat r = kt_quat_from_mat3(pose.rotation);
    return Transform(Rotation(SimTK::Quaternion(r.w, r.x, r.y, r.z)), vector_of(pose.position));
}

/* The library's frames in Simbody. A pin turns about z and a slider moves along x of its frames. */
struct simbody_run {
    peer_request *request = nullptr;
    peer_scene scene = {};
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter{system};
    SimTK::GeneralForceSubsystem forces{system};
    std::vector<SimTK::MobilizedBodyIndex> body;
    SimTK::State start;
    long evaluations = 0;
};

SimTK::MassProperties mass_of(const kt_twin &twin, int i) {
    kt_vec3 com;
    kt_sym3 j;
    kt_twin_mass(&twin, i, &com, &j);
    const double mass = twin.description->bodies[i].mass;
    const SimTK::Inertia central(j.xx, j.yy, j.zz, j.xy, j.xz, j.yz);
    return SimTK::MassProperties(mass, vector_of(com), central.shiftFromMassCenter(-vector_of(com), mass));
}

void add_body(simbody_run *run, const kt_twin &twin, int i) {
    const kt_joint &j = twin.description->bodies[i].joint;
    kt_pose frame = kt_pose_identity();
    frame.position = j.at;
    (void)!kt_rotation_evaluate(&j.rotation, &frame.rotation, nullptr);
    const SimTK::Body::Rigid rigid(mass_of(twin, i));
    MobilizedBody &parent =
        twin.parent[i] >= 0 ? run->matter.updMobilizedBody(run->body[twin.parent[i]]) : run->matter.Ground();
    const SimTK::CoordinateAxis axis =
        j.type == KT_JOINT_PRISMATIC ? SimTK::CoordinateAxis(SimTK::XAxis) : SimTK::CoordinateAxis(SimTK::ZAxis);
    const bool has_axis = j.type == KT_JOINT_PRISMATIC || j.type == KT_JOINT_REVOLUTE;
    const Transform turned = has_axis ? Transform(Rotation(SimTK::UnitVec3(vector_of(j.axis)), axis)) : Transform();
    const Transform outer = transform_of(frame) * turned;
    switch (j.type) {
    case KT_JOINT_REVOLUTE:
        run->body[i] = MobilizedBody::Pin(parent, outer, rigid, turned).getMobilizedBodyIndex();
        break;
    case KT_JOINT_PRISMATIC:
        run->body[i] = MobilizedBody::Slider(parent, outer, rigid, turned).getMobilizedBodyIndex();
        break;
    case KT_JOINT_SPHERICAL:
        run->body[i] = MobilizedBody::Ball(parent, outer, rigid, turned).getMobilizedBodyIndex();
        break;
    case KT_JOINT_FREE:
        run->body[i] = MobilizedBody::Free(parent, outer, rigid, turned).getMobilizedBodyIndex();
        break;
    default:
        run->body[i] = MobilizedBody::Weld(parent, outer, rigid, turned).getMobilizedBodyIndex();
    }
}

/* The body that an end is on, and its place there. */
Vec3 end_of(simbody_run *run, const kt_twin &twin, const kt_end *end, MobilizedBody **body) {
    int i;
    kt_pose frame = kt_twin_end(&twin, end, &i);
    *body = i >= 0 ? &run->matter.updMobilizedBody(run->body[i]) : &run->matter.updGround();
    if (i >= 0)
        frame = kt_pose_compose(kt_pose_invert(twin.pose[i]), frame);
    return vector_of(frame.position);
}

/* A ball takes three equations; in the plane the third one repeats what the joints have. */
void add_loop(simbody_run *run, const kt_twin &twin, const kt_loop *loop) {
    MobilizedBody *a, *b;
    const Vec3 at = end_of(run, twin, &loop->between[0], &a), other = end_of(run, twin, &loop->between[1], &b);
    if (loop->type == KT_LOOP_SPHERICAL) {
        SimTK::Constraint::Ball(*a, at, *b, other);
        return;
    }
    SimTK::Constraint::PointInPlane(*a, SimTK::UnitVec3(SimTK::XAxis), at[0], *b, other);
    SimTK::Constraint::PointInPlane(*a, SimTK::UnitVec3(SimTK::YAxis), at[1], *b, other);
}

/* Writes the poses and twists of the start into the state. */
void fit_start(simbody_run *run, const kt_twin &twin) {
    for (int i = 0; i < run->scene.count; i++) {
        const MobilizedBody &body = run->matter.getMobilizedBody(run->body[i]);
        const Transform world = transform_of(twin.pose[i]);
        const SimTK::SpatialVec twist(vector_of(twin.twist[i].angular), vector_of(twin.twist[i].linear));
        run->system.realize(run->start, SimTK::Stage::Position);
        const MobilizedBody &parent = body.getParentMobilizedBody();
        const Transform frame = parent.getBodyTransform(run->start) * body.getInboardFrame(run->start);
        body.setQToFitTransform(run->start, ~frame * world * body.getOutboardFrame(run->start));
        run->system.realize(run->start, SimTK::Stage::Velocity);
        const Vec3 spin = parent.getBodyAngularVelocity(run->start), arm = body.getOutboardFrame(run->start).p();
        const Vec3 end = world * arm, speed = twist[1] + twist[0] % (end - world.p());
        const Vec3 carried =
            parent.getBodyOriginVelocity(run->start) + spin % (end - parent.getBodyOriginLocation(run->start));
        body.setUToFitVelocity(run->start,
                               SimTK::SpatialVec(~frame.R() * (twist[0] - spin), ~frame.R() * (speed - carried)));
    }
    run->system.realize(run->start, SimTK::Stage::Velocity);
}

bool open_run(peer_request *request, void **given) {
    simbody_run *run = new simbody_run;
    *given = run;
    run->request = request;
    if (!peer_scene_open(request, &run->scene))
        return false;
    const kt_twin twin = peer_scene_twin(&run->scene);
    const kt_description *d = twin.description;
    for (int i = 0; i < d->loop_count; i++)
        if (d->loops[i].type == KT_LOOP_REVOLUTE && !kt_twin_flat(&twin)) {
            (void)std::snprintf(request->reason, PEER_REASON, "revolute loops in space are not built in this engine");
            return false;
        }
    SimTK::Force::Gravity(run->forces, run->matter, vector_of(d->gravity));
    run->body.resize(static_cast<size_t>(run->scene.count));
    for (int i = 0; i < run->scene.count; i++)
        add_body(run, twin, i);
    for (int i = 0; i < d->loop_count; i++)
        add_loop(run, twin, &d->loops[i]);
    run->start = run->system.realizeTopology();
    run->system.realizeModel(run->start);
    fit_start(run, twin);
    return true;
}

void write_poses(const simbody_run *run, const SimTK::State &state, double *poses) {
    for (int i = 0; i < run->scene.count; i++, poses += PEER_POSE) {
        const Transform &pose = run->matter.getMobilizedBody(run->body[i]).getBodyTransform(state);
        const SimTK::Quaternion r = pose.R().convertRotationToQuaternion();
        const double numbers[PEER_POSE] = {pose.p()[0], pose.p()[1], pose.p()[2], r[0], r[1], r[2], r[3]};
        std::memcpy(poses, numbers, sizeof numbers);
    }
}

std::unique_ptr<SimTK::Integrator> make_integrator(const simbody_run *run) {
    const char *method = run->request->method;
    if (std::strcmp(method, "CPodes") == 0)
        return std::unique_ptr<SimTK::Integrator>(
            new SimTK::CPodesIntegrator(run->system, SimTK::CPodes::Adams, SimTK::CPodes::Functional));
    if (std::strcmp(method, "RungeKutta3") == 0)
        return std::unique_ptr<SimTK::Integrator>(new SimTK::RungeKutta3Integrator(run->system));
    return std::unique_ptr<SimTK::Integrator>(new SimTK::RungeKuttaMersonIntegrator(run->system));
}

void run_all(simbody_run *run, double *poses) {
    const std::unique_ptr<SimTK::Integrator> integrator = make_integrator(run);
    const size_t width = PEER_POSE * static_cast<size_t>(run->scene.count);
    integrator->setAccuracy(run->request->setting);
    integrator->setConstraintTolerance(std::fmin(1e-3, 0.1 * run->request->setting));
    SimTK::TimeStepper stepper(run->system, *integrator);
    stepper.initialize(run->start);
    if (poses == nullptr)
        stepper.stepTo(run->request->records * run->request->interval);
    for (int record = 0; record <= run->request->records && poses != nullptr; record++) {
        if (record > 0)
            stepper.stepTo(record * run->request->interval);
        run->system.realize(integrator->getState(), SimTK::Stage::Position);
        write_poses(run, integrator->getState(), poses + static_cast<size_t>(record) * width);
    }
    run->evaluations = integrator->getNumRealizations();
}

bool run_motion(void *given, double *poses) {
    simbody_run *run = static_cast<simbody_run *>(given);
    try {
        run_all(run, poses);
        return true;
    } catch (const std::exception &fault) {
        (void)std::snprintf(run->request->reason, PEER_REASON, "%s", fault.what());
        for (char *c = run->request->reason; *c != '\0'; c++)
            *c = *c == '\n' ? ' ' : *c;
        return false;
    }
}

void close_run(void *given) {
    simbody_run *run = static_cast<simbody_run *>(given);
    peer_scene_close(&run->scene);
    delete run;
}

int count_bodies(const void *given) { return static_cast<const simbody_run *>(given)->scene.count; }

const char *name_body(const void *given, int i) {
    return static_cast<const simbody_run *>(given)->scene.e.scene.description.bodies[i].name;
}

long count_evaluations(const void *given) { return static_cast<const simbody_run *>(given)->evaluations; }

const char *name_version() {
    static char text[32];
    int major, minor, build;
    SimTK_version_simbody(&major, &minor, &build);
    (void)std::snprintf(text, sizeof text, "Simbody %d.%d.%d", major, minor, build);
    return text;
}

} // namespace

int main(int argc, char **argv) {
    static const peer_engine engine = {name_version, methods,   open_run,          run_motion,
                                       count_bodies, name_body, count_evaluations, close_run};
    return peer_main(&engine, argc, argv);
}
