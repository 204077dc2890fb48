/* Checks before a file is generated (check.c). */
#ifndef KT_CODEGEN_CHECK_H
#define KT_CODEGEN_CHECK_H

#include "model/model.h"

/* Whether a name can begin the names of a file in C. */
bool kt_code_is_identifier(const char *name);

/* Reports what cannot be generated of the functions. */
kt_status kt_code_check(const kt_model *model, unsigned functions, kt_error *error);

#endif
