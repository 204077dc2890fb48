/* Parses command lines by tables of options. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "text/arguments.h"

#include "base/decimal.h"
#include "command.h"
#include "text/list.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double radians_per_degree = 3.14159265358979323846 / 180.0;

/* ---- help -------------------------------------------------------------------------------------------------------- */

enum { HELP_WIDTH = 100, OPTION_WIDTH = 27 };

/* Prints the words of a text, wrapped. The first line begins at a column, the next ones after an indentation. */
static void print_wrapped(const char *text, size_t length, size_t column, size_t indentation) {
    const char *end = text + length;
    bool is_first = true;
    while (text < end) {
        const size_t gap = strspn(text, " \n"), word = strcspn(text + gap, " \n");
        const size_t shown = text + gap + word > end ? 0 : word;
        if (shown > 0 && !is_first && column + 1 + shown > HELP_WIDTH) {
            printf("\n%*s", (int)indentation, "");
            column = indentation;
        } else if (shown > 0 && !is_first) {
            putchar(' ');
            column++;
        }
        printf("%.*s", (int)shown, text + gap);
        column += shown;
        is_first = is_first && shown == 0;
        text += gap + word;
    }
    putchar('\n');
}

/* Prints paragraphs, wrapped; lines that are indented or empty are printed as they are. */
static void print_about(const char *text) {
    while (*text != '\0') {
        size_t length = strcspn(text, "\n");
        if (length == 0 || *text == ' ') {
            printf("%.*s\n", (int)length, text);
        } else {
            while (text[length] == '\n' && strchr(" \n", text[length + 1]) == NULL)
                length += 1 + strcspn(text + length + 1, "\n");
            print_wrapped(text, length, 0, 0);
        }
        text += length + (text[length] == '\n');
    }
}

const char *kt_group_title(const kt_usage *usage, const kt_option *option) {
    for (const kt_option_group *group = usage->groups; group != NULL && group->title != NULL; group++)
        if (strcmp(group->first, option->name) == 0)
            return group->title;
    return NULL;
}

static void print_option(const kt_option *option) {
    char left[64], help[1024];
    snprintf(left, sizeof left, "--%s%s%s", option->name, option->argument != NULL ? " " : "",
             option->argument != NULL ? option->argument : "");
    if (printf("  %-24s ", left) > OPTION_WIDTH)
        printf("\n%*s", OPTION_WIDTH, "");
    const bool is_choice = option->type == KT_OPTION_CHOICE;
    snprintf(help, sizeof help, "%s%s%s%s", option->help, is_choice ? " (" : "", is_choice ? option->choices : "",
             is_choice ? ")" : "");
    print_wrapped(help, strlen(help), OPTION_WIDTH, OPTION_WIDTH);
}

void kt_usage_print(const kt_usage *usage) {
    printf("Examples\n%s\nUsage: kinetree %s%s%s%s\n\n", usage->examples, usage->command,
           usage->option_count > 0 ? " [OPTION...]" : "", *usage->operands != '\0' ? " " : "", usage->operands);
    print_about(usage->about);
    if (usage->option_count > 0 && usage->groups == NULL)
        fputs("\nOptions\n", stdout);
    for (size_t i = 0; i < usage->option_count; i++) {
        const char *title = kt_group_title(usage, &usage->options[i]);
        if (title != NULL)
            printf("\n%s\n", title);
        print_option(&usage->options[i]);
    }
}

/* ---- values ------------------------------------------------------------------------------------------------------ */

static bool read_real(const kt_option *option, const char *text, double *member) {
    double value;
    const char *rest;
    if (!kt_decimal_read(text, &value, &rest))
        return false;
    if (option->type == KT_OPTION_ANGLE) {
        while (*rest == ' ')
            rest++;
        if (strcmp(rest, "deg") == 0) {
            value *= radians_per_degree;
            rest += strlen("deg");
        }
    }
    if (*rest != '\0' || (option->type == KT_OPTION_POSITIVE && !(value > 0.0)))
        return false;
    *member = value;
    return true;
}

static bool read_count(const char *text, long *member) {
    char *end;
    if (*text < '0' || *text > '9')
        return false;
    errno = 0;
    long value = strtol(text, &end, 10);
    if (*end != '\0' || errno != 0)
        return false;
    *member = value;
    return true;
}

enum { CHOICES_MAX = 16, WORD_SIZE = 32 };

/* Splits "a|b|c" into its words. Returns their number. */
static int split_choices(const char *choices, char words[CHOICES_MAX][WORD_SIZE]) {
    int count = 0;
    for (const char *start = choices; start != NULL && count < CHOICES_MAX; count++) {
        const char *bar = strchr(start, '|');
        snprintf(words[count], WORD_SIZE, "%.*s", bar != NULL ? (int)(bar - start) : WORD_SIZE - 1, start);
        start = bar != NULL ? bar + 1 : NULL;
    }
    return count;
}

static int say_wrong_value(const kt_usage *usage, const kt_option *option, const char *text, const char *wanted) {
    return kt_misuse("%s: --%s takes %s, not '%s'", usage->command, option->name, wanted, text);
}

static int read_choice_option(const kt_usage *usage, const kt_option *option, const char *text, int *member) {
    char words[CHOICES_MAX][WORD_SIZE];
    int count = split_choices(option->choices, words);
    kt_nearest nearest = kt_nearest_make(text, NULL);
    for (int i = 0; i < count; i++) {
        if (strcmp(words[i], text) == 0) {
            *member = i;
            return -1;
        }
        (void)kt_nearest_try(&nearest, words[i]);
    }
    return kt_misuse("%s: --%s takes one of %s, not '%s'%s", usage->command, option->name, option->choices, text,
                     kt_ask(&nearest, "", "").text);
}

/* Rejects a list in which a name occurs twice: its column, for example, would be written twice. */
static int read_names_option(const kt_usage *usage, const kt_option *option, const char *text, const char **member) {
    kt_word word, before;
    if (*text == '\0' && option->type == KT_OPTION_NAMES)
        return kt_misuse("%s: --%s: the list is empty", usage->command, option->name);
    if (*text == ',' || strstr(text, ",,") != NULL || (*text != '\0' && text[strlen(text) - 1] == ','))
        return kt_misuse("%s: --%s: a name is missing next to a comma of '%s'", usage->command, option->name, text);
    for (const char *rest = text; kt_word_next(&rest, &word);)
        for (const char *other = text; kt_word_next(&other, &before) && before.text < word.text;)
            if (before.length == word.length && memcmp(before.text, word.text, word.length) == 0)
                return kt_misuse("%s: --%s names '%.*s' twice; remove one", usage->command, option->name,
                                 (int)word.length, word.text);
    *member = text;
    return -1;
}

static int add_setting(const kt_usage *usage, const kt_option *option, const char *text, kt_setting_list *settings) {
    if (strchr(text, '=') == NULL || text[0] == '=')
        return kt_misuse(
            "%s: --%s takes %s%s, not '%s'", usage->command, option->name, option->argument,
            strncmp(option->argument, "LINK=", 5) == 0 ? "" : ", where PATH or NAME is such as L or bodies.arm.mass",
            text);
    if (settings->count == KT_SETTINGS_MAX)
        return kt_misuse("%s: --%s can be given %d times; write the rest into the scene", usage->command, option->name,
                         KT_SETTINGS_MAX);
    settings->text[settings->count++] = text;
    return -1;
}

static int read_option_value(const kt_usage *usage, const kt_option *option, const char *text, void *members) {
    void *member = (char *)members + option->offset;
    switch (option->type) {
    case KT_OPTION_FLAG:
        *(bool *)member = true;
        return -1;
    case KT_OPTION_TEXT:
        *(const char **)member = text;
        return -1;
    case KT_OPTION_NAMES:
    case KT_OPTION_ANY_NAMES:
        return read_names_option(usage, option, text, member);
    case KT_OPTION_NUMBER:
        return read_real(option, text, member) ? -1 : say_wrong_value(usage, option, text, "a number");
    case KT_OPTION_POSITIVE:
        return read_real(option, text, member) ? -1 : say_wrong_value(usage, option, text, "a number above zero");
    case KT_OPTION_ANGLE:
        return read_real(option, text, member)
                   ? -1
                   : say_wrong_value(usage, option, text, "an angle in radians, or in degrees as in 30deg");
    case KT_OPTION_COUNT:
        return read_count(text, member) ? -1 : say_wrong_value(usage, option, text, "a whole number");
    case KT_OPTION_SEVERAL:
        return read_count(text, member) && *(const long *)member > 0
                   ? -1
                   : say_wrong_value(usage, option, text, "a whole number above zero");
    case KT_OPTION_SETTING:
        return add_setting(usage, option, text, member);
    case KT_OPTION_CHOICE:
        return read_choice_option(usage, option, text, member);
    }
    return -1;
}

/* ---- reading ----------------------------------------------------------------------------------------------------- */

static const kt_option *find_option(const kt_usage *usage, const char *name, size_t length) {
    for (size_t i = 0; i < usage->option_count; i++) {
        const char *candidate = usage->options[i].name;
        if (strlen(candidate) == length && memcmp(candidate, name, length) == 0)
            return &usage->options[i];
    }
    return NULL;
}

/* Options that had another name in earlier versions. */
static const struct { const char *before, *now; } renamed[] = {{"compare-sets", "formulations"}};

/* Options of import that users also try with other subcommands. */
static const char *const of_import[] = {"keyframe", "floating", "stops",  "stop-damping", "inertia", "allow",
                                        "density",  "mass",     "search", "contacts",     "ground"};

static int say_unknown_option(const kt_usage *usage, const char *argument, size_t length) {
    char name[64];
    snprintf(name, sizeof name, "%.*s", (int)(length < sizeof name ? length : sizeof name - 1), argument);
    for (size_t i = 0; i < sizeof renamed / sizeof *renamed; i++)
        if (strcmp(name, renamed[i].before) == 0 && find_option(usage, renamed[i].now, strlen(renamed[i].now)))
            return kt_misuse("%s: the option '--%s' is called '--%s' now", usage->command, name, renamed[i].now);
    kt_nearest nearest = kt_nearest_make(name, NULL);
    for (size_t i = 0; i < usage->option_count; i++)
        (void)kt_nearest_try(&nearest, usage->options[i].name);
    for (size_t i = 0; i < sizeof of_import / sizeof *of_import; i++)
        if (strcmp(name, of_import[i]) == 0)
            return kt_misuse("%s: '--%s' is an option of 'kinetree import', which writes a scene for '%s' to read",
                             usage->command, name, usage->command);
    if (nearest.best != NULL)
        kt_say("%s: there is no option '--%s'%s", usage->command, name, kt_ask(&nearest, "--", "").text);
    else
        kt_say("%s: there is no option '--%s'; 'kinetree %s --help' lists them", usage->command, name, usage->command);
    return KT_EXIT_USAGE;
}

/* Returns the option that an argument is, "--NAME" or "--NAME=value"; NULL: it is none. */
static const kt_option *option_at(const kt_usage *usage, const char *argument) {
    return strncmp(argument, "--", 2) == 0 ? find_option(usage, argument + 2, strcspn(argument + 2, "=")) : NULL;
}

static bool is_help(const char *argument) { return strcmp(argument, "--help") == 0 || strcmp(argument, "-h") == 0; }

enum { OPTIONS_MAX = 64 };

/* Of every subcommand that has both options. */
static const kt_option_rule quiet_or_verbose = {"quiet", false, "verbose", NULL};

/* Checks one rule for the options that are given, in the order of the usage. */
static int check_rule(const kt_usage *usage, const kt_option_rule *rule, const bool given[OPTIONS_MAX]) {
    const kt_option *found = NULL;
    char needed[128] = "";
    size_t used = 0;
    kt_word word;
    if (!given[find_option(usage, rule->option, strlen(rule->option)) - usage->options])
        return -1;
    for (const char *rest = rule->others; found == NULL && kt_word_next(&rest, &word);) {
        const kt_option *other = find_option(usage, word.text, word.length);
        found = given[other - usage->options] ? other : NULL;
        if (rule->needs && used < sizeof needed)
            used +=
                (size_t)snprintf(needed + used, sizeof needed - used, "%s--%s%s%s", used > 0 ? " or " : "", other->name,
                                 other->argument != NULL ? " " : "", other->argument != NULL ? other->argument : "");
    }
    if ((found != NULL) == rule->needs)
        return -1;
    if (rule->words != NULL)
        return kt_misuse("%s: %s%s", usage->command, rule->words,
                         strcmp(rule->words + strlen(rule->words) - 2, "--") == 0 ? found->name : "");
    if (rule->needs)
        return kt_misuse("%s: --%s has nothing to act on: %s goes with it", usage->command, rule->option, needed);
    return kt_misuse("%s: --%s and --%s exclude each other", usage->command, rule->option, found->name);
}

/* Reads the option at argv[*index], which starts with two dashes, and moves *index to the last word of the option. */
static int read_option(const kt_usage *usage, int argc, char **argv, int *index, void *members,
                       bool given[OPTIONS_MAX]) {
    const char *name = argv[*index] + 2;
    const char *equals = strchr(name, '=');
    const kt_option *option = option_at(usage, argv[*index]);
    if (option == NULL)
        return say_unknown_option(usage, name, strcspn(name, "="));
    given[option - usage->options] = true;
    if (option->type == KT_OPTION_FLAG) {
        if (equals == NULL)
            return read_option_value(usage, option, NULL, members);
        return kt_misuse("%s: --%s takes nothing; leave out '%s'", usage->command, option->name, equals);
    }
    if (equals != NULL)
        return read_option_value(usage, option, equals + 1, members);
    if (*index + 1 >= argc)
        return kt_misuse("%s: --%s must be followed by its %s", usage->command, option->name, option->argument);
    if (option_at(usage, argv[*index + 1]) != NULL || is_help(argv[*index + 1]))
        return kt_misuse("%s: --%s must be followed by its %s, and '%s' is an option; --%s=%s takes it as it is",
                         usage->command, option->name, option->argument, argv[*index + 1], option->name,
                         argv[*index + 1]);
    return read_option_value(usage, option, argv[++*index], members);
}

int kt_arguments_read(const kt_usage *usage, int argc, char **argv, void *members, int *operand_count) {
    int count = 0;
    bool options_ended = false, given[OPTIONS_MAX] = {false};
    for (int i = 1; i < argc; i++) {
        const char *argument = argv[i];
        if (options_ended || argument[0] != '-' || argument[1] == '\0') {
            argv[1 + count++] = argv[i];
        } else if (strcmp(argument, "--") == 0) {
            options_ended = true;
        } else if (is_help(argument)) {
            kt_usage_print(usage);
            return kt_finish_output(KT_EXIT_DONE);
        } else if (argument[1] != '-') {
            return kt_misuse("%s: there is no option '%s'; 'kinetree %s --help' lists them", usage->command, argument,
                             usage->command);
        } else {
            int code = read_option(usage, argc, argv, &i, members, given);
            if (code >= 0)
                return code;
        }
    }
    const size_t length = strlen(usage->operands);
    const bool takes_any = length > 3 && strcmp(usage->operands + length - 3, "...") == 0;
    const int least = length > 0 && usage->operands[0] != '[', most = takes_any ? count : length > 0;
    if (count < least || count > most) {
        const bool has_forms = strchr(usage->operands, ',') != NULL;
        if (count < least)
            kt_say("%s: %s%s%s; 'kinetree %s --help' has examples", usage->command,
                   has_forms ? "a file is missing: " : "", usage->operands, has_forms ? "" : " is missing",
                   usage->command);
        else
            kt_say("%s: '%s' is one word too many; 'kinetree %s --help' has examples", usage->command, argv[1 + most],
                   usage->command);
        return KT_EXIT_USAGE;
    }
    int code =
        find_option(usage, "verbose", strlen("verbose")) != NULL ? check_rule(usage, &quiet_or_verbose, given) : -1;
    for (size_t i = 0; i < usage->rule_count && code < 0; i++)
        code = check_rule(usage, &usage->rules[i], given);
    if (code >= 0)
        return code;
    if (operand_count != NULL)
        *operand_count = count;
    return -1;
}
