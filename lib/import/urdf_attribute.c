/* Attributes of URDF: numbers, and what to say where they are none. */
#include "import/urdf.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

/* ---- faults and notes -------------------------------------------------------------------------------------------- */

/* "joint 'elbow': limit: ", from the outermost link or joint inwards. */
static void add_context(kt_phrase *phrase, const kt_element *e) {
    if (e->parent == NULL)
        return;
    add_context(phrase, e->parent);
    kt_phrase_add(phrase, "%s", e->name);
    const char *name = e->parent->parent == NULL ? kt_xml_attribute(e, "name") : NULL;
    if (name != NULL)
        kt_phrase_add(phrase, " %s", kt_name_quote(name).text);
    kt_phrase_add(phrase, ": ");
}

bool kt_urdf_fault(kt_reader *r, const kt_element *e, const char *format, ...) {
    kt_phrase where = {.length = 0};
    char what[KT_MESSAGE_SIZE];
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(what, sizeof what, format, arguments);
    va_end(arguments);
    add_context(&where, e);
    return kt_fault_put(r, KT_ERROR_SCENE, e->line, e->column, "%s%s", where.text, what);
}

void kt_urdf_count(kt_left *left, const kt_element *e) {
    if (left->count++ == 0)
        left->first = e;
}

/* Counts what this file does not know, by its name; beyond LEFT_MOST names with the last. */
void kt_urdf_count_unknown(kt_urdf *u, const char *what, const kt_element *e) {
    int i = 0;
    while (i < u->left_count && strcmp(u->left[i].what, what) != 0)
        i++;
    if (i == LEFT_MOST)
        i--;
    if (i == u->left_count)
        u->left[u->left_count++].what = i == LEFT_MOST - 1 ? "others" : what;
    kt_urdf_count(&u->left[i], e);
}

/* ---- attributes -------------------------------------------------------------------------------------------------- */

static const char SPACE[] = " \t\r\n";

/* Numbers in decimal, apart by blanks; false unless there are exactly `count`, all finite. */
static bool parse_numbers(const char *text, int count, double *values) {
    if (text[strspn(text, "+-.0123456789eE \t\r\n")] != '\0')
        return false; /* neither nan nor hexadecimal digits */
    for (int i = 0; i < count; i++) {
        char *end;
        values[i] = strtod(text, &end);
        if (end == text || !isfinite(values[i]) || (*end != '\0' && strchr(SPACE, *end) == NULL))
            return false;
        text = end;
    }
    return text[strspn(text, SPACE)] == '\0';
}

/* Reads an attribute of numbers; without it, values stay as they are. Returns whether there are numbers now. */
bool kt_urdf_numbers(kt_reader *r, const kt_element *e, const char *name, int count, double *values) {
    double read[3];
    const char *text = e != NULL ? kt_xml_attribute(e, name) : NULL;
    if (text == NULL)
        return false;
    if (!parse_numbers(text, count, read))
        return kt_urdf_fault(r, e, "%s: expected %s, found '%.60s'", name, count == 1 ? "a number" : "three numbers",
                             text);
    memcpy(values, read, (size_t)count * sizeof *values);
    return true;
}

void kt_urdf_need_number(kt_reader *r, const kt_element *e, const char *name, double *value) {
    if (kt_xml_attribute(e, name) == NULL)
        (void)kt_urdf_fault(r, e, "the attribute '%s' is missing", name);
    else
        (void)kt_urdf_numbers(r, e, name, 1, value);
}

kt_vec3 kt_urdf_vector(kt_reader *r, const kt_element *e, const char *name, kt_vec3 standard) {
    double v[3] = {standard.x, standard.y, standard.z};
    (void)kt_urdf_numbers(r, e, name, 3, v);
    return kt_vec3_make(v[0], v[1], v[2]);
}

/* The place and the rotation of an element's `origin`. */
void kt_urdf_origin(kt_reader *r, const kt_element *e, kt_vec3 *at, kt_vec3 *rpy) {
    const kt_vec3 zero = kt_vec3_make(0.0, 0.0, 0.0);
    const kt_element *origin = kt_xml_child(e, "origin");
    *at = kt_urdf_vector(r, origin, "xyz", zero);
    *rpy = kt_urdf_vector(r, origin, "rpy", zero);
}
