/* Files from strangers: tables that are damaged, are no files, or have other content than their names promise. Each
 * ends with a message. The inputs in test/command/strangers are seeds of fuzzing, too.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/sum.h"
#include "sanitized.h"
#include "shell.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if KT_ADDRESS_SANITIZER
#define BOUNDED "timeout 600 "
#else
#define BOUNDED "ulimit -v 1500000; OPENBLAS_NUM_THREADS=1 timeout 60 "
#endif

static void prepare(void) {
    kt_shell("cp -f %s/* .; rm -f pipe; mkfifo pipe", KT_STRANGERS);
    kt_write_file("s.yaml", "kinetree: 1\ngravity: [0, -9.81, 0]\nparameters: {m: 1}\nbodies:\n"
                            "  - {name: a, mass: =m, shape: {type: rod, to: [0, -1, 0]}, joint: {type: revolute}}\n"
                            "simulate: {duration: 0.1}\n");
    kt_write_file("from.yaml", "kinetree: 1\nbodies:\n"
                               "  - {name: a, mass: 1, shape: {type: rod, to: [0, -1, 0]}, joint: {type: revolute}}\n"
                               "initial: {from: bare-return.csv}\nsimulate: {duration: 0.1}\n");
}

/* The room for rows was counted at newlines, and the reader ended rows elsewhere, too: numbers of the file were written
 * behind the table. */
KT_TEST(table_has_no_more_rows_than_newlines) {
    static const char where[] = "bare-return.csv:2: a carriage return without a newline is within the row";
    prepare();
#ifdef KT_WITH_CAIRO
    kt_expect(2, where, BOUNDED "$K plot bare-return.csv --out o.svg");
    kt_expect(2, "behind-quotes.csv:2: text follows a cell in quotes", BOUNDED "$K plot behind-quotes.csv --out o.svg");
    kt_expect(2, "many.csv:2: a carriage return",
              "(echo a,b; yes 1,2 | head -n 30000 | tr '\\n' '\\r') >many.csv; " BOUNDED
              "$K plot many.csv --out o.svg");
#endif
    kt_expect(2, where, BOUNDED "$K run s.yaml --from bare-return.csv --out o.csv");
    kt_expect(2, where, BOUNDED "$K accuracy s.yaml --reference bare-return.csv");
    kt_expect(2, where, BOUNDED "$K check from.yaml");
    kt_expect(2, "values-return.csv:2: a carriage return is within the line",
              BOUNDED "$K sweep s.yaml --from values-return.csv --out o.csv");
    /* A newline behind it, or the end of the file, is right. */
    kt_expect(0, NULL,
              "printf 'time,position.a\\r\\n0,1\\r\\n1,2' >right.csv; "
              "$K run s.yaml --from right.csv:1 --quiet --out o.csv 2>/dev/null && grep -q '^0,2,' o.csv");
    kt_expect(0, NULL,
              "printf 'm\\r\\n1\\r\\n2\\r\\n' >two.csv; $K sweep s.yaml --from two.csv --quiet --out o.csv && "
              "test $(wc -l <o.csv) = 3");
}

/* A byte of zero ended a table in silence. */
KT_TEST(table_with_a_byte_of_zero_is_rejected) {
    static const char what[] = "the file has bytes of zero, so it is no text";
    prepare();
    kt_expect(2, what, BOUNDED "$K run s.yaml --from zero-byte.csv --out o.csv");
    kt_expect(2, what, BOUNDED "$K sweep s.yaml --from values-zero.csv --out o.csv");
    kt_expect(2, what, BOUNDED "$K sweep --merge zero-byte.csv --out o.csv");
    kt_expect(2, what, BOUNDED "$K accuracy s.yaml --reference zero-byte.csv");
#ifdef KT_WITH_CAIRO
    kt_expect(2, what, BOUNDED "$K plot zero-byte.csv --out o.svg");
    kt_expect(2, what, BOUNDED "$K plot - --out o.svg <zero-byte.csv");
    kt_expect(2, what, BOUNDED "$K plot - --out o.svg </dev/zero"); /* which never ends */
#endif
}

/* Each name of a file that a command or a scene gives, and what is no file. Nobody writes to the pipe. */
KT_TEST(devices_and_pipes_are_rejected_wherever_a_file_is_named) {
    static const char *const commands[] = {
        "run s.yaml --from $F --out o.csv",
        "check s.yaml --set initial.from=$F",
        "sweep s.yaml --from $F --out o.csv",
        "sweep --merge $F --out o.csv",
        "accuracy s.yaml --reference $F",
#ifdef KT_WITH_CAIRO
        "plot $F --out o.svg",
        "plot two.csv --marks $F --out o.svg",
#endif
    };
    static const char *const files[][2] = {
        {"pipe", "this is a pipe"}, {"/dev/zero", "this is a device"}, {"$PWD", "this is a directory"}};
    prepare();
    kt_shell("printf 'time,position.a\\n0,1\\n1,2\\n' >two.csv");
    for (size_t i = 0; i < sizeof commands / sizeof *commands; i++)
        for (size_t k = 0; k < sizeof files / sizeof *files; k++)
            kt_expect(2, files[k][1], "F=%s; " BOUNDED "$K %s", files[k][0], commands[i]);
    kt_expect(2, "zero.yaml:4:17: initial.from: /dev/zero: this is a device",
              "sed s,bare-return.csv,/dev/zero, from.yaml >zero.yaml; " BOUNDED "$K check zero.yaml");
}

/* A sparse file has any size, and costs nothing. */
KT_TEST(table_has_a_limit_of_its_size) {
    prepare();
    kt_shell("truncate -s 100G sparse.csv");
    kt_expect(2, "the file has 102400 MB; a result has at most 1024",
              BOUNDED "$K run s.yaml --from sparse.csv --out o.csv");
    kt_expect(2, "the file has 102400 MB; a table has at most 1024",
              BOUNDED "$K sweep s.yaml --from sparse.csv --out o.csv");
    kt_expect(2, "the file has bytes of zero", BOUNDED "$K sweep --merge sparse.csv --out o.csv");
    kt_expect(2, "a line is longer than any line of a sweep",
              "head -c 20000000 /dev/zero | tr '\\0' x >long.csv; " BOUNDED "$K sweep --merge long.csv --out o.csv");
    kt_expect(2, "a table has at most 1048576 columns",
              "head -c 2000000 /dev/zero | tr '\\0' , >wide.csv; " BOUNDED "$K accuracy s.yaml --reference wide.csv");
}

KT_TEST(number_of_a_run_does_not_overflow) {
    prepare();
    kt_expect(2, "a line has the number of a run that no sweep has",
              BOUNDED "$K sweep --merge run-number.csv --out o.csv");
    kt_expect(2, "a line has the number of a run that no sweep has",
              "sed 's/^9[0-9]*/99999999999999999999999/' run-number.csv >larger.csv; " BOUNDED
              "$K sweep --merge larger.csv --out o.csv");
}

/* A name may be that of any file of the user, and a message may go to whoever has sent the scene. */
KT_TEST(messages_do_not_quote_a_file_of_another_kind) {
    static const char *const commands[] = {
        "check s.yaml --set initial.from=$F",
        "run s.yaml --from $F --out o.csv",
        "sweep s.yaml --from $F --out o.csv",
        "accuracy s.yaml --reference $F",
        "sweep --merge $F two.csv --out o.csv",
        "check $F",
        "import $F",
        "check csv.yaml --set effects[0].torque.table=$F",
        "check mesh.yaml --set meshes[0].file=$F",
#ifdef KT_WITH_CAIRO
        "plot $F --out o.svg",
        "plot two.csv --marks $F --out o.svg",
#endif
    };
    static const char *const files[] = {"secret-line.txt", "secret-cells.txt", "secret.stl", "secret.urdf",
                                        "secret.yaml"};
    prepare();
    kt_shell("printf 'time,position.a\\n0,1\\n1,2\\n' >two.csv; cp secret-line.txt secret.stl; "
             "cp secret-cells.txt secret.urdf; cp secret-line.txt secret.yaml");
    kt_write_file("csv.yaml", "kinetree: 1\nbodies: [{name: a, mass: 1, inertia: [1, 1, 1], joint: {type: revolute}}]\n"
                              "effects: [{type: motor, joint: a, torque: {table: two.csv}}]\n");
    kt_write_file("mesh.yaml",
                  "kinetree: 1\nbodies: [{name: a, mass: 1, inertia: [1, 1, 1], joint: {type: revolute}}]\n"
                  "meshes: [{body: a, file: secret.stl}]\n");
    for (size_t i = 0; i < sizeof commands / sizeof *commands; i++)
        for (size_t k = 0; k < sizeof files / sizeof *files; k++) {
            const kt_ran ran = kt_shell("F=%s; " BOUNDED "$K %s", files[k], commands[i]);
            kt_check_equal_int(commands[i], kt_count_of(ran.err, "secret-of-mine"), 0);
            kt_check_equal_int(commands[i], kt_count_of(ran.out, "secret-of-mine"), 0);
            kt_check_true("and a message", *ran.err != '\0');
        }
}

/* A terminal obeys the escape character, and C1 controls in UTF-8, too. A newline within a name would begin a message
 * of its own. */
KT_TEST(messages_have_no_control_characters) {
    static const char *const commands[] = {"check e.yaml",
                                           "check \"$N\"",
                                           "run \"$N\" --out o.csv",
                                           "plot \"$N\"",
                                           "import \"$N\"",
                                           "run s.yaml --from \"$N\"",
                                           "run \"s$N.yaml\" --out \"o$N.csv\"",
                                           "sweep --merge \"$N\" --out o.csv",
                                           "run s.yaml --set \"$N=1\"",
                                           "check s.yaml --set initial.from=\"$N\"",
                                           "draw e.yaml --out e.svg",
                                           "check t.yaml",
                                           "view e.yaml --out e.html"};
    prepare();
    kt_write_file("e.yaml", "kinetree: 1\nbodies:\n"
                            "  - {name: a, mass: 1, shape: {type: rod, to: [0, -1, 0]}, joint: {type: revolute}}\n"
                            "meshes: [{body: a, file: \"x\\e[31m\\x9bq\\nz.stl\"}]\n");
    kt_write_file("t.yaml", "kinetree: 1\nbodies:\n"
                            "  - {name: a, mass: 1, shape: {type: rod, to: [0, -1, 0]}, joint: {type: revolute}}\n"
                            "meshes: [{body: a, file: \"x\\e[31m\\x9bq\\nz.obj\"}]\n");
    /* ESC, CSI of C1, a mark that turns the text, DEL, and a newline; also files of this name with wrong content */
    kt_shell("N=$(printf 'x\\033[31m\\302\\233q\\342\\200\\256\\177\\nz'); printf 'solid\n' >\"$N.obj\"; "
             "printf x >\"$(printf 'x\\033[31m\\302\\233q\\nz.obj')\"; cp s.yaml \"s$N.yaml\"");
    for (size_t i = 0; i < sizeof commands / sizeof *commands; i++) {
        const kt_ran ran =
            kt_shell("N=$(printf 'x\\033[31m\\302\\233q\\342\\200\\256\\177\\nz'); " BOUNDED "$K %s", commands[i]);
        static const char *const controls[] = {"\033", "\302\233", "\342\200\256", "\177", "\nz"};
        kt_check_true(commands[i], *ran.err != '\0');
        for (size_t k = 0; k < sizeof controls / sizeof *controls; k++)
            kt_check_equal_int("control characters", kt_count_of(ran.err, controls[k]), 0);
    }
}

/* Others may put a link into a common folder. The file behind it would be overwritten. */
KT_TEST(link_at_a_name_of_the_program_is_not_followed) {
    static const char *const commands[] = {
        "run s.yaml --quiet --out o.csv",
        "sweep s.yaml --vary m=1,2 --quiet --out o.csv",
        "sweep --merge part.csv --quiet --out o.csv",
        "run s.yaml --quiet --out p.csv --summary o.json",
        "export s.yaml --c --out oc.c",
        "run s.yaml --quiet --out p.csv --checkpoint c",
#ifdef KT_WITH_HDF5
        "run s.yaml --quiet --out o.h5",
#endif
#ifdef KT_WITH_CAIRO
        "run s.yaml --quiet --out p.csv --plot o.svg",
        "run s.yaml --quiet --out p.csv --plot o.pdf",
        "draw s.yaml --out o.svg",
#endif
    };
    static const char *const links[] = {"o.csv.partial", "o.json.partial", "oc.c.partial",
                                        "o.h5.partial",  "o.svg.partial",  "o.pdf.partial",
                                        "c.new",         "o.h5.new",       "p.csv.shard"};
    prepare();
    kt_shell("printf 'run,m,status\n0,1,done\n' >part.csv");
    for (size_t i = 0; i < sizeof commands / sizeof *commands; i++) {
        kt_shell("echo precious >other.txt; rm -f o.* c c.new");
        for (size_t k = 0; k < sizeof links / sizeof *links; k++)
            kt_shell("ln -sf other.txt %s", links[k]);
        const kt_ran ran = kt_shell(BOUNDED "$K %s", commands[i]);
        kt_check_contains(commands[i], ran.err, "symbolic link");
        kt_check_equal_int(commands[i], ran.code, 4);
        kt_check_text("the file behind the link", kt_read_file("other.txt"), "precious\n");
    }
}

/* The reader of numbers skipped empty lines in search of a number, from each of them anew. */
KT_TEST(table_of_empty_lines_is_read_once) {
    prepare();
    kt_expect(2, "there are no lines of numbers in it",
              "head -c 20000000 /dev/zero | tr '\\0' '\\n' >lines.csv; " BOUNDED
              "$K accuracy s.yaml --reference lines.csv");
}

/* A chain whose last bodies are welded to poses out of reach: no change closes the loops, and each trial is a failing
 * assembly of 36 equations. Without a limit, the search took minutes. */
KT_TEST(search_for_changes_ends_at_a_limit_of_work) {
    enum { BODIES = 20, WELDS = 6 };
    char text[8192] = "<mujoco><worldbody>";
    size_t used = strlen(text);
    for (int i = 0; i < BODIES; i++)
        used += (size_t)snprintf(text + used, sizeof text - used,
                                 "<body name='b%d' pos='0 0 .1'><joint axis='%d %d %d'/><geom size='.1'/>", i,
                                 i % 3 == 0, i % 3 == 1, i % 3 == 2);
    for (int i = 0; i < BODIES; i++)
        used += (size_t)snprintf(text + used, sizeof text - used, "</body>");
    used += (size_t)snprintf(text + used, sizeof text - used, "</worldbody><equality>");
    for (int i = 0; i < WELDS; i++)
        used += (size_t)snprintf(text + used, sizeof text - used, "<weld body1='b%d' relpose='%d 0 0 1 0 0 0'/>",
                                 BODIES - 1 - i, 99 + i);
    (void)snprintf(text + used, sizeof text - used, "</equality></mujoco>");
    kt_write_file("welds.xml", text);
    kt_expect(3, "the search for changes ended at its limit of work, after ", BOUNDED "$K check welds.xml");
}

/* Writes a checkpoint with another word, and its sum made anew. */
static void write_changed(const char *from, const char *to, long at, int32_t word) {
    char *bytes = calloc(1, 1 << 20);
    FILE *file = fopen(from, "rb");
    const size_t size = bytes != NULL && file != NULL ? fread(bytes, 1, 1 << 20, file) : 0;
    if (file != NULL)
        (void)fclose(file);
    file = fopen(to, "wb");
    if (kt_check_true("there is a checkpoint", size > (size_t)at + 16 && file != NULL)) {
        memcpy(bytes + at, &word, sizeof word);
        const uint64_t sum = kt_sum_add(KT_SUM_START, bytes, size - sizeof sum);
        memcpy(bytes + size - sizeof sum, &sum, sizeof sum);
        kt_check_true("it is written", fwrite(bytes, 1, size, file) == size);
    }
    if (file != NULL)
        (void)fclose(file);
    free(bytes);
}

/* The results of a run so far begin behind the head: counts and indices of distances, angles and records. */
KT_TEST(checkpoint_with_another_index_is_rejected) {
    enum { HEAD = 200, LAST = 8800 };
    int rejected = 0, crashed = 0;
    kt_expect(0, NULL,
              "$K run %s/four-bar.yaml --quiet --duration 0.01 --step 1e-3 --out r.csv --checkpoint a.ck "
              "--checkpoint-interval 1e-9",
              KT_SCENES);
    for (long at = HEAD; at < LAST; at += at < 440 || at > 8560 ? (KT_ADDRESS_SANITIZER ? 24 : 4) : 512) {
        write_changed("a.ck", "b.ck", at, 2147483640);
        const kt_ran ran = kt_shell("$K run %s/four-bar.yaml --quiet --duration 0.01 --step 1e-3 --out r.csv --resume "
                                    "b.ck",
                                    KT_SCENES);
        crashed += ran.code > 4;
        rejected += strstr(ran.err, "a count, an index or a flag in it does not fit this run") != NULL;
    }
    kt_check_equal_int("crashes", crashed, 0);
    kt_check_true("indices and counts are compared", rejected >= (KT_ADDRESS_SANITIZER ? 3 : 12));
}
