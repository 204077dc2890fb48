/* Explains why the loops of a scene do not close, and suggests changes that close them.
 *
 * Every suggested change has been tested: the description is changed in this one respect and assembled. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "advice/advice.h"

#include "kinetree/descriptor.h"
#include "kinetree/study.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    LISTED_MAX = 12, /* lines of a list */
    TRIED_MAX = 6,   /* joints or loops for which a change is tried */
};

static const double degree = 3.14159265358979323846 / 180.0;

/* ---- equations that repeat each other ---------------------------------------------------------------------------- */

/* Types with fewer equations, in the order in which they are tried as replacements. */
static const kt_loop_type lesser[] = {KT_LOOP_INLINE, KT_LOOP_UNIVERSAL, KT_LOOP_SPHERICAL, KT_LOOP_CYLINDRICAL,
                                      KT_LOOP_PLANAR};

/* Returns another type for a loop; NULL: none was found. With it, the mechanism closes, moves as before, and has no
 * equations that disagree. left: the degrees of freedom of the mechanism; -1: undetermined. */
static const char *find_lesser(kt_trials *trials, int loop, int left) {
    kt_description d = trials->scene->description;
    kt_loop *loops = malloc((size_t)d.loop_count * sizeof *loops);
    const char *found = NULL;
    if (loops == NULL)
        return NULL;
    memcpy(loops, d.loops, (size_t)d.loop_count * sizeof *loops);
    d.loops = loops;
    d.tolerance = 0.0;
    for (size_t k = 0; k < sizeof lesser / sizeof *lesser && found == NULL; k++) {
        if (loops[loop].type < KT_LOOP_REVOLUTE || loops[loop].type > KT_LOOP_WELD || lesser[k] == loops[loop].type)
            break;
        loops[loop].type = lesser[k];
        int with;
        bool disagrees;
        if (kt_closes_to(trials, &d, &with, &disagrees) && !disagrees && (left < 0 || with == left))
            found = kt_loop_type_name(lesser[k]);
        loops[loop] = trials->scene->description.loops[loop];
    }
    free(loops);
    return found;
}

int kt_say_disagreement(const kt_scene *scene, const kt_model *model) {
    const int loops = kt_loop_count(model);
    kt_trials trials = {.scene = scene, .usual = kt_trial_work(model)};
    int count = 0;
    for (int i = 0; i < loops; i++) {
        const kt_loop_disagreement d = kt_loop_disagreement_of(model, i);
        if (!(d.length > 0.0) && !(d.angle > 0.0))
            continue;
        if (count++ == 0)
            kt_say("loops repeat each other and disagree, because their data are rounded (up to 'initial: {tolerance: "
                   "%g}' is accepted). Their ends are moved as little as possible until the loops agree. If that "
                   "fails, the loops are closed in the sense of least squares. Repeated equations are left out:",
                   scene->description.tolerance);
        if (count > LISTED_MAX)
            continue;
        kt_print("  loop '%s' (%s) by up to %.2g m, %.2g deg", kt_loop_name(model, i),
                 kt_loop_type_name(kt_loop_type_of(model, i)), d.length, d.angle / degree);
        const char *type = count <= TRIED_MAX ? find_lesser(&trials, i, kt_model_mobility(model).minimal) : NULL;
        if (type != NULL)
            kt_print("; 'type: %s' leaves the same motion and has no such equations", type);
        fputs(count == 1 && type == NULL ? "; give more digits, fewer equations, or a bushing in its place\n" : "\n",
              stderr);
    }
    kt_say_trials_ended(&trials);
    return count;
}

/* ---- lengths of a loop's links ----------------------------------------------------------------------------------- */

/* A length in a loop: the distance from a body's origin to a child's joint on it, or to an end of the loop. Between two
 * joints on the world it is the distance of these joints. */
typedef struct length {
    int body;         /* the body; -1: the world */
    int child;        /* body whose joint is at `to`; -1: `to` is an end of the loop */
    int loop, end;    /* otherwise this end of this loop */
    kt_vec3 from, to; /* m, in the body's frame */
} length;

enum { LENGTHS_MAX = 12, DEPTH_MAX = 64 };

int kt_advised_body(const kt_description *d, const char *name) {
    for (int i = 0; name != NULL && i < d->body_count; i++)
        if (strcmp(d->bodies[i].name, name) == 0)
            return i;
    return -1;
}

static int find_body_marker(const kt_body *body, const char *name) {
    for (int i = 0; name != NULL && i < body->marker_count; i++)
        if (strcmp(body->markers[i].name, name) == 0)
            return i;
    return -1;
}

/* Returns the point of an end in its body's frame, m. */
static kt_vec3 point_of_end(const kt_description *d, const kt_end *end) {
    const int body = kt_advised_body(d, end->body),
              marker = body >= 0 ? find_body_marker(&d->bodies[body], end->marker) : -1;
    return marker >= 0 ? d->bodies[body].markers[marker].at : end->at;
}

/* Lists the bodies on the path from an end of a loop to the world. Returns their number. */
static int follow_path(const kt_description *d, const kt_end *end, int *path) {
    int count = 0;
    for (int i = kt_advised_body(d, end->body); i >= 0 && count < DEPTH_MAX;
         i = kt_advised_body(d, d->bodies[i].parent))
        path[count++] = i;
    return count;
}

static void add_length(length *list, int *count, length one) {
    if (*count < LENGTHS_MAX && kt_vec3_norm(kt_vec3_sub(one.to, one.from)) > 0.0)
        list[(*count)++] = one;
}

/* Lists the lengths of a loop, without bodies common to the paths of both ends. Returns their number. */
static int list_lengths(const kt_description *d, int loop, length *list) {
    const kt_end *ends = d->loops[loop].between;
    int path[2][DEPTH_MAX], n[2], count = 0;
    for (int k = 0; k < 2; k++)
        n[k] = follow_path(d, &ends[k], path[k]);
    while (n[0] > 0 && n[1] > 0 && path[0][n[0] - 1] == path[1][n[1] - 1]) {
        n[0]--;
        n[1]--;
    }
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < n[k]; i++) {
            const kt_vec3 to = i > 0 ? d->bodies[path[k][i - 1]].joint.at : point_of_end(d, &ends[k]);
            add_length(
                list, &count,
                (length){.body = path[k][i], .child = i > 0 ? path[k][i - 1] : -1, .loop = loop, .end = k, .to = to});
        }
    if (n[0] > 0 && n[1] > 0) {
        const int first = path[0][n[0] - 1], last = path[1][n[1] - 1];
        add_length(
            list, &count,
            (length){.body = -1, .child = last, .from = d->bodies[first].joint.at, .to = d->bodies[last].joint.at});
    }
    return count;
}

/* Tests the assembly with the origin of a joint at `to`. */
static bool closes_with_joint_at(kt_trials *trials, int child, kt_vec3 to) {
    kt_joint joint = trials->scene->description.bodies[child].joint;
    joint.at = to;
    return kt_closes_with_joint(trials, child, &joint);
}

/* Tests the assembly with an end of a loop at `to`. The end gets its own position, because other loops may use its
 * marker. */
static bool closes_with_end_at(kt_trials *trials, int loop, int end, kt_vec3 to) {
    kt_loop changed = trials->scene->description.loops[loop];
    changed.between[end].marker = NULL;
    changed.between[end].at = to;
    return kt_closes_with_loop(trials, loop, &changed);
}

/* Tests the assembly with a length that is longer by `change` m. */
static bool closes_longer(kt_trials *trials, const length *l, double change) {
    const kt_vec3 span = kt_vec3_sub(l->to, l->from);
    const kt_vec3 to = kt_vec3_add(l->from, kt_vec3_scale(1.0 + change / kt_vec3_norm(span), span));
    return l->child >= 0 ? closes_with_joint_at(trials, l->child, to) : closes_with_end_at(trials, l->loop, l->end, to);
}

/* The first change that is tried, over the gap. At the gap itself, the bars are in line and locked. */
static const double beyond_gap = 1.001;

/* Returns the first change of a length, in the order of increasing magnitude, for which the loops close; 0: none of
 * those tried. */
static double find_length_change(kt_trials *trials, const length *l, double gap) {
    const double part[] = {beyond_gap, 1.3, 2.0};
    const double whole = kt_vec3_norm(kt_vec3_sub(l->to, l->from));
    for (size_t k = 0; k < sizeof part / sizeof part[0]; k++)
        for (int sign = 1; sign >= -1; sign -= 2) {
            const double change = sign * part[k] * gap;
            if (whole + change > 1e-3 * whole && closes_longer(trials, l, change))
                return change;
        }
    return 0.0;
}

/* ---- millimetres ------------------------------------------------------------------------------------------------- */

/* A length that exceeds the sum of the other lengths of its loop by this factor probably has another unit. */
static const double MILLIMETRES = 30.0;

/* Returns the number of significant digits that distinguish two lengths. */
static int digits_of(double one, double other) {
    const double apart = fabs(one - other) / fmax(fabs(one), fabs(other));
    return apart > 0.0 ? (int)fmin(fmax(3.0, 2.0 + ceil(-log10(apart))), 15.0) : 3;
}

/* Suggests the length of a loop that was probably given in millimetres: divided by 1000, it closes the loop. Returns
 * the number of suggestions. */
static int advise_on_millimetres(kt_trials *trials, int loop) {
    const kt_description *d = &trials->scene->description;
    length list[LENGTHS_MAX];
    const int count = list_lengths(d, loop, list);
    double sum = 0.0;
    int found = 0;
    for (int i = 0; i < count; i++)
        sum += kt_vec3_norm(kt_vec3_sub(list[i].to, list[i].from));
    for (int i = 0; i < count && found == 0; i++) {
        const length *l = &list[i];
        const double whole = kt_vec3_norm(kt_vec3_sub(l->to, l->from));
        if (whole < MILLIMETRES * (sum - whole) || !closes_longer(trials, l, -0.999 * whole))
            continue;
        if (l->body < 0)
            kt_print("  millimetres? They close if the joint of '%s' on the world is %.6g m, not %.6g m, from the "
                     "other one\n",
                     d->bodies[l->child].name, 1e-3 * whole, whole);
        else
            kt_print("  millimetres? They close if the %.6g m from the joint of '%s' to %s '%s' are %.6g m\n", whole,
                     d->bodies[l->body].name, l->child >= 0 ? "that of" : "the end of loop",
                     l->child >= 0 ? d->bodies[l->child].name : d->loops[loop].name, 1e-3 * whole);
        found++;
    }
    return found;
}

/* ---- residuals of open loops ------------------------------------------------------------------------------------- */

/* Prints the residuals of a loop, grouped by unit: "0.5, 0, 0 m; 90, 0 deg". Residuals below 1e-6 of the largest of all
 * loops are printed as zero. */
static void say_gaps(const kt_model *model, int loop, const double *residual, double most) {
    static const char *const unit[] = {" m", " deg", " (rad or m)"};
    const kt_loop_rows rows = kt_loop_rows_of(model, loop);
    const char *before = "";
    kt_print("  loop '%s' (%s), equation by equation: ", kt_loop_name(model, loop),
             kt_loop_type_name(kt_loop_type_of(model, loop)));
    for (int measure = KT_MEASURE_LENGTH; measure < KT_MEASURE_NONE; measure++) {
        int count = 0;
        for (int r = 0; r < rows.count; r++) {
            if (kt_loop_measure_of(model, loop, r) != (kt_loop_measure)measure)
                continue;
            const double x = fabs(residual[rows.first + r]) > 1e-6 * most ? residual[rows.first + r] : 0.0;
            kt_print("%s%.3g", count++ ? ", " : before,
                     measure == KT_MEASURE_ANGLE ? kt_loop_residual_angle(model, loop, r, x) / degree : x);
        }
        if (count > 0) {
            kt_print("%s", unit[measure]);
            before = "; ";
        }
    }
    kt_print("\n");
}

static double largest_gap(const kt_model *model, int loop, const double *residual) {
    const kt_loop_rows rows = kt_loop_rows_of(model, loop);
    double most = 0.0;
    for (int r = 0; r < rows.count; r++)
        most = fmax(most, fabs(residual[rows.first + r]));
    return most;
}

/* Returns the distance between the ends of a loop: the norm of its residuals that are lengths, m. */
static double gap_length(const kt_model *model, int loop, const double *residual) {
    const kt_loop_rows rows = kt_loop_rows_of(model, loop);
    double sum = 0.0;
    for (int r = 0; r < rows.count; r++)
        if (kt_loop_measure_of(model, loop, r) == KT_MEASURE_LENGTH)
            sum += residual[rows.first + r] * residual[rows.first + r];
    return sqrt(sum);
}

/* Loops whose gaps are no larger are closed, m or rad. */
static const double closed = 1e-9;

/* The state in which an assembly ended, with loops open. */
typedef struct reached {
    const kt_model *model;
    kt_data *data;    /* with its kinematics */
    double *state;    /* q and v */
    double *residual; /* of all equations */
    double most;      /* the largest of them, m or rad */
    bool is_closed;   /* the positions close, and velocities contradict each other */
} reached;

static void free_reached(reached *r) {
    kt_data_free(r->data);
    free(r->state);
    free(r->residual);
}

/* Returns whether the assembly has failed, so that there is such a state. Ownership: free_reached frees it in either
 * case. */
static bool find_reached(const kt_model *model, reached *r) {
    *r = (reached){.model = model,
                   .state = kt_given_state(model),
                   .residual = calloc((size_t)kt_model_mobility(model).equations + 1, sizeof *r->residual)};
    if (r->state == NULL || r->residual == NULL || kt_data_create(model, &r->data, NULL) != KT_OK)
        return false;
    if (kt_state_assemble(model, r->data, 0.0, r->state, r->state + kt_model_nq(model), NULL) != KT_ERROR_CONSTRAINT)
        return false;
    kt_assembly_reached(model, r->data, r->state);
    if (kt_loop_equations(model, r->data, 0.0, r->state, NULL, NULL, r->residual, NULL, NULL, NULL) != KT_OK ||
        kt_kinematics_update(model, r->data, r->state, NULL, NULL, NULL) != KT_OK)
        return false;
    for (int i = 0; i < kt_loop_count(model); i++)
        r->most = fmax(r->most, largest_gap(model, i, r->residual));
    r->is_closed = r->most <= closed;
    return true;
}

static int advise_on_hold(kt_trials *trials) {
    const kt_description *d = &trials->scene->description;
    int found = 0;
    for (int i = 0; i < d->hold_count && i < TRIED_MAX; i++)
        if (kt_closes_holding(trials, i, NULL)) {
            kt_print("  they close if '%s' is not in 'initial: hold'\n", d->hold[i]);
            found++;
        }
    return found;
}

static const struct {
    const char *name;
    kt_vec3 axis;
} axes[] = {{"x", {1.0, 0.0, 0.0}}, {"y", {0.0, 1.0, 0.0}}, {"z", {0.0, 0.0, 1.0}}};

static int advise_on_axis(kt_trials *trials, int loop) {
    const kt_loop *given = &trials->scene->description.loops[loop];
    int found = 0;
    for (int k = 0; k < 3 && kt_descriptor_key(kt_loop_descriptor(given->type), "axis"); k++) {
        const kt_vec3 across = kt_vec3_cross(kt_vec3_normalize(given->axis), axes[k].axis);
        kt_loop changed = *given;
        changed.axis = axes[k].axis;
        if (kt_vec3_norm(across) > 1e-6 && kt_closes_with_loop(trials, loop, &changed)) {
            kt_print("  they close with 'axis: %s' in loop '%s'\n", axes[k].name, given->name);
            found++;
        }
    }
    return found;
}

static bool joint_has_axis(kt_joint_type type) {
    return kt_descriptor_key(kt_joint_descriptor(type), "joint.axis") != NULL;
}

/* Tries other axes for the joints on the paths of a loop. Returns the number of suggestions. */
static int advise_on_joints(kt_trials *trials, int loop) {
    const kt_description *d = &trials->scene->description;
    int path[DEPTH_MAX], found = 0, tried = 0;
    for (int end = 0; end < 2; end++) {
        const int count = follow_path(d, &d->loops[loop].between[end], path);
        for (int i = 0; i < count && tried < TRIED_MAX; i++) {
            const kt_body *body = &d->bodies[path[i]];
            if (!joint_has_axis(body->joint.type))
                continue;
            tried++;
            for (int k = 0; k < 3; k++) {
                const kt_vec3 across = kt_vec3_cross(kt_vec3_normalize(body->joint.axis), axes[k].axis);
                kt_joint changed = body->joint;
                changed.axis = axes[k].axis;
                if (kt_vec3_norm(across) <= 1e-6 || !kt_closes_with_joint(trials, path[i], &changed))
                    continue;
                kt_print("  they close with 'axis: %s' in the joint of '%s'\n", axes[k].name, body->name);
                found++;
            }
        }
    }
    return found;
}

/* Tries other lengths in a loop whose ends are `gap` m apart. Returns the number of suggestions. */
static int advise_on_lengths(kt_trials *trials, int loop, double gap) {
    const kt_description *d = &trials->scene->description;
    length list[LENGTHS_MAX];
    const int count = gap > 0.0 ? list_lengths(d, loop, list) : 0;
    int found = 0;
    for (int i = 0; i < count; i++) {
        const length *l = &list[i];
        const double change = find_length_change(trials, l, gap), whole = kt_vec3_norm(kt_vec3_sub(l->to, l->from));
        const char *point = l->child >= 0 ? d->bodies[l->child].name : d->loops[loop].name;
        if (change == 0.0)
            continue;
        found++;
        const bool is_limit = fabs(change) < 1.1 * gap; /* the bars are then in line */
        const double least = is_limit ? change / beyond_gap : change, to = whole + least;
        const int digits = digits_of(to, whole);
        const char *more = is_limit ? "more than " : "", *than = !is_limit ? "" : least > 0.0 ? more : "less than ";
        if (l->body < 0)
            kt_print("  they close if the joint of '%s' on the world is %s%.3g m %s the other one: %s%.*g m, not %.*g "
                     "m\n",
                     point, more, fabs(least), least > 0.0 ? "farther from" : "nearer to", than, digits, to, digits,
                     whole);
        else
            kt_print("  they close if '%s' is %s%.3g m %s from its joint to %s '%s': %s%.*g m, not %.*g m\n",
                     d->bodies[l->body].name, more, fabs(least), least > 0.0 ? "longer" : "shorter",
                     l->child >= 0 ? "that of" : "the end of loop", point, than, digits, to, digits, whole);
    }
    return found;
}

static kt_vec3 without_rounding(kt_vec3 a) {
    const double least = 1e-6 * kt_vec3_norm(a);
    return (kt_vec3){fabs(a.x) > least ? a.x : 0.0, fabs(a.y) > least ? a.y : 0.0, fabs(a.z) > least ? a.z : 0.0};
}

/* Tries each end of a loop at the position of the other end. Returns the number of suggestions. */
static int advise_on_places(kt_trials *trials, const reached *r, int loop, double gap) {
    const kt_description *d = &trials->scene->description;
    const kt_end *ends = d->loops[loop].between;
    int found = 0;
    for (int k = 0; k < 2 && gap > 0.0; k++) {
        const int body = kt_advised_body(d, ends[k].body) >= 0 ? kt_body_find(r->model, ends[k].body) : 0;
        const int other = kt_advised_body(d, ends[1 - k].body) >= 0 ? kt_body_find(r->model, ends[1 - k].body) : 0;
        const kt_vec3 there = kt_point_position(r->model, r->data, other, point_of_end(d, &ends[1 - k]));
        const kt_vec3 to = kt_pose_apply(kt_pose_invert(kt_body_pose(r->model, r->data, body)), there);
        if (!closes_with_end_at(trials, loop, k, to))
            continue;
        const kt_vec3 direction = without_rounding(kt_vec3_sub(to, point_of_end(d, &ends[k])));
        kt_print("  they close if the end of loop '%s' on '%s' is moved by [%.3g, %.3g, %.3g] m in that frame\n",
                 d->loops[loop].name, body > 0 ? ends[k].body : "world", direction.x, direction.y, direction.z);
        found++;
    }
    return found;
}

/* Residuals that data with few digits may leave, m or rad. */
#define NEARLY 1e-3

/* Suggests another type for a loop whose equations repeat others and nearly agree with them. Returns the number of
 * suggestions. */
static int advise_on_types(kt_trials *trials, const int *open, int count) {
    for (int i = 0; i < count; i++) {
        const char *type = find_lesser(trials, open[i], -1);
        if (type == NULL)
            continue;
        fprintf(
            stderr,
            "  they close with 'type: %s' in loop '%s', which has fewer equations, or with a bushing in its place\n",
            type, trials->scene->description.loops[open[i]].name);
        return 1;
    }
    return 0;
}

static void advise_changes(kt_trials *trials, const reached *r, const int *open, const double *gap, int count) {
    const kt_description *d = &trials->scene->description;
    const int held = advise_on_hold(trials);
    int found = kt_say_double_motions("  ", trials->scene);
    found += found == 0 ? kt_say_doubly_driven(trials) : 0;
    const bool is_driven_twice = found > 0;
    const int types = r->most < NEARLY ? advise_on_types(trials, open, count) : 0;
    if (r->most <= d->tolerance)
        fputs("  gaps of this size are accepted as rounding of the data, but not where bars lie in line: such a "
              "position looks like one that is out of reach. Begin at a neighbouring position\n",
              stderr);
    for (int i = 0; i < count && found == 0; i++)
        found += advise_on_millimetres(trials, open[i]);
    for (int i = 0; i < count && !is_driven_twice; i++)
        found += advise_on_axis(trials, open[i]);
    for (int i = 0; i < count && found == 0; i++)
        found += advise_on_joints(trials, open[i]);
    found += held;
    for (int i = 0; i < count && found == 0; i++)
        found += advise_on_lengths(trials, open[i], gap[i]);
    for (int i = 0; i < count && found == 0; i++)
        found += advise_on_places(trials, r, open[i], gap[i]);
    for (int i = 0; i < count && found == 0 && d->loop_count > 1; i++)
        if (kt_closes_without(trials, open[i])) {
            kt_print("  the other loops close without loop '%s'\n", d->loops[open[i]].name);
            found++;
        }
    if (found + types == 0 && !trials->ended)
        fputs(
            "  none of these changes closes them: another axis in one of the loops or their joints, one joint less in "
            "'hold', one length changed by the gap or by twice the gap, one end moved to the other: check the lengths, "
            "places and axes\n",
            stderr);
}

void kt_say_open_loops(const kt_scene *scene, const kt_model *model) {
    reached r;
    kt_trials trials = {.scene = scene, .usual = kt_trial_work(model), .dof = kt_model_mobility(model).minimal};
    int open[TRIED_MAX], count = 0;
    double gap[TRIED_MAX];
    const int loops = find_reached(model, &r) && !r.is_closed ? kt_loop_count(model) : 0;
    for (int i = 0, said = 0; i < loops && said < LISTED_MAX; i++) {
        if (!(largest_gap(model, i, r.residual) > 1e-3 * r.most))
            continue;
        say_gaps(model, i, r.residual, r.most);
        said++;
        if (count == TRIED_MAX)
            continue;
        gap[count] = gap_length(model, i, r.residual);
        open[count++] = i;
    }
    if (loops > 0 && kt_model_nv(model) <= KT_ADVICE_COORDINATES_MAX)
        advise_changes(&trials, &r, open, gap, count);
    if (r.is_closed && kt_model_nv(model) <= KT_ADVICE_COORDINATES_MAX) {
        (void)advise_on_hold(&trials);
        kt_say_contradicting_velocities(&trials);
    }
    kt_say_trials_ended(&trials);
    free_reached(&r);
}
