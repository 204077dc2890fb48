/* FMUs that a scene couples: effects of the type `fmu` (fmu.c). */
#ifndef KT_SCENE_FMU_H
#define KT_SCENE_FMU_H

#include "scene/reader.h"

/* After parameters are read: makes the auxiliary states and the forces of outputs that act in joints. */
void kt_fmus_expand(kt_reader *r);

/* After all sections are read: the FMUs, and an event for each. */
void kt_fmus_read(kt_reader *r, kt_scene *scene);

/* The section `effects` of a kt_scene: forces, and FMUs. An output in a joint is written as the state that holds it. */
extern const kt_kind kt_kind_effects;

#endif
