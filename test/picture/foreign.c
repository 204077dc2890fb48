/* What a kinetree that was built without assimp says of the meshes which assimp would read: this program has a foreign.c
 * of its own, compiled without. */
#include "check.h"

#include "picture/foreign.h"

#include <string.h>

KT_TEST(without_assimp_the_format_and_the_remedy_are_told) {
    static const char text[] = "<COLLADA/>";
    kt_triangles mesh = {.vertex_count = 7};
    kt_error error = {0};
    kt_check_equal_int("status", kt_foreign_parse("/robots/arm.v2/hand.dae", text, strlen(text), &mesh, &error),
                       KT_ERROR_SCENE);
    kt_check_text(
        "error", error.message,
        "this is neither STL nor OBJ nor MSH; '.dae' needs a kinetree that was built with assimp (libassimp-dev)");
    kt_check_equal_int("the mesh is untouched", mesh.vertex_count, 7);
}
