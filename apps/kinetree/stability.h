/* The parts of `kinetree stability`, and words for modes that `kinetree run` uses, too. */
#ifndef KT_COMMAND_STABILITY_H
#define KT_COMMAND_STABILITY_H

#include "command.h"

#include "kinetree/analysis.h"

#include <stdio.h>

/* What was looked at, for the parts that print and draw it. */
typedef struct kt_stability_look {
    const char *name; /* of the scene */
    const kt_model *model;
    const kt_scene *scene;
    const kt_spectrum *spectrum;
    double duration, step;   /* step: asked about; 0: none */
    const kt_method *method; /* that is drawn */
} kt_stability_look;

/* "slider, right, left": the joints that move in a mode by a tenth of the most or more, the most first. An empty text
 * where that is not known. */
void kt_write_movers(const kt_model *model, const double *moves, char *text, size_t size);

/* "decay of 8117 /s", "undamped oscillation of 3.2 Hz" ... */
void kt_write_mode(const kt_mode *mode, char *text, size_t size);

/* The eigenvalues times a step and the boundary of the method's region, as a picture. Returns KT_EXIT_DONE, or an exit
 * code after saying why. */
int kt_stability_draw(const kt_stability_look *look, const char *path, bool is_dark);

#endif
