/* Where the bodies and loops of a scene stand in its file, for faults that show only when it is compiled: the nodes are
 * gone by then, and of each its line and column are kept.
 */
#include "scene/part.h"

#include <stdio.h>
#include <string.h>

typedef struct kt_mark {
    uint32_t line, column;
} kt_mark;

struct kt_scene_marks {
    const char *path;
    const kt_mark *bodies, *loops; /* as the arrays of the description */
};

/* Of each item the place of a key that the faults are about, or of the item where the key is not there. */
static const kt_mark *mark_items(kt_reader *r, kt_node *const *items, int count, const char *key) {
    kt_mark *marks = kt_pool_take(&r->keep, (size_t)count + 1, sizeof *marks);
    for (int i = 0; marks != NULL && i < count; i++) {
        const kt_node *node = kt_node_find(items[i], key);
        node = node != NULL ? node : items[i];
        marks[i] = (kt_mark){node->line, node->column};
    }
    return marks;
}

bool kt_scene_mark(kt_reader *r, const char *path, kt_scene *scene) {
    kt_scene_marks *marks = kt_pool_take(&r->keep, 1, sizeof *marks);
    if (marks == NULL)
        return kt_reader_out_of_memory(r);
    marks->path = kt_pool_text(&r->keep, path, strlen(path));
    marks->bodies = mark_items(r, r->body_nodes, scene->description.body_count, "joint");
    marks->loops = mark_items(r, r->loop_nodes, scene->description.loop_count, "between");
    scene->marks = marks;
    return (marks->path != NULL && marks->bodies != NULL && marks->loops != NULL) || kt_reader_out_of_memory(r);
}

/* The mark of what is named as in "body 'crank'"; NULL where the scene has none of that name. */
static const kt_mark *find_mark(const kt_scene *scene, const char *where) {
    const kt_description *description = &scene->description;
    char text[KT_WHERE_SIZE];
    for (int i = 0; i < description->body_count; i++) {
        (void)snprintf(text, sizeof text, "body '%s'", description->bodies[i].name);
        if (strcmp(text, where) == 0)
            return &scene->marks->bodies[i];
    }
    for (int i = 0; i < description->loop_count; i++) {
        (void)snprintf(text, sizeof text, "loop '%s'", description->loops[i].name);
        if (strcmp(text, where) == 0)
            return &scene->marks->loops[i];
    }
    return NULL;
}

bool kt_scene_locate(const kt_scene *scene, kt_error *error) {
    const kt_mark *mark = scene->marks != NULL ? find_mark(scene, error->where) : NULL;
    if (mark == NULL)
        return false;
    const kt_error plain = *error;
    char where[KT_WHERE_SIZE];
    kt_make_where(where, scene->marks->path, mark->line, mark->column);
    (void)kt_error_set(error, plain.code, where, "%s: %s", plain.where, plain.message);
    return true;
}
