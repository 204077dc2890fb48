/* Every run of a study as a line of CSV. */
#include "accuracy.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* Numbers read back to the same bits; what is not known stays empty. */
static void put(FILE *file, double value) {
    if (isnan(value))
        fputc(',', file);
    else
        fprintf(file, ",%.17g", value);
}

static void write_point(FILE *file, const char *variant, const kt_accuracy_curve *curve,
                        const kt_accuracy_point *point) {
    const kt_accuracy_error *error = &point->error;
    fprintf(file, "%s,%s,%d,%s,%.17g,%s", variant, curve->method->name, curve->method->order,
            curve->adaptive ? "tolerance" : "step", point->setting,
            point->status != KT_OK ? "failed"
            : !point->usable       ? "unusable"
            : point->believed      ? "ok"
                                   : "below the reference");
    put(file, error->position);
    put(file, error->velocity);
    put(file, error->end_position);
    put(file, error->end_velocity);
    put(file, error->energy);
    put(file, error->constraint.position);
    put(file, error->constraint.velocity);
    fprintf(file, ",%llu,%llu,%llu,%llu", (unsigned long long)point->counts.steps,
            (unsigned long long)point->counts.rejected, (unsigned long long)point->counts.evaluations,
            (unsigned long long)point->counts.factorizations);
    put(file, point->cpu);
    put(file, isnan(point->cpu) ? (double)NAN : point->spread);
    fprintf(file, ",%d,%d,%d\n", point->repeats, point->cheapest, point->fewest);
}

int kt_findings_write(const kt_findings *findings, const char *path) {
    const kt_accuracy_results *results = findings->results;
    const bool is_output = strcmp(path, "-") == 0;
    FILE *file = is_output ? stdout : fopen(path, "w");
    if (file == NULL) {
        kt_say("%s cannot be written: %s", path, strerror(errno));
        return KT_EXIT_INTEGRATION;
    }
    fputs("variant,method,order,kind,setting,status,error.position,error.velocity,error.end.position,"
          "error.end.velocity,error.energy,constraint.position,constraint.velocity,steps,rejected,evaluations,"
          "factorizations,cpu,cpu.spread,repeats,cheapest,fewest\n",
          file);
    for (int c = 0; c < results->curve_count; c++) {
        const kt_accuracy_curve *curve = &results->curves[c];
        const char *label = results->variants[curve->variant].label;
        for (int i = 0; i < curve->count; i++)
            write_point(file, label != NULL ? label : "", curve, &results->points[curve->first + i]);
    }
    const bool failed = ferror(file) != 0;
    if (is_output)
        return kt_finish_output(KT_EXIT_DONE);
    if (fclose(file) == 0 && !failed)
        return KT_EXIT_DONE;
    kt_say("%s cannot be written: %s", path, strerror(errno));
    return KT_EXIT_INTEGRATION;
}
