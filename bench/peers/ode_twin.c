/* SPDX-License-Identifier: Apache-2.0 */
#include "ode_twin.h"

#include <ode/ode.h>
#include <stdlib.h>

struct kt_ode_twin {
    kt_twin source;
    dWorldID world;
    dBodyID *body;
    kt_vec3 *com;
    bool is_quick;
    dJointID *joint;        /* between a body and its parent; NULL: free */
    dSpaceID space;         /* of spheres and planes */
    dJointGroupID contacts; /* of a step */
};

static void start_body(const kt_ode_twin *t, int i) {
    const kt_pose pose = t->source.pose[i];
    const kt_mat3 m = pose.rotation;
    const kt_vec3 rows[3] = {{m.x.x, m.y.x, m.z.x}, {m.x.y, m.y.y, m.z.y}, {m.x.z, m.y.z, m.z.z}};
    dMatrix3 r;
    for (int k = 0; k < 3; k++) {
        r[4 * k] = rows[k].x;
        r[4 * k + 1] = rows[k].y;
        r[4 * k + 2] = rows[k].z;
        r[4 * k + 3] = 0.0;
    }
    const kt_vec3 arm = kt_mat3_apply(m, t->com[i]), c = kt_vec3_add(pose.position, arm);
    const kt_vec3 w = t->source.twist[i].angular, v = kt_vec3_add(t->source.twist[i].linear, kt_vec3_cross(w, arm));
    dBodySetRotation(t->body[i], r);
    dBodySetPosition(t->body[i], c.x, c.y, c.z);
    dBodySetLinearVel(t->body[i], v.x, v.y, v.z);
    dBodySetAngularVel(t->body[i], w.x, w.y, w.z);
}

static bool add_body(kt_ode_twin *t, int i) {
    const kt_body *b = &t->source.description->bodies[i];
    kt_sym3 j;
    dMass mass;
    kt_twin_mass(&t->source, i, &t->com[i], &j);
    if (!(b->mass > 0.0) || !(kt_sym3_eigenvalues(j).x > 0.0))
        return false;
    t->body[i] = dBodyCreate(t->world);
    dMassSetParameters(&mass, b->mass, 0.0, 0.0, 0.0, j.xx, j.yy, j.zz, j.xy, j.xz, j.yz);
    dBodySetMass(t->body[i], &mass);
    dBodySetGyroscopicMode(t->body[i], 1);
    start_body(t, i);
    return true;
}

static dJointID add_hinge(const kt_ode_twin *t, dBodyID a, dBodyID b, kt_vec3 at, kt_vec3 axis) {
    dJointID joint = dJointCreateHinge(t->world, 0);
    dJointAttach(joint, a, b);
    dJointSetHingeAnchor(joint, at.x, at.y, at.z);
    dJointSetHingeAxis(joint, axis.x, axis.y, axis.z);
    return joint;
}

static dJointID add_ball(const kt_ode_twin *t, dBodyID a, dBodyID b, kt_vec3 at) {
    dJointID joint = dJointCreateBall(t->world, 0);
    dJointAttach(joint, a, b);
    dJointSetBallAnchor(joint, at.x, at.y, at.z);
    return joint;
}

static void add_joint(kt_ode_twin *t, int i) {
    const kt_joint *j = &t->source.description->bodies[i].joint;
    const dBodyID own = t->body[i], parent = t->source.parent[i] >= 0 ? t->body[t->source.parent[i]] : NULL;
    const kt_pose pose = t->source.pose[i];
    const kt_vec3 axis = kt_mat3_apply(pose.rotation, kt_vec3_normalize(j->axis));
    dJointID joint = NULL;
    switch (j->type) {
    case KT_JOINT_REVOLUTE:
        joint = add_hinge(t, own, parent, pose.position, axis);
        break;
    case KT_JOINT_SPHERICAL:
        joint = add_ball(t, own, parent, pose.position);
        break;
    case KT_JOINT_PRISMATIC:
        joint = dJointCreateSlider(t->world, 0);
        dJointAttach(joint, own, parent);
        dJointSetSliderAxis(joint, axis.x, axis.y, axis.z);
        break;
    case KT_JOINT_FIXED:
        joint = dJointCreateFixed(t->world, 0);
        dJointAttach(joint, own, parent);
        dJointSetFixed(joint);
        break;
    default:
        break;
    }
    t->joint[i] = joint;
}

static void add_loop(const kt_ode_twin *t, const kt_loop *loop) {
    int a, b;
    const kt_pose frame = kt_twin_end(&t->source, &loop->between[0], &a);
    (void)kt_twin_end(&t->source, &loop->between[1], &b);
    const dBodyID first = a >= 0 ? t->body[a] : NULL, second = b >= 0 ? t->body[b] : NULL;
    if (loop->type == KT_LOOP_REVOLUTE)
        (void)add_hinge(t, first, second, frame.position, kt_mat3_apply(frame.rotation, kt_vec3_normalize(loop->axis)));
    else
        (void)add_ball(t, first, second, frame.position);
}

enum { PLANES = 1, SPHERES = 2 };

/* ODE's bodies have their origins at their centres of mass. */
static void add_ground(kt_ode_twin *t, const kt_twin_ground *ground) {
    t->space = dSimpleSpaceCreate(NULL);
    t->contacts = dJointGroupCreate(0);
    for (int k = 0; k < ground->plane_count; k++) {
        const kt_twin_plane *p = &ground->plane[k];
        const kt_vec3 n = p->normal;
        dGeomID plane = dCreatePlane(t->space, n.x, n.y, n.z, kt_vec3_dot(n, p->at));
        dGeomSetCategoryBits(plane, PLANES);
        dGeomSetCollideBits(plane, SPHERES);
    }
    for (int k = 0; k < ground->sphere_count; k++) {
        const kt_twin_sphere *s = &ground->sphere[k];
        const kt_vec3 offset = kt_vec3_sub(s->at, t->com[s->body]);
        dGeomID sphere = dCreateSphere(t->space, s->radius);
        dGeomSetBody(sphere, t->body[s->body]);
        dGeomSetOffsetPosition(sphere, offset.x, offset.y, offset.z);
        dGeomSetCategoryBits(sphere, SPHERES);
        dGeomSetCollideBits(sphere, ground->touch ? PLANES | SPHERES : PLANES);
    }
}

static void add_contact(void *data, dGeomID a, dGeomID b) {
    const kt_ode_twin *t = data;
    dContact contact = {.surface = {.mode = dContactApprox1, .mu = t->source.ground->friction}};
    if (dCollide(a, b, 1, &contact.geom, sizeof contact.geom) == 1)
        dJointAttach(dJointCreateContact(t->world, t->contacts, &contact), dGeomGetBody(a), dGeomGetBody(b));
}

static bool build(kt_ode_twin *t) {
    const kt_description *d = t->source.description;
    dWorldSetGravity(t->world, d->gravity.x, d->gravity.y, d->gravity.z);
    for (int i = 0; i < d->body_count; i++)
        if (!add_body(t, i))
            return false;
    for (int i = 0; i < d->body_count; i++)
        add_joint(t, i);
    for (int i = 0; i < d->loop_count; i++)
        add_loop(t, &d->loops[i]);
    if (t->source.ground)
        add_ground(t, t->source.ground);
    t->is_quick = d->body_count > 50;
    return true;
}

static void say_nothing(int number, const char *format, va_list arguments) {
    (void)number;
    (void)format;
    (void)arguments;
}

kt_ode_twin *kt_ode_twin_create(const kt_twin *source) {
    const size_t count = (size_t)source->description->body_count;
    kt_ode_twin *t = calloc(1, sizeof *t);
    if (t == NULL)
        return NULL;
    dInitODE2(0);
    dSetMessageHandler(say_nothing);
    t->source = *source;
    t->world = dWorldCreate();
    t->body = calloc(count, sizeof(dBodyID));
    t->com = calloc(count, sizeof *t->com);
    t->joint = calloc(count, sizeof(dJointID));
    if (t->body != NULL && t->com != NULL && t->joint != NULL && build(t))
        return t;
    kt_ode_twin_free(t);
    return NULL;
}

void kt_ode_twin_free(kt_ode_twin *t) {
    if (t->space != NULL) {
        dJointGroupDestroy(t->contacts);
        dSpaceDestroy(t->space);
    }
    dWorldDestroy(t->world);
    dCloseODE();
    free(t->joint);
    free(t->body);
    free(t->com);
    free(t);
}

void kt_ode_twin_start(kt_ode_twin *t) {
    for (int i = 0; i < t->source.description->body_count; i++)
        start_body(t, i);
}

void kt_ode_twin_step(kt_ode_twin *t, double step, long count) {
    for (long k = 0; k < count; k++) {
        if (t->space != NULL)
            dSpaceCollide(t->space, t, add_contact);
        (void)(t->is_quick ? dWorldQuickStep(t->world, step) : dWorldStep(t->world, step));
        if (t->space != NULL)
            dJointGroupEmpty(t->contacts);
    }
}

void kt_ode_twin_set_quick(kt_ode_twin *t) { t->is_quick = true; }

double kt_ode_twin_angle(const kt_ode_twin *t, int i, double *rate) {
    *rate = dJointGetHingeAngleRate(t->joint[i]);
    return dJointGetHingeAngle(t->joint[i]);
}

void kt_ode_twin_turn(kt_ode_twin *t, int i, double torque) { dJointAddHingeTorque(t->joint[i], torque); }

void kt_ode_twin_read(const kt_ode_twin *t, const kt_twin *to) {
    for (int i = 0; i < t->source.description->body_count; i++) {
        const dReal *p = dBodyGetPosition(t->body[i]), *r = dBodyGetRotation(t->body[i]);
        const dReal *v = dBodyGetLinearVel(t->body[i]), *w = dBodyGetAngularVel(t->body[i]);
        const kt_mat3 m = {{r[0], r[4], r[8]}, {r[1], r[5], r[9]}, {r[2], r[6], r[10]}};
        const kt_vec3 arm = kt_mat3_apply(m, t->com[i]), omega = kt_vec3_make(w[0], w[1], w[2]);
        to->pose[i] = (kt_pose){m, kt_vec3_sub(kt_vec3_make(p[0], p[1], p[2]), arm)};
        to->twist[i] = (kt_twist){omega, kt_vec3_sub(kt_vec3_make(v[0], v[1], v[2]), kt_vec3_cross(omega, arm))};
    }
}
