/* Tries each part that a small library leaves out (lib/math/base/small.h), and prints a line for each:
 *
 *     PART: accepted              or
 *     PART: rejected: MESSAGE
 *
 * A full library accepts all of them; test/apps/firmware.py compares that with a small library on a Cortex-M7.
 */
#include <kinetree/kinetree.h>

#include <stdio.h>

/* A cart on a spring, and the additions of a case. */
typedef struct scene {
    kt_body body;
    kt_effect effects[2];
    kt_state state;
    kt_variable_mass variable;
    kt_description description;
    kt_run run;
} scene;

static const double rows[] = {0.0, 0.0, 1.0, 1.0, 2.0, 0.0};
static const double corners[] = {0.0, 0.0, 1.0, 0.0, 0.0, 1.0};

static int stone_place(const kt_instant *at, double *value, kt_error *error, void *user) {
    (void)error, (void)user;
    *value = at->q[0];
    return 0;
}

static void begin_scene(scene *s) {
    *s = (scene){.body = kt_body_default(),
                 .effects = {kt_effect_default(), kt_effect_default()},
                 .state = {.name = "x", .rate = "-x"},
                 .variable = {.mass = kt_function_constant(1.0)},
                 .description = kt_description_default(),
                 .run = kt_run_default()};
    s->body.name = s->effects[0].joint = s->effects[1].joint = "cart";
    s->body.joint.type = KT_JOINT_PRISMATIC;
    s->body.joint.position[0] = 0.25;
    s->body.mass = 1.0;
    s->effects[0].type = KT_EFFECT_JOINT_SPRING;
    s->effects[0].stiffness = 1.0;
    s->effects[1].type = KT_EFFECT_MOTOR;
    s->effects[1].torque = kt_function_constant(1.0);
    s->description.bodies = &s->body;
    s->description.body_count = 1;
    s->description.effects = s->effects;
    s->description.effect_count = 2;
    s->run.duration = 0.01;
}

static void add_nothing(scene *s) { (void)s; }
static void add_bump(scene *s) { s->effects[1].torque = kt_function_bump(1.0, 0.0, 1.0); }
static void add_formula(scene *s) { s->effects[1].torque = kt_function_expression("sin(t)"); }

static void add_slopes(scene *s) {
    s->effects[1].torque = kt_function_table(rows, 6, KT_INTERPOLATION_CUBIC);
    s->effects[1].torque.has_slopes = true;
}

static void add_scene_state(scene *s) {
    s->description.states = &s->state;
    s->description.state_count = 1;
}

static void add_polygon(scene *s) {
    s->body.shape = kt_shape_default();
    s->body.shape.type = KT_SHAPE_POLYGON;
    s->body.shape.points = corners;
    s->body.shape.point_count = 3;
    s->body.shape.length = 0.1;
    s->body.inertia_of_shape = s->body.com_of_shape = true;
}

static void add_scene_switch(scene *s) { s->effects[1].switching = KT_SWITCHED_OFF; }

static void add_hard_stop(scene *s) {
    s->effects[1].type = KT_EFFECT_JOINT_LIMIT;
    s->effects[1].lower = -0.5;
    s->effects[1].restitution = 0.5;
}

static void add_sticking(scene *s) {
    s->effects[1].type = KT_EFFECT_JOINT_FRICTION;
    s->effects[1].coulomb = 0.1;
    s->effects[1].stick = true;
}

static void add_variable_mass(scene *s) { s->body.variable_mass = &s->variable; }
static void add_implicit_method(scene *s) { s->run.integrator = "radau5"; }

static kt_status advance_scene(scene *s, int events, kt_error *error) {
    static const kt_event event = {.name = "middle", .function = stone_place};
    kt_simulation_options options = kt_simulation_options_default();
    kt_model *model = NULL;
    kt_simulation *simulation = NULL;
    options.events = events;
    kt_status status = kt_model_compile(&s->description, NULL, &model, error);
    if (status == KT_OK)
        status = kt_simulation_create(model, &s->run, &options, &simulation, error);
    if (status == KT_OK && events > 0)
        status = kt_simulation_event_add(simulation, &event, error);
    if (status == KT_OK)
        status = kt_simulation_advance(simulation, s->run.duration, error);
    kt_simulation_free(simulation);
    kt_model_free(model);
    return status;
}

int main(void) {
    static const struct {
        const char *name;
        void (*add)(scene *);
        int events;
    } parts[] = {{"nothing", add_nothing, 0},
                 {"bump", add_bump, 0},
                 {"formula", add_formula, 0},
                 {"slopes of a table", add_slopes, 0},
                 {"auxiliary state", add_scene_state, 0},
                 {"polygon", add_polygon, 0},
                 {"switch", add_scene_switch, 0},
                 {"hard stop", add_hard_stop, 0},
                 {"friction that sticks", add_sticking, 0},
                 {"variable mass", add_variable_mass, 0},
                 {"implicit method", add_implicit_method, 0},
                 {"event", add_nothing, 1}};
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
        scene s;
        kt_error error = {0};
        begin_scene(&s);
        parts[i].add(&s);
        const kt_status status = advance_scene(&s, parts[i].events, &error);
        printf("%s: %s%s\n", parts[i].name, status == KT_OK ? "accepted" : "rejected: ", error.message);
    }
    return 0;
}
