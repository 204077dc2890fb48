/* A small FMU for tests of the import: FMI 3.0, or 2.0 with -DVERSION=2.
 *
 *     torque = -stiffness angle - damping rate    at once (feedthrough); 0 if `off`
 *     delayed: torque at the end of the last step; integral: of angle, by Euler's method; count: of steps
 *     last: the count at which the FMU ends the simulation; fails: the count at which a step fails,
 *     or with the sign - the count at which a step of FMI 3.0 returns early, which its importer does not allow
 *
 * The functions that a version has besides these are left out, as the standard permits for types without a variable.
 */
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ANGLE, RATE, STIFFNESS, DAMPING, TORQUE, DELAYED, INTEGRAL, REALS };
enum { COUNT, LAST, FAILS, WHOLES };

typedef struct guest {
    double real[REALS];
    int32_t whole[WHOLES];
    bool off, has_failed;
    void (*log)(void);
    void *environment;
    const char *name;
} guest;

static double torque_of(const guest *g) {
    return g->off ? 0.0 : -g->real[STIFFNESS] * g->real[ANGLE] - g->real[DAMPING] * g->real[RATE];
}

static guest *create(void) {
    guest *g = calloc(1, sizeof *g);
    if (g != NULL)
        g->real[STIFFNESS] = 1.0;
    return g;
}

enum { OK = 0, DISCARD = 2, ERROR = 3 };

static bool is_near(double a, double b) { return a - b < 1e-9 && b - a < 1e-9; }

/* Returns whether the step fails; *ends: the simulation ends. */
static bool advance(guest *g, double t, double h, bool *ends) {
    if (!is_near(t, g->whole[COUNT] * h))
        return true; /* a step that is left out, or done twice */
    g->whole[COUNT]++;
    g->real[INTEGRAL] += h * g->real[ANGLE];
    g->real[DELAYED] = torque_of(g);
    *ends = g->whole[COUNT] == g->whole[LAST];
    g->has_failed = g->whole[COUNT] == g->whole[FAILS];
    return g->has_failed;
}

/* Saves and restores all but the addresses. */
enum { STATE = sizeof(double) * REALS + sizeof(int32_t) * WHOLES + 1 };

static void pack(const guest *g, unsigned char *to) {
    memcpy(to, g->real, sizeof g->real);
    memcpy(to + sizeof g->real, g->whole, sizeof g->whole);
    to[STATE - 1] = g->off;
}

static void unpack(guest *g, const unsigned char *from) {
    memcpy(g->real, from, sizeof g->real);
    memcpy(g->whole, from + sizeof g->real, sizeof g->whole);
    g->off = from[STATE - 1] != 0;
}

static double real_of(const guest *g, uint32_t reference) {
    return reference == TORQUE ? torque_of(g) : g->real[reference];
}

#if VERSION == 2
#define NAME(name) fmi2##name
#define STATE_NAME(name) fmi2##name##FMUstate
typedef int truth;
#else
#define NAME(name) fmi3##name
#define STATE_NAME(name) fmi3##name##FMUState
typedef bool truth;
#endif

/* ---- of both versions -------------------------------------------------------------------------------------------- */

#if VERSION == 2
#define COUNTED
#else
#define COUNTED , size_t value_count
#endif

#define ACCESS(type, name, read, write)                                                                                \
    int NAME(Get##name)(void *instance, const uint32_t *reference, size_t count, type *value COUNTED) {                \
        const guest *g = instance;                                                                                     \
        for (size_t i = 0; i < count; i++)                                                                             \
            value[i] = read;                                                                                           \
        return OK;                                                                                                     \
    }                                                                                                                  \
    int NAME(Set##name)(void *instance, const uint32_t *reference, size_t count, const type *value COUNTED) {          \
        guest *g = instance;                                                                                           \
        for (size_t i = 0; i < count; i++)                                                                             \
            write = value[i];                                                                                          \
        return OK;                                                                                                     \
    }

void NAME(FreeInstance)(void *instance) { free(instance); }
/* After an error the instance may only be released: a call ends the program. */
int NAME(Terminate)(void *instance) {
    const guest *g = instance;
    if (g != NULL && g->has_failed)
        abort();
    return g == NULL;
}
int NAME(ExitInitializationMode)(void *instance) { return instance == NULL; }

#ifndef WITHOUT_STATE
int STATE_NAME(Get)(void *instance, void **state) {
    *state = malloc(STATE);
    pack(instance, *state);
    return OK;
}
int STATE_NAME(Set)(void *instance, void *state) {
    unpack(instance, state);
    return OK;
}
int STATE_NAME(Free)(void *instance, void **state) {
    (void)instance;
    free(*state);
    *state = NULL;
    return OK;
}
int STATE_NAME(Serialize)(void *instance, void *state, unsigned char *bytes, size_t size) {
    (void)instance;
    memcpy(bytes, state, size);
    return OK;
}
static int deserialize(const unsigned char *bytes, size_t size, void **state) {
    *state = malloc(STATE);
    memcpy(*state, bytes, size);
    return OK;
}
#endif

#if VERSION == 2

typedef struct callbacks {
    void (*log)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, int);
    void *environment;
} callbacks;

ACCESS(double, Real, real_of(g, reference[i]), g->real[reference[i]])
ACCESS(int, Integer, g->whole[reference[i] - 10], g->whole[reference[i] - 10])
ACCESS(int, Boolean, (int)g->off + 0 * (int)reference[i], g->off)

void *fmi2Instantiate(const char *name, int kind, const char *token, const char *resources, const callbacks *with,
                      int visible, int logging) {
    guest *g = kind == 1 && strcmp(token, "{guest}") == 0 ? create() : NULL;
    (void)resources, (void)visible, (void)logging;
    if (g != NULL) {
        g->log = (void (*)(void))with->log;
        g->environment = with->environment;
        g->name = name;
    }
    return g;
}
int fmi2SetupExperiment(void *g, int has_tolerance, double tolerance, double start, int has_stop, double stop) {
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    return g == NULL || start != 0.0 ? ERROR : OK;
}
int fmi2EnterInitializationMode(void *g) { return g == NULL; }
int fmi2DoStep(void *instance, double t, double h, int is_final) {
    guest *g = instance;
    bool ends = false;
    const bool fails = advance(g, t, h, &ends);
    (void)is_final;
    if (fails)
        ((void (*)(void *, const char *, int, const char *, const char *, ...))g->log)(
            g->environment, g->name, ERROR, "logStatusError", "step %d of %s fails", (int)g->whole[COUNT], "the guest");
    return fails ? ERROR : ends ? DISCARD : OK;
}
int fmi2GetBooleanStatus(void *instance, int kind, int *value) {
    const guest *g = instance;
    *value = kind == 3 && g->whole[COUNT] == g->whole[LAST];
    return OK;
}
#ifndef WITHOUT_STATE
int fmi2SerializedFMUstateSize(void *instance, void *state, size_t *size) {
    (void)instance, (void)state;
    *size = STATE;
    return OK;
}
int fmi2DeSerializeFMUstate(void *instance, const unsigned char *bytes, size_t size, void **state) {
    (void)instance;
    return deserialize(bytes, size, state);
}
#endif

#else

ACCESS(double, Float64, real_of(g, reference[i]), g->real[reference[i]])
ACCESS(int32_t, Int32, g->whole[reference[i] - 10], g->whole[reference[i] - 10])
ACCESS(bool, Boolean, g->off &&reference[i] > 0, g->off)

void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible,
                                  bool logging, bool event_mode, bool early, const uint32_t *required, size_t count,
                                  void *environment, void (*log)(void *, int, const char *, const char *),
                                  void (*update)(void)) {
    const bool is_plain = !event_mode && !early && count == 0 && update == NULL;
    guest *g = is_plain && strcmp(token, "{guest}") == 0 ? create() : NULL;
    (void)name, (void)resources, (void)visible, (void)logging, (void)required;
    if (g != NULL) {
        g->log = (void (*)(void))log;
        g->environment = environment;
    }
    return g;
}
int fmi3EnterInitializationMode(void *g, bool has_tolerance, double tolerance, double start, bool has_stop,
                                double stop) {
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    return g == NULL || start != 0.0 ? ERROR : OK;
}
int fmi3DoStep(void *instance, double t, double h, bool is_final, bool *event, bool *ends, bool *early, double *last) {
    guest *g = instance;
    *event = *early = *ends = false;
    const bool fails = advance(g, t, h, ends);
    char text[80];
    (void)is_final;
    *early = !fails && g->whole[COUNT] == -g->whole[FAILS];
    *last = *early ? t + 0.5 * h : t + h;
    (void)snprintf(text, sizeof text, "step %d of the guest fails", (int)g->whole[COUNT]);
    if (fails)
        ((void (*)(void *, int, const char *, const char *))g->log)(g->environment, ERROR, "logStatusError", text);
    return fails ? ERROR : OK;
}
#ifndef WITHOUT_STATE
int fmi3SerializedFMUStateSize(void *instance, void *state, size_t *size) {
    (void)instance, (void)state;
    *size = STATE;
    return OK;
}
int fmi3DeserializeFMUState(void *instance, const unsigned char *bytes, size_t size, void **state) {
    (void)instance;
    return deserialize(bytes, size, state);
}
#endif

#endif
