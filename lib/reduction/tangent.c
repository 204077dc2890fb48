/* How the forces and the equations of loops change with the state, direction by direction.
 *
 * A loop's equations depend on nothing but how its second end moves against the first: on the freedoms between the link
 * that carries both, taken to be at rest, and the ends. With S, psi', psi'' and phi of such a freedom (freedom.h), all
 * spatial vectors told from one point O that rests, an end with velocity V and acceleration A changes
 *     with q_k, as it is carried along S_k:   dV = S x V + psi',   dA = S x A + psi'' - V x psi'   [derivative.h]
 *     with v_k:                               dV = S,              dA = phi - V x S
 * and a point x that moves with it, whose velocity is v + w x x for V = (w, v) and whose acceleration is a + alpha x x
 * + w x (v + w x x) for A = (alpha, a), follows. So moved, the ends are given to the loop's own code
 * (algebra/number.h): of its rows come the changes of phi'' = A a - b'',     W = sum lambda_r (moment_r + x_2 x
 * force_r, force_r). A freedom i meets W with S_i . W, on the first end's way with the opposite sign. S_i itself is
 * carried along by the freedoms before it, and those of its node, by S_k x S_i.
 */
#include "reduction/tangent.h"

#include "loop/kind.h"

/* ---- the ways to the ends ---------------------------------------------------------------------------------------- */

typedef struct end_motion {
    kt_v4 axes[3], point;
    kt_v4 velocity[2], acceleration[2]; /* V, A */
} end_motion;

typedef struct way {
    const kt_tangent *x;
    int32_t count; /* of freedoms */
    end_motion end[2];
} way;

/* From about `place` to about O, from which that is counted. */
static void tell_from(kt_v4 place, kt_v4 s[2]) { s[1] += kt_v4_cross(place, s[0]); }

static void add_freedoms(way *w, const kt_link *link, int end, kt_v4 place, const kt_freedom_motion *motion) {
    const int count = kt_link_freedoms(link);
    const int32_t first = w->count;
    for (int k = 0; k < count; k++) {
        kt_way_freedom *f = &w->x->freedom[w->count++];
        *f = (kt_way_freedom){.motion = motion[k], .v = link->v + k, .end = end, .first = first + (k >= 3 ? 3 : 0)};
        tell_from(place, f->motion.s);
        tell_from(place, f->motion.psi);
        tell_from(place, f->motion.rate);
        tell_from(place, f->motion.phi);
    }
}

/* Down from the ancestor, whose origin is at `place`, to a frame on a link. */
static void follow(way *w, int32_t ancestor, kt_v4 place, int end, int32_t to, const kt_pose *frame) {
    const kt_model *model = w->x->model;
    const kt_link_motion *motion = w->x->data->motion;
    kt_carried c = {kt_v4_splat(0.0), kt_v4_splat(0.0), kt_v4_splat(0.0), kt_v4_splat(0.0)};
    kt_freedom_motion freedom[KT_FREEDOM_MOST];
    int32_t n = 0;
    for (int32_t i = to; i != ancestor; i = model->link[i].parent)
        w->x->chain[n++] = i;
    while (n-- > 0) {
        const kt_link *link = &model->link[w->x->chain[n]];
        const kt_link_motion *m = &motion[w->x->chain[n]];
        c.velocity += kt_v4_cross(c.omega, m->offset);
        c.linear += kt_v4_cross(c.alpha, m->offset);
        place += m->offset;
        kt_freedoms_set(link, &motion[link->parent], m, w->x->v, w->x->a, &c, freedom);
        add_freedoms(w, link, end, place, freedom);
    }
    end_motion *e = &w->end[end];
    kt_v4 turn[3];
    kt_v4_from_mat3(frame->rotation, turn);
    kt_v4_multiply(motion[to].axes, turn, e->axes);
    e->point = place + kt_v4_apply(motion[to].axes, kt_v4_from(frame->position));
    e->velocity[0] = c.omega, e->velocity[1] = c.velocity;
    e->acceleration[0] = c.alpha, e->acceleration[1] = c.linear;
    tell_from(place, e->velocity);
    tell_from(place, e->acceleration);
}

/* O is the origin of the first link on the way. */
static void follow_both(way *w, int32_t ancestor, const int32_t link[2], const kt_pose frame[2]) {
    int32_t first = link[0] != ancestor ? link[0] : link[1];
    kt_v4 place = kt_v4_splat(0.0);
    while (first != ancestor && w->x->model->link[first].parent != ancestor)
        first = w->x->model->link[first].parent;
    if (first != ancestor)
        place -= w->x->data->motion[first].offset;
    w->count = 0;
    for (int end = 0; end < 2; end++)
        follow(w, ancestor, place, end, link[end], &frame[end]);
}

/* ---- a direction ------------------------------------------------------------------------------------------------- */

typedef enum direction { POSITION, RATE } direction;

/* An end that freedom m moves, or none (NULL). */
static kt_loop_end move(const end_motion *e, const kt_freedom_motion *m, direction along) {
    const kt_v4 none = kt_v4_splat(0.0);
    kt_v4 axes[3] = {none, none, none}, point = none, v[2] = {none, none}, a[2] = {none, none}, x[2];
    if (m && along == POSITION) {
        for (int k = 0; k < 3; k++)
            axes[k] = kt_v4_cross(m->s[0], e->axes[k]);
        point = m->s[1] + kt_v4_cross(m->s[0], e->point);
        kt_motion_cross(m->s[0], m->s[1], e->velocity, v);
        kt_motion_cross(m->s[0], m->s[1], e->acceleration, a);
        kt_motion_cross(e->velocity[0], e->velocity[1], m->psi, x);
        for (int k = 0; k < 2; k++) {
            v[k] += m->psi[k];
            a[k] += m->rate[k] - x[k];
        }
    } else if (m) {
        kt_motion_cross(e->velocity[0], e->velocity[1], m->s, x);
        for (int k = 0; k < 2; k++) {
            v[k] = m->s[k];
            a[k] = m->phi[k] - x[k];
        }
    }
    kt_loop_end end;
    for (int k = 0; k < 3; k++)
        end.axes[k] = kt_vector_of(e->axes[k], axes[k]);
    end.point = kt_vector_of(e->point, point);
    end.omega = kt_vector_of(e->velocity[0], v[0]);
    end.velocity = kt_vector_of(e->velocity[1], v[1]) + kt_cross(end.omega, end.point);
    end.alpha = kt_vector_of(e->acceleration[0], a[0]);
    end.linear =
        kt_vector_of(e->acceleration[1], a[1]) + kt_cross(end.alpha, end.point) + kt_cross(end.omega, end.velocity);
    return end;
}

/* A wrench about O and its change. */
typedef struct pushed {
    kt_vector moment, force;
} pushed;

/* Takes the change of the joint forces with q_k off column d. */
static void take_forces(const way *w, int32_t k, const pushed *p, double *d) {
    const kt_way_freedom *by = &w->x->freedom[k];
    const kt_v4 n = kt_vector_value(p->moment), f = kt_vector_value(p->force);
    const kt_v4 dn = kt_vector_change(p->moment), df = kt_vector_change(p->force);
    for (int32_t i = 0; i < w->count; i++) {
        const kt_way_freedom *at = &w->x->freedom[i];
        double x = kt_v4_dot2(at->motion.s[0], dn, at->motion.s[1], df);
        if (at->end == by->end && i >= by->first) {
            kt_v4 carried[2];
            kt_motion_cross(by->motion.s[0], by->motion.s[1], at->motion.s, carried);
            x += kt_v4_dot2(carried[0], n, carried[1], f);
        }
        d[at->v] -= at->end ? x : -x;
    }
}

/* ---- loops ------------------------------------------------------------------------------------------------------- */

/* Moves along freedom k: what of b'' - A a changes, into e; returns W. */
static pushed evaluate(const way *w, const kt_loop_record *loop, int32_t k, direction along, const double *lambda,
                       double *e) {
    const kt_way_freedom *by = &w->x->freedom[k];
    kt_loop_row rows[KT_LOOP_ROW_MAX];
    kt_loop_end end[2];
    for (int i = 0; i < 2; i++)
        end[i] = move(&w->end[i], by->end == i ? &by->motion : NULL, along);
    const int count = kt_loop_kinds_tangent[loop->type]->evaluate(loop, w->x->model->number, end, w->x->t, rows);
    const kt_vector apart = end[1].point - end[0].point, alpha = end[1].alpha - end[0].alpha;
    const kt_vector linear = end[1].linear - end[0].linear - kt_cross(end[0].alpha, apart);
    pushed sum = {kt_vector_zero(), kt_vector_zero()};
    for (int r = 0; r < count; r++) {
        e[r] = -kt_change(rows[r].drift + kt_dot(rows[r].moment, alpha) + kt_dot(rows[r].force, linear));
        sum.moment += kt_scale(lambda[r], rows[r].moment);
        sum.force += kt_scale(lambda[r], rows[r].force);
    }
    sum.moment += kt_cross(end[1].point, sum.force);
    return sum;
}

void kt_tangent_loops(const kt_tangent *x, const double *lambda, double *d_q, double *e_q, double *e_v) {
    const kt_model *model = x->model;
    const size_t n = model->n.v, p = model->n.row;
    memset(e_q, 0, n * p * sizeof *e_q);
    memset(e_v, 0, n * p * sizeof *e_v);
    for (size_t l = 0; l < model->n.loop; l++) {
        const kt_loop_record *loop = &model->loop[l];
        const size_t row = (size_t)loop->equation;
        way w = {.x = x};
        if (loop->term_count) /* a relation: A is constant, and b'' a function of time */
            continue;
        follow_both(&w, loop->ancestor, loop->link, loop->frame);
        for (int32_t k = 0; k < w.count; k++) {
            const size_t j = (size_t)x->freedom[k].v;
            const pushed sum = evaluate(&w, loop, k, POSITION, lambda + row, e_q + j * p + row);
            take_forces(&w, k, &sum, d_q + j * n);
            (void)evaluate(&w, loop, k, RATE, lambda + row, e_v + j * p + row);
        }
    }
}
