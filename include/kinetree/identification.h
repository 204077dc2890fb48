/* Experimental. Identification: forces as a linear function of the parameters of inertia and friction. The header also
 * finds the combinations of these parameters that can be identified from forces.
 *
 *     tau = Y(q, v, a) pi,        tau = kt_dynamics_inverse(q, v, a) for the model's own pi, without friction
 *
 * The vector pi of the parameters has kt_regressor_columns(model) numbers. These are 10 for each body but the world,
 * and 3 for each velocity coordinate. The first ten parameters belong to body 1, the next ten to body 2, and so on. All
 * refer to the body frame's origin and the body's axes:
 *   The mass m.
 *   The first moment m c (x, y, z).
 *   The inertia matrix I (xx, yy, zz, xy, xz, yz: its elements).
 *
 * After the bodies come three numbers for each velocity coordinate, kind by kind:
 *   The armatures, kg m^2 or kg, are multiplied with accelerations.
 *   The viscous frictions, N m s or N s/m, are multiplied with velocities.
 *   The Coulomb frictions, N m or N, are multiplied with the sign of velocities.
 *
 * With loops, tau are the forces that the tree alone would need. Then Z' Y pi = Z' tau holds with the basis Z of
 * kt_loop_nullspace. Forces of effects do not enter: subtract kt_effect_forces from a measured tau first.
 *
 * Most parameters appear in sums only. The base parameters are the smallest set of combinations that gives all forces.
 *
 * Sources:
 *   Atkeson, An, Hollerbach, Estimation of inertial parameters of manipulator loads and links, Int. J. Robotics
 *     Research 5(3), 1986.
 *   Gautier, Numerical calculation of the base inertial parameters of robots, ICRA 1990.
 *   Mayeda, Yoshida, Osuka, Base parameters of manipulator dynamic models, IEEE Trans. Robotics and Automation 6(3),
 *     1990.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_IDENTIFICATION_H
#define KINETREE_IDENTIFICATION_H

#include "kinetree/dynamics.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Kinds of parameters: first the parameters of a body, in the order of its columns, then the parameters of a
 * coordinate. */
typedef enum kt_dynamic_kind {
    KT_DYNAMIC_MASS = 0,   /* m, kg */
    KT_DYNAMIC_MOMENT_X,   /* m c_x, kg m */
    KT_DYNAMIC_MOMENT_Y,   /* m c_y, kg m */
    KT_DYNAMIC_MOMENT_Z,   /* m c_z, kg m */
    KT_DYNAMIC_INERTIA_XX, /* I_xx, kg m^2, as those below */
    KT_DYNAMIC_INERTIA_YY, /* I_yy */
    KT_DYNAMIC_INERTIA_ZZ, /* I_zz */
    KT_DYNAMIC_INERTIA_XY, /* I_xy, the element of the matrix */
    KT_DYNAMIC_INERTIA_XZ, /* I_xz */
    KT_DYNAMIC_INERTIA_YZ, /* I_yz */
    KT_DYNAMIC_ARMATURE,   /* of a velocity coordinate, kg m^2 or kg */
    KT_DYNAMIC_VISCOUS,    /* likewise, N m s or N s/m */
    KT_DYNAMIC_COULOMB,    /* likewise, N m or N */
} kt_dynamic_kind;

/* The parameter to which a column of the regressor belongs. */
typedef struct kt_dynamic_parameter {
    kt_dynamic_kind kind; /* what it is */
    int body;             /* the body with this parameter, or the body whose joint has the coordinate */
    int coordinate;       /* armature, friction: of v; otherwise -1 */
} kt_dynamic_parameter;

/* Returns the number of parameters, and the parameter of a column. O(1). */
KT_API int kt_regressor_columns(const kt_model *model);
KT_API kt_dynamic_parameter kt_regressor_parameter(const kt_model *model, int column);

/* Writes the model's own parameters: inertias of bodies, armatures of joints, zeros for frictions. O(columns). */
KT_API void kt_regressor_parameters(const kt_model *model, double *parameters);

/* Computes the regressor Y at (q, v, a): nv x columns, column-major. v and a may be NULL (zero). Bodies fixed to the
 * world have zero columns.
 * Errors: KT_ERROR_NOT_FINITE; the regressor is then untouched if an input is not finite.
 * Cost: O(nv columns) for clearing the regressor, and O(depth) for each body. */
KT_API KT_CHECKED kt_status kt_regressor_evaluate(const kt_model *model, kt_data *data, const double *q,
                                                  const double *v, const double *a, double *regressor, kt_error *error);

/* Bytes of the work memory of kt_base_parameters_find, aligned to KT_ALIGNMENT: some 8 columns (columns + nv). */
KT_API size_t kt_base_parameters_work_size(const kt_model *model);

/* Finds base parameters. *rank receives their number b. column (columns numbers) receives the order of the parameters.
 * Each of the first b is the first term of a base parameter; the others are further terms. The array `relation` has
 * room for columns x columns numbers. On return, it has b x (columns - b) coefficients, column-major:
 *
 *     base_i = pi[column[i]] + sum_k relation[i + k b] pi[column[b + k]],
 *     Y pi = sum_i Y[column[i]] base_i.
 *
 * A parameter whose coefficients are all zero has no effect on any force. The preferred first terms are inertias, then
 * first moments, then masses, and bodies near the ground. For example, the mass of a payload appears in the moments of
 * the body that carries the payload.
 *
 * Method: a QR factorisation of regressors at random states of the tree. A column that depends on the preceding columns
 * (to 1e-8 of its length) is skipped. Equal models give equal results.
 * Errors: KT_ERROR_MEMORY (work is too small or not aligned), KT_ERROR_NOT_FINITE.
 * Cost: O(columns^3). */
KT_API KT_CHECKED kt_status kt_base_parameters_find(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                                    int *rank, int *column, double *relation, kt_error *error);

/* Writes base parameter `index` of kt_base_parameters_find as text: "Izz(upper) + 0.25 m(lower)". Terms with
 * coefficients below 1e-9 are omitted. Returns the length of the whole text, as snprintf does. */
KT_API int kt_base_parameter_name(const kt_model *model, int rank, const int *column, const double *relation, int index,
                                  char *text, size_t size);

#ifdef __cplusplus
}
#endif
#endif
