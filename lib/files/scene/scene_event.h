/* Events of scenes. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_SCENE_SCENE_EVENT_H
#define KT_SCENE_SCENE_EVENT_H

#include "kinetree/expression.h"
#include "scene/scene_part.h"

extern const kt_kind kt_kind_events; /* the section `events`, of a kt_scene: kt_event_items */
extern const kt_items kt_event_items;
extern const kt_kind kt_kind_until; /* `simulate.until`, of a kt_scene */

/* Whether a formula of this description's variables, kept as kt_read_formula gives it, is a comparison. */
bool kt_formula_is_comparison(const kt_description *description, const char *text);

/* Reads the formula of a new value, or of an input. A number and an expression are formulas, too. may_turn: the value
 * may be an angle. */
bool kt_event_value_read(kt_reader *r, const kt_scope *scope, kt_node *node, bool may_turn, const char **value);

/* Reports a formula, whose names have been checked, that can never change its sign (crossing.c). `known`: its
 * variables, without parameters. */
bool kt_check_crossing(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_symbols *known);

#endif
