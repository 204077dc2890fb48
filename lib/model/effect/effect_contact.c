/* Contact of a sphere (a point, if its radius is 0) with a plane: a half-space below the plane through the second end,
 * normal to n. The sphere has the centre c, the radius r and the lowest point l = c - r n. The depth x and the slip
 * velocity s, of l on the sphere relative to l on the plane's body, are
 *     x = r - n . (c - p)
 *     s = v1 + w1 x (l - c) - v2 - w2 x (l - p),   n . s = -dx/dt
 * For x > 0 the normal force of Hunt and Crossley (1975) acts in l on both:
 *     N = k x^m max(0, 1 + 3/2 c dx/dt),   V = k x^(m + 1) / (m + 1)
 * For slow impacts at the speed v, the coefficient of restitution is 1 - c v, for every m. The damping vanishes with
 * x^m, so that N is continuous at the beginning and the end of contact. N never pulls. A sphere that leaves faster than
 * 2 / (3 c) leaves the indentation behind, and its energy is dissipated without a force.
 *
 * Friction opposes the tangential part of s, and is smooth in s_t:
 *     T = -mu N tanh(|s_t| / v0) s_t / |s_t|
 * Below v0 (`slip`) it is a damper mu N / v0. Under a load T < mu N a body creeps at v0 artanh(T / (mu N)) instead of
 * resting. Friction acts in l, not in the centre, and so makes a ball roll. Rolling and torsional friction are moments
 * against the angular velocity w = w1 - w2, with the arms a (`rolling`) and b (`torsion`), smooth below w0 (`turn`):
 *     M = -N (a tanh(|w_t| / w0) w_t / |w_t| + b tanh(|w_n| / w0) w_n / |w_n|)
 * A rolling ball needs a force of a N / r, and a wheel stops after v^2 / (2 g) (1 + i^2 / r^2) r / a, with its radius
 * of inertia i. The inelastic part of the power is
 *     dissipated = -P - dV/dt = (N - k x^m) dx/dt + |T| |s_t| + |M . w| >= 0.
 *
 * A disc (an axle a) touches with KT_RIM_POINTS points of its rim, in the directions cos u d + sin u e for the lowest
 * direction d = e x a and the level direction e = n x a / |n x a|. The points keep these directions while the disc
 * spins. An upright disc touches at its lowest point alone and rolls without bumps, and a disc that lies flat stands on
 * all of them. Since the points come in pairs +u and -u, k x^m of a pair does no work in a spin, and the energy is the
 * sum of those of the points. When the disc is flat (|n x a| < KT_RIM_FLAT), the directions are fixed to the disc: the
 * sum of the points hardly depends on their angles then.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/effect.h"
#include "effect/rim.h"

static void contact_check(kt_checker *checker, const kt_effect *effect) {
    kt_effect_check_hard(checker, effect, "contact");
    if (kt_effect_has_axle(effect) && !(effect->radius > 0.0))
        kt_checker_fault(checker, "radius", -1, "radius is %g; that of a disc must be above 0", effect->radius);
    if (effect->radius2 > 0.0 && (!kt_effect_is_hard(effect) || kt_effect_has_axle(effect)))
        kt_checker_fault(
            checker, "radius2", -1,
            "two spheres have a hard contact (restitution) and no axle; give a restitution in place of the "
            "stiffness, or leave `radius2` out");
    if (kt_number_is_fine(effect->exponent) && !(effect->exponent >= 1.0))
        kt_checker_fault(checker, "exponent", -1,
                         "exponent is %g; it must be 1 or more: below, contact would begin with an infinite stiffness",
                         effect->exponent);
}

/* The velocity of the point at `arm` from an end that moves with this end. */
static inline kt_triple end_point_velocity(const kt_effect_frame *end, kt_triple arm) {
    return kt_triple_add(end->velocity, kt_triple_cross(end->omega, arm));
}

/* A share g of moments of friction against a turn: tanh(w / w0) / w */
static inline kt_real share_of_turn(const kt_effect_record *effect, kt_real w) {
    const kt_real ratio = w / effect->turn;
    return KT_CHOOSE(kt_value(ratio) > 0.0, kt_tanh(ratio) / ratio, kt_real_of(1.0)) / effect->turn;
}

/* What a contact does in one point: the wrenches on both ends, and the parts of the power. */
typedef struct contact_load {
    kt_effect_wrench wrench[2];
    kt_real energy, dissipated;
} contact_load;

/* Adds rolling and torsional friction of a normal force. */
static inline void add_turning(const kt_effect_record *effect, const kt_effect_frame *end, kt_triple n, kt_real normal,
                               kt_condition touches, contact_load *to) {
    const kt_triple w = kt_triple_sub(end[0].omega, end[1].omega);
    const kt_real spin = kt_triple_dot(n, w);
    const kt_triple roll = kt_triple_sub(w, kt_triple_scale(spin, n));
    const kt_real speed = KT_CHOOSE(touches, kt_triple_norm(roll), kt_real_of(0.0));
    const kt_real rolling = effect->rolling * normal * share_of_turn(effect, speed);
    const kt_real turning = effect->torsion * normal * share_of_turn(effect, kt_abs(spin));
    const kt_triple moment = kt_triple_add(kt_triple_scale(rolling, roll), kt_triple_scale(turning * spin, n));
    to->wrench[0].moment = kt_triple_sub(to->wrench[0].moment, moment);
    to->wrench[1].moment = kt_triple_add(to->wrench[1].moment, moment);
    to->dissipated = to->dissipated + rolling * speed * speed + turning * spin * spin;
}

/* The contact in a point at `down` from the first end, x deep; `touches` are the lanes in which it is. */
static contact_load load_in_point(const kt_effect_record *effect, const kt_effect_frame *end, kt_triple from_plane,
                                  kt_triple down, kt_real x, kt_condition touches) {
    /* In lanes without contact it makes all forces zero. */
    const kt_triple n = end[1].axes.z, arm = kt_triple_add(from_plane, down);
    const kt_real depth = KT_CHOOSE(touches, x, kt_real_of(0.0));
    const kt_triple s = kt_triple_sub(end_point_velocity(&end[0], down), end_point_velocity(&end[1], arm));
    const kt_real deeper = -kt_triple_dot(n, s), elastic = effect->stiffness * kt_pow(depth, effect->exponent);
    const kt_real normal = elastic * kt_max(1.0 + 1.5 * effect->dissipation * deeper, 0.0);
    const kt_triple across = kt_triple_add(s, kt_triple_scale(deeper, n));
    const kt_real speed = KT_CHOOSE(touches, kt_triple_norm(across), kt_real_of(0.0)), ratio = speed / effect->slip;
    const kt_real rub = effect->friction * normal / effect->slip *
                        KT_CHOOSE(kt_value(ratio) > 0.0, kt_tanh(ratio) / ratio, kt_real_of(1.0));
    const kt_triple force = kt_triple_sub(kt_triple_scale(normal, n), kt_triple_scale(rub, across));
    const kt_triple back = kt_triple_scale(kt_real_of(-1.0), force);
    contact_load load = {.wrench = {{.moment = kt_triple_cross(down, force), .force = force},
                                    {.moment = kt_triple_cross(arm, back), .force = back}},
                         .energy = elastic * depth / (effect->exponent + 1.0),
                         .dissipated = (normal - elastic) * deeper + rub * speed * speed};
    if (effect->rolling > 0.0 || effect->torsion > 0.0)
        add_turning(effect, end, n, normal, touches, &load);
    return load;
}

/* Sums the points of a disc's rim. */
static contact_load load_on_rim(const kt_effect_record *effect, const kt_effect_frame *end, kt_triple from_plane) {
    const kt_triple n = end[1].axes.z, tilt = kt_triple_cross(n, end[0].axes.z), none = kt_triple_zero();
    const kt_real s = kt_triple_norm(tilt);
    const kt_condition flat = kt_value(s) < KT_RIM_FLAT;
    const kt_real per_s = 1.0 / KT_CHOOSE(flat, kt_real_of(1.0), s);
    const kt_triple e = KT_CHOOSE_TRIPLE(flat, end[0].axes.y, kt_triple_scale(per_s, tilt));
    const kt_triple d = kt_triple_cross(e, end[0].axes.z);
    contact_load sum = {.wrench = {{none, none}, {none, none}}};
    sum.energy = sum.dissipated = kt_real_of(0.0);
    for (int i = 0; i < KT_RIM_POINTS; i++) {
        const kt_triple down = kt_triple_add(kt_triple_scale(kt_real_of(effect->radius * kt_rim_cosine(i)), d),
                                             kt_triple_scale(kt_real_of(effect->radius * kt_rim_sine(i)), e));
        const kt_real x = -kt_triple_dot(n, kt_triple_add(from_plane, down));
        const kt_condition touches = kt_not(kt_value(x) <= 0.0);
        if (!kt_is_anywhere(touches))
            continue;
        const contact_load load = load_in_point(effect, end, from_plane, down, x, touches);
        for (int k = 0; k < 2; k++) {
            sum.wrench[k].moment = kt_triple_add(sum.wrench[k].moment, load.wrench[k].moment);
            sum.wrench[k].force = kt_triple_add(sum.wrench[k].force, load.wrench[k].force);
        }
        sum.energy = sum.energy + load.energy;
        sum.dissipated = sum.dissipated + load.dissipated;
    }
    return sum;
}

/* A disc of axle a reaches r |n x a| below its centre. In lanes, all states are computed if any of them touches. */
static void contact_wrench(const kt_effect_record *effect, const double *numbers, const kt_effect_frame *end,
                           kt_plain t, kt_effect_wrench *wrench, kt_effect_power *balance) {
    (void)numbers, (void)t;
    const kt_triple n = end[1].axes.z, none = kt_triple_zero();
    const kt_triple from_plane = kt_triple_sub(end[0].point, end[1].point);
    const kt_real reach =
        effect->disc ? effect->radius * kt_triple_norm(kt_triple_cross(n, end[0].axes.z)) : kt_real_of(effect->radius);
    const kt_real x = reach - kt_triple_dot(n, from_plane);
    const kt_condition touches = kt_not(kt_value(x) <= 0.0);
    if (!kt_is_anywhere(touches)) {
        wrench[0] = wrench[1] = (kt_effect_wrench){.moment = none, .force = none};
        if (balance)
            *balance = (kt_effect_power){.energy = kt_real_of(0.0)};
        return;
    }
    const contact_load load = effect->disc ? load_on_rim(effect, end, from_plane)
                                           : load_in_point(effect, end, from_plane,
                                                           kt_triple_scale(kt_real_of(-effect->radius), n), x, touches);
    wrench[0] = load.wrench[0];
    wrench[1] = load.wrench[1];
    if (balance)
        *balance = (kt_effect_power){.energy = load.energy, .dissipated = load.dissipated};
}

static kt_energetics contact_energetics(const kt_effect_record *effect) {
    return kt_energetics_of(effect->dissipation > 0.0 || effect->friction > 0.0 || effect->rolling > 0.0 ||
                            effect->torsion > 0.0);
}

#if KT_IS_OF_VALUES
/* A change of the plane's motion: rotation and displacement, angular velocity and velocity of its point. */
typedef struct change {
    kt_vec3 rotation, displacement, omega, velocity;
} change;

/* A state of contact. */
typedef struct contact_state {
    kt_vec3 n, from_plane, arm, s, across, force;     /* force: on the sphere */
    double elastic, gradient, bounce, deeper, normal; /* gradient = k m x^(m - 1); bounce: 1 + 3/2 c dx/dt, or 0 */
    double rub, rub_by_speed, speed;                  /* rub_by_speed: for one N of normal force */
} contact_state;

/* All quantities of an elastic contact at the depth x: the normal n, the velocity s of slip at the lowest point, the
 * normal force `elastic` times `bounce` (Hunt and Crossley), and the friction coefficient over the speed, `rub`,
 * smoothed by tanh. */
static contact_state contact_state_of(const kt_effect_record *effect, const kt_effect_end *end, double x) {
    contact_state c = {.n = end[1].axes.z, .from_plane = kt_vec3_sub(end[0].point, end[1].point)};
    const kt_vec3 down = kt_vec3_scale(-effect->radius, c.n);
    c.arm = kt_vec3_add(c.from_plane, down);
    c.s = kt_vec3_sub(end_point_velocity(&end[0], down), end_point_velocity(&end[1], c.arm));
    c.deeper = -kt_vec3_dot(c.n, c.s);
    c.across = kt_vec3_add(c.s, kt_vec3_scale(c.deeper, c.n));
    c.speed = kt_vec3_norm(c.across);
    c.elastic = effect->stiffness * pow(x, effect->exponent);
    c.gradient = effect->stiffness * effect->exponent * pow(x, effect->exponent - 1.0);
    c.bounce = fmax(1.0 + 1.5 * effect->dissipation * c.deeper, 0.0);
    c.normal = c.elastic * c.bounce;
    const double ratio = c.speed / effect->slip, sign = tanh(ratio), share = ratio > 0.0 ? sign / ratio : 1.0;
    c.rub = effect->friction / effect->slip * share;
    c.rub_by_speed = ratio > 0.0 ? effect->friction / effect->slip * (1.0 - sign * sign - share) / c.speed : 0.0;
    c.force = kt_vec3_sub(kt_vec3_scale(c.normal, c.n), kt_vec3_scale(c.rub * c.normal, c.across));
    return c;
}

/* A moment of friction against a turn w of speed u, with the arm `arm`: -N h(u) w, h = arm tanh(u / w0) / u. */
typedef struct contact_turn {
    kt_vec3 w;
    double u, h, slope; /* slope = h' / u */
} contact_turn;

/* h and h' / u of a turn w; at rest h is its limit arm / w0. */
static contact_turn turn_of(const kt_effect_record *effect, kt_vec3 w, double arm) {
    const double u = kt_vec3_norm(w), ratio = u / effect->turn, sign = tanh(ratio),
                 share = ratio > 0.0 ? sign / ratio : 1.0, h = arm / effect->turn;
    return (contact_turn){
        .w = w, .u = u, .h = h * share, .slope = ratio > 0.0 ? h * (1.0 - sign * sign - share) / (u * u) : 0.0};
}

/* The change of N h(u) w, for changes dN and dw. Since u du = w . dw,
 *     d(N h w) = (dN h + N (h' / u) w . dw) w + N h dw */
static kt_vec3 change_of_turn(const contact_turn *t, double dN, double N, kt_vec3 dw) {
    const kt_vec3 along = kt_vec3_scale(dN * t->h + N * t->slope * kt_vec3_dot(t->w, dw), t->w);
    return kt_vec3_add(along, kt_vec3_scale(N * t->h, dw));
}

/* The change of the moment of rolling and torsional friction on the plane's body, N (h(u_t) w_t + h(u_n) w_n). */
static kt_vec3 change_of_turning(const kt_effect_record *effect, const kt_effect_end *end, const contact_state *c,
                                 const change *by, kt_vec3 n, double normal) {
    const kt_vec3 w = kt_vec3_sub(end[0].omega, end[1].omega), changed = kt_vec3_scale(-1.0, by->omega);
    const double spin = kt_vec3_dot(c->n, w), faster = kt_vec3_dot(c->n, changed) + kt_vec3_dot(n, w);
    const kt_vec3 about = kt_vec3_scale(spin, c->n);
    const kt_vec3 turned = kt_vec3_add(kt_vec3_scale(faster, c->n), kt_vec3_scale(spin, n));
    const contact_turn rolls = turn_of(effect, kt_vec3_sub(w, about), effect->rolling);
    const contact_turn turns = turn_of(effect, about, effect->torsion);
    return kt_vec3_add(change_of_turn(&rolls, normal, c->normal, kt_vec3_sub(changed, turned)),
                       change_of_turn(&turns, normal, c->normal, turned));
}

/* The change of the wrench on the plane's body: each line is the derivative of the line of contact_wrench with the
 * same quantity. */
static kt_wrench change_of_wrench(const kt_effect_record *effect, const kt_effect_end *end, const contact_state *c,
                                  const change *by) {
    const kt_vec3 n = kt_vec3_cross(by->rotation, c->n), down = kt_vec3_scale(-effect->radius, n);
    const kt_vec3 arm = kt_vec3_sub(down, by->displacement);
    const double x = kt_vec3_dot(c->n, by->displacement) - kt_vec3_dot(n, c->from_plane);
    const kt_vec3 carried = kt_vec3_add(kt_vec3_cross(end[1].omega, arm), kt_vec3_cross(by->omega, c->arm));
    const kt_vec3 s = kt_vec3_sub(kt_vec3_cross(end[0].omega, down), kt_vec3_add(by->velocity, carried));
    const double deeper = -kt_vec3_dot(n, c->s) - kt_vec3_dot(c->n, s);
    const double bounce = c->bounce > 0.0 ? 1.5 * effect->dissipation * deeper : 0.0;
    const double normal = c->gradient * x * c->bounce + c->elastic * bounce;
    const kt_vec3 across = kt_vec3_add(s, kt_vec3_add(kt_vec3_scale(deeper, c->n), kt_vec3_scale(c->deeper, n)));
    const double speed = c->speed > 0.0 ? kt_vec3_dot(c->across, across) / c->speed : 0.0;
    const double rub = c->rub * normal + c->rub_by_speed * speed * c->normal;
    const kt_vec3 pressing = kt_vec3_add(kt_vec3_scale(normal, c->n), kt_vec3_scale(c->normal, n));
    const kt_vec3 rubbing = kt_vec3_add(kt_vec3_scale(rub, c->across), kt_vec3_scale(c->rub * c->normal, across));
    const kt_vec3 force = kt_vec3_sub(rubbing, pressing);
    kt_vec3 moment = kt_vec3_sub(kt_vec3_cross(c->arm, force), kt_vec3_cross(arm, c->force));
    if (effect->rolling > 0.0 || effect->torsion > 0.0)
        moment = kt_vec3_add(moment, change_of_turning(effect, end, c, by, n, normal));
    return (kt_wrench){.moment = moment, .force = force};
}

/* The changed end is the plane, on which the wrench is the reaction of c.force. Columns are changes of its wrench for
 * unit rotations, displacements and their rates. Discs have dual numbers instead. */
static void contact_jacobian(const kt_effect_record *effect, const double *numbers, const kt_effect_end *end, double t,
                             kt_effect_jacobian *jacobian) {
    (void)numbers, (void)t;
    const double x = effect->radius - kt_vec3_dot(end[1].axes.z, kt_vec3_sub(end[0].point, end[1].point));
    *jacobian = (kt_effect_jacobian){.at_point = false};
    if (x <= 0.0)
        return;
    const contact_state c = contact_state_of(effect, end, x);
    jacobian->force = kt_vec3_scale(-1.0, c.force);
    jacobian->moment = kt_vec3_cross(c.arm, jacobian->force);
    if (effect->rolling > 0.0 || effect->torsion > 0.0) {
        const kt_vec3 w = kt_vec3_sub(end[0].omega, end[1].omega), about = kt_vec3_scale(kt_vec3_dot(c.n, w), c.n);
        const contact_turn rolls = turn_of(effect, kt_vec3_sub(w, about), effect->rolling);
        const contact_turn turns = turn_of(effect, about, effect->torsion);
        const kt_vec3 moment = kt_vec3_add(kt_vec3_scale(rolls.h, rolls.w), kt_vec3_scale(turns.h, turns.w));
        jacobian->moment = kt_vec3_add(jacobian->moment, kt_vec3_scale(c.normal, moment));
    }
    const kt_vec3 none = {0.0, 0.0, 0.0}, direction[3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
    kt_wrench by[4][3];
    for (int k = 0; k < 3; k++) {
        const kt_vec3 e = direction[k];
        const change along[4] = {
            {e, none, none, none}, {none, e, none, none}, {none, none, e, none}, {none, none, none, e}};
        for (int j = 0; j < 4; j++)
            by[j][k] = change_of_wrench(effect, end, &c, &along[j]);
    }
    for (int j = 0; j < 4; j++) {
        kt_mat3(*matrix)[2] = j < 2 ? jacobian->stiffness : jacobian->damping;
        matrix[0][j % 2] = (kt_mat3){by[j][0].moment, by[j][1].moment, by[j][2].moment};
        matrix[1][j % 2] = (kt_mat3){by[j][0].force, by[j][1].force, by[j][2].force};
    }
}
#endif

#if KT_IS_OF_VALUES
/* The distance of the lowest point below the centre: r, and r |n x a| for a disc. */
static double contact_reach_of(const kt_effect_record *effect, const kt_effect_end *end) {
    if (effect->disc)
        return effect->radius * kt_vec3_norm(kt_vec3_cross(end[1].axes.z, end[0].axes.z));
    return effect->radius;
}

/* Returns -x, and the velocity of the sphere's centre in the frame of the plane. For a plane on the ground, the
 * velocity is in the world's axes. Contacts of two spheres are hard: only their distances are used. */
static kt_gap contact_gap(const kt_effect_record *effect, const kt_effect_end *end) {
    const kt_vec3 from_plane = kt_vec3_sub(end[0].point, end[1].point), n = end[1].axes.z;
    if (effect->radius2 > 0.0)
        return (kt_gap){.distance = kt_vec3_norm(from_plane) - effect->radius - effect->radius2};
    const double distance = kt_vec3_dot(n, from_plane) - contact_reach_of(effect, end);
    kt_vec3 velocity = end[0].velocity;
    if (effect->disc) /* that of its lowest point: the rate of the distance is its part along n */
        velocity = kt_vec3_add(velocity, kt_vec3_cross(end[0].omega, kt_contact_lowest(effect, end[0].axes, n)));
    if (effect->force_link[1] == 0)
        return (kt_gap){distance, kt_vec3_dot(n, velocity), velocity, kt_vec3_norm(end[0].omega)};
    const kt_vec3 carried = kt_vec3_add(end[1].velocity, kt_vec3_cross(end[1].omega, from_plane));
    const kt_vec3 u = kt_mat3_apply_transposed(end[1].axes, kt_vec3_sub(velocity, carried));
    return (kt_gap){distance, u.z, u, kt_vec3_norm(kt_vec3_sub(end[0].omega, end[1].omega))};
}

/* For a height n . (c - p) that is a coordinate. */
static kt_gap find_joint_gap(const kt_effect_record *effect, double height, double rate) {
    return (kt_gap){.distance = height - effect->radius, .rate = rate, .velocity = {0.0, 0.0, rate}};
}
#endif

const kt_effect_kind KT_EFFECT(kt_effect_contact) = {.check = contact_check,
                                                     .energetics = contact_energetics,
                                                     .wrench = contact_wrench,
                                                     .gap = KT_GAP(contact_gap),
                                                     .joint_gap = KT_GAP(find_joint_gap),
                                                     .jacobian = KT_IF_JACOBIAN(contact_jacobian)};

#if KT_DESCRIBES
static const kt_key keys[] = {
    {"point", KT_KEY_END, KT_EFFECT_AT(between[0]), "", "the centre of the sphere", .needed = true},
    {"radius", KT_KEY_NUMBER, KT_EFFECT_AT(radius), "m", "r; 0: a point", .range = KT_RANGE_NOT_NEGATIVE},
    {"axle", KT_KEY_AXIS, KT_EFFECT_AT(axle), "",

     "the axis of a thin disc whose rim touches, in place of the sphere; frame of the point", "a sphere",
     .needed = false},
    {"plane", KT_KEY_END, KT_EFFECT_AT(between[1]), "",
     "a frame in the plane, or the centre of a second sphere (radius2)", .needed = true},
    {"radius2", KT_KEY_NUMBER, KT_EFFECT_AT(radius2), "m",
     "of hard contacts: the radius of a second sphere in place of the plane", "a plane",
     .range = KT_RANGE_NOT_NEGATIVE},
    {"axis", KT_KEY_AXIS, KT_EFFECT_AT(axis), "", "n, the normal of the plane, in that frame, out of the half-space",
     .needed = false},
    {"stiffness", KT_KEY_NUMBER, KT_EFFECT_AT(stiffness), "N/m^exponent", KT_ELASTIC_WORDS("k"), KT_ELASTIC_STIFFNESS},
    {"exponent", KT_KEY_NUMBER, KT_EFFECT_AT(exponent), "", "m, 1 or more; 1.5 is that of Hertz", .needed = false},
    {"dissipation", KT_KEY_NUMBER, KT_EFFECT_AT(dissipation), "s/m",
     "c; after a slow impact at v, the speed is v - c v^2", .range = KT_RANGE_NOT_NEGATIVE},
    {"friction", KT_KEY_NUMBER, KT_EFFECT_AT(friction), "", "mu, the coefficient of friction; hard contacts also stick",
     .range = KT_RANGE_NOT_NEGATIVE},
    {"slip", KT_KEY_NUMBER, KT_EFFECT_AT(slip), "m/s",
     "v0, the speed of slip over which friction of an elastic contact builds up", .range = KT_RANGE_POSITIVE},
    {"rolling", KT_KEY_NUMBER, KT_EFFECT_AT(rolling), "m",
     "a, the arm of rolling friction of an elastic contact: a N is its moment", .range = KT_RANGE_NOT_NEGATIVE},
    {"torsion", KT_KEY_NUMBER, KT_EFFECT_AT(torsion), "m",
     "b, the arm of friction against a spin about the normal, of an elastic contact", .range = KT_RANGE_NOT_NEGATIVE},
    {"turn", KT_KEY_NUMBER, KT_EFFECT_AT(turn), "rad/s",
     "w0, the angular velocity over which rolling and torsional friction build up", .range = KT_RANGE_POSITIVE},
    KT_HARD_KEYS("e: the contact is hard; a point that arrives at -w leaves at e w (Newton's rule)")};
const kt_descriptor kt_effect_contact_descriptor = {
    .name = "contact",
    .help = "contact of a sphere or a disc with a half-space (Hunt and Crossley), with friction",
    .formula =
        "x > 0:  normal force = k x^m max(0, 1 + 3/2 c x'),  friction = mu tanh(|s| / v0) times that, against s\n"
        "moments a tanh(|w_t| / w0) and b tanh(|w_n| / w0) times that, against the relative angular velocity w\n"
        "x: depth of the lowest point;  s: slip velocity there;  w_n: along the normal",
    .example = "bodies:\n"
               "  - name: ball\n"
               "    joint:\n"
               "      type: free\n"
               "      position: {position: [0, 0, 0.5]}\n"
               "      velocity: {linear: [1, 0, 0]}\n"
               "    mass: 0.2\n"
               "    shape: {type: sphere, radius: 0.05}\n"
               "    markers: {centre: [0, 0, 0]}\n"
               "effects:\n"
               "  - type: contact\n"
               "    point: ball.centre\n"
               "    radius: 0.05\n"
               "    plane: world\n"
               "    stiffness: 1e4\n"
               "    dissipation: 0.2\n"
               "    friction: 0.4\n",
    KT_DESCRIPTOR_KEYS,
    KT_QUANTITIES(KT_QUANTITY_NORMAL, KT_QUANTITY_FRICTION, KT_QUANTITIES_FORCE, KT_QUANTITY_POWER, KT_QUANTITY_EXCESS,
                  KT_QUANTITY_SLIP, KT_QUANTITY_POINT_X, KT_QUANTITY_POINT_Y, KT_QUANTITY_POINT_Z),
};
#endif
