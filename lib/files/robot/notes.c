/* Notes, names, lists and numbers that the readers of robots share. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/robot_contact.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- what is left out -------------------------------------------------------------------------------------------- */

void kt_left_count(kt_left *left, const kt_element *e) {
    if (left->count++ == 0)
        left->first = e;
}

/* If there are too many texts, the last entry counts all further ones. */
void kt_unknown_count(kt_unknown *unknown, const char *what, const kt_element *e) {
    int i = 0;
    while (i < unknown->count && strcmp(unknown->left[i].what, what) != 0)
        i++;
    if (i == KT_UNKNOWN_MOST)
        i--;
    if (i == unknown->count)
        unknown->left[unknown->count++].what = i == KT_UNKNOWN_MOST - 1 ? "others" : what;
    kt_left_count(&unknown->left[i], e);
}

/* Adds the names with their numbers: "camera (2), light (1)". */
static void list_unknown(const kt_unknown *unknown, kt_phrase *phrase) {
    for (int i = 0; i < unknown->count; i++)
        kt_phrase_add(phrase, "%s%s (%d)", i > 0 ? ", " : "", unknown->left[i].what, unknown->left[i].count);
}

bool kt_words_have(const char *words, const char *word) {
    const size_t length = strlen(word);
    for (const char *at = strstr(words, word); at != NULL; at = strstr(at + 1, word))
        if (at > words && at[-1] == ' ' && at[length] == ' ')
            return true;
    return false;
}

/* Counts an unread name as one that changes the motion, as a harmless one, or as an unknown one. */
static void count_name(kt_strange *strange, const kt_known_list *list, const char *name, const kt_element *e) {
    kt_unknown_count(kt_words_have(list->moving, name)     ? &strange->moving
                     : kt_words_have(list->harmless, name) ? &strange->harmless
                                                           : &strange->unknown,
                     name, e);
}

void kt_strange_search(kt_strange *strange, const kt_known_list *list, const kt_element *e) {
    size_t i = 0;
    if (kt_words_have(list->read, e->name))
        return;
    while (i < list->count && !kt_words_have(list->known[i].names, e->name))
        i++;
    if (i == list->count || kt_words_have(list->apart, e->name)) {
        count_name(strange, list, e->name, e);
        return;
    }
    for (const char *const *a = e->attributes; *a != NULL; a += 2)
        if (!kt_words_have(list->known[i].attributes, *a))
            count_name(strange, list, *a, e);
    for (const kt_element *child = e->first; child != NULL && !kt_words_have(list->closed, e->name);
         child = child->next)
        kt_strange_search(strange, list, child);
}

bool kt_notes_begin(kt_notes *notes, kt_reader *r, const char *path) {
    *notes = (kt_notes){.r = r, .path = path};
    notes->notes = kt_reader_take(r, &r->keep, KT_NOTES_MOST, sizeof *notes->notes);
    return notes->notes != NULL;
}

void kt_note_put(kt_notes *notes, kt_note_rank rank, const kt_left *left, const char *format, ...) {
    char what[KT_MESSAGE_SIZE];
    va_list arguments;
    if (left->count == 0 || notes->notes == NULL || notes->count == KT_NOTES_MOST)
        return;
    va_start(arguments, format);
    (void)vsnprintf(what, sizeof what, format, arguments);
    va_end(arguments);
    const char *path = left->first->file != NULL ? left->first->file : notes->path;
    kt_scene_note *to = &notes->notes[notes->count++];
    to->where = kt_robot_print(notes->r, &notes->r->keep, "%s:%u:%u", path, (unsigned)left->first->line,
                               (unsigned)left->first->column);
    to->what = kt_reader_text(notes->r, &notes->r->keep, what, strlen(what));
    to->rank = rank;
}

void kt_note_massless(kt_phrase *names, kt_left *left, const char *body, const kt_element *e) {
    if (left->count < 5)
        kt_phrase_add(names, "%s%.40s", left->count > 0 ? ", " : "", body);
    else if (left->count == 5)
        kt_phrase_add(names, " ...");
    kt_left_count(left, e);
}

void kt_notes_put(kt_notes *notes, const void *object, const kt_note *list, size_t count) {
    for (size_t i = 0; i < count; i++) {
        const kt_left *left = (const kt_left *)(const void *)((const char *)object + list[i].left);
        kt_phrase text = {.length = 0};
        kt_phrase_add(&text, "%s", list[i].text);
        if (text.text[text.length - 1] == ':')
            kt_phrase_add(&text, left->what != NULL ? " %d; the first: %s" : " %d", left->count, left->what);
        kt_note_put(notes, list[i].rank, left, "%s", text.text);
    }
}

void kt_note_each(kt_notes *notes, const kt_unknown *items, const char *before, const char *behind) {
    for (int i = 0; i < items->count; i++)
        kt_note_put(notes, KT_NOTE_RANK_MOTION, &items->left[i], "%s%s%s: %d", before, items->left[i].what, behind,
                    items->left[i].count);
}

static void note_names(kt_notes *notes, kt_note_rank rank, const kt_unknown *names, const char *what) {
    kt_phrase list = {.length = 0};
    list_unknown(names, &list);
    if (names->count > 0)
        kt_note_put(notes, rank, &names->left[0], "%s: %s", what, list.text);
}

void kt_notes_end(kt_notes *notes, const kt_strange *strange, kt_scene *scene) {
    kt_note_each(notes, &strange->moving, "'", "' is left out");
    note_names(notes, KT_NOTE_RANK_NAME, &strange->unknown, "names that are not known here, and left out");
    note_names(notes, KT_NOTE_RANK_DETAIL, &strange->harmless,
               "elements and attributes that do not concern the motion, left out");
    scene->notes = notes->notes;
    scene->note_count = notes->count;
}

void kt_note_falling(kt_notes *notes, const kt_left *shapes, kt_vec3 gravity) {
    kt_note_put(notes, KT_NOTE_RANK_MOTION, shapes,
                "a body that moves freely has no ground and falls, %.2g m in the first second, since shapes touch "
                "nothing: %d; --contacts lets them touch planes, and --ground 0 adds a floor",
                0.5 * kt_vec3_norm(gravity), shapes->count);
}

void kt_note_groundless(kt_notes *notes, const kt_element *root) {
    kt_note_put(
        notes, KT_NOTE_RANK_MOTION, &(kt_left){.first = root, .count = 1},
        "a body that moves freely falls, since the file has no plane that it could touch; --ground HEIGHT adds a "
        "floor");
}

void kt_note_sunk(kt_notes *notes, const kt_element *root, double depth) {
    static const double harmless = 0.01; /* m: feet of a start at rest are less deep */
    if (depth > harmless)
        kt_note_put(notes, KT_NOTE_RANK_MOTION, &(kt_left){.first = root, .count = 1},
                    "the robot starts %.3g m deep in the ground, which throws it out; start higher, or give --ground a "
                    "lower HEIGHT",
                    depth);
}

/* ---- faults ------------------------------------------------------------------------------------------------------ */

/* "joint 'elbow': limit: ", from below the root inwards. */
static void add_path_context(kt_phrase *phrase, const kt_element *e) {
    if (e->parent == NULL)
        return;
    add_path_context(phrase, e->parent);
    kt_phrase_add(phrase, "%s", e->name);
    const char *name = kt_xml_attribute(e, "name");
    if (name != NULL)
        kt_phrase_add(phrase, " %s", kt_name_quote(name).text);
    kt_phrase_add(phrase, ": ");
}

bool kt_robot_fault(kt_reader *r, const kt_element *e, const char *format, ...) {
    kt_phrase where = {.length = 0};
    va_list arguments;
    add_path_context(&where, e);
    va_start(arguments, format);
    const bool result = kt_xml_fault_in(r, e, where.text, format, arguments);
    va_end(arguments);
    return result;
}

/* ---- names of bodies --------------------------------------------------------------------------------------------- */

bool kt_namer_init(kt_namer *namer, kt_reader *r, int most) {
    *namer = (kt_namer){.r = r, .room = most + 1};
    namer->namesakes = kt_reader_take(r, &r->scratch, (size_t)most + 1, sizeof *namer->namesakes);
    if (namer->namesakes == NULL || !kt_robot_names(r, &namer->names, (size_t)most + 1))
        return false;
    (void)kt_names_add(&namer->names, 0, "world", namer->count++);
    return true;
}

const char *kt_namer_make(kt_namer *namer, const char *wanted) {
    const size_t length = strlen(wanted);
    char *name = kt_reader_take(namer->r, &namer->r->keep, length + 16, 1);
    if (name == NULL || length == 0 || namer->count == namer->room)
        return "";
    size_t at = (wanted[0] >= '0' && wanted[0] <= '9') || wanted[0] == '-' ? 1 : 0; /* '7th' becomes '_7th' */
    name[0] = '_';
    memcpy(name + at, wanted, length);
    for (size_t i = 0; i < at + length; i++) {
        const char test[] = {'_', name[i], '\0'};
        if (!kt_name_is_valid(i == 0 ? test + 1 : test))
            name[i] = '_';
    }
    at += length;
    const int owner = kt_names_add(&namer->names, 0, name, namer->count);
    if (owner >= 0) /* numbers go on where those of the last namesake ended: each is tried once */
        do
            (void)snprintf(name + at, 16, "_%d", ++namer->namesakes[owner] + 1);
        while (kt_names_add(&namer->names, 0, name, namer->count) >= 0);
    namer->count++;
    return name;
}

/* ---- memory ------------------------------------------------------------------------------------------------------ */

const char *kt_robot_print(kt_reader *r, kt_pool *pool, const char *format, ...) {
    va_list arguments, again;
    va_start(arguments, format);
    va_copy(again, arguments);
    const size_t room = (size_t)vsnprintf(NULL, 0, format, arguments) + 1;
    char *text = kt_reader_take(r, pool, room, 1);
    if (text != NULL)
        (void)vsnprintf(text, room, format, again);
    va_end(again);
    va_end(arguments);
    return text;
}

bool kt_robot_names(kt_reader *r, kt_names *names, size_t count) {
    void *memory = kt_reader_take(r, &r->scratch, 1, kt_names_size(count));
    if (memory != NULL)
        kt_names_init(names, count, memory);
    return memory != NULL;
}

/* ---- lists ------------------------------------------------------------------------------------------------------- */

void *kt_list_add(kt_reader *r, kt_pool *pool, kt_list *list, size_t size) {
    void *items = kt_reader_grow(r, pool, list->items, (size_t)list->count, 1, &list->room, size);
    if (items == NULL)
        return NULL;
    list->items = items;
    return (char *)items + (size_t)list->count++ * size;
}

/* ---- elements that a reader makes -------------------------------------------------------------------------------- */

const char *const kt_no_attributes[1] = {NULL};

kt_element *kt_element_at(kt_reader *r, const kt_element *place, const char *name, const char *const *attributes) {
    kt_element *e = kt_reader_take(r, &r->scratch, 1, sizeof *e);
    if (e == NULL)
        return NULL;
    *e = *place;
    e->name = name;
    e->attributes = attributes;
    e->first = e->last = e->next = NULL;
    return e;
}

const char **kt_element_own(kt_reader *r, kt_element *e) {
    size_t count = 0;
    while (e->attributes[count] != NULL)
        count++;
    const char **own = kt_reader_take(r, &r->scratch, count + 1, sizeof *own);
    if (own != NULL)
        memcpy(own, e->attributes, count * sizeof *own);
    e->attributes = own != NULL ? own : kt_no_attributes;
    return own;
}

void kt_element_hang(kt_element *parent, kt_element *e) {
    e->parent = parent;
    e->next = NULL;
    if (parent->last == NULL)
        parent->first = e;
    else
        parent->last->next = e;
    parent->last = e;
}

/* ---- numbers, places --------------------------------------------------------------------------------------------- */

/* Parses numbers of which the text has only `characters`; `word` begins an infinite one. */
static int parse_numbers_of(const char *text, const char *characters, const char *word, int most, double *values) {
    static const char space[] = " \t\r\n";
    int count = 0;
    if (text[strspn(text, characters)] != '\0')
        return -1; /* neither nan nor hexadecimal digits */
    for (text += strspn(text, space); *text != '\0'; text += strspn(text, space)) {
        char *end;
        const double value = strtod(text, &end);
        const bool is_word = text[strspn(text, "+-")] != '\0' && strchr(word, text[strspn(text, "+-")]) != NULL;
        if (end == text || isfinite(value) == is_word || (*end != '\0' && strchr(space, *end) == NULL) || count == most)
            return -1;
        values[count++] = value;
        text = end;
    }
    return count;
}

int kt_parse_numbers(const char *text, int most, double *values) {
    return parse_numbers_of(text, "+-.0123456789eE \t\r\n", "", most, values);
}

int kt_parse_bounds(const char *text, int most, double *values) {
    return parse_numbers_of(text, "+-.0123456789eEinftyINFTY \t\r\n", "iI", most, values);
}

kt_rotation kt_rotation_of_matrix(kt_mat3 matrix) {
    const kt_quat q = kt_quat_from_mat3(matrix);
    if (q.x == 0.0 && q.y == 0.0 && q.z == 0.0)
        return (kt_rotation){.type = KT_ROTATION_NONE};
    return kt_rotation_quaternion(q.w, q.x, q.y, q.z);
}

kt_mat3 kt_mat3_of_rotation(const kt_rotation *rotation) {
    kt_mat3 matrix = kt_mat3_identity();
    if (rotation->type != KT_ROTATION_NONE && kt_rotation_evaluate(rotation, &matrix, NULL) != KT_OK)
        return kt_mat3_identity();
    return matrix;
}

kt_mat3 kt_mat3_z_to(kt_vec3 axis) {
    const kt_vec3 n = kt_vec3_cross(kt_vec3_make(0.0, 0.0, 1.0), axis);
    const double sine = kt_vec3_norm(n);
    if (sine == 0.0)
        return axis.z > 0.0 ? kt_mat3_identity() : kt_mat3_about(0, 3.14159265358979323846);
    return kt_mat3_from_euler_vector(kt_vec3_scale(atan2(sine, axis.z) / sine, n));
}

kt_pose kt_frame_of_joint(const kt_joint *joint) {
    return (kt_pose){.rotation = kt_mat3_of_rotation(&joint->rotation), .position = joint->at};
}

void kt_properties_of(const kt_body *body, kt_vec3 *com, kt_sym3 *inertia) {
    *com = body->com;
    *inertia = body->inertia;
    if ((body->com_of_shape || body->inertia_of_shape) && kt_body_inertia(body, com, inertia, NULL) != KT_OK)
        *com = body->com; /* the check of the description reports it */
}

void kt_moments_about(kt_sym3 inertia, kt_mat3 axes, double moments[3]) {
    const kt_vec3 along[3] = {axes.x, axes.y, axes.z};
    for (int i = 0; i < 3; i++)
        moments[i] = kt_vec3_dot(along[i], kt_sym3_apply(inertia, along[i]));
}

/* The place in the file itself. For an element of an included file, this is the place of the include. */
static kt_mark mark_of(const kt_element *e) {
    const kt_element *at = e->included != NULL ? e->included : e;
    return (kt_mark){at->line, at->column};
}

bool kt_marks_make(kt_reader *r, const char *path, kt_scene *scene, const kt_element *const *body_elements,
                   const kt_element *const *loop_elements) {
    const kt_description *d = &scene->description;
    kt_scene_marks *marks = kt_reader_take(r, &r->keep, 1, sizeof *marks);
    kt_mark *bodies = kt_reader_take(r, &r->keep, (size_t)d->body_count + 1, sizeof *bodies);
    kt_mark *loops = kt_reader_take(r, &r->keep, (size_t)d->loop_count + 1, sizeof *loops);
    char *name = kt_reader_text(r, &r->keep, path, strlen(path));
    if (marks == NULL || bodies == NULL || loops == NULL || name == NULL)
        return false;
    for (int i = 0; i < d->body_count; i++)
        bodies[i] = mark_of(body_elements[i]);
    for (int i = 0; i < d->loop_count; i++)
        loops[i] = mark_of(loop_elements[i]);
    *marks = (kt_scene_marks){.path = name, .bodies = bodies, .loops = loops};
    scene->marks = marks;
    return true;
}
