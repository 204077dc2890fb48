/* The scene and the engine of a live page.
 *
 * A page reads scenes in flow style, since the engine has no reader of YAML, and it has no files. The text of the file
 * keeps the parameters, so that the page has sliders for them. A scene that is no such text, or that reads other files,
 * is written as it was read: numbers take the place of tables and parameters.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "view/live.h"

#include "open/bundled.h"
#include "text/input.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define ENGINE "kinetree.wasm.gz"

int kt_live_find_engine(kt_live *live) {
    static const char *const places[KT_PLACES] = {KT_BROWSER_FROM_PROGRAM, KT_BROWSER_BUILT, KT_BROWSER_INSTALLED};
    static const kt_file_kind kind = {"the engine for browsers", "the engine for browsers", 64 << 20, false};
    char path[4096];
    kt_error error = {0};
    if (!kt_find_installed(places, ENGINE, path, sizeof path))
        return kt_reject(
            KT_EXIT_SCENE,
            "view: --live needs the engine for browsers, %s, which is neither in %s next to the program "
            "nor in %s; build Kinetree with -Dbrowser=enabled, which needs clang, lld and the C library of "
            "WebAssembly (Debian: clang, lld, wasi-libc, libclang-rt-dev-wasm32), or leave --live out",
            ENGINE, KT_BROWSER_FROM_PROGRAM, KT_BROWSER_INSTALLED);
    if (kt_input_read(path, &kind, &live->engine.text, &live->engine.used, &error) == KT_OK)
        return -1;
    kt_say_error(&error);
    return KT_EXIT_SCENE;
}

/* Returns whether a page can read the scene; if not, *error is the reason. */
static bool is_alone(const kt_bytes *text, kt_error *error) {
    kt_scene_options options = kt_scene_options_default();
    kt_scene scene;
    options.is_alone = true;
    if (kt_scene_parse_with("scene", text->text, text->used, &options, &scene, NULL, NULL, error) != KT_OK)
        return false;
    kt_scene_free(&scene);
    return true;
}

/* Writes a text in flow style into live->scene, in place of an earlier one. */
static kt_status take_flow(kt_live *live, const char *path, const kt_bytes *text, const kt_settings *settings,
                           kt_error *error) {
    kt_scene_options options = kt_scene_options_default();
    options.settings = settings != NULL ? settings->text : NULL;
    options.setting_count = settings != NULL ? settings->count : 0;
    free(live->scene.text);
    live->scene = (kt_bytes){0};
    FILE *stream = open_memstream(&live->scene.text, &live->scene.used);
    if (stream == NULL)
        return kt_error_set(error, KT_ERROR_MEMORY, NULL, "there is not enough memory for the scene of the page");
    const kt_status status = kt_scene_write_flow(path, text->text, text->used, &options, stream, error);
    if (fclose(stream) != 0 && status == KT_OK)
        return kt_error_set(error, KT_ERROR_MEMORY, NULL, "there is not enough memory for the scene of the page");
    return status;
}

static kt_status take_file(kt_live *live, const char *path, const kt_settings *settings, kt_error *error) {
    kt_bytes text = {0};
    kt_status status = kt_input_read(path, &kt_input_scene, &text.text, &text.used, error);
    if (status == KT_OK && text.text[strspn(text.text, " \t\r\n")] == '<')
        status = kt_error_set(error, KT_ERROR_SCENE, path, "a robot is no scene");
    if (status == KT_OK)
        status = take_flow(live, path, &text, settings, error);
    free(text.text);
    return status;
}

static kt_status take_written(kt_live *live, const char *path, const kt_scene *scene, kt_error *error) {
    kt_bytes text = {0};
    FILE *stream = open_memstream(&text.text, &text.used);
    if (stream == NULL)
        return kt_error_set(error, KT_ERROR_MEMORY, NULL, "there is not enough memory for the scene of the page");
    kt_status status = kt_scene_write(scene, stream, error);
    if (fclose(stream) != 0 && status == KT_OK)
        status = kt_error_set(error, KT_ERROR_MEMORY, NULL, "there is not enough memory for the scene of the page");
    if (status == KT_OK)
        status = take_flow(live, path, &text, NULL, error);
    free(text.text);
    return status;
}

int kt_live_take_scene(kt_live *live, const char *path, const kt_settings *settings, const kt_scene *scene) {
    kt_error error = {0};
    if (scene->formulation != kt_scene_default().formulation || scene->reduction != kt_scene_default().reduction)
        return kt_reject(KT_EXIT_SCENE, "view: --live: the engine for browsers integrates tree coordinates with QR; "
                                        "remove 'formulation' and 'reduction' from the scene, or leave --live out");
    if (strcmp(path, "-") != 0 && take_file(live, path, settings, &error) == KT_OK && is_alone(&live->scene, &error))
        return -1;
    if (take_written(live, path, scene, &error) == KT_OK && is_alone(&live->scene, &error)) {
        if (scene->parameter_count > 0)
            kt_say("view: --live: the page has no sliders for parameters, because the scene reads other files or comes "
                   "from standard input");
        return -1;
    }
    return kt_reject(KT_EXIT_SCENE, "view: --live: %s cannot be live, because a page reads no other files: %s",
                     kt_show(path).text, kt_words_of(&error).text);
}

void kt_live_free(kt_live *live) {
    free(live->scene.text);
    free(live->engine.text);
    *live = (kt_live){0};
}
