/* The benchmark bicycle (Meijaard, Papadopoulos, Ruina & Schwab, Proc. R. Soc. A `463, 2007, 1955-1982`). It is upright
 * and straight, at the speeds of table 2 and at one more. The test compares the eigenvalues of lean and steer. Figures
 * to 16 digits are from quadratic eigenproblems of the published matrices. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "reference/scene.h"
#include "small.h"

#include <string.h>

static const struct row {
    double speed, castor, capsize[2], weave[2];
} rows[] = {
    {0.0, -5.53094371765393464, {-3.13164324790655567, 0.0}, {0.0, 0.0}},
    {1.0, -7.11008014637440773, {-3.13423125066578423, 0.0}, {3.52696170990069417, 0.807740275199310045}},
    {2.0, -8.67387984831737163, {-3.07158645641514251, 0.0}, {2.68234517512745345, 1.68066296590675776}},
    {3.0, -10.3510146724592282, {-2.63366137253665296, 0.0}, {1.70675605663973515, 2.31582447384324357}},
    {4.0, -12.1586142657644397, {-1.42944427361325745, 0.0}, {0.413253315211241321, 3.07910818603205363}},
    {5.0, -14.0783896927982472, {-0.322866429004087078, 0.0}, {-0.775341882195841925, 4.46486771378822514}},
    {6.0, -16.085371230980284, {-0.00406690076970336242, 0.0}, {-1.52644486584141715, 5.87673060598708403}},
    {7.0, -18.1578846612520209, {0.102681705747664159, 0.0}, {-2.13875644258363428, 7.19525913329804255}},
    {8.0, -20.279408943945663, {0.143278797657129498, 0.0}, {-2.69348683581094772, 8.4603797139693359}},
    {9.0, -22.4378855904085906, {0.157901840309172982, 0.0}, {-3.21675402252490747, 9.69377351531782195}},
};

/* Straight ahead at this speed; neither leaning nor steering. */
static void set_speed(const kt_case *c, double speed, double *v) {
    memset(v, 0, (size_t)kt_model_nv(c->model) * sizeof *v);
    v[kt_case_v(c, "frame")] = speed;
    v[kt_case_v(c, "rear")] = speed / 0.3;
    v[kt_case_v(c, "front")] = speed / 0.35;
}

static void expect_row(const small *s, const struct row *row, kt_worst *worst) {
    const double bound = 5e-12; /* measured: 6e-13 */
    small_expect(s, row->castor, 0.0, bound, worst);
    small_expect(s, row->capsize[0], 0.0, bound, worst);
    if (row->speed == 0.0) { /* two real pairs */
        small_expect(s, -row->castor, 0.0, bound, worst);
        small_expect(s, -row->capsize[0], 0.0, bound, worst);
    } else {
        small_expect(s, row->weave[0], row->weave[1], bound, worst);
    }
}

KT_TEST(bicycle_has_the_published_eigenvalues_at_ten_speeds) {
    double q[16], v[16];
    kt_case c = kt_case_open("bicycle");
    KT_WORST worst = kt_worst_make("lambda");
    kt_model_initial(c.model, q, v);
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        small s = {0};
        set_speed(&c, rows[i].speed, v);
        small_open(&s, c.model, NULL, 0.0, q, v, NULL);
        kt_check_equal_int("positions", s.system->positions, 7);
        kt_check_equal_int("velocities", s.system->velocities, 3);
        kt_check_below("is steady", s.system->acceleration, 1e-13);
        expect_row(&s, &rows[i], &worst);
    }
}
