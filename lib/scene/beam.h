/* Beams (beam.c). */
#ifndef KT_SCENE_BEAM_H
#define KT_SCENE_BEAM_H

#include "scene/reader.h"

/* Makes the items of the section `beams` into items of `bodies`, `effects` and `loops`, before these are read. */
void kt_beams_expand(kt_reader *r);

#endif
