/* Operations and bytes of generated functions: none may need more than before. The published counts are those of a
 * robot for which another generator, SYMORO+, has written the same equations. */
/* SPDX-License-Identifier: Apache-2.0 */
#define _XOPEN_SOURCE 700
#include "files/scene/collect.h"
#include "generated.h"
#include "text.h"

#include "kinetree/scene.h"

#include <stdio.h>
#include <string.h>

/* The functions that have bars. */
enum { FORWARD, INVERSE, BIAS, MASS, COUNTED };
static const char *const function_names[COUNTED] = {"forward", "inverse", "bias", "mass"};
static const unsigned counted_functions = KT_CODEGEN_FORWARD | KT_CODEGEN_INVERSE | KT_CODEGEN_BIAS | KT_CODEGEN_MASS;

typedef struct operation_counts {
    int products, sums, divisions;
} operation_counts;

/* The counts of a file, or their bounds. */
typedef struct code_size {
    operation_counts count[COUNTED];
    int bytes; /* of the source */
} code_size;

/* ---- measurement ------------------------------------------------------------------------------------------------- */

/* The counts in the comment before a function; NULL: there is none. *end: the function. */
static const char *find_counts(const char *source, const char *function, const char **end) {
    char head[64];
    const char *found = NULL;
    (void)snprintf(head, sizeof head, "\nint mech_%s(", function);
    *end = strstr(source, head);
    for (const char *at = source; *end != NULL && (at = strstr(at, "Operations: ")) != NULL && at < *end; at++)
        found = at;
    return found;
}

static operation_counts read_counts(const char *source, const char *function) {
    operation_counts c = {-1, -1, -1};
    const char *end, *found = find_counts(source, function, &end);
    if (!kt_check_true(function, found != NULL) ||
        !kt_check_equal_int(
            "numbers in the comment",
            sscanf(found, "Operations: %d products, %d sums, %d divisions", &c.products, &c.sums, &c.divisions), 3))
        c.products = -1;
    return c;
}

/* The numbers of the array `w` of a function; 0: it has none, or no comment says so. */
static int read_places(const char *source, const char *function) {
    const char *end, *found = find_counts(source, function, &end);
    int places = 0;
    found = found != NULL ? strstr(found, " * w: ") : NULL;
    if (found != NULL && found < end)
        kt_check_equal_int("places in the comment", sscanf(found, " * w: %d numbers on the stack", &places), 1);
    return places;
}

static kt_generated_text generate(const kt_model *model, unsigned functions) {
    kt_generated_text text;
    kt_error error = {0};
    kt_need_fine("generation", kt_generate_text(model, "mech", functions, false, &text, &error), &error);
    return text;
}

static void check_bar(const char *function, const char *what, int observed, int bar) {
    char name[96];
    (void)snprintf(name, sizeof name, "%s: %s", function, what);
    if (bar == 0)
        kt_check_equal_int(name, observed, 0);
    else if (kt_check_true(name, observed >= 0))
        kt_check_below(name, observed, bar);
}

static void check_counts(const char *function, operation_counts observed, operation_counts bar) {
    check_bar(function, "products", observed.products, bar.products);
    check_bar(function, "sums", observed.sums, bar.sums);
    check_bar(function, "divisions", observed.divisions, bar.divisions);
}

/* Bytes may grow by 2 % before the bar is moved: comments and names are among them. */
static void check_model(const char *name, const kt_model *model, const code_size *bar) {
    const kt_generated_text text = generate(model, counted_functions);
    kt_note("%s", name);
    for (int k = 0; k < COUNTED; k++)
        check_counts(function_names[k], read_counts(text.source, function_names[k]), bar->count[k]);
    check_bar(name, "bytes of source", (int)text.length, bar->bytes + bar->bytes / 50);
}

/* ---- models ------------------------------------------------------------------------------------------------------ */

static kt_model *compile_scene(const char *name) { return kt_test_model(&kt_test_bundled(name)->description, NULL); }

static void check_places(const char *name, const kt_model *model, const int bar[COUNTED]) {
    const char *source = generate(model, counted_functions).source;
    kt_note("%s", name);
    for (int k = 0; k < COUNTED; k++) {
        const int places = read_places(source, function_names[k]);
        check_bar(function_names[k], "numbers on the stack", places, bar[k]);
        if (bar[k] > 0)
            kt_check_above("a comment has them", places, 0.0);
    }
}

static void check_scene(const char *name, const code_size *bar) { check_model(name, compile_scene(name), bar); }

/* The bars of inverse_derivatives and forward_derivatives. */
static void check_derivatives(const char *name, const operation_counts bar[2]) {
    static const char *const function[2] = {"inverse_derivatives", "forward_derivatives"};
    const char *source =
        generate(compile_scene(name), KT_CODEGEN_INVERSE_DERIVATIVES | KT_CODEGEN_FORWARD_DERIVATIVES).source;
    kt_note("%s", name);
    for (int k = 0; k < 2; k++)
        check_counts(function[k], read_counts(source, function[k]), bar[k]);
}

enum { LINKS = 32 };

/* Links of a serial robot with all ten inertial parameters. Points into itself: not to be copied. */
typedef struct serial_robot {
    kt_description description;
    kt_body body[LINKS];
    char name[LINKS][8];
    kt_model *model;
} serial_robot;

static kt_body *add_link(serial_robot *r) {
    const int i = r->description.body_count++;
    kt_body *b = &r->body[i];
    (void)snprintf(r->name[i], sizeof r->name[i], "l%d", i);
    *b = kt_body_of(r->name[i], i > 0 ? r->name[i - 1] : NULL, KT_JOINT_REVOLUTE, 2.0 + 0.1 * i);
    b->joint.axis = kt_vec3_make(0.0, 0.0, 1.0);
    b->com = kt_vec3_make(0.05, 0.02 + 0.001 * i, 0.1);
    b->inertia = kt_sym3_make(0.03, 0.035, 0.028, 0.001, -0.002, 0.0015);
    return b;
}

static void compile_robot(serial_robot *r) {
    r->description.bodies = r->body;
    r->model = kt_test_model(&r->description, NULL);
}

static void begin_robot(serial_robot *r) {
    memset(r, 0, sizeof *r);
    r->description = kt_description_default();
    r->description.gravity = kt_vec3_make(0.0, 0.0, -9.81);
}

/* Hinges about x, y and z in turn. at: of each in the link before. */
static void describe_chain(serial_robot *r, kt_vec3 at) {
    begin_robot(r);
    for (int i = 0; i < LINKS; i++) {
        kt_body *b = add_link(r);
        b->joint.axis = kt_vec3_make(i % 3 == 0, i % 3 == 1, i % 3 == 2);
        b->joint.at = i > 0 ? at : kt_vec3_make(0.0, 0.0, 0.0);
    }
}

/* The Comau Racer 3 in the parameters of Khalil and Kleinfinger: alpha and an offset of theta in quarters of a turn,
 * d and r. */
static void describe_racer(serial_robot *r) {
    static const struct {
        int alpha, offset;
        double d, r;
    } joint[6] = {{0, 0, 0.0, 0.365},  {-1, -1, 0.05, 0.0}, {0, 0, 0.27, 0.0},
                  {-1, 0, 0.05, 0.22}, {1, 0, 0.0, 0.0},    {-1, 0, 0.0, 0.0}};
    static const double sine[3] = {-1.0, 0.0, 1.0}, cosine[3] = {0.0, 1.0, 0.0};
    begin_robot(r);
    for (int i = 0; i < 6; i++) {
        kt_body *b = add_link(r);
        const double s = sine[joint[i].alpha + 1], c = cosine[joint[i].alpha + 1];
        const double so = sine[joint[i].offset + 1], co = cosine[joint[i].offset + 1];
        const kt_mat3 turn = {.x = {co, c * so, s * so}, .y = {-so, c * co, s * co}, .z = {0.0, -s, c}};
        b->joint.at = kt_vec3_make(joint[i].d, -joint[i].r * s, joint[i].r * c);
        b->joint.rotation = kt_rotation_matrix(turn);
    }
}

/* ---- bars -------------------------------------------------------------------------------------------------------- */

KT_TEST(generated_functions_need_no_more_operations_than_before) {
    static serial_robot r;
    static const code_size arm = {{{523, 414, 6}, {249, 207, 0}, {241, 192, 0}, {156, 117, 0}}, 65936};
    static const code_size humanoid = {{{4546, 3722, 50}, {1843, 1509, 6}, {1810, 1423, 6}, {4253, 2793, 6}}, 494321};
    static const code_size four_bar = {{{79, 51, 3}, {20, 11, 0}, {14, 5, 0}, {3, 3, 0}}, 18511};
    static const code_size chain = {{{3887, 3609, 31}, {1697, 1608, 0}, {1689, 1562, 0}, {4573, 2917, 0}}, 284228};
    static const code_size like = {{{4733, 4548, 31}, {1903, 1833, 0}, {1894, 1789, 0}, {4901, 4001, 0}}, 223393};
    check_scene("arm7", &arm);
    check_scene("humanoid", &humanoid);
    check_scene("four-bar", &four_bar);
    describe_chain(&r, kt_vec3_make(0.0, 0.0, 0.25));
    compile_robot(&r);
    check_model("chain of 32 links in space", r.model, &chain);
    describe_chain(&r, kt_vec3_make(0.1, 0.2, -0.3));
    compile_robot(&r);
    check_model("chain of 32 links whose zeros agree", r.model, &like);
}

/* Places are used again behind the last part that reads them: otherwise the mass matrix of the humanoid takes 2147. */
KT_TEST(numbers_that_parts_share_take_no_more_places_than_before) {
    static serial_robot r;
    kt_model *const arm = compile_scene("arm7"), *const humanoid = compile_scene("humanoid");
    check_places("arm7", arm, (const int[COUNTED]){0});
    check_places("humanoid", humanoid, (const int[COUNTED]){798, 345, 343, 1168});
    describe_chain(&r, kt_vec3_make(0.0, 0.0, 0.25));
    compile_robot(&r);
    check_places("chain of 32 links in space", r.model, (const int[COUNTED]){481, 254, 0, 887});
}

KT_TEST(derivatives_need_no_more_operations_than_before) {
    check_derivatives("arm7", (const operation_counts[2]){{1199, 979, 0}, {2221, 1887, 6}});
    check_derivatives("double-pendulum", (const operation_counts[2]){{26, 10, 0}, {57, 28, 1}});
    check_derivatives("three-body", (const operation_counts[2]){{742, 567, 2}, {2310, 1883, 8}});
    check_derivatives("four-bar", (const operation_counts[2]){{28, 10, 0}, {292, 185, 3}});
    check_derivatives("lagrange-top", (const operation_counts[2]){{24, 7, 1}, {34, 7, 1}});
}

#ifdef __x86_64__

/* Reads the bytes of instructions and constants that `size` reports for a compiled file; -1: there is no such program.
 */
static int read_text_bytes(const kt_generated *g) {
    char command[128], line[256];
    int bytes = -1;
    (void)snprintf(command, sizeof command, "size %s/mech.so 2>/dev/null", g->folder);
    FILE *pipe = popen(command, "r");
    while (pipe != NULL && fgets(line, sizeof line, pipe) != NULL)
        (void)sscanf(line, " %d", &bytes);
    if (pipe != NULL)
        (void)pclose(pipe);
    return bytes;
}

/* Compilers differ by 10 %. */
static void check_text(const char *name, int bar) {
    static kt_generated g;
    kt_generated_make_some(&g, compile_scene(name), counted_functions, "cc -std=c99 -O2", false);
    const int bytes = read_text_bytes(&g);
    if (bytes < 0)
        kt_skip(name, "there is no program of the name size");
    else
        check_bar(name, "bytes of text", bytes, bar + bar / 10);
}

KT_TEST(compiled_functions_take_no_more_bytes_than_before) {
    kt_generated_need_compiler();
    check_text("arm7", 36553);
    check_text("four-bar", 6008);
}

#endif

/* SYMORO+ (Khalil and Creusot, Robotica 15, 1997): the files racer3_52_paras.ccg and .inm, whose heads count 295 sums
 * and 306 products for h, and 243 and 290 for M. Friction is in 12 of each of the first. Sines and cosines are not
 * counted. A link has ten inertial parameters there, too. */
KT_TEST(a_robot_needs_no_more_operations_than_published) {
    static serial_robot r;
    describe_racer(&r);
    compile_robot(&r);
    const char *source = generate(r.model, counted_functions).source;
    const operation_counts h = read_counts(source, "bias"), m = read_counts(source, "mass");
    check_counts("bias", h, (operation_counts){306 - 12, 295 - 12, 0});
    check_counts("mass", m, (operation_counts){290, 243, 0});
}
