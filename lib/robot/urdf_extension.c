/* Extensions of URDF by simulators that change the motion.
 *
 * <gazebo reference="NAME"> gives a link or a joint more: friction, a spring, no weight. <gazebo> without a reference
 * is about the robot. <mujoco> has settings of MuJoCo, of which gravity is read. */
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

/* ---- Gazebo ------------------------------------------------------------------------------------------------------ */

/* Reads a number of a child. Returns whether there is one. */
static bool read_extension(kt_urdf *u, const kt_element *within, const char *child, double *value) {
    const kt_element *e = kt_xml_child(within, child);
    double read;
    if (e == NULL)
        return false;
    if (e->text == NULL || kt_parse_numbers(e->text, 1, &read) != 1)
        return kt_robot_fault(u->r, e, "expected a number, found '%.60s'", e->text != NULL ? e->text : "");
    *value = read;
    return true;
}

/* Whether an extension is `true`, `yes` or `1`, with blanks around it. */
static bool is_extension_true(const kt_element *e) {
    static const char *const words[] = {"true", "True", "TRUE", "yes", "1"};
    const char *text = e->text != NULL ? e->text + strspn(e->text, " \t\r\n") : "";
    const size_t length = strcspn(text, " \t\r\n");
    bool found = false;
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        found = found || (strlen(words[i]) == length && strncmp(words[i], text, length) == 0);
    return found;
}

static void extend_link(kt_urdf *u, const kt_element *e, kt_urdf_link *link) {
    const kt_element *off = kt_xml_child(e, "turnGravityOff"), *on = kt_xml_child(e, "gravity");
    double friction = link->friction;
    if (read_extension(u, e, "mu1", &friction) || (!link->has_friction && read_extension(u, e, "mu", &friction)))
        link->friction = fmax(0.0, friction);
    link->has_friction = link->has_friction || kt_xml_child(e, "mu1") != NULL;
    link->is_light = (off != NULL && is_extension_true(off)) || (on != NULL && !is_extension_true(on)) ||
                     (link->is_light && off == NULL && on == NULL);
}

static void extend_joint(kt_urdf *u, const kt_element *e, kt_urdf_joint *j) {
    (void)read_extension(u, e, "springStiffness", &j->stiffness);
    (void)read_extension(u, e, "springReference", &j->rest);
    if (j->stiffness != 0.0 && j->kind != NULL && !j->kind->is_scalar)
        kt_unknown_count(&u->strange.moving, "springStiffness", e);
}

/* Later elements count before earlier ones. */
void kt_urdf_read_extensions(kt_urdf *u) {
    for (const kt_element *e = kt_xml_child(u->robot, "gazebo"); e != NULL; e = kt_xml_next(e, "gazebo")) {
        const char *reference = kt_xml_attribute(e, "reference");
        const kt_element *fixed = reference == NULL ? kt_xml_child(e, "static") : NULL;
        const int link = reference != NULL ? kt_names_find(&u->names, LINKS, reference) : -1;
        const int joint = reference != NULL ? kt_names_find(&u->names, JOINTS, reference) : -1;
        if (fixed != NULL && is_extension_true(fixed))
            kt_unknown_count(&u->strange.moving, "static", fixed);
        if (link >= 0)
            extend_link(u, e, &u->links[link]);
        if (joint >= 0)
            extend_joint(u, e, &u->joints[joint]);
    }
    read_urdf_gravity(u);
}

void kt_urdf_extend(kt_urdf *u) {
    for (int i = 0; i < u->joint_count && !u->r->out_of_memory; i++) {
        const kt_urdf_joint *j = &u->joints[i];
        const bool is_sprung = j->stiffness != 0.0 && j->kind != NULL && j->kind->is_scalar && j->name != NULL;
        kt_effect *spring =
            is_sprung ? kt_draft_joint_effect(&u->draft, j->element, KT_EFFECT_JOINT_SPRING, j->name) : NULL;
        if (spring == NULL)
            continue;
        spring->stiffness = j->stiffness;
        spring->rest = kt_function_constant(j->rest);
    }
    for (int i = 0; i < u->link_count && !u->r->out_of_memory; i++) {
        const kt_urdf_link *link = &u->links[i];
        const kt_body *body = link->index >= 0 ? (const kt_body *)u->draft.bodies.items + link->index : NULL;
        if (link->is_light && body != NULL && kt_draft_lift(&u->draft, link->element, body, u->gravity, 1.0))
            kt_left_count(&u->no_gravity, link->element);
    }
}
