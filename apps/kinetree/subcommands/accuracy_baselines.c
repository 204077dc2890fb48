/* kinetree accuracy --baselines: differential-algebraic formulations of closed loops, by implicit methods. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/accuracy.h"

#include <math.h>
#include <stdio.h>

static const char *const methods[] = {"implicit-euler", "crank-nicolson", "bdf2", "two-step", "radau5"};
enum { METHODS = sizeof methods / sizeof *methods, STEPS_MOST = 8 };

/* Chooses the steps of --steps, or else three steps of the study. */
static int choose_steps(const kt_findings *findings, double *steps) {
    const kt_accuracy_arguments *arguments = findings->arguments;
    int count = 0;
    for (; count < arguments->step_count && count < STEPS_MOST; count++)
        steps[count] = arguments->steps[count];
    for (; arguments->step_count == 0 && count < 3; count++)
        steps[count] = findings->results->interval / (1 << count);
    return count;
}

static void print_order(double coarse, double fine, double ratio) {
    if (coarse > 0.0 && fine > 0.0 && isfinite(coarse) && isfinite(fine))
        printf(" %4.1f", log(coarse / fine) / log(ratio));
    else
        printf("    -");
}

static void print_baseline_row(const kt_accuracy_baseline *b, const kt_accuracy_baseline *before) {
    printf("    %8.3g", b->step);
    if (b->status != KT_OK) {
        printf("  breaks down after %.0f steps\n", (double)b->counts.steps);
        return;
    }
    printf("  %8.2g %8.2g %8.2g  %8.2g %8.2g  %8.1g ", b->error.position, b->error.velocity, b->multiplier,
           b->error.constraint.position, b->error.constraint.velocity, b->condition);
    if (before != NULL && before->status == KT_OK && before->step > b->step) {
        const double ratio = before->step / b->step;
        print_order(before->error.position, b->error.position, ratio);
        print_order(before->error.velocity, b->error.velocity, ratio);
        print_order(before->multiplier, b->multiplier, ratio);
    }
    putchar('\n');
}

/* Returns the status of the runs; an error is the caller's. */
static kt_status print_baseline_method(const kt_findings *findings, const kt_dae_options *options,
                                       kt_formulation formulation, kt_error *error) {
    double steps[STEPS_MOST];
    kt_accuracy_baseline rows[STEPS_MOST];
    const int count = choose_steps(findings, steps);
    kt_status status = KT_OK;
    for (int i = 0; i < count && status == KT_OK; i++) {
        status = kt_accuracy_measure_baseline(findings->study, options, formulation, steps[i], &rows[i], error);
        if (status == KT_OK && i == 0)
            printf("  %s, %s\n", kt_dae_name(options->type), options->method->name);
        if (status == KT_OK)
            print_baseline_row(&rows[i], i > 0 ? &rows[i - 1] : NULL);
        fflush(stdout);
    }
    return status;
}

/* Prints all baselines in one set of coordinates. If a body has no inertia, the baselines do not exist, and the message
 * of the error is printed instead. */
static int print_formulation(const kt_findings *findings, kt_formulation formulation) {
    printf("in %s coordinates\n", kt_formulation_name(formulation));
    for (int type = 0; type < KT_DAE_COUNT; type++)
        for (int m = 0; m < METHODS; m++) {
            kt_error error = {0};
            kt_dae_options options = kt_dae_options_default((kt_dae_type)type);
            options.method = kt_method_find(methods[m]);
            const kt_status status = print_baseline_method(findings, &options, formulation, &error);
            if (status == KT_ERROR_SINGULAR) {
                printf("  %s\n", error.message);
                return KT_EXIT_DONE;
            }
            if (status != KT_OK)
                return kt_say_status(status, &error);
        }
    return KT_EXIT_DONE;
}

int kt_findings_print_baselines(const kt_findings *findings) {
    printf("Differential-algebraic baselines over %.3g s: the largest errors at %d records; those of multipliers over "
           "the\n"
           "largest multiplier; orders of positions, velocities and multipliers between a step and the one above\n"
           "    %8s  %8s %8s %8s  %8s %8s  %8s   %s\n",
           findings->results->duration, findings->results->records, "step, s", "position", "velocity", "multipl.",
           "open", "rates off", "condition", "orders");
    const int code = print_formulation(findings, KT_FORMULATION_TREE);
    return code == KT_EXIT_DONE ? print_formulation(findings, KT_FORMULATION_ABSOLUTE) : code;
}
