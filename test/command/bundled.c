/* The folders in which the program searches the bundled scenes, also on systems that hide its own path. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "command.h"
#include "open/bundled.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

static char said[1024];

void kt_say(const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(said, sizeof said, format, arguments);
    va_end(arguments);
}

static const char *find(void) {
    static char folder[4096];
    said[0] = '\0';
    return kt_bundled_find(folder, sizeof folder, true) ? folder : "none";
}

/* Nothing lies next to this program; its source tree is ./source, and its scenes are installed in ./installed. */
KT_TEST(scenes_are_found_in_the_source_tree_where_they_were_installed_or_where_told) {
    char directory[] = "/tmp/kinetree-bundled-XXXXXX";
    kt_need(kt_check_true("a folder of its own", mkdtemp(directory) != NULL && chdir(directory) == 0));
    unsetenv("KINETREE_SCENES");
    kt_check_text("nowhere", find(), "none");
    kt_check_contains("where they could be", said, "in installed; set KINETREE_SCENES=FOLDER");
    mkdir("installed", 0700);
    kt_check_text("installed", find(), "installed");
    mkdir("source", 0700);
    kt_check_text("in the source tree", find(), "source");
    setenv("KINETREE_SCENES", "given", 1);
    kt_check_text("where there is nothing", find(), "none");
    kt_check_contains("where there is nothing", said, "'given', which is no folder");
    mkdir("given", 0700);
    kt_check_text("where told", find(), "given");
    unsetenv("KINETREE_SCENES");
    kt_check_true("its folder is removed", rmdir("given") == 0 && rmdir("source") == 0 && rmdir("installed") == 0 &&
                                               chdir("/") == 0 && rmdir(directory) == 0);
}
