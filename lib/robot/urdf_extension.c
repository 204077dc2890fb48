/* Extensions of URDF by simulators that change the motion.
 *
 * <gazebo reference="NAME"> gives a link or a joint more: friction, a spring, no weight. <gazebo> without a reference
 * is about the robot. <mujoco> has settings of MuJoCo, of which gravity is read. */
#include "robot/urdf.h"

#include <string.h>

/* ---- Gazebo ------------------------------------------------------------------------------------------------------ */

/* The last child of this name in the extensions of an element of URDF (NULL: the robot); NULL if there is none. */
static const kt_element *find_extension(const kt_urdf *u, const kt_element *of, const char *child) {
    const char *name = of != NULL ? kt_xml_attribute(of, "name") : NULL;
    const kt_element *found = NULL;
    for (const kt_element *e = kt_xml_child(u->robot, "gazebo"); e != NULL; e = kt_xml_next(e, "gazebo")) {
        const char *reference = kt_xml_attribute(e, "reference");
        const bool is_meant = of == NULL ? reference == NULL || *reference == '\0'
                                         : reference != NULL && name != NULL && strcmp(reference, name) == 0;
        const kt_element *here = is_meant ? kt_xml_child(e, child) : NULL;
        found = here != NULL ? here : found;
    }
    return found;
}

double kt_urdf_extension_number(kt_urdf *u, const kt_element *of, const char *child, double standard) {
    const kt_element *e = find_extension(u, of, child);
    double value;
    if (e == NULL)
        return standard;
    if (e->text != NULL && kt_parse_numbers(e->text, 1, &value) == 1)
        return value;
    (void)kt_robot_fault(u->r, e, "expected a number, found '%.60s'", e->text != NULL ? e->text : "");
    return standard;
}

/* Whether an extension is `true`, `yes` or `1`, with blanks around it. */
static bool is_true(const kt_element *e) {
    static const char *const words[] = {"true", "True", "TRUE", "yes", "1"};
    const char *text = e->text != NULL ? e->text + strspn(e->text, " \t\r\n") : "";
    const size_t length = strcspn(text, " \t\r\n");
    bool found = false;
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        found = found || (strlen(words[i]) == length && strncmp(words[i], text, length) == 0);
    return found;
}

static void put_spring(kt_urdf *u, const kt_urdf_joint *j) {
    const double stiffness = kt_urdf_extension_number(u, j->element, "springStiffness", 0.0);
    const double rest = kt_urdf_extension_number(u, j->element, "springReference", 0.0);
    if (stiffness != 0.0 && !j->kind->is_scalar)
        kt_unknown_count(&u->strange.moving, "springStiffness", j->element);
    if (stiffness == 0.0 || !j->kind->is_scalar)
        return;
    kt_effect *spring = kt_draft_joint_effect(&u->draft, j->element, KT_EFFECT_JOINT_SPRING, j->name);
    if (spring == NULL)
        return;
    spring->stiffness = stiffness;
    spring->rest = kt_function_constant(rest);
}

static void lift_link(kt_urdf *u, const kt_urdf_link *link) {
    const kt_element *off = find_extension(u, link->element, "turnGravityOff");
    const kt_element *on = find_extension(u, link->element, "gravity");
    const bool is_light = (off != NULL && is_true(off)) || (on != NULL && !is_true(on));
    const kt_body *body = link->index >= 0 ? (const kt_body *)u->draft.bodies.items + link->index : NULL;
    if (is_light && body != NULL && kt_draft_lift(&u->draft, link->element, body, u->gravity, 1.0))
        kt_left_count(&u->no_gravity, link->element);
}

void kt_urdf_extend(kt_urdf *u) {
    const kt_element *fixed = find_extension(u, NULL, "static");
    if (fixed != NULL && is_true(fixed))
        kt_unknown_count(&u->strange.moving, "static", fixed);
    for (int i = 0; i < u->joint_count && !u->r->out_of_memory; i++)
        if (u->joints[i].kind != NULL && u->joints[i].name != NULL)
            put_spring(u, &u->joints[i]);
    for (int i = 0; i < u->link_count && !u->r->out_of_memory; i++)
        lift_link(u, &u->links[i]);
}

/* ---- MuJoCo ------------------------------------------------------------------------------------------------------ */

void kt_urdf_read_gravity(kt_urdf *u) {
    const kt_element *mujoco = kt_xml_child(u->robot, "mujoco");
    const kt_element *option = mujoco != NULL ? kt_xml_child(mujoco, "option") : NULL;
    u->gravity = kt_urdf_vector(u->r, option, "gravity", kt_vec3_make(0.0, 0.0, -9.81));
    u->has_gravity = option != NULL && kt_xml_attribute(option, "gravity") != NULL;
}
