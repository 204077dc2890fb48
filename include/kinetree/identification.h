/* Identification: forces as a linear function of the parameters of inertia and friction, and which combinations of
 * these parameters can be identified from forces.
 *
 *     tau = Y(q, v, a) pi,        tau = kt_dynamics_inverse(q, v, a) for the model's own pi, without friction
 *
 * pi has kt_regressor_columns(model) = 10 (bodies - 1) + 3 nv numbers: of body 1 its mass m, first moment m c (x, y, z)
 * and inertia matrix I (xx, yy, zz, xy, xz, yz: its elements), about the body frame's origin in the body's axes; then
 * those of body 2, and so on; after the bodies the armatures of all velocity coordinates (kg m^2 or kg: armature times
 * acceleration), their viscous frictions (N m s or N s/m: times velocity), and their Coulomb frictions (N m or N: times
 * the sign of the velocity). With loops tau are the forces that the tree alone would need; Z' Y pi = Z' tau holds with
 * the basis Z of kt_loop_nullspace. Forces of effects do not enter: subtract kt_effect_forces from a measured tau
 * first.
 *
 * Most parameters show in sums alone: the base parameters are as few combinations of them as give all forces.
 *
 * Sources: Atkeson, An, Hollerbach, Estimation of inertial parameters of manipulator loads and links, Int. J. Robotics
 * Research 5(3), 1986; Gautier, Numerical calculation of the base inertial parameters of robots, ICRA 1990; Mayeda,
 * Yoshida, Osuka, Base parameters of manipulator dynamic models, IEEE Trans. Robotics and Automation 6(3), 1990.
 */
#ifndef KINETREE_IDENTIFICATION_H
#define KINETREE_IDENTIFICATION_H

#include "kinetree/dynamics.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Kinds of parameters, in the order of a body's columns; those of coordinates follow. */
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

/* What a column of the regressor belongs to. */
typedef struct kt_dynamic_parameter {
    kt_dynamic_kind kind; /* what it is */
    int body;             /* that has it, or whose joint has the coordinate */
    int coordinate;       /* armature, friction: of v; otherwise -1 */
} kt_dynamic_parameter;

/* The number of parameters, and what one of them is. O(1). */
KT_API int kt_regressor_columns(const kt_model *model);
KT_API kt_dynamic_parameter kt_regressor_parameter(const kt_model *model, int column);

/* The model's own parameters: inertias of its bodies, armatures of its joints, zeros for frictions. O(columns). */
KT_API void kt_regressor_parameters(const kt_model *model, double *parameters);

/* Computes the regressor Y at (q, v, a): nv x columns, column-major. v and a may be NULL (zero). Bodies fixed to the
 * world have zero columns. Errors: KT_ERROR_NOT_FINITE; the regressor is then untouched if an input is not finite. O(nv
 * columns) for clearing it, and O(depth) for each body. */
KT_API KT_CHECKED kt_status kt_regressor_evaluate(const kt_model *model, kt_data *data, const double *q,
                                                  const double *v, const double *a, double *regressor, kt_error *error);

/* Bytes of the work memory of kt_base_parameters_find, aligned to KT_ALIGNMENT: some 8 columns (columns + nv). */
KT_API size_t kt_base_parameters_work_size(const kt_model *model);

/* Finds base parameters. *rank receives their number b, and column (columns numbers) the order of the parameters: each
 * of the first b is the first term of a base parameter; the others add to these. relation (columns x columns numbers of
 * room) receives b x (columns - b) coefficients, column-major:
 *     base_i = pi[column[i]] + sum_k relation[i + k b] pi[column[b + k]],
 *     Y pi = sum_i Y[column[i]] base_i.
 * A parameter whose coefficients are all zero has no effect on any force. Inertias are preferred as first terms, then
 * first moments, then masses, and bodies near the ground; so a payload's mass, say, appears in the moments of what
 * carries it. Found by a QR factorisation of regressors at random states of the tree, in which columns that depend on
 * those before them (to 1e-8 of their length) are passed over; equal models give equal results. Errors: KT_ERROR_MEMORY
 * (work is too small or not aligned), KT_ERROR_NOT_FINITE. O(columns^3). */
KT_API KT_CHECKED kt_status kt_base_parameters_find(const kt_model *model, kt_data *data, void *work, size_t work_size,
                                                    int *rank, int *column, double *relation, kt_error *error);

/* Writes base parameter `index` of kt_base_parameters_find as words: "Izz(upper) + 0.25 m(lower)", terms with
 * coefficients below 1e-9 left out. Returns the length that the whole text has, as snprintf does. */
KT_API int kt_base_parameter_name(const kt_model *model, int rank, const int *column, const double *relation, int index,
                                  char *text, size_t size);

#ifdef __cplusplus
}
#endif
#endif
