/* Completion scripts for bash, zsh and fish, generated from the tables of options.
 *
 * The help shows a word for each argument, which determines its completion. FILE is any file. SCENE is a *.yaml file,
 * ROBOT a *.urdf file, RESULT a *.csv file. NAME of demo is a bundled scene. a|b|c is one of these words. The option
 * --integrator takes a method. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/text.h"
#include "text/reference.h"

#include <stdio.h>
#include <string.h>

/* Calls put(subcommand, option) for each option of a subcommand, including those of the subcommands in `also`. */
static void for_each_option(const kt_subcommand *subcommand, void put(const kt_subcommand *, const kt_option *)) {
    for (const kt_usage *usage = subcommand->usage; usage != NULL; usage = usage->also)
        for (size_t i = 0; i < usage->option_count; i++)
            put(subcommand, &usage->options[i]);
}

static bool takes_file(const kt_option *option) {
    return option->type == KT_OPTION_TEXT && kt_text_begins(option->argument, "FILE");
}

/* The methods are those that the command lists. */
static bool takes_method(const kt_option *option) { return strcmp(option->name, "integrator") == 0; }

#define LISTED_METHODS " integrators 2>/dev/null | sed -n \"2,/^\\$/s/ .*//p\""

/* Prints a|b|c as "a b c". */
static void put_words(const char *choices) {
    for (; *choices != '\0'; choices++)
        putchar(*choices == '|' ? ' ' : *choices);
}

static void put_subcommands(const kt_overview *all) {
    for (size_t i = 0; i < all->count; i++)
        printf("%s%s", i > 0 ? " " : "", all->subcommands[i].name);
}

/* Extension of the files that are operands; NULL: the operands are not files. */
static const char *operand_ending(const kt_usage *usage) {
    return kt_text_begins(usage->operands, "SCENE")    ? "yaml"
           : kt_text_begins(usage->operands, "ROBOT")  ? "urdf"
           : kt_text_begins(usage->operands, "RESULT") ? "csv"
                                                       : NULL;
}

static bool takes_bundled_scene(const kt_usage *usage) { return kt_text_begins(usage->operands, "[NAME"); }

static bool takes_subcommand(const kt_usage *usage) { return kt_text_begins(usage->operands, "[SUBCOMMAND"); }

static bool takes_word(const kt_usage *usage) { return strchr(usage->operands, '|') != NULL; }

/* Prints the words of which one is the operand, or an option's value, between two texts. */
static void put_operand_words(const char *before, const kt_overview *all, const kt_usage *usage, const char *after) {
    fputs(before, stdout);
    if (takes_subcommand(usage))
        put_subcommands(all);
    else
        put_words(usage->operands);
    fputs(after, stdout);
}

static void put_choices(const char *before, const kt_option *option, const char *after) {
    fputs(before, stdout);
    put_words(option->choices);
    fputs(after, stdout);
}

/* Prints text for use within single quotes: ' as `quote`, and each character of `special` after a backslash. */
static void put_quoted(const char *text, const char *special, const char *quote) {
    for (; *text != '\0'; text++) {
        if (*text == '\'')
            fputs(quote, stdout);
        else
            printf(strchr(special, *text) != NULL ? "\\%c" : "%c", *text);
    }
}

/* ---- bash -------------------------------------------------------------------------------------------------------- */

static void put_bash_value(const kt_subcommand *subcommand, const kt_option *option) {
    if (option->type == KT_OPTION_FLAG)
        return;
    printf("    '%s --%s') ", subcommand->name, option->name);
    if (option->type == KT_OPTION_CHOICE) {
        put_choices("words='", option, "' ;;\n");
    } else if (takes_method(option)) {
        puts("words=$(\"${COMP_WORDS[0]}\"" LISTED_METHODS ") ;;");
    } else {
        puts(takes_file(option) ? "files='' ;;" : "return ;;");
    }
}

static void put_bash_name(const kt_subcommand *subcommand, const kt_option *option) {
    (void)subcommand;
    printf("--%s ", option->name);
}

static void put_bash_operands(const kt_overview *all, const kt_usage *usage) {
    if (operand_ending(usage) != NULL)
        printf(" files='!*.%s'", operand_ending(usage));
    if (takes_bundled_scene(usage))
        fputs(" words=$(\"${COMP_WORDS[0]}\" demo 2>/dev/null | cut -d ' ' -f 1)", stdout);
    if (takes_word(usage))
        put_operand_words(" words='", all, usage, "'");
}

static void print_bash(const kt_overview *all) {
    puts("# Completes command lines of kinetree in bash; written by 'kinetree help --completion bash'.\n"
         "_kinetree() {\n"
         "    local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} command=${COMP_WORDS[1]}\n"
         "    local words='' options='' files\n"
         "    COMPREPLY=()\n"
         "    [ \"$COMP_CWORD\" -gt 1 ] || command=''\n"
         "    # --name=value arrives as three words\n"
         "    if [ \"$word\" = = ]; then word=''\n"
         "    elif [ \"$before\" = = ]; then before=${COMP_WORDS[COMP_CWORD - 2]}; fi\n"
         "    case \"$command $before\" in");
    for (size_t i = 0; i < all->count; i++)
        for_each_option(&all->subcommands[i], put_bash_value);
    fputs("    ' '*) options='--help --version' words='", stdout);
    put_subcommands(all);
    puts("' ;;");
    for (size_t i = 0; i < all->count; i++) {
        printf("    '%s '*) options='", all->subcommands[i].name);
        for_each_option(&all->subcommands[i], put_bash_name);
        fputs("--help'", stdout);
        put_bash_operands(all, all->subcommands[i].usage);
        puts(" ;;");
    }
    puts("    esac\n"
         "    case $word in\n"
         "    -*) words=\"$options $words\" ;;\n"
         "    esac\n"
         "    mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$word\")\n"
         "    if [ -n \"${files+set}\" ]; then\n"
         "        compopt -o filenames 2>/dev/null\n"
         "        mapfile -t -O \"${#COMPREPLY[@]}\" COMPREPLY < <(compgen -f -X \"$files\" -- \"$word\"\n"
         "            [ -z \"$files\" ] || compgen -d -- \"$word\")\n"
         "    fi\n"
         "}\n"
         "complete -F _kinetree kinetree");
}

/* ---- zsh --------------------------------------------------------------------------------------------------------- */

static void put_zsh_option(const kt_subcommand *subcommand, const kt_option *option) {
    (void)subcommand;
    printf(" \\\n            '%s--%s%s[", option->type == KT_OPTION_SETTING ? "*" : "", option->name,
           option->type != KT_OPTION_FLAG ? "=" : "");
    put_quoted(option->help, "[]:\\", "'\\''");
    putchar(']');
    if (option->type == KT_OPTION_CHOICE) {
        printf(":%s:", option->argument);
        put_choices("(", option, ")");
    } else if (takes_method(option)) {
        printf(":%s:($(kinetree" LISTED_METHODS "))", option->argument);
    } else if (option->type != KT_OPTION_FLAG) {
        printf(":%s:%s", option->argument, takes_file(option) ? "_files" : " ");
    }
    putchar('\'');
}

static void put_zsh_operands(const kt_overview *all, const kt_usage *usage) {
    if (operand_ending(usage) != NULL)
        printf(" \\\n            '*:file:_files -g \"*.%s\"'", operand_ending(usage));
    if (takes_bundled_scene(usage))
        fputs(" \\\n            '1:scene:($(kinetree demo 2>/dev/null | cut -d \" \" -f 1))'", stdout);
    if (takes_word(usage))
        put_operand_words(" \\\n            '1:word:(", all, usage, ")'");
}

static void print_zsh(const kt_overview *all) {
    puts("#compdef kinetree\n"
         "# Completes command lines of kinetree in zsh; written by 'kinetree help --completion zsh'.\n"
         "_kinetree() {\n"
         "    local -a subcommands\n"
         "    subcommands=(");
    for (size_t i = 0; i < all->count; i++) {
        printf("        '%s:", all->subcommands[i].name);
        put_quoted(all->subcommands[i].summary, "\\", "'\\''");
        puts("'");
    }
    puts("    )\n"
         "    if (( CURRENT == 2 )); then\n"
         "        _describe subcommand subcommands\n"
         "        return\n"
         "    fi\n"
         "    shift words\n"
         "    (( CURRENT-- ))\n"
         "    case $words[1] in");
    for (size_t i = 0; i < all->count; i++) {
        printf("    %s)\n        _arguments", all->subcommands[i].name);
        for_each_option(&all->subcommands[i], put_zsh_option);
        fputs(" \\\n            '--help[show examples and options]'", stdout);
        put_zsh_operands(all, all->subcommands[i].usage);
        puts("\n        ;;");
    }
    puts("    esac\n"
         "}\n"
         "_kinetree \"$@\"");
}

/* ---- fish -------------------------------------------------------------------------------------------------------- */

static void put_fish_option(const kt_subcommand *subcommand, const kt_option *option) {
    printf("complete -c kinetree -n '__fish_seen_subcommand_from %s' -l %s", subcommand->name, option->name);
    if (option->type == KT_OPTION_CHOICE) {
        put_choices(" -x -a '", option, "'");
    } else if (takes_method(option)) {
        fputs(" -x -a '(kinetree" LISTED_METHODS ")'", stdout);
    } else if (option->type != KT_OPTION_FLAG) {
        fputs(takes_file(option) ? " -r -F" : " -x", stdout);
    }
    fputs(" -d '", stdout);
    put_quoted(option->help, "\\", "\\'");
    puts("'");
}

static void put_fish_operands(const kt_overview *all, const kt_subcommand *subcommand) {
    const kt_usage *usage = subcommand->usage;
    const char *ending = operand_ending(usage);
    if (ending == NULL && !takes_bundled_scene(usage) && !takes_word(usage))
        return;
    printf("complete -c kinetree -n '__fish_seen_subcommand_from %s' -a '", subcommand->name);
    if (ending != NULL)
        printf("(__fish_complete_suffix .%s)", ending);
    if (takes_bundled_scene(usage))
        fputs("(kinetree demo 2>/dev/null | string replace -r \" .*\" \"\")", stdout);
    if (takes_word(usage))
        put_operand_words("", all, usage, "");
    puts("'");
}

static void print_fish(const kt_overview *all) {
    puts("# Completes command lines of kinetree in fish; written by 'kinetree help --completion fish'.\n"
         "complete -c kinetree -f\n"
         "complete -c kinetree -l help -d 'show examples and options'\n"
         "complete -c kinetree -n __fish_use_subcommand -l version -d 'show the version'");
    for (size_t i = 0; i < all->count; i++) {
        printf("complete -c kinetree -n __fish_use_subcommand -a %s -d '", all->subcommands[i].name);
        put_quoted(all->subcommands[i].summary, "\\", "\\'");
        puts("'");
        for_each_option(&all->subcommands[i], put_fish_option);
        put_fish_operands(all, &all->subcommands[i]);
    }
}

void kt_completion_print(const kt_overview *all, int shell) {
    static void (*const print[])(const kt_overview *) = {print_bash, print_zsh,
                                                         print_fish}; /* in the order of KT_SHELLS */
    print[shell](all);
}
