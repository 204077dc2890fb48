/* Sizes of public structs, by their names. No code of the folders above is used: their headers declare the structs. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/experimental.h"
#include "kinetree/kinetree.h"

#include <string.h>

#define KT_STRUCT_LIST(X)                                                                                              \
    X(kt_accuracy_baseline)                                                                                            \
    X(kt_accuracy_curve)                                                                                               \
    X(kt_accuracy_error)                                                                                               \
    X(kt_accuracy_events)                                                                                              \
    X(kt_accuracy_instant)                                                                                             \
    X(kt_accuracy_options)                                                                                             \
    X(kt_accuracy_point)                                                                                               \
    X(kt_accuracy_quantity)                                                                                            \
    X(kt_accuracy_results)                                                                                             \
    X(kt_activation)                                                                                                   \
    X(kt_actuator)                                                                                                     \
    X(kt_batch_frame)                                                                                                  \
    X(kt_batch_inputs)                                                                                                 \
    X(kt_batch_job)                                                                                                    \
    X(kt_batch_lanes)                                                                                                  \
    X(kt_batch_options)                                                                                                \
    X(kt_batch_report)                                                                                                 \
    X(kt_batch_sensors)                                                                                                \
    X(kt_beam)                                                                                                         \
    X(kt_beam_property)                                                                                                \
    X(kt_body)                                                                                                         \
    X(kt_completed_steps)                                                                                              \
    X(kt_complex)                                                                                                      \
    X(kt_constraint_formulation_options)                                                                               \
    X(kt_constraint_formulation_statistics)                                                                            \
    X(kt_contact_counts)                                                                                               \
    X(kt_contact_excess)                                                                                               \
    X(kt_contact_load)                                                                                                 \
    X(kt_coordinate_list)                                                                                              \
    X(kt_coordinates)                                                                                                  \
    X(kt_cost_point)                                                                                                   \
    X(kt_crossings)                                                                                                    \
    X(kt_dae_counts)                                                                                                   \
    X(kt_dae_options)                                                                                                  \
    X(kt_description)                                                                                                  \
    X(kt_descriptor)                                                                                                   \
    X(kt_difference)                                                                                                   \
    X(kt_dynamic_parameter)                                                                                            \
    X(kt_effect)                                                                                                       \
    X(kt_effect_load)                                                                                                  \
    X(kt_end)                                                                                                          \
    X(kt_energy_watch)                                                                                                 \
    X(kt_ensemble_member)                                                                                              \
    X(kt_ensemble_report)                                                                                              \
    X(kt_equilibrium)                                                                                                  \
    X(kt_equilibrium_options)                                                                                          \
    X(kt_error)                                                                                                        \
    X(kt_event)                                                                                                        \
    X(kt_event_cuts)                                                                                                   \
    X(kt_fast_state)                                                                                                   \
    X(kt_floquet_options)                                                                                              \
    X(kt_frame_motion)                                                                                                 \
    X(kt_function)                                                                                                     \
    X(kt_impact)                                                                                                       \
    X(kt_initial_change)                                                                                               \
    X(kt_instant)                                                                                                      \
    X(kt_integrator_callbacks)                                                                                         \
    X(kt_integrator_counts)                                                                                            \
    X(kt_integrator_memory)                                                                                            \
    X(kt_integrator_options)                                                                                           \
    X(kt_iterations)                                                                                                   \
    X(kt_joint)                                                                                                        \
    X(kt_joint_limits)                                                                                                 \
    X(kt_key)                                                                                                          \
    X(kt_linear_system)                                                                                                \
    X(kt_linearization_options)                                                                                        \
    X(kt_link_tree)                                                                                                    \
    X(kt_graph_joint)                                                                                                  \
    X(kt_graph_choice)                                                                                                 \
    X(kt_lookup)                                                                                                       \
    X(kt_loop)                                                                                                         \
    X(kt_loop_disagreement)                                                                                            \
    X(kt_loop_group)                                                                                                   \
    X(kt_loop_rows)                                                                                                    \
    X(kt_marker)                                                                                                       \
    X(kt_marker_index)                                                                                                 \
    X(kt_marker_pair)                                                                                                  \
    X(kt_mat3)                                                                                                         \
    X(kt_mechanism)                                                                                                    \
    X(kt_method)                                                                                                       \
    X(kt_mobility)                                                                                                     \
    X(kt_mode)                                                                                                         \
    X(kt_model_options)                                                                                                \
    X(kt_multiplier)                                                                                                   \
    X(kt_muscle)                                                                                                       \
    X(kt_native)                                                                                                       \
    X(kt_newton)                                                                                                       \
    X(kt_occurrence)                                                                                                   \
    X(kt_parameter)                                                                                                    \
    X(kt_parameter_change)                                                                                             \
    X(kt_path_point)                                                                                                   \
    X(kt_place)                                                                                                        \
    X(kt_plan_step)                                                                                                    \
    X(kt_polynomial_spring)                                                                                            \
    X(kt_pose)                                                                                                         \
    X(kt_power)                                                                                                        \
    X(kt_quat)                                                                                                         \
    X(kt_reaction_share)                                                                                               \
    X(kt_record)                                                                                                       \
    X(kt_reference)                                                                                                    \
    X(kt_residual)                                                                                                     \
    X(kt_robot_options)                                                                                                \
    X(kt_rollout)                                                                                                      \
    X(kt_rollout_task)                                                                                                 \
    X(kt_rotation)                                                                                                     \
    X(kt_run)                                                                                                          \
    X(kt_sampling)                                                                                                     \
    X(kt_scene)                                                                                                        \
    X(kt_scene_call)                                                                                                   \
    X(kt_scene_column)                                                                                                 \
    X(kt_scene_event)                                                                                                  \
    X(kt_scene_mesh)                                                                                                   \
    X(kt_scene_missed)                                                                                                 \
    X(kt_scene_note)                                                                                                   \
    X(kt_scene_options)                                                                                                \
    X(kt_scene_parameter)                                                                                              \
    X(kt_scene_set)                                                                                                    \
    X(kt_scene_switch)                                                                                                 \
    X(kt_shape)                                                                                                        \
    X(kt_simulation_counts)                                                                                            \
    X(kt_simulation_options)                                                                                           \
    X(kt_spectrum_mode)                                                                                                \
    X(kt_stability)                                                                                                    \
    X(kt_stability_verdict)                                                                                            \
    X(kt_auxiliary_state)                                                                                              \
    X(kt_step)                                                                                                         \
    X(kt_step_limit)                                                                                                   \
    X(kt_step_task)                                                                                                    \
    X(kt_surface)                                                                                                      \
    X(kt_sym3)                                                                                                         \
    X(kt_symbol)                                                                                                       \
    X(kt_symbols)                                                                                                      \
    X(kt_term)                                                                                                         \
    X(kt_track)                                                                                                        \
    X(kt_twist)                                                                                                        \
    X(kt_variable)                                                                                                     \
    X(kt_variable_mass)                                                                                                \
    X(kt_variant)                                                                                                      \
    X(kt_vec3)                                                                                                         \
    X(kt_velocity_correction)                                                                                          \
    X(kt_work)                                                                                                         \
    X(kt_work_estimate)                                                                                                \
    X(kt_wrench)                                                                                                       \
    X(kt_wrench_derivatives)
size_t kt_struct_size(const char *name) {
    static const struct {
        const char *name;
        size_t size;
    } structs[] = {
#define KT_STRUCT_ENTRY(type) {#type, sizeof(type)},
        KT_STRUCT_LIST(KT_STRUCT_ENTRY)
#undef KT_STRUCT_ENTRY
    };
    for (size_t i = 0; name != NULL && i < sizeof structs / sizeof *structs; i++)
        if (strcmp(structs[i].name, name) == 0)
            return structs[i].size;
    return 0;
}
