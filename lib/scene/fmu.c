/* FMUs that a scene couples, a controller for example:
 *
 *     effects:
 *       - {name: controller, type: fmu, file: pd.fmu, step: 0.01, inputs: {angle: position.arm, rate: velocity.arm},
 *          outputs: {torque: arm}, parameters: {stiffness: 20}}
 *
 * The FMU itself belongs to the program that runs the scene. The reader makes an event of each FMU. It happens at the
 * multiples of the step, reads the inputs, and sets the outputs as an action `set` does (watch.c). An output is a
 * parameter or an auxiliary state of the scene, or a force in a joint. Such a force is made of an auxiliary state of
 * the rate 0 and an effect `expression`, both with the name FMU_VARIABLE.
 *
 * The items are taken out of `effects` before anything else is read (fmu_node.c), so that the list contains forces
 * alone.
 */
#include "scene/expand.h"

#include "base/copy.h"
#include "scene/csv.h"
#include "scene/event.h"
#include "scene/expression.h"
#include "scene/parameter.h"
#include "scene/part.h"

#include <stddef.h>
#include <stdio.h>
#include <string.h>

enum { FMU_COUNT_MAX = 100, NAME_MAX_LENGTH = 60 };
static const double points_most = 1e12; /* communication points in a run */

/* ---- outputs that act in joints ---------------------------------------------------------------------------------- */

/* The name of the state and of the effect of an output: FMU_VARIABLE, with _ for all that is no letter and no digit. */
static bool name_held(const kt_node *item, const char *variable, char name[NAME_MAX_LENGTH + 1]) {
    const kt_node *own = kt_node_find(item, "name");
    if (own == NULL || own->kind != KT_NODE_TEXT || !kt_name_is_valid(own->of.text))
        return false;
    const int length = snprintf(name, NAME_MAX_LENGTH + 1, "%s_%s", own->of.text, variable);
    for (char *at = name + strlen(own->of.text); *at != '\0'; at++)
        if (!((*at >= 'a' && *at <= 'z') || (*at >= 'A' && *at <= 'Z') || (*at >= '0' && *at <= '9')))
            *at = '_';
    return length <= NAME_MAX_LENGTH;
}

/* Whether an output is held by a parameter or a state of the file. */
static bool is_held(const kt_reader *r, const char *target) {
    return kt_section_has(r, "parameters", target) || kt_section_has(r, "states", target);
}

static void append_text(kt_reader *r, const char *section, const char *text, const kt_node *target) {
    const kt_replacement joint = {"__joint__", target, NULL};
    kt_node *items = kt_nodes_parse(r, text, strlen(text));
    if (items == NULL)
        return;
    kt_nodes_settle(items, target, &joint, 1);
    kt_nodes_append(r, section, items, target);
}

static void expand_output(kt_reader *r, const kt_node *item, const kt_node *key) {
    char name[NAME_MAX_LENGTH + 1];
    const kt_node *target = key->next;
    if (key->kind != KT_NODE_TEXT || target->kind != KT_NODE_TEXT || target->count == 0 ||
        is_held(r, target->of.text) || !name_held(item, key->of.text, name))
        return; /* with a fault, if any, of kt_fmus_read */
    char *text = kt_reader_take(r, &r->scratch, 1, 4 * NAME_MAX_LENGTH);
    char *effect = kt_reader_take(r, &r->scratch, 1, 4 * NAME_MAX_LENGTH);
    if (text == NULL || effect == NULL)
        return;
    (void)snprintf(text, 4 * NAME_MAX_LENGTH, "{%s: {rate: \"0\"}}", name);
    append_text(r, "states", text, target);
    (void)snprintf(effect, 4 * NAME_MAX_LENGTH, "- {name: %s, type: expression, joint: __joint__, force: \"%s\"}", name,
                   name);
    append_text(r, "effects", effect, target);
}

void kt_fmus_expand(kt_reader *r) {
    for (int i = 0; i < r->scene->fmu_count; i++)
        for (const kt_node *key = kt_fmu_first(r->scene->fmu_nodes[i], "outputs"); key != NULL; key = key->next->next)
            expand_output(r, r->scene->fmu_nodes[i], key);
}

/* ---- reading ----------------------------------------------------------------------------------------------------- */

/* The place of a node in messages; NULL: out of memory. */
static const char *where_of(kt_reader *r, const kt_node *node) {
    char where[KT_WHERE_SIZE];
    kt_reader_where(r, r->path, node->line, node->column, where);
    return kt_reader_text(r, &r->keep, where, strlen(where));
}

/* A mapping of variables of the FMU: the detail of a field whose offset is that of their number. */
typedef struct port_list {
    /* Reads the value of a variable into its port. */
    bool (*read)(kt_reader *r, const kt_scope *scope, kt_node *value, kt_scene_port *port);
    const char *expected;
    size_t ports; /* offset in kt_scene_fmu */
} port_list;

static bool read_ports(kt_reader *r, const kt_scope *scope, kt_node *map, const kt_field *field, void *object) {
    const port_list *list = field->detail;
    if (map->kind != KT_NODE_MAP)
        return kt_fault_expected(r, scope, map, list->expected);
    kt_scene_port *to = kt_pool_take(&r->keep, (size_t)map->count + 1, sizeof *to);
    if (to == NULL)
        return kt_reader_out_of_memory(r);
    int read_count = 0;
    for (kt_node *key = map->of.first; key != NULL; key = key->next->next) {
        if (key->kind != KT_NODE_TEXT || key->count == 0)
            return kt_fault_expected(r, scope, key, "the name of a variable of the FMU");
        const kt_scope here = {.outer = scope, .key = key->of.text};
        kt_scene_port *port = &to[read_count];
        port->variable = kt_pool_text(&r->keep, key->of.text, key->count);
        port->where = where_of(r, key);
        if (port->variable == NULL)
            return kt_reader_out_of_memory(r);
        for (int i = 0; i < read_count; i++)
            if (strcmp(to[i].variable, port->variable) == 0)
                return kt_fault_at(r, KT_ERROR_SCENE, scope, key, "%s is there already; remove one of them",
                                   kt_name_quote(port->variable).text);
        if (list->read(r, &here, key->next, port))
            read_count++;
    }
    memcpy((char *)object + list->ports, &to, sizeof to);
    memcpy(kt_field_in(object, field), &read_count, sizeof read_count);
    return !kt_node_is_faulty(map);
}

static void write_ports(kt_emitter *e, const kt_member *m) {
    const port_list *list = m->field->detail;
    const kt_scene_port *ports;
    const int *count = kt_member_value(m);
    memcpy(&ports, (const char *)m->object + list->ports, sizeof ports);
    kt_emit_map(e, true);
    for (int i = 0; i < *count; i++) {
        kt_emit_name(e, ports[i].variable);
        if (ports[i].text != NULL)
            kt_emit_text(e, ports[i].text);
        else
            kt_emit_number(e, ports[i].value);
    }
    kt_emit_end(e);
}

static bool read_input(kt_reader *r, const kt_scope *scope, kt_node *value, kt_scene_port *port) {
    return kt_event_value_read(r, scope, value, true, &port->text);
}

static bool read_parameter(kt_reader *r, const kt_scope *scope, kt_node *value, kt_scene_port *port) {
    return kt_put_number(r, scope, value, KT_QUANTITY_ANGLE, &port->value);
}

static bool read_output(kt_reader *r, const kt_scope *scope, kt_node *value, kt_scene_port *port) {
    if (!kt_read_name(r, scope, value, "a joint, or the name of a parameter or a state", &port->target))
        return false;
    port->text = is_held(r, port->target) ? port->target : NULL;
    return true;
}

static const port_list input_ports = {read_input, "inputs of the FMU and formulas ('{angle: position.arm}')",
                                      offsetof(kt_scene_fmu, inputs)},
                       output_ports = {read_output, "outputs of the FMU and their targets ('{torque: arm}')",
                                       offsetof(kt_scene_fmu, outputs)},
                       parameter_ports = {read_parameter, "parameters of the FMU and numbers ('{stiffness: 20}')",
                                          offsetof(kt_scene_fmu, parameters)};

static bool read_fmu_type(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    (void)r, (void)scope, (void)node, (void)field, (void)object;
    return true;
}

static void write_fmu_type(kt_emitter *e, const kt_member *m) {
    (void)m;
    kt_emit_word(e, "fmu");
}

static bool read_fmu_file(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    const char *file = NULL;
    if (!kt_read_text(r, scope, node, &file))
        return false;
    *(const char **)kt_field_in(object, field) = kt_path_near(r, file);
    return true;
}

static const kt_kind kind_type = {.read = read_fmu_type, .write = write_fmu_type};
static const kt_kind kind_file = {.read = read_fmu_file, .write = kt_text_write};
static const kt_kind kind_ports = {.read = read_ports, .write = write_ports, .size = sizeof(int)};

#define AT(member) .offset = offsetof(kt_scene_fmu, member)
static const kt_field fmu_fields[] = {
    {.key = "name", .kind = &kt_kind_name, AT(name), .flags = KT_FIELD_REQUIRED},
    {.key = "type", .kind = &kind_type, .flags = KT_FIELD_REQUIRED},
    {.key = "file", .kind = &kind_file, AT(file), .flags = KT_FIELD_REQUIRED},
    {.key = "step", .kind = &kt_kind_positive, AT(step), .flags = KT_FIELD_REQUIRED},
    {.key = "inputs", .kind = &kind_ports, AT(input_count), .detail = &input_ports},
    {.key = "outputs", .kind = &kind_ports, AT(output_count), .detail = &output_ports},
    {.key = "parameters", .kind = &kind_ports, AT(parameter_count), .detail = &parameter_ports},
};
static const kt_table fmu_table = {.fields = fmu_fields, .count = KT_COUNT_OF(fmu_fields), .flow = true};

/* ---- events ------------------------------------------------------------------------------------------------------ */

/* Reports a step that is lost in the rounding of times, or makes points without end. */
static bool check_fmu_step(kt_reader *r, const kt_scope *scope, kt_node *item, const kt_scene_fmu *fmu,
                           double duration) {
    const kt_scope here = {.outer = scope, .key = "step"};
    if (fmu->step * points_most >= duration)
        return true;
    return kt_fault_at(r, KT_ERROR_SCENE, &here, kt_node_find(item, "step"),
                       "%g s: divides the duration of %g s into more than %g parts; take a longer step", fmu->step,
                       duration, points_most);
}

/* The states that the outputs set, in their order. Two outputs cannot set one state. */
static bool list_sets(kt_reader *r, const kt_scope *scope, kt_node *item, kt_scene_fmu *fmu, kt_scene_event *event) {
    kt_scene_port *outputs = (kt_scene_port *)(uintptr_t)fmu->outputs; /* the scene's own */
    kt_scene_set *sets = kt_pool_take(&r->keep, (size_t)fmu->output_count + 1, sizeof *sets);
    kt_node *map = kt_node_find(item, "outputs");
    char name[NAME_MAX_LENGTH + 1];
    if (sets == NULL)
        return kt_reader_out_of_memory(r);
    for (int i = 0; i < fmu->output_count; i++) {
        if (outputs[i].text == NULL && !name_held(item, outputs[i].variable, name))
            return kt_fault_at(
                r, KT_ERROR_SCENE, scope, map,
                "the name of the FMU and that of its variable, '%.20s...', are longer than %d characters "
                "together; make the output a state of the scene",
                outputs[i].variable, (int)NAME_MAX_LENGTH - 1);
        if (outputs[i].text == NULL && (outputs[i].text = kt_pool_text(&r->keep, name, strlen(name))) == NULL)
            return kt_reader_out_of_memory(r);
        for (int k = 0; k < i; k++)
            if (strcmp(outputs[k].text, outputs[i].text) == 0)
                return kt_fault_at(r, KT_ERROR_SCENE, scope, map, "two outputs set %s; remove one of them",
                                   kt_name_quote(outputs[i].text).text);
        sets[i].name = outputs[i].text;
    }
    event->sets = fmu->output_count > 0 ? sets : NULL;
    event->set_count = fmu->output_count;
    return true;
}

/* An event at each multiple of the step. */
static bool make_event(kt_reader *r, const kt_scope *scope, kt_node *item, kt_scene_fmu *fmu, const kt_scene *scene,
                       kt_scene_event *event) {
    char when[64];
    (void)snprintf(when, sizeof when, "t >= %.17g", fmu->step);
    *event = (kt_scene_event){.name = fmu->name,
                              .when = kt_pool_text(&r->keep, when, strlen(when)),
                              .direction = KT_DIRECTION_RISING,
                              .fmu = fmu};
    if (event->when == NULL)
        return kt_reader_out_of_memory(r);
    for (int i = 0; i < scene->event_count; i++)
        if (scene->events[i].name != NULL && strcmp(scene->events[i].name, fmu->name) == 0)
            return kt_fault_at(r, KT_ERROR_SCENE, scope, kt_node_find(item, "name"),
                               "there is an event or an FMU of this name already; take another one");
    return list_sets(r, scope, item, fmu, event);
}

void kt_fmus_read(kt_reader *r, kt_scene *scene) {
    const int count = r->scene->fmu_count;
    if (count == 0 || r->out_of_memory)
        return;
    if (count > FMU_COUNT_MAX) {
        (void)kt_fault_at(r, KT_ERROR_SCENE, NULL, r->scene->fmu_nodes[FMU_COUNT_MAX],
                          "there are %d FMUs; a scene has at most %d", count, (int)FMU_COUNT_MAX);
        return;
    }
    kt_scene_fmu *fmus = kt_reader_take(r, &r->keep, (size_t)count, sizeof *fmus);
    kt_scene_event *events = kt_reader_take(r, &r->keep, (size_t)scene->event_count + (size_t)count, sizeof *events);
    if (fmus == NULL || events == NULL)
        return;
    kt_copy(events, scene->events, (size_t)scene->event_count * sizeof *events);
    scene->events = events;
    for (int i = 0; i < count && !r->out_of_memory; i++) {
        kt_node *item = r->scene->fmu_nodes[i];
        const kt_scope scope = kt_item_scope("effect", "effects", i, item);
        fmus[i].where = where_of(r, item);
        if (kt_table_read(r, &scope, item, &fmu_table, &fmus[i]) && !kt_node_is_faulty(item) &&
            check_fmu_step(r, &scope, item, &fmus[i], scene->run.duration) &&
            make_event(r, &scope, item, &fmus[i], scene, &events[scene->event_count]))
            scene->event_count++;
    }
    scene->fmus = fmus;
    scene->fmu_count = count;
}

/* ---- writing ----------------------------------------------------------------------------------------------------- */

static void write_effects(kt_emitter *e, const kt_member *m) {
    static const kt_scene_fmu rest = {.name = NULL};
    const kt_items *list = m->field->detail;
    const kt_scene *scene = m->object;
    kt_emit_list(e, list->flow);
    for (int i = 0; i < scene->description.effect_count; i++)
        list->write(e, &scene->description.effects[i], i);
    for (int i = 0; i < scene->fmu_count; i++)
        kt_table_write(e, &fmu_table, &scene->fmus[i], &rest);
    kt_emit_end(e);
}

static bool same_effects(const kt_member *m) {
    return ((const kt_scene *)m->object)->fmu_count == 0 && kt_items_same(m);
}

const kt_kind kt_kind_effects = {.read = kt_items_read, .write = write_effects, .same = same_effects};
