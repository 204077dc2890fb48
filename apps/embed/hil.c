/* Hardware in the loop: a process that simulates the plant and communicates by UDP.
 *
 * The plant is a cart with a pole on top, simulated at 1 kHz. A controller in another process, or on another device,
 * receives states and sends forces. It needs only the two messages below, and nothing of the library (hil_client.c).
 * Numbers are little-endian, floats IEEE 754 binary64, without padding:
 *
 *     state, 48 bytes:   "KTS1", u32 tick, f64 time (s), f64 x (m), f64 angle (rad, from upright), f64 x', f64 angle'
 *     command, 16 bytes: "KTC1", u32 tick of the state that it answers, f64 force on the cart (N)
 *
 * The plant starts at the first command and sends each state to the sender of the last command. Every message is
 * checked. A message is ignored
 *
 *   - if it has another format,
 *   - if its force is not finite,
 *   - if its tick is not newer than the last, or
 *   - if its tick has not been sent.
 *
 * The force is limited. Without a new command the last force is held for 20 ticks. After that the force is zero until a
 * command arrives.
 *
 *     hil [--port N] [--duration S] [--lockstep] [--lose PERCENT] [--csv FILE]
 *
 * --port 0, the default, selects a free port, which the first line of the output states. With --lockstep, each step
 * waits for the answer to its state instead of the clock. The load of the machine then changes no bit of the result.
 * After a second without an answer the plant no longer waits, until the controller sends again. --lose ignores commands
 * at random. */
/* SPDX-License-Identifier: Apache-2.0 */
#include <kinetree/kinetree.h>

#include <arpa/inet.h>
#include <math.h>
#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

enum { STATE_SIZE = 48, COMMAND_SIZE = 16, PATIENCE = 20, RESENDS = 10, RESEND_MS = 100, HELLO_MS = 10000 };

static const double tick = 1e-3, force_limit = 20.0;

typedef struct plant {
    kt_simulation *simulation;
    int socket;
    struct sockaddr_in peer;
    uint32_t n, last; /* current tick; tick of the newest command */
    double force;
    bool lockstep, gone;
    double lose;
    uint64_t seed;
    uint32_t commands, lost, silence, zeroed; /* numbers; ticks since the last command, ticks at zero force */
} plant;

static void put_bits(unsigned char *to, uint64_t bits, int bytes) {
    for (int i = 0; i < bytes; i++)
        to[i] = (unsigned char)(bits >> (8 * i));
}

static uint64_t get_bits(const unsigned char *from, int bytes) {
    uint64_t bits = 0;
    for (int i = 0; i < bytes; i++)
        bits |= (uint64_t)from[i] << (8 * i);
    return bits;
}

static void send_state(const plant *p) {
    unsigned char message[STATE_SIZE] = "KTS1";
    const double *q = kt_simulation_positions(p->simulation), *v = kt_simulation_velocities(p->simulation);
    const double numbers[5] = {kt_simulation_time(p->simulation), q[0], q[1], v[0], v[1]};
    put_bits(message + 4, p->n, 4);
    for (int i = 0; i < 5; i++) {
        uint64_t bits;
        memcpy(&bits, &numbers[i], sizeof bits);
        put_bits(message + 8 + 8 * i, bits, 8);
    }
    /* A message that cannot be sent counts as lost, which UDP permits anyway. */
    (void)sendto(p->socket, message, sizeof message, 0, (const struct sockaddr *)&p->peer, sizeof p->peer);
}

static bool plant_is_lost(plant *p) {
    p->seed = p->seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(p->seed >> 11) * 0x1p-53 < p->lose;
}

/* Waits up to `wait` ms for a message. Returns 1 for a new command and 0 for any other message. Returns -1 if none
 * arrives. */
static int receive_command(plant *p, int wait, bool first) {
    struct pollfd ready = {.fd = p->socket, .events = POLLIN};
    struct sockaddr_in from;
    socklen_t length = sizeof from;
    unsigned char message[COMMAND_SIZE + 1];
    if (poll(&ready, 1, wait) <= 0)
        return -1;
    const ssize_t size = recvfrom(p->socket, message, sizeof message, 0, (struct sockaddr *)&from, &length);
    if (size != COMMAND_SIZE || memcmp(message, "KTC1", 4) != 0)
        return 0;
    const uint32_t answered = (uint32_t)get_bits(message + 4, 4);
    const uint64_t bits = get_bits(message + 8, 8);
    double force;
    memcpy(&force, &bits, sizeof force);
    if (!isfinite(force) || (!first && (answered > p->n || answered <= p->last)))
        return 0;
    p->peer = from;
    if (first)
        return 1;
    p->last = answered;
    if (plant_is_lost(p)) {
        p->lost++;
        return 1;
    }
    p->force = fmin(fmax(force, -force_limit), force_limit);
    p->commands++;
    p->silence = 0;
    p->gone = false;
    return 1;
}

/* Sends the state and receives commands. In lock-step it waits for the answer. Otherwise it takes the commands that
 * have arrived. */
static void exchange_with_client(plant *p) {
    p->silence++;
    send_state(p);
    if (p->lockstep && !p->gone) {
        int tries = 0;
        while (p->last < p->n && tries < RESENDS) {
            if (receive_command(p, RESEND_MS, false) < 0) {
                tries++;
                send_state(p);
            }
        }
        p->gone = p->last < p->n;
    }
    for (int i = 0; i < 8 && receive_command(p, 0, false) >= 0; i++) {
    }
    if (p->silence > PATIENCE) {
        p->force = 0.0;
        p->zeroed++;
    }
}

static kt_status make_cart(kt_model **model, kt_error *error) {
    kt_body bodies[2] = {kt_body_default(), kt_body_default()};
    kt_description description = kt_description_default();
    bodies[0].name = "cart";
    bodies[0].joint.type = KT_JOINT_PRISMATIC;
    bodies[0].joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    bodies[0].mass = 0.8;
    bodies[1].name = "pole";
    bodies[1].parent = "cart";
    bodies[1].joint.type = KT_JOINT_REVOLUTE;
    bodies[1].joint.axis = kt_vec3_make(0.0, 0.0, 1.0);
    bodies[1].joint.position[0] = 0.15;
    bodies[1].mass = 0.2;
    bodies[1].com = kt_vec3_make(0.0, 0.3, 0.0);
    bodies[1].inertia = kt_sym3_make(0.006, 1e-5, 0.006, 0.0, 0.0, 0.0);
    description.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    description.bodies = bodies;
    description.body_count = 2;
    return kt_model_compile(&description, NULL, model, error);
}

static kt_status run_plant(plant *p, uint32_t ticks, FILE *csv, kt_error *error) {
    struct timespec due;
    double most = 0.0; /* rad, largest angle in the last quarter */
    clock_gettime(CLOCK_MONOTONIC, &due);
    for (p->n = 1; p->n <= ticks; p->n++) {
        exchange_with_client(p);
        const double *q = kt_simulation_positions(p->simulation), torque[2] = {p->force, 0.0};
        if (csv && p->n % 10 == 1)
            fprintf(csv, "%.3f,%.9g,%.9g,%.9g\n", (p->n - 1) * tick, q[0], q[1], p->force);
        kt_status status = kt_simulation_set_torque(p->simulation, torque, error);
        if (status == KT_OK)
            status = kt_simulation_tick(p->simulation, tick, error);
        if (status != KT_OK)
            return status;
        if (p->n > ticks - ticks / 4)
            most = fmax(most, fabs(kt_simulation_positions(p->simulation)[1]));
        due.tv_nsec += 1000000;
        if (due.tv_nsec >= 1000000000) {
            due.tv_nsec -= 1000000000;
            due.tv_sec++;
        }
        while (!p->lockstep && clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, NULL) != 0) {
        }
    }
    printf("%u ticks, %u commands, %u lost, %u ticks with the force off\n", ticks, p->commands, p->lost, p->zeroed);
    printf("pole within %.9f rad over the last quarter\n", most);
    return KT_OK;
}

static int usage(void) {
    fprintf(stderr, "usage: hil [--port N] [--duration S] [--lockstep] [--lose PERCENT] [--csv FILE]\n");
    return 1;
}

int main(int argc, char **argv) {
    plant p = {.seed = 1};
    struct sockaddr_in own = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t length = sizeof own;
    double duration = 5.0;
    FILE *csv = NULL;
    kt_model *model = NULL;
    kt_error error = {0};
    kt_run plan = kt_run_default();
    for (int i = 1; i < argc; i++) {
        const char *value = i + 1 < argc ? argv[i + 1] : "";
        if (strcmp(argv[i], "--lockstep") == 0) {
            p.lockstep = true;
            continue;
        }
        if (strcmp(argv[i], "--port") == 0)
            own.sin_port = htons((uint16_t)strtoul(value, NULL, 10));
        else if (strcmp(argv[i], "--duration") == 0)
            duration = strtod(value, NULL);
        else if (strcmp(argv[i], "--lose") == 0)
            p.lose = 0.01 * strtod(value, NULL);
        else if (strcmp(argv[i], "--csv") != 0 || !(csv = fopen(value, "w")))
            return usage();
        i++;
    }
    if (!(duration > 0.0 && duration < 1e6))
        return usage();
    p.socket = socket(AF_INET, SOCK_DGRAM, 0);
    if (p.socket < 0 || bind(p.socket, (struct sockaddr *)&own, sizeof own) != 0 ||
        getsockname(p.socket, (struct sockaddr *)&own, &length) != 0)
        return perror("hil: the port cannot be opened"), 1;
    printf("port %u\n", (unsigned)ntohs(own.sin_port));
    fflush(stdout);
    plan.integrator = "rk4";
    plan.step = tick;
    kt_status status = make_cart(&model, &error);
    if (status == KT_OK)
        status = kt_simulation_create(model, &plan, NULL, &p.simulation, &error);
    int hello = 0;
    while (status == KT_OK && hello == 0)
        hello = receive_command(&p, HELLO_MS, true);
    if (status == KT_OK && hello < 0)
        status = kt_error_set(&error, KT_ERROR_STEP, "hil", "no command came within ten seconds");
    if (csv)
        fprintf(csv, "time,position.cart,position.pole,force\n");
    if (status == KT_OK)
        status = run_plant(&p, (uint32_t)lround(duration / tick), csv, &error);
    if (status != KT_OK)
        fprintf(stderr, "hil: %s: %s\n", error.where, error.message);
    if (csv)
        fclose(csv);
    close(p.socket);
    kt_simulation_free(p.simulation);
    kt_model_free(model);
    return status == KT_OK ? 0 : 1;
}
