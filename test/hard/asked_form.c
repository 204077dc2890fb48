/* A library to preload into the command (band.py --forms). Models are compiled with the structure that the environment
 * names, and without the forms of groups that it names. The command has no option for these. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/kinetree.h"

#include <dlfcn.h>
#include <stdlib.h>
#include <string.h>

typedef kt_status (*compile_call)(const kt_description *, const kt_model_options *, kt_model **, kt_error *);

kt_status kt_model_compile(const kt_description *description, const kt_model_options *options, kt_model **model,
                           kt_error *error) {
    void *next = dlsym(RTLD_NEXT, "kt_model_compile");
    const char *structure = getenv("KT_ASKED_STRUCTURE"), *excluded = getenv("KT_EXCLUDED_FORMS");
    kt_model_options asked = options ? *options : kt_model_options_default();
    compile_call compile;
    memcpy(&compile, &next, sizeof compile);
    if (structure)
        asked.structure = (kt_structure)strtol(structure, NULL, 10);
    if (excluded)
        asked.excluded_forms = (unsigned)strtol(excluded, NULL, 10);
    return compile(description, &asked, model, error);
}
