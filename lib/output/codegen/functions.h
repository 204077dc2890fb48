/* The graphs of the functions of a file. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CODEGEN_FUNCTIONS_H
#define KT_CODEGEN_FUNCTIONS_H

#include "codegen/print_function.h"
#include "kinetree/codegen.h"
#include "model/model.h"

/* Functions that only other functions of the generated file call, numbered after the functions of KT_CODEGEN_LIST. */
enum {
    KT_CODE_CLOSE = KT_CODEGEN_COUNT,
    KT_CODE_SETTLE,
    KT_CODE_CLOSE_CHANGES,
    KT_CODE_SETTLE_CHANGES,
    KT_CODE_FUNCTIONS
};

/* Makes the graph of a function that is no text. is_apart: no output is an input. */
void kt_code_make_function(kt_code_tree *tree, int k, bool is_apart, kt_code_function *f);

/* Whether a name can begin the names of a file in C. */
bool kt_code_is_identifier(const char *name);

/* Reports the functions that cannot be generated, and the reasons. */
kt_status kt_code_check(const kt_model *model, unsigned functions, kt_error *error);

/* The functions of KT_CODEGEN_ALL that have something to compute: loops need equations, states auxiliary states. */
unsigned kt_code_available(const kt_model *model);

#endif
