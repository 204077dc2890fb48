/* Numbers that follow from variables: which there are (while a scene is read), and their new values (kt_scene_vary).
 *
 * Numbers are listed in the order in which they are read, parameters before all else and each after those that it uses, so
 * that a walk along the list finds everything evaluated that an expression needs.
 */
#include "scene/vary.h"

#include "base/require.h"
#include "expression/expression.h"
#include "scene/expression.h" /* kt_named_number */
#include "scene/parameter.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

/* A number of the scene. */
typedef struct kt_follower {
    const kt_expression *expression; /* of parameters; NULL: the value of a variable */
    int variable;
    bool positive;  /* others are refused */
    bool is_offset; /* it lies in the struct kt_scene, which its owner may move */
    double *at;
    size_t offset;
} kt_follower;

/* What has been read and depends on a variable, until a reader has said where it stays. */
typedef struct kt_noted {
    const kt_node *node;
    const kt_expression *expression; /* a copy, as long as the scene; NULL: the value of a variable, or no number */
} kt_noted;

struct kt_scene_variables {
    kt_follower *followers;
    size_t count, room;
    int variable_count, first_setting;
    double *values;     /* of the variables, now */
    double *parameters; /* values of all parameters, now */
    kt_noted *noted;    /* while the scene is read */
    size_t noted_count, noted_room;
    bool is_fixed;             /* something has been left there, which cannot be changed */
    char where[KT_WHERE_SIZE]; /* the first of it */
};

/* ---- while a scene is read --------------------------------------------------------------------------------------- */

void kt_varying_start(kt_reader *r, const kt_scene_options *options) {
    if (options == NULL || options->variable_count == 0)
        return;
    kt_scene_variables *v = kt_pool_take(&r->keep, 1, sizeof *v);
    double *values = kt_pool_take(&r->keep, (size_t)options->variable_count, sizeof *values);
    if (v == NULL || values == NULL) {
        (void)kt_reader_out_of_memory(r);
        return;
    }
    memcpy(values, options->values, (size_t)options->variable_count * sizeof *values);
    v->values = values;
    v->variable_count = options->variable_count;
    v->first_setting = options->setting_count;
    r->varying = v;
}

/* The variable that a node is the value of; -1: of none. */
static int variable_of(const kt_scene_variables *v, const kt_node *node) {
    if (node->line < KT_SETTING_LINE)
        return -1;
    const int k = (int)(node->line - KT_SETTING_LINE) - v->first_setting;
    return k < v->variable_count ? k : -1;
}

static bool depends(const kt_reader *r, const kt_expression *expression) {
    for (size_t i = 0; i < expression->count; i++)
        if (expression->term[i].code == KT_OPERATOR_SYMBOL && r->parameters[expression->term[i].symbol].varies)
            return true;
    return false;
}

/* Room for one more in an array that is taken from a pool; NULL: out of memory. */
static void *grow(kt_reader *r, kt_pool *pool, void *items, size_t count, size_t *room, size_t size) {
    if (count < *room)
        return items;
    void *more = kt_pool_take(pool, 2 * *room + 16, size);
    if (more == NULL) {
        (void)kt_reader_out_of_memory(r);
        return NULL;
    }
    if (count > 0)
        memcpy(more, items, count * size);
    *room = 2 * *room + 16;
    return more;
}

static void add_noted(kt_reader *r, kt_node *node, const kt_expression *expression) {
    kt_scene_variables *v = r->varying;
    kt_noted *noted = grow(r, &r->scratch, v->noted, v->noted_count, &v->noted_room, sizeof *noted);
    if (noted == NULL)
        return;
    noted[v->noted_count++] = (kt_noted){node, expression};
    v->noted = noted;
    node->follows = true;
}

void kt_varying_note_fixed(kt_reader *r, kt_node *node) {
    if (r->varying != NULL)
        add_noted(r, node, NULL);
}

void kt_varying_note(kt_reader *r, kt_node *node, const kt_expression *expression) {
    if (r->varying == NULL || (expression != NULL ? !depends(r, expression) : variable_of(r->varying, node) < 0))
        return;
    const size_t size = expression != NULL ? sizeof *expression + expression->count * sizeof expression->term[0] : 0;
    kt_expression *kept = expression != NULL ? kt_pool_take(&r->keep, 1, size) : NULL;
    if (kept != NULL)
        memcpy(kept, expression, size);
    if (kept == NULL && expression != NULL)
        (void)kt_reader_out_of_memory(r);
    else
        add_noted(r, node, kept);
}

static kt_follower *add_follower(kt_reader *r) {
    kt_scene_variables *v = r->varying;
    kt_follower *followers = grow(r, &r->keep, v->followers, v->count, &v->room, sizeof *followers);
    if (followers == NULL)
        return NULL;
    v->followers = followers;
    return &followers[v->count++];
}

/* Takes what was noted of a node last out of the list. */
static kt_noted take_noted(kt_scene_variables *v, const kt_node *node) {
    size_t k = v->noted_count - 1;
    while (v->noted[k].node != node)
        k--;
    const kt_noted found = v->noted[k];
    memmove(&v->noted[k], &v->noted[k + 1], (v->noted_count - k - 1) * sizeof found);
    v->noted_count--;
    return found;
}

bool kt_number_follows(kt_reader *r, kt_node *node, bool positive, double *at) {
    if (r->varying == NULL || !node->follows || r->out_of_memory)
        return false;
    kt_follower *follower = add_follower(r);
    if (follower == NULL)
        return false;
    const kt_noted noted = take_noted(r->varying, node);
    *follower = (kt_follower){.expression = noted.expression,
                              .variable = noted.expression == NULL ? variable_of(r->varying, node) : -1,
                              .positive = positive};
    follower->at = at;
    node->follows = false;
    return true;
}

void kt_number_follows_too(kt_reader *r, double *at) {
    kt_follower *follower = add_follower(r);
    if (follower == NULL)
        return;
    *follower = follower[-1];
    follower->at = at;
}

void kt_numbers_follow(kt_reader *r, const kt_node *list, double *at) {
    int k = 0;
    for (kt_node *item = list->of.first; r->varying != NULL && item != NULL; item = item->next)
        (void)kt_number_follows(r, item, false, &at[k++]);
}

/* ---- once it has been read --------------------------------------------------------------------------------------- */

static double *place_of(const kt_follower *follower, kt_scene *scene) {
    return follower->is_offset ? (double *)(void *)((char *)scene + follower->offset) : follower->at;
}

static double value_of(const kt_scene_variables *v, const kt_follower *follower, const double *values) {
    return follower->expression != NULL ? kt_expression_evaluate(follower->expression, v->parameters)
                                        : values[follower->variable];
}

/* Whether a number is where the scene has it for good, and still what was read. */
static bool is_in_place(const kt_reader *r, kt_follower *follower, kt_scene *scene) {
    const uintptr_t at = (uintptr_t)follower->at, begin = (uintptr_t)scene;
    follower->is_offset = at >= begin && at < begin + sizeof *scene;
    follower->offset = follower->is_offset ? (size_t)(at - begin) : 0;
    if (!follower->is_offset && !kt_pool_has(&r->keep, follower->at))
        return false;
    return *place_of(follower, scene) == value_of(r->varying, follower, r->varying->values);
}

static void tell_where(const kt_reader *r, const char *path, const kt_node *node, char where[KT_WHERE_SIZE]) {
    if (node != NULL && node->line < KT_SETTING_LINE)
        kt_scene_where(where, path, node->line, node->column);
    else if (node != NULL)
        (void)snprintf(where, KT_WHERE_SIZE, "%s", r->settings[node->line - KT_SETTING_LINE]);
    else
        (void)snprintf(where, KT_WHERE_SIZE, "%s", path);
}

void kt_varying_finish(kt_reader *r, const char *path, kt_scene *scene) {
    kt_scene_variables *v = r->varying;
    if (v == NULL)
        return;
    bool follows = v->noted_count == 0;
    v->parameters = r->parameter_values;
    for (size_t i = 0; follows && i < v->count; i++)
        follows = is_in_place(r, &v->followers[i], scene);
    v->is_fixed = !follows;
    tell_where(r, path, v->noted_count > 0 ? v->noted[0].node : NULL, v->where);
    v->noted = NULL;
    scene->variables = v;
}

/* ---- new values -------------------------------------------------------------------------------------------------- */

/* Puts the numbers into the scene; NULL, or the first that cannot be: the scene is then half new. */
static const kt_follower *put(kt_scene *scene, const double *values) {
    const kt_scene_variables *v = scene->variables;
    for (size_t i = 0; i < v->count; i++) {
        const kt_follower *follower = &v->followers[i];
        const double value = value_of(v, follower, values);
        if (!isfinite(value) || (follower->positive && !(value > 0.0)))
            return follower;
        *place_of(follower, scene) = value;
    }
    for (int k = 0; k < scene->parameter_count; k++)
        scene->parameters[k].value = v->parameters[k];
    return NULL;
}

kt_status kt_scene_vary(kt_scene *scene, const double *values, kt_error *error) {
    if (KT_IS_MISSING(error, scene, values))
        return KT_ERROR_ARGUMENT;
    kt_scene_variables *v = scene->variables;
    if (v == NULL)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "kt_scene_vary",
                            "the scene was read without variables; name them in kt_scene_options");
    if (v->is_fixed)
        return kt_error_set(error, KT_ERROR_UNSUPPORTED, v->where,
                            "more than a number follows from a variable here; read the scene again with other values");
    for (int k = 0; k < v->variable_count; k++)
        if (!isfinite(values[k]))
            return kt_error_set(error, KT_ERROR_SCENE, "kt_scene_vary", "variable %d is not finite", k);
    if (put(scene, values) != NULL) {
        (void)put(scene, v->values);
        return kt_error_set(error, KT_ERROR_SCENE, "kt_scene_vary",
                            "a number that follows from these values is not finite, or not above 0 as it must be; read "
                            "the scene with them for the place");
    }
    memcpy(v->values, values, (size_t)v->variable_count * sizeof *values);
    return KT_OK;
}
