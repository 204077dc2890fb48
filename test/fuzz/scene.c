/* The readers of scenes and of robots in URDF, MJCF and SDF (FUZZ_ROBOT), for any text. Each reports the fault, or
 * reads a scene. A written scene reads as the same. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "fuzz.h"
#include "kinetree/import.h"

#include "files/scene/collect.h"
#include "files/scene/difference.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* For difference.c, which then does not need all of collect.c. */
bool kt_same_bytes(const void *a, const void *b, size_t size) { return memcmp(a, b, size) == 0; }

typedef struct heard {
    int count;
    kt_error first;
} heard;

static bool is_text(const char *text, size_t room) { return memchr(text, '\0', room) != NULL; }

static void listen(void *user, const kt_error *fault) {
    heard *h = user;
    if (h->count++ == 0)
        h->first = *fault;
    kt_fuzz_must(fault->code != KT_OK, "a fault has a code");
    kt_fuzz_must(is_text(fault->where, KT_WHERE_SIZE) && strncmp(fault->where, "x.yaml:", 7) == 0,
                 "a fault has a place: %.160s", fault->where);
    kt_fuzz_must(is_text(fault->message, KT_MESSAGE_SIZE) && fault->message[0] != '\0', "a fault has a message");
}

/* Reads the written scene, which must be right. */
static void read_again(const char *text, size_t size, kt_scene *scene) {
    kt_error error;
    const kt_status status = kt_scene_parse("again.yaml", text, size, scene, NULL, NULL, &error);
    kt_fuzz_must(status == KT_OK, "what was written is read: %s: %s\n%.4000s", error.where, error.message, text);
}

static char *write_text(const kt_scene *scene, size_t *size) {
    char *text = NULL;
    kt_error error;
    FILE *stream = open_memstream(&text, size);
    kt_fuzz_must(stream != NULL, "there is memory");
    const kt_status status = kt_scene_write(scene, stream, &error);
    (void)fclose(stream);
    kt_fuzz_must(status == KT_OK, "what was read is written: %s: %s", error.where, error.message);
    return text;
}

static void write_and_read(kt_scene *scene) {
    size_t size = 0, size_again = 0;
    kt_scene again;
    char *text = write_text(scene, &size);
    read_again(text, size, &again);
    const char *difference = kt_scene_difference(scene, &again);
    kt_fuzz_must(*difference == '\0', "it comes back to the bit: %s\n%.4000s", difference, text);
    char *text_again = write_text(&again, &size_again);
    kt_fuzz_must(size == size_again && memcmp(text, text_again, size) == 0,
                 "the same bytes are written:\n%.4000s\n%.4000s", text, text_again);
    free(text);
    free(text_again);
    kt_scene_free(&again);
}

#ifdef FUZZ_ROBOT
static kt_status read_robot(const char *path, const char *text, size_t size, kt_scene *scene, kt_scene_report *report,
                            void *user, kt_error *error) {
    static const kt_robot_options options = {.floating = true, .stop_stiffness = 1e4, .stop_damping = 1.0};
    const bool is_odd = size % 2 != 0;
    return kt_robot_parse(path, text, size, is_odd ? &options : NULL, scene, report, user, error);
}
#define READ read_robot
#else
#define READ kt_scene_parse
#endif

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    kt_scene scene, untouched;
    kt_error error = {KT_OK, "", ""};
    heard faults = {0};
    memset(&scene, 0x5A, sizeof scene);
    memcpy(&untouched, &scene, sizeof scene);
    const kt_status status = READ("x.yaml", (const char *)data, size, &scene, listen, &faults, &error);
    if (status != KT_OK) {
        kt_fuzz_must(memcmp(&scene, &untouched, sizeof scene) == 0, "a failure leaves the scene untouched");
        kt_fuzz_must(faults.count > 0 && error.code == status && faults.first.code == status, "a failure is told");
        kt_fuzz_must(strcmp(faults.first.message, error.message) == 0, "the error is the first fault");
        return 0;
    }
    kt_fuzz_must(faults.count == 0, "a scene that is right has no faults");
    write_and_read(&scene);
    kt_scene_free(&scene);
    return 0;
}
