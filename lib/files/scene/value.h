/* The kinds of values that tables of keys are made of. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_SCENE_VALUE_H
#define KT_SCENE_VALUE_H

#include "scene/scene_reader.h"

/* The quantity that a number measures: which units and values it may have. */
typedef enum kt_quantity {
    KT_QUANTITY_NUMBER = 0,
    KT_QUANTITY_POSITIVE, /* > 0 */
    KT_QUANTITY_ANGLE,    /* an angle: also "30 deg" */
    KT_QUANTITY_RATE      /* rate of an angle: also "30 deg", per second */
} kt_quantity;

/* Each function reads a node. On a fault, it reports the fault, leaves *out untouched and returns false. */
bool kt_read_number(kt_reader *r, const kt_scope *scope, kt_node *node, kt_quantity quantity, double *out);
/* A list of exactly `count` numbers (at most 9), of one quantity or, `quantities` not NULL, of one each. */
bool kt_read_numbers(kt_reader *r, const kt_scope *scope, kt_node *node, int count, kt_quantity quantity,
                     const kt_quantity *quantities, double *out);
bool kt_read_vector(kt_reader *r, const kt_scope *scope, kt_node *node, kt_vec3 *out);
/* A list of points of `size` numbers each, kept with the scene. A list with a wrong point is kept, so that its length
 * gets no second fault. The text `expected` describes the list; quantities: of the numbers of a point, or NULL. */
bool kt_read_points(kt_reader *r, const kt_scope *scope, kt_node *node, int size, const kt_quantity *quantities,
                    const char *expected, const double **out, int *count);
void kt_write_points(kt_emitter *e, const double *points, int size, int count);
/* Reads numbers that a variable may replace in *out later, since no other value follows from them (vary.h). */
bool kt_put_number(kt_reader *r, const kt_scope *scope, kt_node *node, kt_quantity quantity, double *out);
bool kt_put_numbers(kt_reader *r, const kt_scope *scope, kt_node *node, int count, kt_quantity quantity,
                    const kt_quantity *quantities, double *out);
/* Free text, or the name of an object, which `expected` describes ("a name"). Kept with the scene. kt_description_check
 * decides whether a name is valid. */
bool kt_read_text(kt_reader *r, const kt_scope *scope, kt_node *node, const char **out);
bool kt_read_name(kt_reader *r, const kt_scope *scope, kt_node *node, const char *expected, const char **out);
/* A quaternion, normalised; one that is of unit norm to rounding keeps its bits. */
bool kt_read_quaternion(kt_reader *r, const kt_scope *scope, kt_node *node, double out[4]);
bool kt_read_rotation(kt_reader *r, const kt_scope *scope, kt_node *node, kt_rotation *out);
/* The end of a mapping that has been read: reports two points, and takes `world` for the ground. Returns false if the
 * mapping has faults. */
bool kt_end_settle(kt_reader *r, const kt_scope *scope, kt_node *node, kt_end *end);
bool kt_read_end(kt_reader *r, const kt_scope *scope, kt_node *node, kt_end *out);
/* Joints and a number each, which `read` reads: kt_read_number, or kt_put_number. */
typedef bool kt_number_reader(kt_reader *r, const kt_scope *scope, kt_node *node, kt_quantity quantity, double *out);
bool kt_terms_read(kt_reader *r, const kt_scope *scope, kt_node *node, kt_number_reader *read, const kt_term **out,
                   int *count);
/* A function of time; `quantity` is that of its values. */
bool kt_read_function(kt_reader *r, const kt_scope *scope, kt_node *node, kt_quantity quantity, kt_function *out);

/* The forms of a value: a mapping has one key of several, and the key gives the type. */
typedef struct kt_forms {
    const char *several, *expected, *missing; /* texts of faults, such as "surfaces", "a surface (one of ...)" */
    const kt_field *fields;
    const int *types; /* type of each field; equal types belong to one form */
    int count;        /* number of the fields that are forms */
    size_t size;      /* size of the value, whose first member is the type; only for the kinds of surfaces and tracks */
} kt_forms;

/* The type of the one form that the mapping has; 0 after reporting that there is none, or more than one. */
int kt_form_find(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_forms *forms);
void kt_form_write(kt_emitter *e, const kt_forms *forms, int type, const void *value, const void *standard);

/* Scales q to unit norm unless it has it to rounding, so that a second call changes no bit. */
void kt_quaternion_settle(double q[4]);

void kt_write_rotation(kt_emitter *e, const kt_rotation *rotation);
void kt_write_end(kt_emitter *e, const kt_end *end);
void kt_write_function(kt_emitter *e, const kt_function *function);

/* Equal in every bit: -0 is not 0. */
bool kt_same_bits(const void *a, const void *b, size_t size);
bool kt_same_rotation(const kt_rotation *a, const kt_rotation *b);

/* Parts of kinds. Numbers are as many as the kind's size has room for. The function `same` of kt_never_written leaves a
 * key out. */
bool kt_never_written(const kt_member *m);
bool kt_kind_numbers_read(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object);
void kt_kind_numbers_write(kt_emitter *e, const kt_member *m);
void kt_axis_write(kt_emitter *e, const kt_member *m);
void kt_text_write(kt_emitter *e, const kt_member *m);
bool kt_word_read(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object);
void kt_word_write(kt_emitter *e, const kt_member *m);
void kt_map_write(kt_emitter *e, const kt_member *m);
bool kt_map_same(const kt_member *m);

/* double */
extern const kt_kind kt_kind_number, kt_kind_positive, kt_kind_angle;
/* kt_vec3; an axis is also one of x, y, z, -x, -y, -z */
extern const kt_kind kt_kind_vector, kt_kind_axis;
/* const char *: free text; the name of something */
extern const kt_kind kt_kind_text, kt_kind_name;
/* An enumeration, with a kt_choice as detail. */
extern const kt_kind kt_kind_choice;
extern const kt_kind kt_kind_flag; /* bool */
/* A struct within the struct, with its kt_table as detail. */
extern const kt_kind kt_kind_map;
extern const kt_kind kt_kind_rotation;                  /* kt_rotation */
extern const kt_kind kt_kind_end;                       /* kt_end */
extern const kt_kind kt_kind_ends;                      /* kt_end[2] */
extern const kt_kind kt_kind_path;                      /* kt_effect.path */
extern const kt_kind kt_kind_actuators, kt_kind_spring; /* of kt_effect */
extern const kt_kind kt_kind_activation;                /* kt_auxiliary_state.activation */
extern const kt_kind kt_kind_surface;                   /* kt_surface */
extern const kt_kind kt_kind_track;                     /* kt_track */

/* Functions for parts of these kinds, for keys that may be missing. */
bool kt_kind_end_read(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object);
void kt_kind_end_write(kt_emitter *e, const kt_member *m);
bool kt_kind_ends_read(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object);
void kt_kind_ends_write(kt_emitter *e, const kt_member *m);

/* The kinds that read, write and compare keys of a type. A key that any type may have has kt_kind_of_value_key (NULL:
 * it is of another kind). A key of a loop or an effect has kt_kind_of_item_key. The quantity of a key's number follows
 * from its unit. */
const kt_kind *kt_kind_of_value_key(const kt_key *key);
const kt_kind *kt_kind_of_item_key(const kt_key *key);
/* A table of the keys of one type alone. */
#define KT_TYPE_TABLE(describer, id)                                                                                   \
    { .describe = describer, .kind_of = kt_kind_of_value_key, .type = id, .flow = true }
kt_quantity kt_key_quantity(const kt_reader *r, const kt_field *field);
/* The SI unit of a key's number, up to a '|' or its end. For "rad|m" it is the first if the joint that the item acts
 * in, which has been read before, rotates. */
const char *kt_key_unit(const kt_reader *r, const kt_field *field);

#endif
