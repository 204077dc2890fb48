/* All states of a batch in one call of Python. Rows are states; an array that is NULL is left out. */
static kt_status kt_python_batch_set(kt_batch *batch, const kt_python_rows *rows, kt_error *error) {
    const size_t nq = rows->nq, nv = rows->nv, nx = rows->nx;
    kt_status status = KT_OK;
    for (size_t i = 0; i < rows->states && status == KT_OK; i++) {
        const double *q = rows->q ? rows->q + i * nq : NULL, *v = rows->v ? rows->v + i * nv : NULL;
        status = kt_batch_set_state(batch, i, rows->t, q, v, error);
        if (status == KT_OK && rows->a != NULL)
            status = kt_batch_set_acceleration(batch, i, rows->a + i * nv, error);
        else if (status == KT_OK)
            status = kt_batch_set_torque(batch, i, rows->tau ? rows->tau + i * nv : NULL, error);
        if (status == KT_OK && rows->x != NULL && nx > 0)
            status = kt_batch_set_own_states(batch, i, rows->x + i * nx, error);
    }
    return status;
}

static kt_status kt_python_batch_get(const kt_batch *batch, const kt_python_rows *rows, kt_error *error) {
    const size_t nq = rows->nq, nv = rows->nv, nx = rows->nx;
    kt_status status = KT_OK;
    for (size_t i = 0; i < rows->states && status == KT_OK; i++) {
        if (rows->q != NULL)
            status = kt_batch_get_state(batch, i, NULL, rows->q + i * nq, rows->v + i * nv, error);
        if (status == KT_OK && rows->tau != NULL)
            status = kt_batch_get_torque(batch, i, rows->tau + i * nv, error);
        if (status == KT_OK && rows->a != NULL)
            status = kt_batch_get_acceleration(batch, i, rows->a + i * nv, error);
        if (status == KT_OK && rows->x != NULL && nx > 0)
            status = kt_batch_get_own_states(batch, i, rows->x + i * nx, error);
    }
    return status;
}
