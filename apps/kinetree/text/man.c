/* Writes man pages in the macros of man(7), generated from the tables of options. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "text/reference.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>

/* Prints text such that roff finds no requests and no escapes in it; a minus remains an ASCII minus that can be
 * copied. */
static void put_roff_text(const char *text, size_t length) {
    if (length > 0 && (*text == '.' || *text == '\''))
        fputs("\\&", stdout);
    for (size_t i = 0; i < length; i++) {
        switch (text[i]) {
        case '\\':
            fputs("\\e", stdout);
            break;
        case '-':
            fputs("\\-", stdout);
            break;
        case '\'':
            fputs("\\(aq", stdout);
            break;
        case '`':
            fputs("\\(ga", stdout);
            break;
        case '^':
            fputs("\\(ha", stdout);
            break;
        case '~':
            fputs("\\(ti", stdout);
            break;
        default:
            putchar(text[i]);
        }
    }
}

static void put_roff(const char *text) { put_roff_text(text, strlen(text)); }

/* Prints lines as running text; indented lines are printed verbatim, and an empty line ends a paragraph. */
static void put_lines(const char *text) {
    bool is_verbatim = false;
    while (*text != '\0') {
        const size_t length = strcspn(text, "\n");
        if ((*text == ' ') != is_verbatim)
            puts(is_verbatim ? ".fi" : ".nf");
        is_verbatim = *text == ' ';
        if (length > 0)
            put_roff_text(text, length);
        else
            fputs(".PP", stdout);
        putchar('\n');
        text += length + (text[length] == '\n');
    }
    if (is_verbatim)
        puts(".fi");
}

/* Prints ".BR kinetree-NAME (1)"; name: NULL for the page of the whole command. */
static void put_reference(const char *name, const char *end) {
    printf(".BR kinetree%s%s (1)%s\n", name != NULL ? "\\-" : "", name != NULL ? name : "", end);
}

static void put_title(const char *name, const char *summary) {
    fputs(name != NULL ? ".TH KINETREE\\-" : ".TH KINETREE", stdout);
    for (const char *c = name; c != NULL && *c != '\0'; c++)
        putchar(toupper((unsigned char)*c));
    printf(" 1 \"\" \"kinetree %s\" \"Kinetree\"\n.SH NAME\nkinetree%s%s \\- ", kt_version(), name != NULL ? "\\-" : "",
           name != NULL ? name : "");
    put_roff(summary);
    putchar('\n');
}

static void put_option(const kt_option *option) {
    fputs(".TP\n\\fB\\-\\-", stdout);
    put_roff(option->name);
    fputs("\\fR", stdout);
    if (option->argument != NULL) {
        fputs(" \\fI", stdout);
        put_roff(option->argument);
        fputs("\\fR", stdout);
    }
    putchar('\n');
    put_roff(option->help);
    if (option->type == KT_OPTION_CHOICE) {
        fputs(" (", stdout);
        put_roff(option->choices);
        putchar(')');
    }
    putchar('\n');
}

static void put_options(const kt_usage *usage) {
    puts(".SH OPTIONS");
    for (size_t i = 0; i < usage->option_count; i++) {
        const char *title = kt_group_title(usage, &usage->options[i]);
        if (title != NULL)
            printf(".SS %s\n", title);
        put_option(&usage->options[i]);
    }
    if (usage->also != NULL) {
        puts(".PP\nAll options of");
        put_reference(usage->also->command, "");
        puts("are accepted, too.");
    }
    puts(".TP\n\\fB\\-\\-help\\fR\nshow examples and options, and end");
}

static void print_subcommand(const kt_overview *overview, const kt_subcommand *subcommand) {
    const kt_usage *usage = subcommand->usage;
    put_title(subcommand->name, subcommand->summary);
    printf(".SH SYNOPSIS\n.B kinetree %s\n", subcommand->name);
    put_roff(usage->option_count > 0 ? "[OPTION...] " : "");
    put_roff(usage->operands);
    puts("\n.SH DESCRIPTION");
    put_lines(usage->about);
    put_options(usage);
    puts(".SH EXAMPLES");
    put_lines(usage->examples);
    puts(".SH EXIT STATUS");
    put_lines(overview->exit_status);
    puts(".SH SEE ALSO");
    put_reference(NULL, "");
}

static void print_man_overview(const kt_overview *overview) {
    put_title(NULL, overview->summary);
    puts(".SH SYNOPSIS\n.B kinetree\nSUBCOMMAND ...\n.br\n.B kinetree \\-\\-help\n.br\n.B kinetree \\-\\-version\n.SH "
         "SUBCOMMANDS");
    for (size_t i = 0; i < overview->count; i++) {
        printf(".TP\n.B %s\n", overview->subcommands[i].name);
        put_roff(overview->subcommands[i].summary);
        putchar('\n');
    }
    puts(".SH EXAMPLES");
    put_lines(overview->examples);
    puts(".SH EXIT STATUS");
    put_lines(overview->exit_status);
    puts(".SH SEE ALSO");
    for (size_t i = 0; i < overview->count; i++)
        put_reference(overview->subcommands[i].name, i + 1 < overview->count ? "," : "");
}

void kt_man_print(const kt_overview *overview, const kt_subcommand *subcommand) {
    if (subcommand != NULL)
        print_subcommand(overview, subcommand);
    else
        print_man_overview(overview);
}
