/* Versions of SDF before 1.4, whose tree is made that of 1.4 before it is read.
 *
 * In 1.0 numbers are attributes: `<inertial mass="2">`, `<axis xyz="0 0 1"/>`, `<origin pose="..."/>`, `<parent
 * link="a"/>`. They become elements of that name, or the text of the element. Files of 1.2 and 1.3 have elements
 * already, but for some names. Axes are those of 1.4: in the model's frame. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/sdf.h"

#include <string.h>

/* Elements whose numbers are attributes in SDF 1.0 only. */
static const kt_known moved[] = {
    {" model ", " static "},
    {" link ", " gravity self_collide kinematic "},
    {" inertial ", " mass "},
    {" inertia ", " ixx ixy ixz iyy iyz izz "},
    {" box ", " size "},
    {" sphere ", " radius "},
    {" cylinder ", " radius length "},
    {" mesh ", " filename scale "},
    {" plane ", " normal "},
    {" axis axis2 ", " xyz "},
    {" dynamics ", " damping friction "},
    {" limit ", " lower upper effort velocity "},
};

/* Elements whose only attribute becomes their text; the name that they have then. */
static const struct {
    const char *name, *attribute, *new_name;
} texts[] = {{"origin", "pose", "pose"},
             {"parent", "link", "parent"},
             {"child", "link", "child"},
             {"gravity", "xyz", "gravity"}};

/* Elements with another name, and the elements around them. */
static const struct {
    const char *within, *name, *new_name;
} names[] = {{"mesh", "filename", "uri"}, {"link", "damping", "velocity_decay"}};

static void hang_text(kt_sdf *m, kt_element *parent, const char *name, const char *text) {
    kt_element *e = kt_element_at(m->r, parent, name, kt_no_attributes);
    if (e == NULL)
        return;
    e->text = text;
    kt_element_hang(parent, e);
    parent->text = NULL;
}

/* Makes children of those attributes that are in a list, and keeps the others. */
static void move_attributes(kt_sdf *m, kt_element *e, const char *list) {
    const char **own = kt_element_own(m->r, e);
    size_t kept = 0;
    for (size_t i = 0; own != NULL && own[i] != NULL; i += 2) {
        if (kt_words_have(list, own[i])) {
            hang_text(m, e, own[i], own[i + 1]);
            continue;
        }
        own[kept++] = own[i];
        own[kept++] = own[i + 1];
    }
    if (own != NULL)
        own[kept] = NULL;
}

static void convert_element(kt_sdf *m, kt_element *e) {
    for (size_t i = 0; i < sizeof moved / sizeof *moved; i++)
        if (kt_words_have(moved[i].names, e->name))
            move_attributes(m, e, moved[i].attributes);
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        const char *text = strcmp(e->name, texts[i].name) == 0 ? kt_xml_attribute(e, texts[i].attribute) : NULL;
        if (text == NULL)
            continue;
        e->attributes = kt_no_attributes;
        e->name = texts[i].new_name;
        e->text = text;
    }
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (e->parent != NULL && strcmp(e->parent->name, names[i].within) == 0 && strcmp(e->name, names[i].name) == 0)
            e->name = names[i].new_name;
}

static void convert_tree(kt_sdf *m, kt_element *e) {
    convert_element(m, e);
    for (kt_element *child = e->first; child != NULL && !m->r->out_of_memory; child = child->next)
        convert_tree(m, child);
}

void kt_sdf_convert(kt_sdf *m, kt_element *sdf) {
    kt_left_count(&m->older, sdf);
    convert_tree(m, sdf);
}

bool kt_sdf_is_root(const kt_element *e) { return strcmp(e->name, "sdf") == 0 || strcmp(e->name, "gazebo") == 0; }
