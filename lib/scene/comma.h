/* Formulas that a comma has cut (comma.c). */
#ifndef KT_SCENE_COMMA_H
#define KT_SCENE_COMMA_H

#include "scene/reader.h"

/* Reports plain texts of the file that a comma has cut within parentheses; their parts are faulty then. O(nodes). */
void kt_commas_check(kt_reader *r);

#endif
