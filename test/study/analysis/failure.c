/* Models that cannot be linearised are rejected with a message, and earlier results stay. Nothing is allocated after
 * set-up. Equal inputs give equal bits, independent of earlier calls. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "interpose.h"
#include "mechanics/constraint/linkage.h"
#include "small.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const kt_vec3 none = {0.0, 0.0, 0.0}, down = {0.0, -1.0, 0.0};

/* Folded level, all bars of the window lie on one line, and the couplers may turn either way. */
KT_TEST(singular_position_is_rejected_and_its_neighbours_are_not) {
    linkage l;
    linkage_windows(&l, 2, 1.0, 0.0, KT_LOOP_REVOLUTE);
    linkage_build(&l, 0.0);
    small s = {0};
    kt_error error = {0};
    double before[4];
    small_open(&s, l.model, NULL, 0.0, l.q, l.v, NULL);
    kt_need(kt_check_equal_int("states", s.system->states, 2));
    kt_check_true("is far from singular", !s.system->near_singular);
    memcpy(before, s.system->state, sizeof before);
    linkage flat;
    linkage_windows(&flat, 2, acos(0.0), 0.0, KT_LOOP_REVOLUTE);
    linkage_compile(&flat);
    kt_check_equal_int("is rejected", kt_linearization_evaluate(s.linearization, 0.0, flat.q, flat.v, NULL, &error),
                       KT_ERROR_SINGULAR);
    kt_check_contains("says what", error.message, "singular position");
    kt_check_contains("names a loop", error.where, "loop0");
    kt_check_equal_bits("what was known stays", kt_linearization_system(s.linearization)->state, before, 4);
    linkage_windows(&l, 2, acos(0.0) - 3e-4, 0.0, KT_LOOP_REVOLUTE);
    linkage_build(&l, 0.0);
    small_open(&s, l.model, NULL, 0.0, l.q, l.v, NULL);
    kt_check_true("near", s.system->near_singular);
    /* theta'' = c sin(theta): the derivative is c cos(theta) */
    const double c = windows_acceleration(2, acos(0.0)), expected = c * cos(acos(0.0) - 3e-4);
    const double observed = small_at(s.system->state, 2, 1, 0);
    kt_check_near("still right to its estimate", observed, expected, 4.0 * small_at(s.system->state_error, 2, 1, 0));
    kt_check_near("and right", observed, expected, 1e-10);
    kt_check_below("which is small", s.system->error, 1e-10);
}

KT_TEST(wrong_options_and_memory_are_rejected) {
    linkage l;
    linkage_begin(&l);
    linkage_bar(&l, "bar", NULL, none, down, 0.3, 0.0);
    linkage_compile(&l);
    const int inputs[] = {1};
    const kt_marker_index marker = {1, 0}, body = {2, 0};
    kt_linearization_options settings = kt_linearization_options_default();
    kt_linearization *linearization = NULL;
    kt_error error = {0};
    settings.inputs = inputs;
    settings.input_count = 1;
    kt_check_equal_int("input", kt_linearization_create(l.model, &settings, &linearization, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("has no size", (long long)kt_linearization_size(l.model, &settings), 0);
    kt_check_contains("says what there is", error.message, "from 0 to 0");
    settings = kt_linearization_options_default();
    settings.outputs = &marker;
    settings.output_count = 1;
    kt_check_equal_int("marker", kt_linearization_create(l.model, &settings, &linearization, &error),
                       KT_ERROR_ARGUMENT);
    kt_check_contains("names the body", error.message, "bar");
    settings.outputs = &body;
    kt_check_equal_int("body", kt_linearization_create(l.model, &settings, &linearization, &error), KT_ERROR_ARGUMENT);
    kt_check_true("nothing was made", linearization == NULL);
    const size_t size = kt_linearization_size(l.model, NULL);
    char *memory = aligned_alloc(KT_ALIGNMENT, size);
    kt_check_equal_int("too small", kt_linearization_init(l.model, NULL, memory, size - 1, &linearization, &error),
                       KT_ERROR_MEMORY);
    kt_check_equal_int("misaligned", kt_linearization_init(l.model, NULL, memory + 8, size, &linearization, &error),
                       KT_ERROR_MEMORY);
    free(memory);
    double q = (double)NAN, v = 0.0;
    linearization = kt_test_linearization(l.model, NULL);
    kt_check_equal_int("not finite", kt_linearization_evaluate(linearization, 0.0, &q, &v, NULL, &error),
                       KT_ERROR_NOT_FINITE);
    kt_check_contains("names the joint", error.where, "bar");
    kt_check_equal_int("no system yet", kt_linearization_system(linearization)->states, 0);
}

KT_TEST(evaluations_allocate_nothing_and_repeat_to_the_bit) {
    const four_bar f = four_bar_default();
    linkage l;
    small s = {0};
    linkage_four_bar(&l, &f);
    linkage_build(&l, 0.0);
    small_open(&s, l.model, NULL, 0.0, l.q, l.v, NULL);
    kt_error error = {0};
    const double first[4] = {s.system->state[0], s.system->state[1], s.system->state[2], s.system->state[3]};
    const kt_mode mode = kt_modes_at(s.modes, 0);
    double q[3] = {l.q[0], l.q[1], l.q[2]}, zero[3] = {0.0, 0.0, 0.0};
    kt_interpose_start();
    kt_status status = kt_equilibrium_find(s.linearization, NULL, 0.0, q, NULL, NULL, &error);
    if (status == KT_OK)
        status = kt_linearization_evaluate(s.linearization, 0.0, q, zero, NULL, &error);
    if (status == KT_OK)
        status = kt_modes_evaluate(s.modes, s.system, &error);
    if (status == KT_OK)
        status = kt_linearization_evaluate(s.linearization, 0.0, l.q, l.v, NULL, &error);
    if (status == KT_OK)
        status = kt_modes_evaluate(s.modes, s.system, &error);
    const long allocations = kt_interpose_stop();
    kt_check_equal_int("all went well", status, KT_OK);
    kt_check_equal_int("allocations", allocations, 0);
    const kt_mode again = kt_modes_at(s.modes, 0);
    kt_check_equal_bits("state", s.system->state, first, 4);
    kt_check_equal_bits("lambda", &again.real, &mode.real, 1);
}
