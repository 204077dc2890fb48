/* Programs of version 0.1 compile with -DKT_COMPAT_0_1 and run. Their calls give the results of this version. */
#define KT_COMPAT_0_1
#include "check.h"

#include "kinetree/kinetree.h"

#include <stdlib.h>
#include <string.h>

#pragma GCC diagnostic ignored "-Wdeprecated-declarations"

enum { NV = 3 };

/* An arm of three links, as programs of 0.1 made it. */
typedef struct arm {
    kt_model *model, *payload;
    kt_data *data;
    void *block, *work;
    size_t work_size;
} arm;

static bool make(arm *a) {
    static const char *const names[NV] = {"upper", "fore", "hand"};
    kt_error error;
    kt_body body[NV];
    kt_description d = kt_description_default();
    d.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    for (int i = 0; i < NV; i++) {
        body[i] = kt_body_default();
        body[i].name = names[i];
        body[i].parent = i ? names[i - 1] : NULL;
        body[i].mass = 1.0;
        body[i].com = kt_vec3_make(0.25, 0.0, 0.0);
        body[i].inertia = kt_sym3_make(0.01, 0.02, 0.02, 0.0, 0.0, 0.0);
        body[i].joint.type = KT_JOINT_REVOLUTE;
        body[i].joint.at = kt_vec3_make(i ? 0.5 : 0.0, 0.0, 0.0);
        body[i].joint.position[0] = 0.4;
    }
    d.bodies = body;
    d.body_count = NV;
    memset(a, 0, sizeof *a);
    a->work_size = (size_t)1 << 16;
    a->work = aligned_alloc(KT_ALIGNMENT, a->work_size);
    kt_status status = kt_model_compile(&d, NULL, &a->model, &error);
    if (status == KT_OK)
        status = kt_data_create(a->model, &a->data, &error);
    const size_t size = (kt_model_size(a->model) + 63) / 64 * 64;
    a->block = aligned_alloc(KT_ALIGNMENT, size);
    if (status == KT_OK)
        status = kt_model_copy(a->model, a->block, size, &a->payload, &error);
    return kt_check_true("made", status == KT_OK);
}

static void release(arm *a) {
    kt_data_free(a->data);
    kt_model_free(a->model);
    free(a->block);
    free(a->work);
}

KT_TEST(a_payload_is_set_and_read) {
    arm a;
    kt_error error;
    kt_parameter mass;
    double value = 1.75, read = 0.0;
    if (!make(&a))
        return;
    kt_check_equal_int("find", kt_parameter_find(a.payload, "hand.mass", &mass, &error), KT_OK);
    kt_check_equal_int("set", kt_parameter_set(a.payload, &mass, &value, &error), KT_OK);
    kt_parameter_get(a.payload, &mass, &read);
    kt_check_near("payload", read, 1.75, 0.0);
    kt_parameter_get(a.model, &mass, &read);
    kt_check_near("model", read, 1.0, 0.0);
    release(&a);
}

KT_TEST(torques_of_an_arm_are_inverse_dynamics) {
    arm a;
    kt_error error;
    const int all[NV] = {0, 1, 2};
    const double q[NV] = {0.4, -0.3, 0.7}, v[NV] = {0.1, 0.2, -0.3}, acceleration[NV] = {1.0, -2.0, 0.5};
    double tau[NV], expected[NV], basis[NV * NV];
    if (!make(&a))
        return;
    kt_check_equal_int("actuation",
                       kt_actuation_evaluate(a.model, a.data, a.work, a.work_size, 0.0, q, v, acceleration, NULL,
                                             (kt_coordinate_list){all, NV}, NULL, tau, &error),
                       KT_OK);
    kt_check_equal_int("inverse", kt_dynamics_inverse(a.model, a.data, q, v, acceleration, NULL, expected, &error),
                       KT_OK);
    for (int i = 0; i < NV; i++) /* rounding of sums of some 10 N m */
        kt_check_near("torque", tau[i], expected[i], 1e-13);
    kt_check_equal_int("basis",
                       kt_independent_basis(a.model, a.data, a.work, a.work_size, 0.0, q, (kt_coordinate_list){all, NV},
                                            basis, &error),
                       KT_OK);
    for (int i = 0; i < NV * NV; i++)
        kt_check_near("identity", basis[i], i % (NV + 1) == 0 ? 1.0 : 0.0, 0.0);
    release(&a);
}

KT_TEST(the_inertia_felt_at_a_joint_is_that_of_the_mass_matrix) {
    arm a;
    kt_error error;
    kt_mass_inverse *inverse = NULL;
    const double q[NV] = {0.4, -0.3, 0.7}, rows[NV * NV] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
    double inertia[NV * NV], mass[NV * NV];
    if (!make(&a))
        return;
    kt_check_equal_int("create", kt_mass_inverse_create(a.model, NV, &inverse, &error), KT_OK);
    kt_check_equal_int("compute", kt_mass_inverse_compute(inverse, a.data, 0.0, q, &error), KT_OK);
    kt_check_equal_int("inertia", kt_operational_inertia(inverse, NV, rows, inertia, NULL, &error), KT_OK);
    kt_check_equal_int("mass", kt_dynamics_mass(a.model, a.data, q, mass, &error), KT_OK);
    for (int i = 0; i < NV * NV; i++) /* condition some 100 */
        kt_check_near("entry", inertia[i], mass[i], 1e-13);
    kt_mass_inverse_free(inverse);
    release(&a);
}

KT_TEST(a_robot_is_read) {
    static const char text[] = "<robot name='r'><link name='a'><inertial><mass value='2'/><inertia ixx='1' iyy='1' "
                               "izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link></robot>";
    const kt_urdf_options options = {.floating = true, .inertia = KT_URDF_INERTIA_STRICT};
    kt_scene scene = kt_scene_default();
    kt_error error;
    kt_need(kt_check_equal_int("parse", kt_urdf_parse("r", text, sizeof text - 1, &options, &scene, NULL, NULL, &error),
                               KT_OK));
    kt_check_equal_int("bodies", scene.description.body_count, 1);
    kt_check_near("mass", scene.description.bodies[0].mass, 2.0, 0.0);
    kt_scene_free(&scene);
    kt_check_equal_int("no file", kt_urdf_read("none.urdf", NULL, &scene, NULL, NULL, &error), KT_ERROR_FILE);
}
