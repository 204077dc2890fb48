/* Links and joints of URDF: the tree, and the names. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/urdf.h"

#include <math.h>
#include <string.h>

static const kt_urdf_kind kinds[] = {
    {"revolute", KT_JOINT_REVOLUTE, true, true},   {"continuous", KT_JOINT_REVOLUTE, true, false},
    {"prismatic", KT_JOINT_PRISMATIC, true, true}, {"fixed", KT_JOINT_FIXED, false, false},
    {"floating", KT_JOINT_FREE, false, false},     {"planar", KT_JOINT_PLANAR, false, false},
};

/* The attributes of elements. Elements that are missing here are not read. */
static const kt_known known[] = {
    {" link visual collision material ", " name "},
    {" contact surface friction ode drake:proximity_properties ", " "},
    {" joint ", " name type "},
    {" origin ", " xyz rpy quat_xyzw "},
    {" axis ", " xyz "},
    {" parent child ", " link "},
    {" inertial geometry mujoco ", " "},
    {" compiler ", " balanceinertia inertiafromgeom boundmass boundinertia settotalmass "},
    {" mass mu mu1 mu2 lateral_friction rolling_friction spinning_friction drake:mu_static drake:mu_dynamic static "
     "kinematic enable_wind gravity "
     "turnGravityOff springStiffness springReference ",
     " value "},
    {" inertia ", " ixx ixy ixz iyy iyz izz "},
    {" limit ", " lower upper effort velocity "},
    {" dynamics ", " damping friction "},
    {" mimic ", " joint multiplier offset "},
    {" box ", " size "},
    {" cylinder capsule ", " radius length "},
    {" sphere ", " radius "},
    {" mesh ", " filename scale "},
    {" gazebo ", " reference "},
    {" option ", " gravity "},
};

/* All elements of a transmission that concern the motion are read. */
static const kt_known_list all_known = {
    known,
    sizeof known / sizeof *known,
    .apart = " ",
    .closed = " material ",
    .read = " transmission ",
    .harmless = " safety_controller calibration color texture sensor type version verbose "
                "link_state joint_state fdir1 kp kd minDepth maxVel maxContacts "
                "selfCollide laserRetro provideFeedback implicitSpringDamper stopCfm stopErp "
                "fudgeFactor cfmDamping disableFixedJointLumping preserveFixedJoint angle "
                "eulerseq meshdir texturedir assetdir strippath discardvisual fusestatic "
                "autolimits convexhull usethread timestep integrator solver "
                "iterations tolerance cone impratio jacobian size contact_cfm contact_erp stiffness "
                "damping friction_anchor inertia_scaling " KT_COMPLIANCE_OF_DRAKE,
    .moving = " plugin torsional bullet slip1 slip2 restitution bounce "
              "dampingFactor velocity_decay "
              "density viscosity wind flag "
              "loop_joint force_element joint:hinge joint:slider " KT_MOVING_OF_DRAKE};

/* ---- links and joints -------------------------------------------------------------------------------------------- */

static const char *urdf_name_of(kt_reader *r, const kt_element *e) {
    const char *name = kt_element_name(e, NULL);
    if (name == NULL)
        (void)kt_robot_fault(r, e, "the attribute 'name' is missing");
    return name;
}

/* Adds the name of a link or joint; reports one that is there already. */
static void add_urdf_name(kt_urdf *u, int scope, const kt_element *e, int index) {
    const char *name = urdf_name_of(u->r, e);
    const int other = name != NULL ? kt_names_add(&u->names, scope, name, index) : -1;
    if (other >= 0)
        (void)kt_robot_fault(u->r, e, "the name is that of the %s in line %u, too; each needs one of its own",
                             scope == LINKS ? "link" : "joint",
                             (unsigned)(scope == LINKS ? u->links[other].element : u->joints[other].element)->line);
}

/* A link or joint that an attribute of a child element names; -1 after reporting. */
static int find_urdf_name(kt_urdf *u, const kt_element *joint, const char *child, const char *attribute, int scope) {
    const kt_element *e = kt_xml_child(joint, child);
    const char *name = e != NULL ? kt_xml_attribute(e, attribute) : NULL;
    if (name == NULL) {
        (void)kt_robot_fault(u->r, e != NULL ? e : joint, "<%s %s=\"...\"/> is missing", child, attribute);
        return -1;
    }
    const int found = kt_names_find(&u->names, scope, name);
    if (found >= 0)
        return found;
    kt_nearest nearest = kt_nearest_make(name, &u->r->effort);
    const int most = scope == LINKS ? u->link_count : u->joint_count;
    for (int i = 0; i < most; i++)
        if (!kt_nearest_try(&nearest,
                            kt_xml_attribute(scope == LINKS ? u->links[i].element : u->joints[i].element, "name")))
            break;
    (void)kt_robot_fault(u->r, e, "%s %s does not exist%s%s%s", attribute, kt_name_quote(name).text,
                         nearest.best != NULL ? "; did you mean " : "",
                         nearest.best != NULL ? kt_name_quote(nearest.best).text : "", nearest.best != NULL ? "?" : "");
    return -1;
}

static const kt_urdf_kind *find_urdf_kind(kt_urdf *u, const kt_element *e) {
    const char *type = kt_xml_attribute(e, "type");
    if (type == NULL) {
        (void)kt_robot_fault(u->r, e, "the attribute 'type' is missing");
        return NULL;
    }
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (strcmp(kinds[i].name, type) == 0)
            return &kinds[i];
    (void)kt_robot_fault(
        u->r, e, "there is no type '%.40s'; it is revolute, continuous, prismatic, fixed, floating or planar", type);
    return NULL;
}

/* A limit of effort or speed is data: a text that is no number of the kind is left out. */
static double limit_of(kt_urdf *u, const kt_element *limit, const char *name) {
    const char *text = kt_xml_attribute(limit, name);
    double value;
    if (text != NULL && kt_parse_bounds(text, 1, &value) == 1 && value >= 0.0)
        return value;
    if (text != NULL)
        kt_left_count(&u->rates, limit);
    return (double)INFINITY;
}

/* Limits of position, and the start: zero, or the limit nearest to it. URDF's default for one that is not given is
 * 0. */
static void read_limits(kt_urdf *u, kt_urdf_joint *j) {
    const kt_element *limit = kt_xml_child(j->element, "limit");
    double lower = 0.0, upper = 0.0;
    j->lower = -(double)INFINITY;
    j->upper = j->effort = j->speed = (double)INFINITY;
    if (limit == NULL)
        return;
    if (j->kind->is_scalar) {
        j->effort = limit_of(u, limit, "effort");
        j->speed = limit_of(u, limit, "velocity");
    }
    const bool has_lower = kt_urdf_bound(u->r, limit, "lower", &lower);
    const bool has_upper = kt_urdf_bound(u->r, limit, "upper", &upper);
    const bool is_faulty = (!has_lower && kt_xml_attribute(limit, "lower") != NULL) ||
                           (!has_upper && kt_xml_attribute(limit, "upper") != NULL);
    if (!j->kind->is_limited || is_faulty || (!has_lower && !has_upper))
        return;
    if (lower > upper && u->source->options->stop_stiffness != 0.0)
        (void)kt_robot_fault(u->r, limit, "lower, %g, is above upper, %g; exchange them, or leave --stops out", lower,
                             upper);
    if (lower > upper) {
        kt_left_count(&u->disordered, limit);
        return;
    }
    if (lower == (double)INFINITY || upper == -(double)INFINITY) {
        (void)kt_robot_fault(u->r, limit, "from %g to %g there is no number; exchange the signs", lower, upper);
        return;
    }
    j->lower = lower;
    j->upper = upper;
    if (isinf(lower) && isinf(upper))
        return;
    j->start = fmin(fmax(0.0, lower), upper);
    if (!kt_robot_has_stops(u->source->options))
        kt_left_count(&u->limits, limit);
}

static void read_urdf_joint(kt_urdf *u, int index) {
    kt_urdf_joint *j = &u->joints[index];
    j->kind = find_urdf_kind(u, j->element);
    j->parent = find_urdf_name(u, j->element, "parent", "link", LINKS);
    j->child = find_urdf_name(u, j->element, "child", "link", LINKS);
    if (j->kind != NULL)
        read_limits(u, j);
    if (j->child < 0)
        return;
    kt_urdf_link *child = &u->links[j->child];
    if (child->carrier >= 0)
        (void)kt_robot_fault(
            u->r, j->element,
            "link %s is the child of the joint in line %u, too; a link has one joint to its parent: close loops "
            "in the scene, by 'loops'",
            kt_name_quote(kt_xml_attribute(child->element, "name")).text,
            (unsigned)u->joints[child->carrier].element->line);
    else
        child->carrier = index;
}

/* ---- joints that follow others ----------------------------------------------------------------------------------- */

/* q = multiplier q' + offset. A joint that is fixed, or follows a fixed joint, loses its mimic. */
static void read_mimic(kt_urdf *u, kt_urdf_joint *j) {
    const kt_element *e = kt_xml_child(j->element, "mimic");
    if (e == NULL || j->kind == NULL)
        return;
    j->multiplier = 1.0;
    const int other = find_urdf_name(u, j->element, "mimic", "joint", JOINTS);
    (void)kt_urdf_numbers(u->r, e, "multiplier", 1, &j->multiplier);
    (void)kt_urdf_numbers(u->r, e, "offset", 1, &j->offset);
    const kt_urdf_kind *kind = other >= 0 ? u->joints[other].kind : NULL;
    if (kind == NULL || u->joints[other].child < 0)
        return;
    if (j->kind->type == KT_JOINT_FIXED || kind->type == KT_JOINT_FIXED)
        kt_left_count(&u->fixed_mimics, e);
    else if (!j->kind->is_scalar || !kind->is_scalar)
        (void)kt_robot_fault(u->r, e, "only revolute, continuous and prismatic joints can be coupled");
    else
        j->master = other;
}

/* The position of its master determines the start of a follower. Starts that are not zero, or are beyond its own
 * limits, are counted. */
static void place_follower(kt_urdf *u, kt_urdf_joint *j) {
    j->start = j->multiplier * u->joints[j->master].start + j->offset;
    if (j->start != 0.0)
        kt_left_count(&u->followers, j->element);
    if (j->start < j->lower || j->start > j->upper)
        kt_left_count(&u->beyond, j->element);
}

/* Finds the joint that each joint follows, and the start of all of them. */
static void follow_urdf_joints(kt_urdf *u) {
    int *path = kt_reader_take(u->r, &u->r->scratch, (size_t)u->joint_count + 1, sizeof *path);
    if (path == NULL)
        return;
    for (int i = 0; i < u->joint_count; i++)
        read_mimic(u, &u->joints[i]);
    for (int i = 0; i < u->joint_count; i++) {
        int count = 0, at = i;
        for (; at >= 0 && !u->joints[at].is_placed; at = u->joints[at].master) {
            u->joints[at].is_placed = true;
            path[count++] = at;
        }
        for (int k = 0; k < count && at >= 0; k++) /* met on this path again: a circle, which has no master */
            if (path[k] == at) {
                (void)kt_robot_fault(u->r, kt_xml_child(u->joints[at].element, "mimic"),
                                     "joints follow each other in a circle; let one of them follow none");
                u->joints[path[count - 1]].master = -1;
            }
        while (count-- > 0) {
            kt_urdf_joint *j = &u->joints[path[count]];
            if (j->master >= 0)
                place_follower(u, j);
            else if (j->start != 0.0)
                kt_left_count(&u->starts, kt_xml_child(j->element, "limit"));
        }
    }
}

/* ---- all of them ------------------------------------------------------------------------------------------------- */

/* If no link declares the parent `world`, it becomes a link without inertia. links and names have room for it. */
static void declare_world(kt_urdf *u) {
    static const char *const attributes[] = {"name", "world", NULL};
    for (int i = 0; i < u->joint_count && kt_names_find(&u->names, LINKS, "world") < 0; i++) {
        const kt_element *parent = kt_xml_child(u->joints[i].element, "parent");
        const char *name = parent != NULL ? kt_xml_attribute(parent, "link") : NULL;
        if (name == NULL || strcmp(name, "world") != 0)
            continue;
        kt_element *e = kt_element_at(u->r, parent, "link", attributes);
        if (e == NULL)
            return;
        e->parent = (kt_element *)u->joints[i].element->parent;
        (void)kt_names_add(&u->names, LINKS, "world", u->link_count);
        u->links[u->link_count++] = (kt_urdf_link){.element = e, .carrier = -1, .index = -1, .mu = {-1.0, -1.0, -1.0}};
        kt_left_count(&u->undeclared, parent);
    }
}

/* Numbers the links and joints of <robot>, in the order of the file. */
bool kt_urdf_collect(kt_urdf *u) {
    for (const kt_element *e = u->robot->first; e != NULL; e = e->next) {
        u->link_count += strcmp(e->name, "link") == 0;
        u->joint_count += strcmp(e->name, "joint") == 0;
        kt_strange_search(&u->strange, &all_known, e);
    }
    const size_t links = (size_t)u->link_count, joints = (size_t)u->joint_count;
    u->links = kt_reader_take(u->r, &u->r->scratch, links + 2, sizeof *u->links);
    u->joints = kt_reader_take(u->r, &u->r->scratch, joints + 1, sizeof *u->joints);
    if (u->links == NULL || u->joints == NULL || !kt_robot_names(u->r, &u->names, links + joints + 1) ||
        !kt_namer_init(&u->namer, u->r, u->link_count + 1))
        return false;
    u->link_count = u->joint_count = 0;
    for (const kt_element *e = u->robot->first; e != NULL; e = e->next) {
        if (strcmp(e->name, "link") == 0) {
            u->links[u->link_count] =
                (kt_urdf_link){.element = e, .carrier = -1, .index = -1, .mu = {-1.0, -1.0, -1.0}};
            add_urdf_name(u, LINKS, e, u->link_count++);
        } else if (strcmp(e->name, "joint") == 0) {
            u->joints[u->joint_count] = (kt_urdf_joint){.element = e, .master = -1};
            add_urdf_name(u, JOINTS, e, u->joint_count++);
        }
    }
    declare_world(u);
    for (int i = 0; i < u->joint_count; i++)
        read_urdf_joint(u, i);
    kt_urdf_transmissions(u);
    follow_urdf_joints(u);
    return !u->r->out_of_memory;
}

/* The link that no joint carries; -1 after reporting that there is not one. */
int kt_urdf_root(kt_urdf *u) {
    int root = -1;
    for (int i = 0; i < u->link_count; i++) {
        if (u->links[i].carrier >= 0)
            continue;
        if (root < 0)
            root = i;
        else
            (void)kt_robot_fault(u->r, u->links[i].element,
                                 "no joint has this link as child, nor the one in line %u; only one can be the root",
                                 (unsigned)u->links[root].element->line);
    }
    if (root < 0)
        (void)kt_robot_fault(u->r, u->robot,
                             u->link_count == 0 ? "there is no link" : "no link is the root: each is a child");
    return root;
}

/* ---- names of bodies --------------------------------------------------------------------------------------------- */

/* A link's name as a body has it; "" of one without a name, which has been reported. */
static const char *make_urdf_name(kt_urdf *u, int index) {
    const char *link = kt_element_name(u->links[index].element, "");
    const char *name = *link != '\0' ? kt_namer_make(&u->namer, link) : "";
    if (strcmp(name, link) != 0)
        kt_left_count(&u->renamed, u->links[index].element);
    return name;
}

bool kt_urdf_is_world(const kt_urdf *u, int root) {
    const kt_element *e = root >= 0 ? u->links[root].element : NULL;
    const char *name = e != NULL ? kt_xml_attribute(e, "name") : NULL;
    return kt_text_is(name, "world") && kt_xml_child(e, "inertial") == NULL;
}

void kt_urdf_names(kt_urdf *u, int root) {
    for (int i = 0; i < u->link_count; i++)
        u->links[i].body = i == root && kt_urdf_is_world(u, root) ? NULL : make_urdf_name(u, i);
}
