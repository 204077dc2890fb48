/* A small importer of FMUs of FMI 3.0, which loads a binary and writes values of its variables.
 *
 *     importer BINARY RESOURCES TOKEN MODE STEP COUNT STATES [REFERENCE[=VALUE]...]
 *
 * MODE is one of
 *     cs         co-simulation
 *     early      co-simulation with event mode and early returns; intermediate updates read the references. The line
 *                "early" has the numbers of early returns and of updates
 *     start=T    co-simulation that starts at T, s
 *     two        co-simulation while another instance takes half steps
 *     serial     co-simulation; another instance continues from the serialised state at half time
 *     save=FILE  co-simulation to half time, and the serialised state to a file
 *     load=FILE  co-simulation from the state of a file, at half time, to the end
 *     gain       co-simulation; at the end the derivatives of the references by the sum of those with a value
 *     me         model exchange with the classical method of fourth order. Lines "next T" have the times of events that
 *                the FMU announces
 *     slopes=STATE,RATE
 *                model exchange; after each step derivatives along a random direction are compared with
 *                differences. The numbers are the references of the first state and of its derivative
 * A reference with a value is set before the initialization. The others are written after each step with 17 digits. The
 * last line counts allocations of all steps.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "interpose.h"

#include <dlfcn.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 256 };

typedef void log_message(void *, int, const char *, const char *);
typedef void update_call(void *, double, bool, bool, bool, bool, bool *, double *);

/* The functions of the standard that are called here. */
#define FUNCTIONS(X)                                                                                                   \
    X(void *, InstantiateCoSimulation,                                                                                 \
      (const char *, const char *, const char *, bool, bool, bool, bool, const uint32_t *, size_t, void *,             \
       log_message *, update_call *))                                                                                  \
    X(void *, InstantiateModelExchange, (const char *, const char *, const char *, bool, bool, void *, log_message *)) \
    X(void, FreeInstance, (void *))                                                                                    \
    X(int, EnterInitializationMode, (void *, bool, double, double, bool, double))                                      \
    X(int, ExitInitializationMode, (void *))                                                                           \
    X(int, EnterContinuousTimeMode, (void *))                                                                          \
    X(int, EnterEventMode, (void *))                                                                                   \
    X(int, EnterStepMode, (void *))                                                                                    \
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
    X(int, GetDirectionalDerivative,                                                                                   \
      (void *, const uint32_t *, size_t, const uint32_t *, size_t, const double *, size_t, double *, size_t))          \
    X(int, GetAdjointDerivative,                                                                                       \
      (void *, const uint32_t *, size_t, const uint32_t *, size_t, const double *, size_t, double *, size_t))          \
    X(int, CompletedIntegratorStep, (void *, bool, bool *, bool *))                                                    \
    X(int, UpdateDiscreteStates, (void *, bool *, bool *, bool *, bool *, bool *, double *))

#define DECLARE(type, name, arguments) static type(*fmi_##name) arguments;
FUNCTIONS(DECLARE)

/* The arguments of the program. */
typedef struct request {
    const char *resources, *token, *mode;
    double step, start; /* s */
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

/* The environment of an instance with intermediate updates. */
typedef struct updates {
    const request *r;
    void *instance;
    double last; /* s */
    int count, early;
} updates;

static updates within; /* a step of the mode `early` */

static void read_within(void *environment, double time, bool set, bool get, bool finished, bool may_return,
                        bool *returns, double *at) {
    double values[MOST];
    (void)environment;
    *returns = false; /* then the time has no meaning */
    *at = -1.0;
    require(!set && get && finished && may_return && time >= within.last, "arguments of an update");
    require(fmi_GetFloat64(within.instance, within.r->show, within.r->shown, values, within.r->shown) == 0,
            "a value cannot be read in an update");
    require(within.r->shown == 0 || within.r->show[0] != 0 || values[0] == time, "the time of an update");
    within.last = time;
    within.count++;
}

/* Lets events take effect in co-simulation. Returns whether the run is over. */
static bool update_events(void *instance) {
    bool need = true, end = false, nominals, moved, has_next;
    double next;
    while (need && !end)
        require(fmi_UpdateDiscreteStates(instance, &need, &end, &nominals, &moved, &has_next, &next) == 0 && !has_next,
                "events of co-simulation");
    require(end || fmi_EnterStepMode(instance) == 0, "the end of event mode");
    return end;
}

static bool is_early(const request *r) { return strcmp(r->mode, "early") == 0; }

static void *start(const request *r, bool exchange) {
    void *instance =
        exchange ? fmi_InstantiateModelExchange("one", r->token, r->resources, false, false, NULL, print_message)
                 : fmi_InstantiateCoSimulation("one", r->token, r->resources, false, false, is_early(r), is_early(r),
                                               NULL, 0, NULL, print_message, is_early(r) ? read_within : NULL);
    require(instance != NULL, "no instance");
    require(fmi_SetFloat64(instance, r->give, r->given, r->value, r->given) == 0, "a value cannot be set");
    require(fmi_EnterInitializationMode(instance, false, 0.0, r->start, true, r->start + r->step * r->count) == 0,
            "initialization");
    require(fmi_ExitInitializationMode(instance) == 0, "end of initialization");
    if (!exchange && is_early(r)) {
        within = (updates){.r = r, .instance = instance};
        update_events(instance);
    }
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

static void show_gain(const request *r, void *instance) {
    double seed[MOST], gain[MOST];
    for (size_t i = 0; i < r->given; i++)
        seed[i] = 1.0;
    require(fmi_GetDirectionalDerivative(instance, r->show, r->shown, r->give, r->given, seed, r->given, gain,
                                         r->shown) == 0,
            "a directional derivative fails");
    for (size_t i = 0; i < r->shown; i++)
        printf("%.17g%c", gain[i], i + 1 < r->shown ? ',' : '\n');
}

/* Takes step k, in parts if the instance returns early. Returns the status. */
static int step_to(const request *r, void *instance, int k, bool *end) {
    bool event, early;
    double from = r->start + k * r->step, step = r->step;
    int status;
    do {
        status = fmi_DoStep(instance, from, step, true, &event, end, &early, &from);
        step = r->start + (k + 1) * r->step - from;
        require(is_early(r) || !(event || early), "an event or an early return that is not allowed");
        within.early += early;
        if (status == 0 && event)
            *end = fmi_EnterEventMode(instance) != 0 || update_events(instance);
    } while (status == 0 && early && !*end);
    return status;
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
        const int status = step_to(r, instance, k, &end);
        allocations += kt_interpose_stop();
        require(status == 0, "a step fails");
        show(r, instance);
    }
    if (saved != NULL)
        save(instance, saved);
    if (strcmp(r->mode, "gain") == 0)
        show_gain(r, instance);
    fmi_Terminate(instance);
    fmi_FreeInstance(instance);
    if (second != NULL)
        fmi_FreeInstance(second);
    if (is_early(r))
        printf("early %d, updates %d\n", within.early, within.count);
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

/* Leaves event mode. Returns the time of the next event. */
static double update_states(void *instance, bool *moved) {
    bool need, end, nominals, has_next;
    double next;
    require(fmi_UpdateDiscreteStates(instance, &need, &end, &nominals, moved, &has_next, &next) == 0 &&
                fmi_EnterContinuousTimeMode(instance) == 0,
            "event mode");
    return has_next ? next : HUGE_VAL;
}

static double handle_event(const request *r, void *instance, double *y) {
    bool moved = false;
    require(fmi_EnterEventMode(instance) == 0, "start of event mode");
    const double next = update_states(instance, &moved);
    if (moved)
        require(fmi_GetContinuousStates(instance, y, r->states) == 0, "states after an event");
    return next;
}

/* ---- derivatives ------------------------------------------------------------------------------------------------- */

/* The unknowns (rates, then outputs) and the knowns (states, then inputs) of derivatives, at one state. */
typedef struct point {
    uint32_t unknown[2 * MOST], known[2 * MOST];
    size_t unknowns, knowns;
    double y[MOST];
} point;

/* Returns a number between -1 and 1 (Knuth's MMIX generator). */
static double any_number(void) {
    static uint64_t state = 1;
    state = state * 6364136223846793005u + 1442695040888963407u;
    return 2.0 * (double)(state >> 11) / 9007199254740992.0 - 1.0;
}

/* Adds weight f(y + distance dy, u + distance du) to `sum`. */
static void add_sample(const request *r, void *instance, const point *p, double distance, double weight,
                       const double *seed, double *sum) {
    double y[MOST], u[MOST], f[2 * MOST];
    for (size_t i = 0; i < r->states; i++)
        y[i] = p->y[i] + distance * seed[i];
    for (size_t i = 0; i < r->given; i++)
        u[i] = r->value[i] + distance * seed[r->states + i];
    require(fmi_SetContinuousStates(instance, y, r->states) == 0 &&
                fmi_SetFloat64(instance, r->give, r->given, u, r->given) == 0 &&
                fmi_GetFloat64(instance, p->unknown, p->unknowns, f, p->unknowns) == 0,
            "a sample fails");
    for (size_t i = 0; i < p->unknowns; i++)
        sum[i] += weight * f[i];
}

/* Computes central differences of order six. */
static void difference(const request *r, void *instance, const point *p, const double *seed, double *result) {
    static const double h = 5e-4, weight[] = {3.0 / 4.0, -3.0 / 20.0, 1.0 / 60.0};
    memset(result, 0, p->unknowns * sizeof *result);
    for (int k = 1; k <= 3; k++) {
        add_sample(r, instance, p, k * h, weight[k - 1] / h, seed, result);
        add_sample(r, instance, p, -k * h, -weight[k - 1] / h, seed, result);
    }
    require(fmi_SetContinuousStates(instance, p->y, r->states) == 0 &&
                fmi_SetFloat64(instance, r->give, r->given, r->value, r->given) == 0,
            "the state cannot be set");
}

static double dot(const double *a, const double *b, size_t count) {
    double sum = 0.0;
    for (size_t i = 0; i < count; i++)
        sum += a[i] * b[i];
    return sum;
}

/* Returns the largest difference, over the largest number of b or 1; NaN if any number is NaN. */
static double distance_of(const double *a, const double *b, size_t count) {
    double size = 1.0, worst = 0.0;
    for (size_t i = 0; i < count; i++)
        size = fmax(size, fabs(b[i]));
    for (size_t i = 0; i < count; i++)
        worst = fabs(a[i] - b[i]) <= worst * size ? worst : fabs(a[i] - b[i]) / size;
    return worst;
}

/* Raises a maximum that keeps a NaN. */
static void raise_to(double *most, double value) { *most = value <= *most || isnan(*most) ? *most : value; }

/* Compares derivatives at a state. worst: of rates, of outputs, and of <b, J s> - <J' b, s>. */
static void check_slopes(const request *r, void *instance, const point *p, double worst[3]) {
    double seed[2 * MOST], ours[2 * MOST], theirs[2 * MOST], back[2 * MOST], sum[2 * MOST];
    for (size_t i = 0; i < p->knowns; i++)
        seed[i] = any_number();
    for (size_t i = 0; i < p->unknowns; i++)
        back[i] = any_number();
    difference(r, instance, p, seed, theirs);
    require(fmi_GetDirectionalDerivative(instance, p->unknown, p->unknowns, p->known, p->knowns, seed, p->knowns, ours,
                                         p->unknowns) == 0,
            "a directional derivative fails");
    require(fmi_GetAdjointDerivative(instance, p->unknown, p->unknowns, p->known, p->knowns, back, p->unknowns, sum,
                                     p->knowns) == 0,
            "an adjoint derivative fails");
    const double forward = dot(back, ours, p->unknowns), size = sqrt(dot(sum, sum, p->knowns));
    raise_to(&worst[0], distance_of(ours, theirs, r->states));
    raise_to(&worst[1], distance_of(ours + r->states, theirs + r->states, r->shown));
    raise_to(&worst[2], fabs(forward - dot(sum, seed, p->knowns)) / fmax(1.0, size));
}

static void integrate(const request *r) {
    const char *first = file_of(r, "slopes=");
    point p = {.unknowns = 0};
    double worst[3] = {0.0, 0.0, 0.0};
    for (size_t i = 0; i < r->states && first != NULL; i++) {
        char *second;
        p.known[p.knowns++] = (uint32_t)(strtoul(first, &second, 10) + i);
        p.unknown[p.unknowns++] = (uint32_t)(strtoul(second + 1, NULL, 10) + i);
    }
    for (size_t i = 0; i < r->given; i++)
        p.known[p.knowns++] = r->give[i];
    for (size_t i = 0; i < r->shown; i++)
        p.unknown[p.unknowns++] = r->show[i];
    void *instance = start(r, true);
    double slope[MOST], *y = p.y;
    bool moved, end, event;
    double next = update_states(instance, &moved), announced[MOST] = {next};
    int announcements = 1;
    require(fmi_GetContinuousStates(instance, y, r->states) == 0, "start of model exchange");
    if (first == NULL)
        show(r, instance);
    long allocations = 0;
    for (int k = 0; k < r->count; k++) {
        kt_interpose_start();
        step_rk4(r, instance, k * r->step, y);
        slope_at(r, instance, (k + 1) * r->step, y, slope);
        require(fmi_CompletedIntegratorStep(instance, true, &event, &end) == 0, "completed step");
        if (event || (k + 1.0) * r->step >= next) {
            const double later = handle_event(r, instance, y);
            if (later > next && announcements < MOST)
                announced[announcements++] = later;
            next = later;
        }
        allocations += kt_interpose_stop();
        if (first == NULL)
            show(r, instance);
        else
            check_slopes(r, instance, &p, worst);
    }
    fmi_Terminate(instance);
    fmi_FreeInstance(instance);
    for (int k = 0; k < announcements && first == NULL && announced[k] < HUGE_VAL; k++)
        printf("next %.17g\n", announced[k]);
    if (first != NULL)
        printf("slopes %.17g,%.17g,%.17g\n", worst[0], worst[1], worst[2]);
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
    if (file_of(&r, "start=") != NULL)
        r.start = strtod(file_of(&r, "start="), NULL);
    load_functions(argv[1]);
    if (strcmp(r.mode, "me") == 0 || file_of(&r, "slopes=") != NULL)
        integrate(&r);
    else
        simulate(&r);
    return 0;
}
