/* The part of auxiliary states x in the slope of a stage. With y = (q, v, x)
 *
 *     K = (E(q) v, a(q, v, x), f(q, v, x))
 *     dK = (d(E v), a_q xi + a_v dv + a_x dx, f_q xi + f_v dv + f_x dx)
 */
#include "base/copy.h"
#include "derivative/stiffness.h"
#include "sensitivity/sensitivity.h"

KT_ARENA_ARRAYS(place_arrays, kt_own_step, KT_OWN_STEP_FIELDS, size_t N, size_t n, size_t m, size_t s, size_t c,
                size_t g)

size_t kt_own_step_place(kt_own_step *own, void *memory, const kt_model *model, size_t columns, size_t stages,
                         size_t together) {
    const size_t m = model->n.x;
    return m > 0 ? place_arrays(own, memory, kt_state_numbers(model), model->n.v, m, stages, columns, together) : 0;
}

/* kt_state_derivatives have a_x, -f_q, -f_v and -f_x. */
static kt_state_derivatives blocks_of(const kt_step_work *w, size_t place) {
    const size_t n = w->model->n.v, m = w->model->n.x;
    const kt_own_step *own = &w->own;
    return (kt_state_derivatives){own->force + place * n * m, own->rate_q + place * n * m, own->rate_v + place * n * m,
                                  own->rate_x + place * m * m};
}

kt_status kt_own_differentiate(kt_step_work *w, size_t place, const kt_dynamic_state *at, const double *a,
                               const kt_forward_matrices *by, kt_error *error) {
    const kt_state_derivatives states = blocks_of(w, place);
    const kt_acceleration_matrices to = {.by = *by, .states = &states};
    return kt_acceleration_derivatives_at(w->model, w->data, w->derivative, kt_acceleration_work_size(w->model), at, a,
                                          &to, error);
}

/* y += factor A x, with `rows` rows. */
static void add_product(double *y, double factor, const double *a, const double *x, size_t rows, size_t columns) {
    for (size_t j = 0; j < columns; j++)
        for (size_t i = 0; i < rows && x[j] != 0.0; i++)
            y[i] += factor * a[j * rows + i] * x[j];
}

void kt_own_slope_change(const kt_step_work *w, size_t place, const double *xi, const double *dy, double *out) {
    const size_t nq = w->model->n.q, n = w->model->n.v, m = w->model->n.x;
    const kt_state_derivatives by = blocks_of(w, place);
    const double *dv = dy + nq, *dx = dv + n;
    double *rates = out + nq + n;
    add_product(out + nq, 1.0, by.force, dx, n, m);
    kt_clear(rates, m * sizeof *rates);
    add_product(rates, -1.0, by.rate_q, xi, m, n);
    add_product(rates, -1.0, by.rate_v, dv, m, n);
    add_product(rates, -1.0, by.rate_x, dx, m, m);
}
