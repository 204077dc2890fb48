/* What a run was and came to, in a few lines for people. */
#include "run.h"

#include <stdio.h>
#include <string.h>

static const char *plural(long long count) { return count == 1 ? "" : "s"; }

/* "3 bodies, 1 loop, 1 degree of freedom" */
static void say_size(const kt_outcome *outcome) {
    int bodies = kt_model_body_count(outcome->model) - 1, loops = kt_loop_count(outcome->model);
    kt_mobility dof = kt_model_mobility(outcome->model);
    fprintf(stderr, "  %d bod%s", bodies, bodies == 1 ? "y" : "ies");
    if (loops > 0)
        fprintf(stderr, ", %d loop%s", loops, plural(loops));
    fprintf(stderr, ", %d degree%s of freedom", dof.minimal, plural(dof.minimal));
}

static void say_method(const kt_run *run) {
    fprintf(stderr, ", %s", run->integrator);
    if (run->step > 0.0)
        fprintf(stderr, " with steps of %g s\n", run->step);
    else if (run->relative == run->absolute)
        fprintf(stderr, " at tolerance %g\n", run->relative);
    else
        fprintf(stderr, " at tolerances %g relative, %g absolute\n", run->relative, run->absolute);
}

static void say_cost(const kt_outcome *outcome, double time) {
    kt_simulation_counts counts = kt_simulation_counts_get(outcome->simulation);
    fprintf(stderr, "  %llu step%s", (unsigned long long)counts.steps, plural((long long)counts.steps));
    if (counts.rejected > 0)
        fprintf(stderr, " (%llu rejected)", (unsigned long long)counts.rejected);
    fprintf(stderr, ", %llu evaluations, %.3g s of CPU time", (unsigned long long)counts.evaluations,
            outcome->cpu_seconds);
    if (outcome->cpu_seconds > 0.0 && time > 0.0)
        fprintf(stderr, ": %.3g times real time", time / outcome->cpu_seconds);
    fputc('\n', stderr);
}

static void say_file(const char *what, const char *path) {
    if (path != NULL)
        fprintf(stderr, "  %s: %s\n", what, strcmp(path, "-") == 0 ? "standard output" : kt_show(path).text);
}

void kt_report_outcome(const kt_outcome *outcome, const char *out, const char *summary, const char *plot) {
    double time = kt_simulation_time(outcome->simulation), duration = outcome->run->duration;
    fprintf(stderr, "%s: %g s simulated", kt_show(outcome->name).text, time);
    if (time < duration)
        fprintf(stderr, " of %g s", duration);
    fputc('\n', stderr);
    say_size(outcome);
    say_method(outcome->run);
    say_cost(outcome, time);
    if (outcome->energy.records > 0)
        fprintf(stderr, "  total energy %g J, %s at most %.2g J\n", outcome->energy.start,
                outcome->energy.energetics == KT_ENERGY_CONSERVED ? "drift" : "change", outcome->energy.change);
    if (outcome->energy.has_balance) {
        const kt_work work = kt_simulation_work(outcome->simulation);
        fprintf(stderr, "  %g J dissipated, %g J supplied: the balance closes to %.2g J\n", work.dissipated,
                work.supplied, outcome->energy.balance_change);
    }
    if (kt_loop_count(outcome->model) > 0 && outcome->records > 0)
        fprintf(stderr, "  loops closed to %.2g m or rad, %.2g m/s or rad/s\n", outcome->constraint.position,
                outcome->constraint.velocity);
    fprintf(stderr, "  %lld record%s: %s\n", (long long)outcome->records, plural(outcome->records),
            strcmp(out, "-") == 0 ? "standard output" : kt_show(out).text);
    say_file("summary", summary);
    say_file("picture", plot);
    if (outcome->replaced[0] != '\0')
        fprintf(stderr, "  replaces an older %s\n", outcome->replaced);
}
