/* The system's compiler: which one, and a call of it. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "command.h"
#include "native/native.h"

#include <errno.h>
#include <fcntl.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/utsname.h>
#include <sys/wait.h>
#include <unistd.h>

extern char **environ;

/* No sum may be fused with a product: bits are then those of all other builds of the file. */
static const char *const flags[] = {"-std=c99", "-O3", "-fPIC", "-shared", "-ffp-contract=off", "-fno-math-errno"};

enum { FLAGS = sizeof flags / sizeof *flags, FLAGS_MOST = FLAGS + 1, SHOWN_LINES = 12 };

/* A flag of all compilations; behind them, one of this processor; then NULL. Instructions with three operands need
 * fewer moves. The bits do not depend on them. */
static const char *flag_of_compiler(int i) {
#ifdef __x86_64__
    if (i == FLAGS && __builtin_cpu_supports("avx2"))
        return "-mavx2";
#endif
    return i < FLAGS ? flags[i] : NULL;
}

/* ---- which compiler ---------------------------------------------------------------------------------------------- */

/* Finds the file of a program, as a shell does. */
static bool find_program(const char *name, char path[KT_NATIVE_PATH]) {
    struct stat status;
    const char *folders = getenv("PATH");
    if (strchr(name, '/') != NULL)
        return snprintf(path, KT_NATIVE_PATH, "%s", name) < KT_NATIVE_PATH && access(path, X_OK) == 0;
    for (const char *at = folders; at != NULL && *at != '\0';) {
        const int length = (int)strcspn(at, ":");
        if (snprintf(path, KT_NATIVE_PATH, "%.*s/%s", length, at, name) < KT_NATIVE_PATH && access(path, X_OK) == 0 &&
            stat(path, &status) == 0 && S_ISREG(status.st_mode))
            return true;
        at += length + (at[length] == ':');
    }
    return false;
}

/* A compiler that was replaced has another size or time, and its files are not taken. Nor are those of other kinds of
 * machines that share the folder. */
static void identify_compiler(kt_compiler *compiler) {
    struct stat status = {.st_size = 0};
    struct utsname machine = {.machine = ""};
    size_t used = 0;
    (void)stat(compiler->program, &status);
    (void)uname(&machine);
    used += (size_t)snprintf(compiler->identity, sizeof compiler->identity, "%s %lld %lld.%09ld %s %s",
                             compiler->program, (long long)status.st_size, (long long)status.st_mtim.tv_sec,
                             (long)status.st_mtim.tv_nsec, machine.sysname, machine.machine);
    for (int i = 1; compiler->word[i] != NULL && used < sizeof compiler->identity; i++)
        used += (size_t)snprintf(compiler->identity + used, sizeof compiler->identity - used, " %s", compiler->word[i]);
    for (int i = 0; flag_of_compiler(i) != NULL && used < sizeof compiler->identity; i++)
        used +=
            (size_t)snprintf(compiler->identity + used, sizeof compiler->identity - used, " %s", flag_of_compiler(i));
}

bool kt_compiler_find(kt_compiler *compiler, const char *command) {
    static const char *const blanks = " \t\n";
    const char *given = getenv("CC");
    const bool is_given = given != NULL && given[strspn(given, blanks)] != '\0';
    char *rest = NULL;
    int count = 0;
    memset(compiler, 0, sizeof *compiler);
    const int length = snprintf(compiler->text, sizeof compiler->text, "%s", is_given ? given : "cc");
    for (char *word = strtok_r(compiler->text, blanks, &rest); word != NULL && count < KT_COMPILER_WORDS;
         word = strtok_r(NULL, blanks, &rest))
        compiler->word[count++] = word;
    if (length >= (int)sizeof compiler->text || count == KT_COMPILER_WORDS) {
        kt_say("%s: --native: the variable CC has more than %d words or %d characters; set it to a "
               "script, or leave --native out",
               command, KT_COMPILER_WORDS - 1, KT_NATIVE_PATH - 1);
        return false;
    }
    if (find_program(compiler->word[0], compiler->program)) {
        identify_compiler(compiler);
        return true;
    }
    kt_say("%s: --native needs a C compiler, and there is no '%s'%s; install gcc or clang, set CC to a compiler, or "
           "leave --native out",
           command, kt_show(compiler->word[0]).text, is_given ? " (the variable CC)" : "");
    return false;
}

/* ---- a call of it ------------------------------------------------------------------------------------------------ */

/* Prints the first lines of what the compiler has printed. */
static void say_log(const char *path) {
    char line[512];
    FILE *log = fopen(path, "r");
    for (int i = 0; log != NULL && i < SHOWN_LINES && fgets(line, sizeof line, log) != NULL; i++) {
        line[strcspn(line, "\n")] = '\0';
        kt_print("  %s\n", kt_show(line).text);
    }
    if (log != NULL)
        (void)fclose(log);
}

/* Starts a program whose output goes to a file, and waits. Returns its exit status; -1 if it could not be started. */
static int call_program(const char *program, char *const *words, const char *log) {
    posix_spawn_file_actions_t actions;
    pid_t child;
    int status = 0;
    if (posix_spawn_file_actions_init(&actions) != 0)
        return -1;
    int code = posix_spawn_file_actions_addopen(&actions, 1, log, O_WRONLY | O_CREAT | O_TRUNC, 0600);
    code = code == 0 ? posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0) : code;
    code = code == 0 ? posix_spawn_file_actions_adddup2(&actions, 1, 2) : code;
    code = code == 0 ? posix_spawn(&child, program, &actions, NULL, words, environ) : code;
    (void)posix_spawn_file_actions_destroy(&actions);
    if (code != 0)
        return -1;
    while (waitpid(child, &status, 0) < 0)
        if (errno != EINTR)
            return -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + (WIFSIGNALED(status) ? WTERMSIG(status) : 0);
}

bool kt_compiler_run(const kt_compiler *compiler, const char *command, const char *folder) {
    char source[KT_NATIVE_PATH + 16], target[KT_NATIVE_PATH + 16], log[KT_NATIVE_PATH + 16];
    char to[] = "-o", math[] = "-lm", flag[FLAGS_MOST][32];
    char *words[KT_COMPILER_WORDS + FLAGS_MOST + 5];
    int count = 0;
    (void)snprintf(source, sizeof source, "%s/native.c", folder);
    (void)snprintf(target, sizeof target, "%s/native.so", folder);
    (void)snprintf(log, sizeof log, "%s/native.log", folder);
    for (; compiler->word[count] != NULL; count++)
        words[count] = compiler->word[count];
    for (int i = 0; flag_of_compiler(i) != NULL; i++) {
        (void)snprintf(flag[i], sizeof flag[i], "%s", flag_of_compiler(i));
        words[count++] = flag[i];
    }
    char *const last[] = {source, to, target, math, NULL};
    memcpy(words + count, last, sizeof last);
    const int code = call_program(compiler->program, words, log);
    if (code == 0 && access(target, R_OK) == 0)
        return true;
    kt_say("%s: --native: the compiler '%s' failed (status %d); set CC to another one, or leave --native out", command,
           kt_show(compiler->program).text, code);
    say_log(log);
    return false;
}
