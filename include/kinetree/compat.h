/* Names and calls of version 0.1, for programs that have not changed yet. They are deprecated, and leave with version
 * 0.3.
 *
 *     cc -DKT_COMPAT_0_1 program.c ...
 *
 * With this definition, kinetree.h includes this header. The calls below then have their signatures of version 0.1, in
 * the whole source file. Without it, they have the signatures of this version. Nothing here adds a symbol to the
 * library.
 */
#ifndef KINETREE_COMPAT_H
#define KINETREE_COMPAT_H

#include "kinetree/control.h"
#include "kinetree/import.h"
#include "kinetree/model.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Marks a call that leaves with the next version; the compiler then prints its successor. */
#if defined(__GNUC__)
#define KT_DEPRECATED(successor) __attribute__((deprecated("use " successor)))
#else
#define KT_DEPRECATED(successor)
#endif

/* The readers of robots read MJCF and SDF, too: kt_urdf_ has become kt_robot_. */
typedef kt_robot_options kt_urdf_options;
typedef kt_robot_inertia kt_urdf_inertia;
#define KT_URDF_INERTIA_WARN KT_ROBOT_INERTIA_WARN     /* of kt_robot_inertia */
#define KT_URDF_INERTIA_STRICT KT_ROBOT_INERTIA_STRICT /* of kt_robot_inertia */
#define KT_URDF_INERTIA_ACCEPT KT_ROBOT_INERTIA_ACCEPT /* of kt_robot_inertia */

/* Calls kt_robot_read. */
KT_DEPRECATED("kt_robot_read")
static inline kt_status kt_urdf_read(const char *path, const kt_urdf_options *options, kt_scene *scene,
                                     kt_scene_report *report, void *user, kt_error *error) {
    return kt_robot_read(path, options, scene, report, user, error);
}

/* Calls kt_robot_parse. */
KT_DEPRECATED("kt_robot_parse")
static inline kt_status kt_urdf_parse(const char *path, const char *text, size_t size, const kt_urdf_options *options,
                                      kt_scene *scene, kt_scene_report *report, void *user, kt_error *error) {
    return kt_robot_parse(path, text, size, options, scene, report, user, error);
}

/* Calls kt_parameter_get, which returns a status and takes an error since version 0.2. */
KT_DEPRECATED("kt_parameter_get with an error")
static inline void kt_parameter_get_0_1(const kt_model *model, const kt_parameter *parameter, double *values) {
    if (kt_parameter_get(model, parameter, values, NULL) != KT_OK)
        return; /* values are untouched, as in version 0.1 */
}
#define kt_parameter_get kt_parameter_get_0_1

/* Calls kt_operational_inertia, which returns rcond since version 0.2. */
KT_DEPRECATED("kt_operational_inertia with rcond, which may be NULL")
static inline kt_status kt_operational_inertia_0_1(kt_mass_inverse *inverse, int rows, const double *jacobian,
                                                   double *inertia, double *consistent, kt_error *error) {
    return kt_operational_inertia(inverse, rows, jacobian, inertia, consistent, NULL, error);
}
#define kt_operational_inertia kt_operational_inertia_0_1

/* Calls kt_independent_basis, which returns rcond since version 0.2. */
KT_DEPRECATED("kt_independent_basis with rcond, which may be NULL")
static inline kt_status kt_independent_basis_0_1(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                                 double t, const double *q, kt_coordinate_list independent,
                                                 double *basis, kt_error *error) {
    return kt_independent_basis(model, data, work, work_size, t, q, independent, basis, NULL, error);
}
#define kt_independent_basis kt_independent_basis_0_1

/* Calls kt_actuation_evaluate, which returns rcond since version 0.2. */
KT_DEPRECATED("kt_actuation_evaluate with rcond, which may be NULL")
static inline kt_status kt_actuation_evaluate_0_1(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                                  double t, const double *q, const double *v, const double *a,
                                                  const kt_wrench *external, kt_coordinate_list actuated,
                                                  const double *weights, double *forces, kt_error *error) {
    return kt_actuation_evaluate(model, data, work, work_size, t, q, v, a, external, actuated, weights, forces, NULL,
                                 error);
}
#define kt_actuation_evaluate kt_actuation_evaluate_0_1

#ifdef __cplusplus
}
#endif

#endif
