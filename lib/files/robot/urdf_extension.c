/* Extensions of URDF by simulators that change the motion.
 *
 * <gazebo reference="NAME"> gives a link or a joint more: friction, a spring, no weight. <gazebo> without a reference
 * is about the robot. <mujoco> has settings of MuJoCo, of which gravity is read. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/urdf.h"

#include <math.h>
#include <string.h>

/* ---- MuJoCo ------------------------------------------------------------------------------------------------------ */

static void read_urdf_gravity(kt_urdf *u) {
    const kt_element *mujoco = kt_xml_child(u->robot, "mujoco");
    const kt_element *option = mujoco != NULL ? kt_xml_child(mujoco, "option") : NULL;
    u->gravity = kt_urdf_vector(u->r, option, "gravity", kt_vec3_make(0.0, 0.0, -9.81));
    u->has_gravity = option != NULL && kt_xml_attribute(option, "gravity") != NULL;
}

static bool read_flag(kt_urdf *u, const kt_element *e, const char *name) {
    const char *text = kt_xml_attribute(e, name);
    if (text != NULL && !kt_words_have(" true false auto ", text))
        (void)kt_robot_fault(u->r, e, "%s: expected true or false, found '%.40s'", name, text);
    return kt_text_is(text, "true");
}

/* Later elements count before earlier ones. */
static void read_urdf_compiler(kt_urdf *u) {
    const kt_element *mujoco = kt_xml_child(u->robot, "mujoco");
    const kt_element *e = mujoco != NULL ? kt_xml_child(mujoco, "compiler") : NULL;
    kt_urdf_compiler *c = &u->compiler;
    for (; e != NULL; e = kt_xml_next(e, "compiler")) {
        c->balances = read_flag(u, e, "balanceinertia") || c->balances;
        c->from_geoms = read_flag(u, e, "inertiafromgeom") || c->from_geoms;
        (void)kt_urdf_numbers(u->r, e, "boundmass", 1, &c->mass_least);
        (void)kt_urdf_numbers(u->r, e, "boundinertia", 1, &c->inertia_least);
        (void)kt_urdf_numbers(u->r, e, "settotalmass", 1, &c->total_mass);
    }
}

/* ---- Gazebo ------------------------------------------------------------------------------------------------------ */

static const char *extension_text(const kt_element *e) {
    const char *value = kt_element_value(e);
    return value != NULL ? value : "";
}

/* Reads a number of a child. Without it, or if it is no number, the value stays as it is. */
static void read_extension(kt_urdf *u, const kt_element *within, const char *child, double *value) {
    const kt_element *e = kt_xml_child(within, child);
    double read;
    if (e != NULL && kt_parse_numbers(extension_text(e), 1, &read) == 1)
        *value = read;
    else if (e != NULL)
        kt_unknown_count(&u->strange.moving, child, e);
}

/* Whether an extension is one of some words, with capitals or without, and with blanks around it. */
static bool is_extension_of(const kt_element *e, const char *words) {
    static const char space[] = " \t\r\n";
    const char *text = extension_text(e);
    char word[8] = "";
    text += strspn(text, space);
    const size_t length = strcspn(text, space);
    for (size_t i = 0; i < length && length < sizeof word; i++)
        word[i] = (char)(text[i] >= 'A' && text[i] <= 'Z' ? text[i] - 'A' + 'a' : text[i]);
    return *word != '\0' && kt_words_have(words, word);
}

/* A friction below zero is ignored. `collision` of <gazebo> stands in each collision of the link, as in Gazebo. */
static void read_gazebo_friction(kt_urdf *u, const kt_element *e, kt_urdf_link *link) {
    static const char *const names[] = {"mu", "mu1", "mu2"};
    static const char *const path[] = {"collision", "surface", "friction", "ode"};
    const kt_element *within = e;
    for (size_t i = 0; within != NULL && i < sizeof path / sizeof *path; i++)
        within = kt_xml_child(within, path[i]);
    for (int k = 0; k < 3; k++) {
        double mu = -1.0;
        if (within != NULL)
            read_extension(u, within, names[k], &mu);
        read_extension(u, e, names[k], &mu);
        link->mu[k] = mu >= 0.0 ? mu : link->mu[k];
    }
}

/* As in Gazebo: unless the text of `turnGravityOff` is a word for "no", the link has no weight. Unless the text of
 * `gravity` is such a word, the link has its weight. */
static void extend_link(kt_urdf *u, const kt_element *e, kt_urdf_link *link) {
    static const char no[] = " false no 0 ";
    const kt_element *off = kt_xml_child(e, "turnGravityOff"), *on = kt_xml_child(e, "gravity");
    read_gazebo_friction(u, e, link);
    link->is_light = (off != NULL && !is_extension_of(off, no)) || (on != NULL && is_extension_of(on, no)) ||
                     (link->is_light && off == NULL && on == NULL);
}

static void extend_joint(kt_urdf *u, const kt_element *e, kt_urdf_joint *j) {
    read_extension(u, e, "springStiffness", &j->stiffness);
    read_extension(u, e, "springReference", &j->rest);
    if (j->stiffness != 0.0 && j->kind != NULL && !j->kind->is_scalar)
        kt_unknown_count(&u->strange.moving, "springStiffness", e);
}

/* Later elements count before earlier ones. */
void kt_urdf_read_extensions(kt_urdf *u) {
    static const char *const flags[] = {"static", "kinematic", "enable_wind"}; /* the first one of the whole robot */
    for (const kt_element *e = kt_xml_child(u->robot, "gazebo"); e != NULL; e = kt_xml_next(e, "gazebo")) {
        const char *reference = kt_xml_attribute(e, "reference");
        const int link = reference != NULL ? kt_names_find(&u->names, LINKS, reference) : -1;
        const int joint = reference != NULL ? kt_names_find(&u->names, JOINTS, reference) : -1;
        for (size_t i = reference == NULL ? 0 : 1; i < sizeof flags / sizeof *flags; i++) {
            const kt_element *flag = kt_xml_child(e, flags[i]);
            if (flag != NULL && is_extension_of(flag, " true yes 1 "))
                kt_unknown_count(&u->strange.moving, flags[i], flag);
        }
        for (const kt_element *part = reference == NULL ? e->first : NULL; part != NULL; part = part->next)
            if (kt_words_have(" joint link ", part->name)) /* which Gazebo adds to the robot */
                kt_unknown_count(&u->strange.moving, part->name, part);
        if (link >= 0)
            extend_link(u, e, &u->links[link]);
        if (joint >= 0)
            extend_joint(u, e, &u->joints[joint]);
    }
    read_urdf_gravity(u);
    read_urdf_compiler(u);
}

/* ---- friction ---------------------------------------------------------------------------------------------------- */

/* A number in <contact> of a link, by PyBullet; below zero: none. */
static double read_pybullet(kt_urdf *u, const kt_urdf_link *link, const char *name) {
    const kt_element *contact = kt_xml_child(link->element, "contact");
    double number = -1.0;
    if (contact != NULL)
        read_extension(u, contact, name, &number);
    return number;
}

double kt_urdf_arm(kt_urdf *u, const kt_urdf_link *link, const char *name) {
    return fmax(read_pybullet(u, link, name), 0.0);
}

/* As in Gazebo, `mu1` has precedence over `mu`. `mu1` is the friction along one direction, and `mu2` the friction
 * across this direction. */
static double gazebo_friction(kt_urdf *u, const kt_urdf_link *link, const kt_element *collision) {
    const double mu = link->mu[1] >= 0.0 ? link->mu[1] : link->mu[0];
    if (link->mu[2] >= 0.0 && link->mu[2] != (mu >= 0.0 ? mu : KT_FRICTION_STANDARD))
        kt_left_count(&u->collisions.directional, collision);
    return mu >= 0.0 || link->mu[2] < 0.0 ? mu : KT_FRICTION_STANDARD;
}

double kt_urdf_friction(kt_urdf *u, const kt_urdf_link *link, const kt_element *collision) {
    const double given[] = {kt_friction_of_drake(&u->collisions, collision), gazebo_friction(u, link, collision),
                            read_pybullet(u, link, "lateral_friction")};
    double mu = -1.0;
    bool differ = false;
    for (size_t i = 0; i < sizeof given / sizeof *given; i++) {
        differ = differ || (mu >= 0.0 && given[i] >= 0.0 && given[i] != mu);
        mu = mu >= 0.0 ? mu : given[i];
    }
    if (differ)
        kt_left_count(&u->collisions.disputed, collision);
    return mu >= 0.0 ? mu : KT_FRICTION_STANDARD;
}

/* ---- springs and weights ----------------------------------------------------------------------------------------- */

void kt_urdf_extend(kt_urdf *u) {
    for (int i = 0; i < u->joint_count && !u->r->out_of_memory; i++) {
        const kt_urdf_joint *j = &u->joints[i];
        if (j->kind != NULL && j->kind->is_scalar && j->name != NULL)
            kt_draft_spring(&u->draft, j->element, j->name, j->stiffness, j->rest);
    }
    for (int i = 0; i < u->link_count && !u->r->out_of_memory; i++) {
        const kt_urdf_link *link = &u->links[i];
        const kt_body *body = link->index >= 0 ? (const kt_body *)u->draft.bodies.items + link->index : NULL;
        if (link->is_light && body != NULL && kt_draft_lift(&u->draft, link->element, body, u->gravity, 1.0))
            kt_left_count(&u->no_gravity, link->element);
    }
}
