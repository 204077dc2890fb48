/* Reads the description of an FMU (description.h). */
#include "fmu/description.h"
#include "command.h"

#include "fmu/archive.h"

#include <ctype.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool is_true(const kt_element *element, const char *name) {
    const char *text = kt_xml_attribute(element, name);
    return text != NULL && (strcmp(text, "true") == 0 || strcmp(text, "1") == 0);
}

/* ---- variables --------------------------------------------------------------------------------------------------- */

static kt_fmi_type fmi_type_of(const char *name) {
    static const struct {
        const char *name;
        kt_fmi_type type;
    } types[] = {
#define TYPE(id, name, type) {#name, id},
        KT_FMI_TYPE_LIST(TYPE)
#undef TYPE
            {"Enumeration", KT_FMI_INT64},
        {"Real", KT_FMI_FLOAT64},
        {"Integer", KT_FMI_INT32}};
    for (size_t i = 0; i < sizeof types / sizeof types[0]; i++)
        if (strcmp(types[i].name, name) == 0)
            return types[i].type;
    return KT_FMI_OTHER;
}

/* The unit of a variable: its own, or that of its declared type. */
static const char *declared_unit_of(const kt_element *root, const kt_element *value) {
    const char *unit = kt_xml_attribute(value, "unit"), *declared = kt_xml_attribute(value, "declaredType");
    const kt_element *types = unit == NULL && declared != NULL ? kt_xml_child(root, "TypeDefinitions") : NULL;
    for (const kt_element *type = types != NULL ? types->first : NULL; type != NULL; type = type->next) {
        const char *name = kt_xml_attribute(type, "name");
        if (name == NULL || strcmp(name, declared) != 0)
            continue;
        return kt_xml_attribute(strcmp(type->name, "SimpleType") == 0 && type->first != NULL ? type->first : type,
                                "unit");
    }
    return unit;
}

/* The element with the type and the start of a variable: itself, or its only child in FMI 2.0. */
static const kt_element *typed_value_of(const kt_element *variable, int version) {
    const kt_element *value = variable->first;
    if (version == 3)
        return variable;
    while (value != NULL && fmi_type_of(value->name) == KT_FMI_OTHER && strcmp(value->name, "String") != 0)
        value = value->next;
    return value;
}

/* Reads a value reference, a whole number of 32 bits. */
static bool read_reference(const char *text, uint32_t *reference) {
    char *end;
    errno = 0;
    const unsigned long long number = strtoull(text, &end, 10);
    *reference = (uint32_t)number;
    return isdigit((unsigned char)*text) && *end == '\0' && errno == 0 && number <= UINT32_MAX;
}

static bool read_variable(const kt_element *root, const kt_element *element, int version, kt_fmi_variable *variable) {
    const kt_element *value = typed_value_of(element, version);
    const char *name = kt_xml_attribute(element, "name"), *reference = kt_xml_attribute(element, "valueReference");
    const char *causality = kt_xml_attribute(element, "causality"), *varies = kt_xml_attribute(element, "variability");
    uint32_t number = 0;
    if (value == NULL || name == NULL || reference == NULL)
        return false;
    const bool has_reference = read_reference(reference, &number);
    *variable = (kt_fmi_variable){.name = name,
                                  .type_name = value->name,
                                  .causality = causality != NULL ? causality : "local",
                                  .unit = declared_unit_of(root, value),
                                  .has_reference = has_reference,
                                  .reference = number,
                                  .type = fmi_type_of(value->name),
                                  .is_array = kt_xml_child(element, "Dimension") != NULL,
                                  .has_start = kt_xml_attribute(value, "start") != NULL,
                                  .is_constant = varies != NULL && strcmp(varies, "constant") == 0};
    if (version == 2 && variable->type == KT_FMI_INT64)
        variable->type = KT_FMI_INT32;
    return true;
}

static kt_status read_fmi_variables(const char *path, kt_fmi_description *d, kt_error *error) {
    const kt_element *list = kt_xml_child(d->root, "ModelVariables");
    size_t count = 0;
    for (const kt_element *one = list != NULL ? list->first : NULL; one != NULL; one = one->next)
        count++;
    kt_fmi_variable *variables = kt_pool_take(&d->reader.scratch, count + 1, sizeof *variables);
    if (variables == NULL)
        return kt_reject_memory(error);
    d->variables = variables;
    for (const kt_element *one = count > 0 ? list->first : NULL; one != NULL; one = one->next) {
        if (!read_variable(d->root, one, d->version, &variables[d->count]))
            continue;
        if (!variables[d->count].has_reference)
            return kt_error_set(error, KT_ERROR_SCENE, NULL,
                                "%.200s: the valueReference '%.40s' of its variable '%.60s' is no whole number of 32 "
                                "bits; export the FMU again",
                                path, kt_xml_attribute(one, "valueReference"), variables[d->count].name);
        d->count++;
    }
    return KT_OK;
}

const kt_fmi_variable *kt_fmi_variable_find(const kt_fmi_description *description, const char *name) {
    for (int i = 0; i < description->count; i++)
        if (strcmp(description->variables[i].name, name) == 0)
            return &description->variables[i];
    return NULL;
}

/* ---- units ------------------------------------------------------------------------------------------------------- */

bool kt_fmi_unit_find(const kt_fmi_description *description, const char *name, kt_fmi_unit *unit) {
    static const char *const names[] = {"kg", "m", "s", "A", "K", "mol", "cd", "rad"};
    const kt_element *list = kt_xml_child(description->root, "UnitDefinitions"), *base = NULL;
    for (const kt_element *one = list != NULL ? list->first : NULL; one != NULL; one = one->next) {
        const char *own = kt_xml_attribute(one, "name");
        if (own != NULL && strcmp(own, name) == 0)
            base = kt_xml_child(one, "BaseUnit");
    }
    if (base == NULL)
        return false;
    const char *factor = kt_xml_attribute(base, "factor"), *offset = kt_xml_attribute(base, "offset");
    *unit = (kt_fmi_unit){.factor = factor != NULL ? strtod(factor, NULL) : 1.0,
                          .offset = offset != NULL ? strtod(offset, NULL) : 0.0};
    for (int i = 0; i < 8; i++) {
        const char *exponent = kt_xml_attribute(base, names[i]);
        unit->exponent[i] = exponent != NULL ? (int)strtol(exponent, NULL, 10) : 0;
    }
    return true;
}

/* ---- the whole --------------------------------------------------------------------------------------------------- */

static kt_status read_root(const char *path, kt_fmi_description *d, kt_error *error) {
    const char *version = kt_xml_attribute(d->root, "fmiVersion");
    const kt_element *simulates = kt_xml_child(d->root, "CoSimulation");
    if (strcmp(d->root->name, "fmiModelDescription") != 0 || version == NULL)
        return kt_error_set(error, KT_ERROR_SCENE, NULL, "%.200s is no FMU: its modelDescription.xml has no fmiVersion",
                            path);
    d->version = strncmp(version, "2.", 2) == 0 ? 2 : strncmp(version, "3.", 2) == 0 ? 3 : 0;
    if (d->version == 0)
        return kt_error_set(error, KT_ERROR_UNSUPPORTED, NULL,
                            "%.200s is an FMU of FMI %.20s; export it with FMI 2.0 or 3.0", path, version);
    if (simulates == NULL)
        return kt_error_set(error, KT_ERROR_UNSUPPORTED, NULL,
                            "%.200s has no co-simulation%s; export it for co-simulation", path,
                            kt_xml_child(d->root, "ModelExchange") != NULL ? ", but model exchange alone" : "");
    d->name = kt_xml_attribute(d->root, "modelName");
    d->token = kt_xml_attribute(d->root, d->version == 2 ? "guid" : "instantiationToken");
    d->identifier = kt_xml_attribute(simulates, "modelIdentifier");
    if (d->identifier == NULL || d->token == NULL || strchr(d->identifier, '/') != NULL)
        return kt_error_set(error, KT_ERROR_SCENE, NULL,
                            "%.200s: its modelDescription.xml has no modelIdentifier, or no instantiationToken (guid)",
                            path);
    d->can_serialize = is_true(simulates, d->version == 2 ? "canSerializeFMUstate" : "canSerializeFMUState");
    return read_fmi_variables(path, d, error);
}

kt_status kt_fmi_description_read(const char *path, kt_fmi_description *description, kt_error *error) {
    char *text = NULL;
    size_t size = 0;
    kt_element *root = NULL;
    kt_xml_late late = {0};
    *description = (kt_fmi_description){.reader.path = "modelDescription.xml", .reader.effort = 50000000};
    kt_status status = kt_fmu_read_entry(path, "modelDescription.xml", &text, &size, error);
    if (status != KT_OK)
        return status;
    kt_reader *reader = &description->reader;
    if (!kt_xml_parse(reader, text, size, &root, &late))
        status = reader->fault_count > 0
                     ? kt_error_set(error, KT_ERROR_SCENE, NULL, "%.200s: modelDescription.xml:%u:%u: %s", path,
                                    (unsigned)reader->faults[0].line, (unsigned)reader->faults[0].column,
                                    reader->faults[0].message)
                     : kt_reject_memory(error);
    free(text);
    description->root = root;
    return status == KT_OK ? read_root(path, description, error) : status;
}

void kt_fmi_description_free(kt_fmi_description *description) {
    kt_pool_free(description->reader.scratch.chunks);
    kt_pool_free(description->reader.keep.chunks);
    *description = (kt_fmi_description){.version = 0};
}

void kt_fmi_binary_name(const kt_fmi_description *description, char *name, size_t size) {
    static const char platform[] = KT_FMU_PLATFORM;
    const char *folder = description->version == 3               ? platform
                         : strcmp(platform, "x86_64-linux") == 0 ? "linux64"
                         : strcmp(platform, "x86-linux") == 0    ? "linux32"
                                                                 : platform;
    (void)snprintf(name, size, "binaries/%s/%s.so", folder, description->identifier);
}
