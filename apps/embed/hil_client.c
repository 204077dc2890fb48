/* An independent controller for the plant of hil.c: it balances the pole and uses only these two messages, all
 * little-endian:
 *
 *     state, 48 bytes:   "KTS1", u32 tick, f64 time (s), f64 x (m), f64 angle (rad, from upright), f64 x', f64 angle'
 *     command, 16 bytes: "KTC1", u32 tick of the state that it answers, f64 force on the cart (N)
 *
 * It starts with a command for tick 0 and answers each state. It ends if no state arrives for three seconds or the
 * plant has ended.
 *
 * The force is state feedback, u = -K (x, angle, x', angle'). The gains K place the poles of the linear model by
 * Ackermann's formula. The values are
 *
 *     poles = -2.5, -3, -6, -7 1/s,   cart = 0.8 kg,   rod = 0.2 kg, 0.6 m.
 *
 *     hil_client PORT [TICKS]
 *
 * With TICKS it stops after that number of answers, like a controller whose cable is unplugged. */
/* SPDX-License-Identifier: Apache-2.0 */
#include <arpa/inet.h>
#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

static const double gain[4] = {-10.917, 55.317, -11.385, 10.844};

static double number_at(const unsigned char *from) {
    uint64_t bits = 0;
    double number;
    for (int i = 0; i < 8; i++)
        bits |= (uint64_t)from[i] << (8 * i);
    memcpy(&number, &bits, sizeof number);
    return number;
}

/* Sends a command; `ticks` are the four bytes of the tick as received. */
static void command(int out, const unsigned char *ticks, double force) {
    unsigned char message[16] = "KTC1";
    uint64_t bits;
    memcpy(&bits, &force, sizeof bits);
    memcpy(message + 4, ticks, 4);
    for (int i = 0; i < 8; i++)
        message[8 + i] = (unsigned char)(bits >> (8 * i));
    if (send(out, message, sizeof message, 0) < 0)
        perror("hil_client"); /* the plant may have ended */
}

int main(int argc, char **argv) {
    static const unsigned char zero[4] = {0, 0, 0, 0};
    struct sockaddr_in plant = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    const long ticks = argc > 2 ? strtol(argv[2], NULL, 10) : -1;
    unsigned char state[49];
    long answered = 0;
    int idle = 0;
    if (argc < 2)
        return fprintf(stderr, "usage: hil_client PORT [TICKS]\n"), 1;
    plant.sin_port = htons((uint16_t)strtoul(argv[1], NULL, 10));
    const int wire = socket(AF_INET, SOCK_DGRAM, 0);
    if (wire < 0 || connect(wire, (struct sockaddr *)&plant, sizeof plant) != 0)
        return perror("hil_client"), 1;
    command(wire, zero, 0.0);
    while (idle < 30 && answered != ticks) {
        struct pollfd ready = {.fd = wire, .events = POLLIN};
        if (poll(&ready, 1, 100) <= 0) {
            idle++;
            command(wire, zero, 0.0); /* the first one may be lost; recv fails if the plant has ended */
            continue;
        }
        const ssize_t size = recv(wire, state, sizeof state, 0);
        if (size < 0)
            break; /* the plant has ended */
        if (size != 48 || memcmp(state, "KTS1", 4) != 0)
            continue;
        double force = 0.0;
        for (int i = 0; i < 4; i++)
            force -= gain[i] * number_at(state + 16 + 8 * i);
        command(wire, state + 4, force);
        answered++;
        idle = 0;
    }
    printf("%ld states answered\n", answered);
    close(wire);
    return answered > 0 ? 0 : 1;
}
