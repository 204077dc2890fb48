/* A hard case in ODE. Every body is free and every joint is a constraint, as in this engine's absolute formulation.
 * Semi-implicit Euler steps of the case's length are taken by dWorldStep, whose exact solver is cubic in the number of
 * constraints. With more than 50 bodies the iterative dWorldQuickStep is used. Error reduction and mixing have ODE's
 * defaults. */
#include "peers.h"

#include <ode/ode.h>
#include <stdlib.h>

const char *kt_hard_ode_version(void) { return "ODE " KT_ODE_VERSION; }

typedef struct twin {
    dWorldID world;
    dBodyID *body;
    kt_vec3 *com;
    bool quick;
} twin;

static bool add_body(kt_hard *h, twin *t, int i) {
    const kt_body *b = &h->description.bodies[i];
    kt_sym3 j;
    dMass mass;
    dMatrix3 r;
    kt_hard_peer_mass(h, i, &t->com[i], &j);
    if (!(b->mass > 0.0) || !(kt_sym3_eigenvalues(j).x > 0.0))
        return false;
    t->body[i] = dBodyCreate(t->world);
    dMassSetParameters(&mass, b->mass, 0.0, 0.0, 0.0, j.xx, j.yy, j.zz, j.xy, j.xz, j.yz);
    dBodySetMass(t->body[i], &mass);
    const kt_mat3 m = h->pose[i].rotation;
    const kt_vec3 rows[3] = {{m.x.x, m.y.x, m.z.x}, {m.x.y, m.y.y, m.z.y}, {m.x.z, m.y.z, m.z.z}};
    for (int k = 0; k < 3; k++) {
        r[4 * k] = rows[k].x;
        r[4 * k + 1] = rows[k].y;
        r[4 * k + 2] = rows[k].z;
        r[4 * k + 3] = 0.0;
    }
    const kt_vec3 arm = kt_mat3_apply(m, t->com[i]), c = kt_vec3_add(h->pose[i].position, arm);
    const kt_vec3 w = h->twist[i].angular, v = kt_vec3_add(h->twist[i].linear, kt_vec3_cross(w, arm));
    dBodySetRotation(t->body[i], r);
    dBodySetPosition(t->body[i], c.x, c.y, c.z);
    dBodySetLinearVel(t->body[i], v.x, v.y, v.z);
    dBodySetAngularVel(t->body[i], w.x, w.y, w.z);
    dBodySetGyroscopicMode(t->body[i], 1);
    return true;
}

static void add_hinge(const twin *t, dBodyID a, dBodyID b, kt_vec3 at, kt_vec3 axis) {
    dJointID joint = dJointCreateHinge(t->world, 0);
    dJointAttach(joint, a, b);
    dJointSetHingeAnchor(joint, at.x, at.y, at.z);
    dJointSetHingeAxis(joint, axis.x, axis.y, axis.z);
}

static void add_ball(const twin *t, dBodyID a, dBodyID b, kt_vec3 at) {
    dJointID joint = dJointCreateBall(t->world, 0);
    dJointAttach(joint, a, b);
    dJointSetBallAnchor(joint, at.x, at.y, at.z);
}

static void add_joint(const kt_hard *h, const twin *t, int i) {
    const kt_joint *j = &h->description.bodies[i].joint;
    const dBodyID own = t->body[i], parent = h->parent[i] >= 0 ? t->body[h->parent[i]] : NULL;
    const kt_vec3 axis = kt_mat3_apply(h->pose[i].rotation, kt_vec3_normalize(j->axis)), at = h->pose[i].position;
    dJointID joint;
    switch (j->type) {
    case KT_JOINT_REVOLUTE:
        add_hinge(t, own, parent, at, axis);
        break;
    case KT_JOINT_SPHERICAL:
        add_ball(t, own, parent, at);
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
}

static void add_loop(const kt_hard *h, const twin *t, const kt_loop *loop) {
    int a, b;
    const kt_pose frame = kt_hard_peer_end(h, &loop->between[0], &a);
    (void)kt_hard_peer_end(h, &loop->between[1], &b);
    const dBodyID first = a >= 0 ? t->body[a] : NULL, second = b >= 0 ? t->body[b] : NULL;
    if (loop->type == KT_LOOP_REVOLUTE)
        add_hinge(t, first, second, frame.position, kt_mat3_apply(frame.rotation, kt_vec3_normalize(loop->axis)));
    else
        add_ball(t, first, second, frame.position);
}

static bool build(kt_hard *h, twin *t) {
    const kt_vec3 g = h->description.gravity;
    dWorldSetGravity(t->world, g.x, g.y, g.z);
    for (int i = 0; i < h->description.body_count; i++)
        if (!add_body(h, t, i))
            return false;
    for (int i = 0; i < h->description.body_count; i++)
        add_joint(h, t, i);
    for (int i = 0; i < h->description.loop_count; i++)
        add_loop(h, t, &h->description.loops[i]);
    t->quick = h->description.body_count > 50;
    return true;
}

static void read_bodies(kt_hard *h, const twin *t) {
    for (int i = 0; i < h->description.body_count; i++) {
        const dReal *p = dBodyGetPosition(t->body[i]), *r = dBodyGetRotation(t->body[i]);
        const dReal *v = dBodyGetLinearVel(t->body[i]), *w = dBodyGetAngularVel(t->body[i]);
        const kt_mat3 m = {{r[0], r[4], r[8]}, {r[1], r[5], r[9]}, {r[2], r[6], r[10]}};
        const kt_vec3 arm = kt_mat3_apply(m, t->com[i]), omega = kt_vec3_make(w[0], w[1], w[2]);
        h->pose[i] = (kt_pose){m, kt_vec3_sub(kt_vec3_make(p[0], p[1], p[2]), arm)};
        h->twist[i] = (kt_twist){omega, kt_vec3_sub(kt_vec3_make(v[0], v[1], v[2]), kt_vec3_cross(omega, arm))};
    }
}

static bool run(kt_hard *h, const kt_hard_motion *motion, const twin *t, kt_hard_watch *watch, char *words) {
    bool good = kt_hard_peer_view(h, motion, watch, 0.0, words);
    long step = 0;
    for (long view = 0, n; good && (n = kt_hard_peer_steps(h, motion, view)) > 0; view++) {
        for (long k = 0; k < n; k++, step++)
            (void)(t->quick ? dWorldQuickStep(t->world, motion->step) : dWorldStep(t->world, motion->step));
        read_bodies(h, t);
        good = kt_hard_peer_view(h, motion, watch, (double)step * motion->step, words);
    }
    return good;
}

static void say_nothing(int number, const char *format, va_list arguments) {
    (void)number;
    (void)format;
    (void)arguments;
}

bool kt_hard_ode(kt_hard *h, const kt_hard_motion *motion, kt_hard_watch *watch, char *words) {
    const size_t count = (size_t)h->description.body_count;
    bool good = false;
    if (!kt_hard_peer_begin(h, words))
        return false;
    dInitODE2(0);
    dSetMessageHandler(say_nothing);
    twin t = {dWorldCreate(), calloc(count, sizeof(dBodyID)), calloc(count, sizeof(kt_vec3)), false};
    if (t.body && t.com) {
        good = build(h, &t);
        if (!good)
            (void)snprintf(words, KT_HARD_WORDS, "refused: needs mass");
        good = good && run(h, motion, &t, watch, words);
    }
    dWorldDestroy(t.world);
    dCloseODE();
    free(t.body);
    free(t.com);
    return good;
}
