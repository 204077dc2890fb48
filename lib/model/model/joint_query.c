/* Finds joints by their names, and returns their design limits. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/require.h"
#include "model/model.h"

kt_joint_limits kt_joint_limits_of(const kt_model *model, int body) {
    const int32_t limit = model && KT_IS_INDEX(body, model->n.body) ? model->body[body].limit : 0;
    return limit > 0 ? model->limit[limit - 1] : kt_joint_default().limits;
}

kt_status kt_joint_find(const kt_model *model, const char *name, int *body, kt_error *error) {
    if (KT_IS_MISSING(error, model, name, body))
        return KT_ERROR_ARGUMENT;
    const int found = kt_joint_index(model, name);
    if (found > 0) {
        *body = found;
        return KT_OK;
    }
    const kt_name_text wanted = kt_name_quote(name);
    const int carried = kt_body_find(model, name);
    if (carried > 0)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "name", "there is no joint %s; that of body %s is named %s",
                            wanted.text, wanted.text, kt_name_quote(kt_joint_name(model, carried)).text);
    kt_nearest search = kt_nearest_make(name, NULL);
    for (int i = 1; i < (int)model->n.body; i++)
        if (!kt_nearest_try(&search, kt_joint_name(model, i)))
            break;
    if (search.best)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "name", "there is no joint %s; did you mean %s?", wanted.text,
                            kt_name_quote(search.best).text);
    return kt_error_set(error, KT_ERROR_ARGUMENT, "name", "there is no joint %s; kt_joint_name lists them",
                        wanted.text);
}
