/* Distances that push: what a rod does and a rope cannot. */
#ifndef KT_COMMAND_ADVICE_COMPRESSION_H
#define KT_COMMAND_ADVICE_COMPRESSION_H

#include "kinetree/scene.h"

#include <jansson.h>

enum { KT_COMPRESSIONS_MOST = 16 };

/* The first distances of a scene, and by how much each pushes its ends apart and pulls them together. */
typedef struct kt_compressions {
    int count;
    int loop[KT_COMPRESSIONS_MOST];
    double compression[KT_COMPRESSIONS_MOST], tension[KT_COMPRESSIONS_MOST]; /* N, the largest */
    double since[KT_COMPRESSIONS_MOST];                                      /* s, when it first does */
} kt_compressions;

/* Lists the distances of a scene. */
void kt_compressions_begin(kt_compressions *compressions, const kt_scene *scene);
/* Takes the multipliers of a record; `model` is the one that is integrated then. */
void kt_compressions_add(kt_compressions *compressions, const kt_model *model, double time, const double *multipliers);

/* Says on standard error which distances push; and as an object, by their names. */
void kt_compressions_say(const kt_compressions *compressions, const kt_scene *scene);
json_t *kt_compressions_describe(const kt_compressions *compressions, const kt_scene *scene);

#endif
