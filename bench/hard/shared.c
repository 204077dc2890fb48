/* Code shared by the twins of a hard case in other engines: the start, the masses, the views. */
#include "peers.h"

#include <math.h>
#include <string.h>

bool kt_hard_peer_flat(const kt_hard *h) {
    for (int i = 0; i < h->description.body_count; i++) {
        const kt_joint *j = &h->description.bodies[i].joint;
        const bool turns = j->type == KT_JOINT_REVOLUTE && j->axis.x == 0.0 && j->axis.y == 0.0;
        if (!(turns || (j->type == KT_JOINT_PRISMATIC && j->axis.z == 0.0)) || j->rotation.type != KT_ROTATION_NONE)
            return false;
    }
    return true;
}

void kt_hard_peer_mass(const kt_hard *h, int body, kt_vec3 *com, kt_sym3 *inertia) {
    const kt_body *b = &h->description.bodies[body];
    *com = b->com;
    *inertia = b->inertia;
    if (b->com_of_shape || b->inertia_of_shape)
        (void)!kt_body_inertia(b, com, inertia, NULL);
    if (kt_hard_peer_flat(h)) {
        inertia->xx = fmax(inertia->xx, 1e-4 * b->mass + inertia->zz);
        inertia->yy = fmax(inertia->yy, 1e-4 * b->mass + inertia->zz);
    }
}

static bool known(const kt_hard *h) {
    bool good = true;
    for (int i = 0; i < h->description.body_count; i++) {
        const kt_joint_type type = h->description.bodies[i].joint.type;
        good = good && (type == KT_JOINT_FIXED || type == KT_JOINT_REVOLUTE || type == KT_JOINT_PRISMATIC ||
                        type == KT_JOINT_SPHERICAL || type == KT_JOINT_FREE);
    }
    for (int i = 0; i < h->description.loop_count; i++)
        good = good &&
               (h->description.loops[i].type == KT_LOOP_REVOLUTE || h->description.loops[i].type == KT_LOOP_SPHERICAL);
    return good && h->description.effect_count == 0;
}

bool kt_hard_peer_begin(kt_hard *h, char *words) {
    kt_data *data = NULL;
    kt_error error;
    (void)snprintf(words, KT_HARD_WORDS, "-");
    if (!known(h))
        return false;
    const bool done = kt_data_create(h->model, &data, &error) == KT_OK &&
                      kt_kinematics_update(h->model, data, kt_simulation_positions(h->simulation),
                                           kt_simulation_velocities(h->simulation), NULL, &error) == KT_OK;
    if (done)
        (void)kt_hard_look(h, data, 0.0);
    kt_data_free(data);
    return done;
}

kt_pose kt_hard_peer_end(const kt_hard *h, const kt_end *end, int *body) {
    kt_pose frame = kt_pose_identity();
    frame.position = end->at;
    (void)!kt_rotation_evaluate(&end->rotation, &frame.rotation, NULL);
    *body = -1;
    for (int i = 0; end->body && i < h->description.body_count; i++)
        if (strcmp(h->description.bodies[i].name, end->body) == 0)
            *body = i;
    if (*body < 0)
        return frame;
    const kt_body *b = &h->description.bodies[*body];
    for (int m = 0; end->marker && m < b->marker_count; m++)
        if (strcmp(b->markers[m].name, end->marker) == 0)
            frame.position = b->markers[m].at;
    return kt_pose_compose(h->pose[*body], frame);
}

long kt_hard_peer_steps(const kt_hard *h, const kt_hard_motion *motion, long view) {
    const double interval = fmax(motion->interval, motion->step);
    if ((double)(view + 1) * interval > kt_hard_duration(h, motion) * (1.0 + 1e-9))
        return 0;
    return lround(interval / motion->step);
}

bool kt_hard_peer_view(kt_hard *h, const kt_hard_motion *motion, kt_hard_watch *watch, double t, char *words) {
    const kt_hard_view view = {&h->description, h->parent, h->pose, h->twist, t};
    for (int i = 0; i < h->description.body_count; i++)
        if (!kt_vec3_is_finite(h->pose[i].position) || !kt_vec3_is_finite(h->twist[i].linear) ||
            kt_vec3_norm(h->twist[i].linear) > 1e12) {
            (void)snprintf(words, KT_HARD_WORDS, "nan at %.2g s", t);
            return false;
        }
    motion->watch(watch, &view);
    watch->count++;
    return true;
}
