/* Accelerations by compiled code: run --native, and sweep --native. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_NATIVE_NATIVE_H
#define KT_COMMAND_NATIVE_NATIVE_H

#include "kinetree/codegen.h"
#include "kinetree/scene.h"

#include <stdbool.h>

/* Whether the library is expected to compute accelerations faster than a generated file. This depends on the model
 * alone, so that equal calls give equal records. */
bool kt_native_is_slow(const kt_model *model);

/* Computes what a file makes of the numbers of its parameters. */
typedef void kt_native_renew(const double *numbers, void *prepared);

/* A generated file, loaded into this process. All models of its structure share it. */
typedef struct kt_native_file {
    void *library; /* NULL: none */
    uint64_t structure;
    size_t numbers, prepared; /* bytes */
    kt_native_renew *renew;
    kt_native_acceleration *acceleration;
    double seconds; /* s that the compiler took; 0: the file was in the cache */
} kt_native_file;

/* Generates code for the accelerations of a scene. Compiles the code, or takes it from the cache, and loads it. Returns
 * -1, or an exit code after printing the error. kt_native_file_free may follow in any case. */
int kt_native_file_make(kt_native_file *file, const char *command, const kt_scene *scene, const kt_model *model);
void kt_native_file_free(kt_native_file *file);

/* A file with the numbers of a model. */
typedef struct kt_native_code {
    const kt_native_file *file;
    kt_native native;
    double *numbers; /* values of the parameters */
    void *prepared;  /* numbers that the file has computed from the parameters */
} kt_native_code;

/* Passes the numbers of a model to a file of its structure. kt_native_code_free may follow in any case. Several threads
 * may call it with one file at the same time. */
kt_status kt_native_code_begin(kt_native_code *code, const kt_native_file *file, const kt_model *model,
                               kt_error *error);
void kt_native_code_free(kt_native_code *code);

/* Prints what the code has saved in a run, and when it pays. */
void kt_native_report(const kt_native_code *code, const kt_simulation *simulation);

/* ---- compiler and cache (compile.c, cache.c) --------------------------------------------------------------------- */

enum { KT_COMPILER_WORDS = 24, KT_NATIVE_PATH = 4096 };

/* The compiler: the words of CC, or cc. */
typedef struct kt_compiler {
    char text[KT_NATIVE_PATH];           /* words of the command, apart by zeros */
    char *word[KT_COMPILER_WORDS];       /* the last one is NULL */
    char program[KT_NATIVE_PATH];        /* file of the first word */
    char identity[KT_NATIVE_PATH + 256]; /* changes if the compiler is replaced, or the machine */
} kt_compiler;

/* Finds the compiler. Returns false after printing the error. command: for messages. */
bool kt_compiler_find(kt_compiler *compiler, const char *command);

/* Compiles folder/native.c to folder/native.so. Returns false after printing the error. */
bool kt_compiler_run(const kt_compiler *compiler, const char *command, const char *folder);

/* The folder of compiled files, and a folder within for one compilation. */
typedef struct kt_code_cache {
    char folder[KT_NATIVE_PATH];
    char build[KT_NATIVE_PATH];
    bool is_temporary; /* the files cannot be kept */
} kt_code_cache;

/* Finds or makes the folder: kinetree in $XDG_CACHE_HOME or ~/.cache. If files cannot be kept there, a folder for
 * temporary files takes its place, and a message is printed. Returns false after printing the error. */
bool kt_code_cache_open(kt_code_cache *cache, const char *command);

/* Writes the path of a compiled file. Returns false if it is too long. */
bool kt_code_cache_path(const kt_code_cache *cache, const char *key, char path[KT_NATIVE_PATH]);

/* Makes the folder of a compilation. Returns false after printing the error. */
bool kt_code_cache_begin(kt_code_cache *cache, const char *command);

/* Gives native.so of that folder its path if `fine`, and removes the folder. Returns whether the path has the file. */
bool kt_code_cache_end(kt_code_cache *cache, const char *command, const char *path, bool fine);

/* Whether a file may be loaded: it exists, and only this user can write it. Prints an error in the latter case. */
bool kt_code_cache_has(const char *command, const char *path, bool *is_foreign);

/* Finds a function of a library: writes its address to *function. Returns false if it is missing. */
bool kt_find_symbol(void *library, const char *name, void *function);

#endif
