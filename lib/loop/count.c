/* Equations of each loop type (SCENE: "Loops"). Orientation closures are first order in the violation, so the counts
 * are those of the freedoms that a type removes. */
#include "loop/loop.h"

static const signed char equations[KT_LOOP_TYPE_COUNT] = {
    [KT_LOOP_SPHERICAL] = 3, [KT_LOOP_INLINE] = 2,    [KT_LOOP_INPLANE] = 1,     [KT_LOOP_DISTANCE] = 1,
    [KT_LOOP_PARALLEL] = 3,  [KT_LOOP_COAXIAL] = 2,   [KT_LOOP_ORTHOGONAL] = 1,  [KT_LOOP_REVOLUTE] = 5,
    [KT_LOOP_PRISMATIC] = 5, [KT_LOOP_SCREW] = 5,     [KT_LOOP_CYLINDRICAL] = 4, [KT_LOOP_PLANAR] = 3,
    [KT_LOOP_WELD] = 6,      [KT_LOOP_UNIVERSAL] = 4, [KT_LOOP_COUPLING] = 1,    [KT_LOOP_MOTION] = 1,
    [KT_LOOP_ROLLING] = 2,
};

int kt_loop_row_count(const kt_loop *loop) {
    return equations[loop->type] + (loop->type == KT_LOOP_ROLLING && loop->holonomic ? 1 : 0);
}
