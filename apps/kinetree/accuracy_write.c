/* Every run of a study as a line of CSV. */
#include "accuracy.h"
#include "output.h"

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

static int write_points(const kt_accuracy_results *results, FILE *file) {
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
    return fflush(file) != 0 || ferror(file) != 0;
}

int kt_findings_write(const kt_findings *findings, const char *path) {
    kt_output output;
    if (strcmp(path, "-") == 0) {
        (void)write_points(findings->results, stdout);
        return kt_finish_output(KT_EXIT_DONE);
    }
    int code = kt_output_start(&output, path);
    if (code >= 0)
        return code;
    errno = 0;
    FILE *file = fopen(kt_output_path(&output), "w");
    bool failed = file == NULL || write_points(findings->results, file) != 0;
    const int reason = errno;
    if (file != NULL)
        failed = fclose(file) != 0 || failed;
    if (failed)
        kt_say("%s cannot be written: %s", path, strerror(reason != 0 ? reason : errno));
    if (kt_output_end(&output, failed ? KT_OUTPUT_NOTHING : KT_OUTPUT_WHOLE) != 0)
        failed = true;
    return failed ? KT_EXIT_INTEGRATION : KT_EXIT_DONE;
}
