/* Which equations a loop has in a generated file.
 *
 * Each type is a list of parts, as in lib/model/loop. A part is left out if it vanishes in the plane of its mechanism,
 * or if it repeats other parts and was not chosen when the model was compiled.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "codegen/loop_rows.h"
#include "constraint/formula_row.h"
#include "constraint/group.h"
#include "kinetree/description.h"

bool kt_code_loop_is_planar(const kt_model *model, const kt_loop_record *loop) {
    return model->n.planar_loop > 0 && model->group[loop->group].planar;
}

/* The equations of types, in the order of lib/model/loop; types without them cannot be generated, or have no parts. */
static const unsigned char part_of_type[KT_LOOP_TYPE_COUNT][KT_LOOP_ROW_MAX] = {
    [KT_LOOP_SPHERICAL] = {KT_PART_X, KT_PART_Y, KT_PART_Z},
    [KT_LOOP_INLINE] = {KT_PART_X, KT_PART_Y},
    [KT_LOOP_INPLANE] = {KT_PART_Z},
    [KT_LOOP_PARALLEL] = {KT_PART_ROTATION_X, KT_PART_ROTATION_Y, KT_PART_ROTATION_Z},
    [KT_LOOP_COAXIAL] = {KT_PART_TILT_X, KT_PART_TILT_Y},
    [KT_LOOP_ORTHOGONAL] = {KT_PART_NORMAL},
    [KT_LOOP_REVOLUTE] = {KT_PART_X, KT_PART_Y, KT_PART_Z, KT_PART_TILT_X, KT_PART_TILT_Y},
    [KT_LOOP_PRISMATIC] = {KT_PART_X, KT_PART_Y, KT_PART_ROTATION_X, KT_PART_ROTATION_Y, KT_PART_ROTATION_Z},
    [KT_LOOP_CYLINDRICAL] = {KT_PART_X, KT_PART_Y, KT_PART_TILT_X, KT_PART_TILT_Y},
    [KT_LOOP_PLANAR] = {KT_PART_Z, KT_PART_TILT_X, KT_PART_TILT_Y},
    [KT_LOOP_WELD] = {KT_PART_X, KT_PART_Y, KT_PART_Z, KT_PART_ROTATION_X, KT_PART_ROTATION_Y, KT_PART_ROTATION_Z},
    [KT_LOOP_UNIVERSAL] = {KT_PART_X, KT_PART_Y, KT_PART_Z, KT_PART_NORMAL},
    [KT_LOOP_SCREW] = {KT_PART_X, KT_PART_Y, KT_PART_TILT_X, KT_PART_TILT_Y, KT_CODE_ADVANCE},
    [KT_LOOP_HOMOKINETIC] = {KT_PART_X, KT_PART_Y, KT_PART_Z, KT_CODE_TURN},
    [KT_LOOP_SURFACE] = {KT_CODE_SURFACE},
    [KT_LOOP_CURVE] = {KT_CODE_CURVE_FIRST, KT_CODE_CURVE_SECOND, KT_CODE_CURVE_ALONG},
    [KT_LOOP_ROLLING] = {KT_CODE_ROLL_X, KT_CODE_ROLL_Y, KT_CODE_ROLL_GAP},
    [KT_LOOP_KNIFE_EDGE] = {KT_CODE_EDGE},
    [KT_LOOP_GEAR] = {KT_CODE_WHEEL},
    [KT_LOOP_RACK] = {KT_CODE_WHEEL},
    [KT_LOOP_WORM] = {KT_CODE_WHEEL},
    [KT_LOOP_SPAN] = {KT_CODE_WHEEL},
    [KT_LOOP_BELT] = {KT_CODE_WHEEL, KT_CODE_WHEEL_SECOND},
};

/* Equations of velocities, which have no residual. */
#define CODE_VELOCITIES (1u << KT_CODE_ROLL_X | 1u << KT_CODE_ROLL_Y | 1u << KT_CODE_EDGE)

/* Whether an equation of a loop is among the independent equations that were chosen when the model was compiled. */
static bool is_chosen(const kt_model *model, const kt_loop_record *r, int row) {
    const kt_group *group = &model->group[r->group];
    const int32_t slot = model->slot[r->slot + row];
    return slot >= 0 && (group->rank[KT_ROWS_ALL] == group->count[KT_ROWS_ALL] ||
                         model->weight[KT_ROWS_ALL * model->n.row + (size_t)(group->row + slot)] >= KT_PREFERRED);
}

unsigned kt_code_active_parts(const kt_model *model, const kt_loop_record *r) {
    unsigned active = 0;
    if (kt_code_loop_is_planar(model, r)) {
        const kt_planar_loop *flat = &model->planar_loop[r - model->loop];
        for (int i = 0; i < flat->count; i++)
            if (is_chosen(model, r, flat->row[i].row))
                active |= 1u << part_of_type[r->type][flat->row[i].row];
    } else {
        for (int i = 0; i < r->row_count && part_of_type[r->type][i] != KT_PART_NONE; i++)
            if (is_chosen(model, r, i))
                active |= 1u << part_of_type[r->type][i];
    }
    return active;
}

static int count_bits(unsigned x) {
    int count = 0;
    for (; x > 0; x &= x - 1)
        count++;
    return count;
}

int kt_code_count_coincidence(const kt_model *model, const kt_loop_record *r, unsigned active) {
    const int least = kt_code_loop_is_planar(model, r) ? 2 : 3;
    return count_bits(active & KT_CODE_POINT) >= least ? least : 0;
}

/* Whether a loop has one equation with a function of time. */
static bool has_function(const kt_loop_record *r) {
    return r->type == KT_LOOP_DISTANCE || r->type == KT_LOOP_COUPLING || r->type == KT_LOOP_MOTION ||
           r->type == KT_LOOP_RATES;
}

/* Whether the form of a loop can be generated. A foot on a helix or a spline follows from an iteration. */
static bool has_loop_form(const kt_loop_record *r) {
    if (r->type == KT_LOOP_CURVE)
        return r->form == KT_TRACK_LINE || r->form == KT_TRACK_CIRCLE;
    return r->type != KT_LOOP_ROLLING || r->form == KT_ROLLING_DISC;
}

bool kt_code_has_loop_type(const kt_model *model, int loop) {
    const kt_loop_record *r = &model->loop[loop];
    if (r->group < 0) /* it is switched off */
        return false;
    if (kt_has_formula_row(r) && !kt_code_has_tables(kt_loop_formula(model, r)))
        return false;
    if (has_function(r))
        return kt_code_has_curve(model, &r->curve);
    return r->type >= 0 && r->type < KT_LOOP_TYPE_COUNT && part_of_type[r->type][0] != KT_PART_NONE &&
           has_loop_form(r) && kt_code_has_curve(model, &r->curve);
}

int kt_code_rows_of_loop(const kt_model *model, int loop) {
    const kt_loop_record *r = &model->loop[loop];
    if (!kt_code_has_loop_type(model, loop))
        return 0;
    if (has_function(r))
        return is_chosen(model, r, 0) ? 1 : 0;
    const unsigned active = kt_code_active_parts(model, r);
    const int points = kt_code_count_coincidence(model, r, active);
    return points > 0 ? points + count_bits(active & ~KT_CODE_POINT) : count_bits(active);
}

int kt_code_closed_rows_of_loop(const kt_model *model, int loop) {
    const kt_loop_record *r = &model->loop[loop];
    const int count = kt_code_rows_of_loop(model, loop);
    if (count == 0 || r->type == KT_LOOP_RATES)
        return 0;
    return has_function(r) ? count : count - count_bits(kt_code_active_parts(model, r) & CODE_VELOCITIES);
}
