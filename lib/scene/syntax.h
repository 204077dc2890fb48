/* YAML's own errors in plain words. */
#ifndef KT_SCENE_SYNTAX_H
#define KT_SCENE_SYNTAX_H

#include "scene/reader.h"

#include <yaml.h>

/* Reports the error that libyaml stopped at. */
void kt_syntax_report(kt_reader *r, const yaml_parser_t *parser);

#endif
