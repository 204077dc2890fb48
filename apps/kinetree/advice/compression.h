/* Distances that push. A rod can push, and a rope cannot. */
#ifndef KT_COMMAND_ADVICE_COMPRESSION_H
#define KT_COMMAND_ADVICE_COMPRESSION_H

#include "kinetree/scene.h"

#include <jansson.h>

enum { KT_COMPRESSIONS_MOST = 256 };

/* The first distances of a scene, with the largest forces that push the ends apart and pull them together. */
typedef struct kt_compressions {
    int count, left;                    /* left: distances beyond these, which are not watched */
    int loop[KT_COMPRESSIONS_MOST];     /* index in the description */
    int of_model[KT_COMPRESSIONS_MOST]; /* and in the model that is integrated */
    double compression[KT_COMPRESSIONS_MOST], tension[KT_COMPRESSIONS_MOST]; /* N, the largest */
    double since[KT_COMPRESSIONS_MOST];                                      /* s, when it first does */
} kt_compressions;

/* Lists the distances of a scene. model: the integrated model, in absolute or tree coordinates. */
void kt_compressions_begin(kt_compressions *compressions, const kt_scene *scene, const kt_model *model);
/* Takes the multipliers of a record. model: of the same shape, with the loops that are on. */
void kt_compressions_add(kt_compressions *compressions, const kt_model *model, double time, const double *multipliers);

/* Report the distances that push: on standard error, and as an object with their names. */
void kt_compressions_say(const kt_compressions *compressions, const kt_scene *scene);
json_t *kt_compressions_describe(const kt_compressions *compressions, const kt_scene *scene);

#endif
