/* The command line of a subcommand: a table of options, read into a plain struct. */
#ifndef KT_COMMAND_ARGUMENTS_H
#define KT_COMMAND_ARGUMENTS_H

#include <stddef.h>

/* What an option takes, and the type of the member that it fills. */
typedef enum kt_option_type {
    KT_OPTION_FLAG,     /* nothing; bool */
    KT_OPTION_TEXT,     /* anything; const char * */
    KT_OPTION_NUMBER,   /* a finite number; double */
    KT_OPTION_POSITIVE, /* a number above zero; double */
    KT_OPTION_ANGLE,    /* a finite number, of degrees where "deg" follows; double, rad */
    KT_OPTION_COUNT,    /* a whole number, zero or more; long */
    KT_OPTION_CHOICE,   /* one of the words of `choices`; int, its place among them */
} kt_option_type;

typedef struct kt_option {
    const char *name; /* without the dashes */
    kt_option_type type;
    size_t offset;        /* of the member */
    const char *argument; /* how the help calls what it takes: "FILE" */
    const char *help;
    const char *choices; /* "qr|partition|svd" */
} kt_option;

typedef struct kt_usage {
    const char *command;  /* "run" */
    const char *examples; /* lines, shown first */
    const char *operands; /* "SCENE" */
    int least, most;      /* number of operands; most < 0: any number */
    const char *about;    /* lines, shown after the examples */
    const kt_option *options;
    size_t option_count;
    const struct kt_usage *also; /* NULL, or of whom it takes all options, too; they are shown there */
} kt_usage;

/* Reads argv[1] onwards. Members whose options are not given keep their values; the operands are moved to the front,
 * argv[1] onwards, and counted. Both "--name value" and "--name=value" are read, and "--" ends the options.
 * Returns -1: go on; otherwise the exit code to end with: help was asked for and shown, or something is wrong and was
 * said. */
int kt_arguments_read(const kt_usage *usage, int argc, char **argv, void *members, int *operand_count);

/* What --help shows, on standard output. */
void kt_usage_print(const kt_usage *usage);

#endif
