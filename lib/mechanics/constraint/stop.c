/* Stops that callbacks of loops request. Functions that evaluate loops call callbacks many times, and most functions
 * repeat a failed evaluation in another way, so that a single failure of a callback would go unnoticed. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "constraint/rejecting_loop.h"

#include "base/where.h"
#include "loop/loop_custom.h"

static bool has_stop_code(const kt_model *model, const kt_data *data) {
    return data->stopped[0] > 0 && data->stopped[0] <= (int32_t)model->n.loop;
}

void kt_stop_store_code(const kt_model *model, const kt_data *data, const kt_loop_record *loop, double rate) {
    int code;
    if (has_stop_code(model, data) || !kt_custom_stopped(rate, &code))
        return;
    data->stopped[0] = 1 + (int32_t)(loop - model->loop);
    data->stopped[1] = code;
}

kt_status kt_stop_report(const kt_model *model, const kt_data *data, double t, kt_status status, kt_error *error) {
    if (!model->custom || !has_stop_code(model, data))
        return status;
    const char *name = model->text + model->loop[data->stopped[0] - 1].name;
    data->stopped[0] = 0;
    return kt_error_set(error, KT_ERROR_CALLBACK, kt_where_format("loop '%.100s', t = %.9g s", name, t).text,
                        "its callback stopped (code %d)", (int)data->stopped[1]);
}
