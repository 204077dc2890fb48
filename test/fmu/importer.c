/* A small importer of FMUs of FMI 3.0, which loads a binary and writes values of its variables.
 *
 *     importer BINARY RESOURCES TOKEN MODE STEP COUNT STATES [REFERENCE[=VALUE]...]
 *
 * MODE is one of
 *     cs         co-simulation
 *     two        co-simulation while another instance takes half steps
 *     serial     co-simulation; another instance continues from the serialised state at half time
 *     save=FILE  co-simulation to half time, and the serialised state to a file
 *     load=FILE  co-simulation from the state of a file, at half time, to the end
 *     me         model exchange with the classical method of fourth order
 * A reference with a value is set before the initialization. The others are written after each step with 17 digits. The
 * last line counts allocations of all steps.
 */
#include "interpose.h"

#include <dlfcn.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 256 };

typedef void log_message(void *, int, const char *, const char *);

/* The functions of the standard that are called here. */
#define FUNCTIONS(X)                                                                                                   \
    X(void *, InstantiateCoSimulation,                                                                                 \
      (const char *, const char *, const char *, bool, bool, bool, bool, const uint32_t *, size_t, void *,             \
       log_message *, void *))                                                                                         \
    X(void *, InstantiateModelExchange, (const char *, const char *, const char *, bool, bool, void *, log_message *)) \
    X(void, FreeInstance, (void *))                                                                                    \
    X(int, EnterInitializationMode, (void *, bool, double, double, bool, double))                                      \
    X(int, ExitInitializationMode, (void *))                                                                           \
    X(int, EnterContinuousTimeMode, (void *))                                                                          \
    X(int, EnterEventMode, (void *))                                                                                   \
    X(int, Terminate, (void *))                                                                                        \
    X(int, GetFloat64, (void *, const uint32_t *, size_t, double *, size_t))                                           \
    X(int, SetFloat64, (void *, const uint32_t *, size_t, const double *, size_t))                                     \
    X(int, DoStep, (void *, double, double, bool, bool *, bool *, bool *, double *))                                   \
    X(int, GetFMUState, (void *, void **))                                                                             \
    X(int, SetFMUState, (void *, void *))                                                                              \
    X(int, FreeFMUState, (void *, void **))                                                                            \
    X(int, SerializedFMUStateSize, (void *, void *, size_t *))                                                         \
    X(int, SerializeFMUState, (void *, void *, uint8_t *, size_t))                                                     \
    X(int, DeserializeFMUState, (void *, const uint8_t *, size_t, void **))                                            \
    X(int, SetTime, (void *, double))                                                                                  \
    X(int, SetContinuousStates, (void *, const double *, size_t))                                                      \
    X(int, GetContinuousStates, (void *, double *, size_t))                                                            \
    X(int, GetContinuousStateDerivatives, (void *, double *, size_t))                                                  \
    X(int, CompletedIntegratorStep, (void *, bool, bool *, bool *))                                                    \
    X(int, UpdateDiscreteStates, (void *, bool *, bool *, bool *, bool *, bool *, double *))

#define DECLARE(type, name, arguments) static type(*fmi_##name) arguments;
FUNCTIONS(DECLARE)

/* The arguments of the program. */
typedef struct request {
    const char *resources, *token, *mode;
    double step;
    int count;
    size_t states, shown, given;
    uint32_t show[MOST], give[MOST];
    double value[MOST];
} request;

static void print_message(void *environment, int status, const char *category, const char *message) {
    (void)environment;
    fprintf(stderr, "%d %s: %s\n", status, category, message);
}

static void require(bool holds, const char *what) {
    if (holds)
        return;
    fprintf(stderr, "importer: %s\n", what);
    exit(1);
}

static void load_functions(const char *binary) {
    void *library = dlopen(binary, RTLD_NOW | RTLD_LOCAL);
    if (library == NULL)
        fprintf(stderr, "%s\n", dlerror());
    require(library != NULL, "the binary cannot be loaded");
#define LOAD(type, name, arguments)                                                                                    \
    *(void **)&fmi_##name = dlsym(library, "fmi3" #name);                                                              \
    require(fmi_##name != NULL, "the binary has no fmi3" #name);
    FUNCTIONS(LOAD)
}

static void *start(const request *r, bool exchange) {
    void *instance =
        exchange ? fmi_InstantiateModelExchange("one", r->token, r->resources, false, false, NULL, print_message)
                 : fmi_InstantiateCoSimulation("one", r->token, r->resources, false, false, false, false, NULL, 0, NULL,
                                               print_message, NULL);
    require(instance != NULL, "no instance");
    require(fmi_SetFloat64(instance, r->give, r->given, r->value, r->given) == 0, "a value cannot be set");
    require(fmi_EnterInitializationMode(instance, false, 0.0, 0.0, true, r->step * r->count) == 0, "initialization");
    require(fmi_ExitInitializationMode(instance) == 0, "end of initialization");
    return instance;
}

static void show(const request *r, void *instance) {
    double values[MOST];
    require(fmi_GetFloat64(instance, r->show, r->shown, values, r->shown) == 0, "a value cannot be read");
    for (size_t i = 0; i < r->shown; i++)
        printf("%.17g%c", values[i], i + 1 < r->shown ? ',' : '\n');
}

/* ---- co-simulation ----------------------------------------------------------------------------------------------- */

/* A serialised state. */
typedef struct block {
    uint8_t *bytes;
    size_t size;
} block;

static block serialise(void *instance) {
    void *state = NULL;
    block b;
    require(fmi_GetFMUState(instance, &state) == 0 && fmi_SerializedFMUStateSize(instance, state, &b.size) == 0,
            "state");
    b.bytes = malloc(b.size);
    require(b.bytes != NULL && fmi_SerializeFMUState(instance, state, b.bytes, b.size) == 0, "serialised state");
    require(fmi_FreeFMUState(instance, &state) == 0 && state == NULL, "release of a state");
    return b;
}

static void restore(void *instance, block b) {
    void *state = NULL;
    require(fmi_DeserializeFMUState(instance, b.bytes, b.size, &state) == 0, "deserialised state");
    require(fmi_SetFMUState(instance, state) == 0 && fmi_FreeFMUState(instance, &state) == 0, "restored state");
}

/* Goes on in a new instance from the serialised state. */
static void *pass_on(const request *r, void *instance) {
    void *other = NULL;
    const block b = serialise(instance);
    fmi_FreeInstance(instance);
    instance = start(r, false);
    restore(instance, b);
    /* A block that is damaged is rejected, and the instance goes on. */
    b.bytes[0] ^= 1;
    require(fmi_DeserializeFMUState(instance, b.bytes, b.size, &other) == 0, "damaged state");
    require(fmi_SetFMUState(instance, other) != 0, "a damaged state is accepted");
    require(fmi_FreeFMUState(instance, &other) == 0, "release of a damaged state");
    free(b.bytes);
    return instance;
}

static void save(void *instance, const char *name) {
    FILE *file = fopen(name, "wb");
    const block b = serialise(instance);
    require(file != NULL && fwrite(b.bytes, 1, b.size, file) == b.size && fclose(file) == 0, "a state cannot be saved");
    free(b.bytes);
}

static void load(void *instance, const char *name) {
    FILE *file = fopen(name, "rb");
    block b = serialise(instance); /* has the size */
    require(file != NULL && fread(b.bytes, 1, b.size, file) == b.size && fgetc(file) == EOF, "a state cannot be read");
    fclose(file);
    restore(instance, b);
    free(b.bytes);
}

/* Returns the file of a mode, NULL if it is another mode. */
static const char *file_of(const request *r, const char *mode) {
    return strncmp(r->mode, mode, strlen(mode)) == 0 ? r->mode + strlen(mode) : NULL;
}

static void simulate(const request *r) {
    const char *saved = file_of(r, "save="), *loaded = file_of(r, "load=");
    void *instance = start(r, false), *second = strcmp(r->mode, "two") == 0 ? start(r, false) : NULL;
    long allocations = 0;
    bool event, end = false, early;
    double last;
    if (loaded != NULL)
        load(instance, loaded);
    else
        show(r, instance);
    for (int k = loaded != NULL ? r->count / 2 : 0; k < (saved != NULL ? r->count / 2 : r->count) && !end; k++) {
        if (strcmp(r->mode, "serial") == 0 && k == r->count / 2)
            instance = pass_on(r, instance);
        if (second != NULL)
            require(fmi_DoStep(second, 0.5 * k * r->step, 0.5 * r->step, true, &event, &end, &early, &last) == 0,
                    "a step of the second instance fails");
        kt_interpose_start();
        const int status = fmi_DoStep(instance, k * r->step, r->step, true, &event, &end, &early, &last);
        allocations += kt_interpose_stop();
        require(status == 0, "a step fails");
        show(r, instance);
    }
    if (saved != NULL)
        save(instance, saved);
    fmi_Terminate(instance);
    fmi_FreeInstance(instance);
    if (second != NULL)
        fmi_FreeInstance(second);
    printf("allocations %ld\n", allocations);
}

/* ---- model exchange ---------------------------------------------------------------------------------------------- */

static void slope_at(const request *r, void *instance, double t, const double *y, double *slope) {
    require(fmi_SetTime(instance, t) == 0 && fmi_SetContinuousStates(instance, y, r->states) == 0 &&
                fmi_GetContinuousStateDerivatives(instance, slope, r->states) == 0,
            "a derivative fails");
}

/* One step of the classical method. */
static void step_rk4(const request *r, void *instance, double t, double *y) {
    static const double node[] = {0.0, 0.5, 0.5, 1.0}, weight[] = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0};
    double stage[MOST], slope[MOST] = {0.0}, sum[MOST] = {0.0};
    for (int k = 0; k < 4; k++) {
        for (size_t i = 0; i < r->states; i++)
            stage[i] = y[i] + node[k] * r->step * slope[i];
        slope_at(r, instance, t + node[k] * r->step, stage, slope);
        for (size_t i = 0; i < r->states; i++)
            sum[i] += weight[k] * slope[i];
    }
    for (size_t i = 0; i < r->states; i++)
        y[i] += r->step * sum[i];
}

static void handle_event(const request *r, void *instance, double *y) {
    bool need, end, nominals, moved = false, has_next;
    double next;
    require(fmi_EnterEventMode(instance) == 0 &&
                fmi_UpdateDiscreteStates(instance, &need, &end, &nominals, &moved, &has_next, &next) == 0 &&
                fmi_EnterContinuousTimeMode(instance) == 0,
            "event mode");
    if (moved)
        require(fmi_GetContinuousStates(instance, y, r->states) == 0, "states after an event");
}

static void integrate(const request *r) {
    void *instance = start(r, true);
    double y[MOST], slope[MOST];
    bool need, end, nominals, moved, has_next, event;
    double next;
    require(fmi_UpdateDiscreteStates(instance, &need, &end, &nominals, &moved, &has_next, &next) == 0 &&
                fmi_EnterContinuousTimeMode(instance) == 0 && fmi_GetContinuousStates(instance, y, r->states) == 0,
            "start of model exchange");
    show(r, instance);
    long allocations = 0;
    for (int k = 0; k < r->count; k++) {
        kt_interpose_start();
        step_rk4(r, instance, k * r->step, y);
        slope_at(r, instance, (k + 1) * r->step, y, slope);
        require(fmi_CompletedIntegratorStep(instance, true, &event, &end) == 0, "completed step");
        if (event)
            handle_event(r, instance, y);
        allocations += kt_interpose_stop();
        show(r, instance);
    }
    fmi_Terminate(instance);
    fmi_FreeInstance(instance);
    printf("allocations %ld\n", allocations);
}

int main(int argc, char **argv) {
    require(argc > 7, "arguments");
    request r = {.resources = argv[2], .token = argv[3], .mode = argv[4], .step = strtod(argv[5], NULL)};
    r.count = (int)strtol(argv[6], NULL, 10);
    r.states = strtoul(argv[7], NULL, 10);
    require(r.states <= MOST && argc - 8 <= MOST, "too many numbers");
    for (int i = 8; i < argc; i++) {
        char *end;
        const uint32_t reference = (uint32_t)strtoul(argv[i], &end, 10);
        if (*end == '=') {
            r.give[r.given] = reference;
            r.value[r.given++] = strtod(end + 1, NULL);
        } else {
            r.show[r.shown++] = reference;
        }
    }
    load_functions(argv[1]);
    if (strcmp(r.mode, "me") == 0)
        integrate(&r);
    else
        simulate(&r);
    return 0;
}
