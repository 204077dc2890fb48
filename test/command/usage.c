/* Command lines that are right, wrong, and nearly right; exit codes and words. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "shell.h"

#include <stdio.h>
#include <string.h>

static const char pendulum[] = "kinetree: 1\n"
                               "gravity: [0, -9.81, 0]\n"
                               "bodies:\n"
                               "  - name: bob\n"
                               "    joint: {type: revolute, position: 1}\n"
                               "    mass: 1\n"
                               "    shape: {type: point, at: [0, -1, 0]}\n"
                               "    markers: {tip: [0, -1, 0]}\n";

KT_TEST(help_of_every_subcommand_leads_with_examples) {
    static const char *const subcommands[] = {"",      "run",         "accuracy",  "plot", "evaluate",
                                              "info",  "check",       "demo",      "make", "integrators",
                                              "modes", "equilibrium", "stability", "help", "draw"};
    for (size_t i = 0; i < sizeof subcommands / sizeof subcommands[0]; i++) {
        kt_ran ran = kt_shell("$K %s --help", subcommands[i]);
        char start[64];
        snprintf(start, sizeof start, "Examples\n  kinetree %s", subcommands[i]);
        kt_check_equal_int(subcommands[i], ran.code, 0);
        kt_check_true("examples first", strncmp(ran.out, start, strlen(start)) == 0);
        kt_check_contains("usage", ran.out, "\nUsage: kinetree ");
        kt_check_text("standard error", ran.err, "");
        if (i > 0) {
            kt_ran all = kt_shell("$K --help");
            snprintf(start, sizeof start, "\n  %s ", subcommands[i]);
            kt_check_contains("told of by 'kinetree --help'", all.out, start);
        }
    }
}

KT_TEST(version_is_that_of_the_project) {
    kt_ran ran = kt_shell("$K --version");
    const char *first = "kinetree " KT_PROJECT_VERSION "\n";
    kt_check_true("the version comes first", strncmp(ran.out, first, strlen(first)) == 0);
    static const char *const parts[] = {"\n  compiler ", "\n  kernels ", "\n  libraries ",
                                        "libyaml ",      "expat ",       "\n  system "};
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++)
        kt_check_contains("a report of a fault", ran.out, parts[i]);
    kt_check_equal_int("exit code", ran.code, 0);
}

KT_TEST(help_of_a_subcommand_is_its_own) {
    char own[8192];
    snprintf(own, sizeof own, "%s", kt_shell("$K run --help").out);
    kt_check_text("help run", kt_shell("$K help run").out, own);
    kt_expect(1, "did you mean 'run'?", "$K help rnu");
    kt_expect(1, "takes neither --man nor the name of one", "$K help --completion bash run");
    kt_expect(1, "takes one of bash|zsh|fish, not 'bsah'; did you mean 'bash'?", "$K help --completion bsah");
}

KT_TEST(near_misses_are_told_what_would_do) {
    kt_write_file("p.yaml", pendulum);
    kt_expect(2, "did you mean 'p.yaml'?", "$K run p");
    kt_expect(2, "did you mean 'p.yaml'?", "$K run pp.yaml");
    kt_expect(2, "did you mean the bundled scene 'double-pendulum.yaml'? 'kinetree demo double-pendulum' runs it",
              "$K run double-pendulm.yaml");
    kt_expect(2, "did you mean the bundled scene 'trebuchet.yaml'?", "$K run no/trebuchett");
    kt_check_true("no scene for a robot", strstr(kt_shell("$K import nope.urdf").err, "did you mean") == NULL);
    kt_check_true("no name is near", strstr(kt_shell("$K run nothing.yaml").err, "did you mean") == NULL);
    kt_expect(2, "did you mean 'p.yaml'?", "$K run p.urdf");
    kt_expect(2, "'kinetree demo pendulum' runs the bundled scene of this name; its file is /", "$K run pendulum.yaml");
    kt_expect(2, "/cart-pole.yaml", "$K draw cart-pole");
    kt_expect(1, "there are position, velocity, ", "$K run p.yaml --record force");
    kt_expect(1, "p.yaml is a scene, not a result: 'kinetree run p.yaml --plot p.svg' runs and draws it",
              "$K plot p.yaml");
}

KT_TEST(typing_errors_end_in_one_with_the_nearest_name) {
    kt_write_file("p.yaml", pendulum);
    kt_expect(1, "a subcommand is missing", "$K");
    kt_expect(1, "did you mean 'run'?", "$K rnu p.yaml");
    kt_expect(1, "did you mean 'integrators'?", "$K integrator");
    kt_expect(1, "'kinetree --help' lists them", "$K xyzzy");
    kt_expect(1, "there is no subcommand 'p.yaml'; 'kinetree run p.yaml' simulates this file", "$K p.yaml");
    kt_expect(1, "'kinetree run pendulum.yml' simulates this file", "$K pendulum.yml");
    kt_expect(1, "'kinetree demo pendulum' runs the bundled scene of this name", "$K pendulum.yaml");
    kt_expect(1, "did you mean '--duration'?", "$K run p.yaml --duratoin 3");
    kt_expect(1, "did you mean '--tolerance'?", "$K run p.yaml --tolerence=3");
    kt_expect(1, "did you mean 'dopri5'?", "$K run p.yaml --integrator dopri");
    kt_expect(1, "did you mean 'partition'?", "$K run p.yaml --reduction partiton");
    kt_expect(1, "did you mean 'velocity'?", "$K run p.yaml --record position,velocty");
    kt_expect(1, "did you mean 'bob'?", "$K run p.yaml --markers bab.tip");
    kt_expect(1, "did you mean 'tip'?", "$K run p.yaml --markers bob.top");
    kt_expect(1, "did you mean 'chain'?", "$K make chian");
    kt_expect(1, "did you mean 'spherical'?", "$K make chain --joint sperical");
}

KT_TEST(wrong_values_end_in_one_and_say_what_is_wanted) {
    kt_write_file("p.yaml", pendulum);
    kt_expect(1, "SCENE is missing", "$K run");
    kt_expect(1, "'q.yaml' is one word too many", "$K run p.yaml q.yaml");
    kt_expect(1, "--duration takes a number, not 'x'", "$K run p.yaml --duration x");
    kt_expect(1, "--duration takes a number, not 'nan'", "$K run p.yaml --duration nan");
    kt_expect(1, "--duration takes a number, not '1e999'", "$K run p.yaml --duration 1e999");
    kt_expect(1, "--duration takes a number, not '3s'", "$K run p.yaml --duration 3s");
    kt_expect(1, "must be zero or more", "$K run p.yaml --duration -1");
    kt_expect(1, "duration: 4.94066e-324 s is too short", "$K run p.yaml --duration 5e-324");
    kt_expect(1, "tolerance: 1e-30 (relative) is below the rounding", "$K run p.yaml --tolerance 1e-30");
    kt_expect(1, "step: 1e-30 s is lost in the rounding", "$K run p.yaml --step 1e-30");
    kt_expect(0, "warning: the step, 20 s, is longer than the duration: one step of 0.1 s is taken",
              "$K run p.yaml --integrator rk4 --step 20 --duration 0.1 --out once.csv");
    kt_ran ran = kt_shell("$K run p.yaml --integrator rk4 --step 20 --duration 0.1 --quiet --out once.csv --summary -");
    kt_check_text("no words", ran.err, "");
    json_t *root = kt_json(ran.out);
    kt_check_text("but in the summary", json_string_value(kt_json_find(root, "warnings[0].code")), "long_step");
    kt_check_near("the step", kt_json_at(root, "warnings[0].value"), 20.0, 0.0);
    json_decref(root);
    kt_expect(1, "--duration must be followed by its S", "$K run p.yaml --duration");
    kt_expect(1, "--step takes a number above zero, not '0'", "$K run p.yaml --step 0");
    kt_expect(1, "--interval takes a number above zero, not '-1'", "$K run p.yaml --interval=-1");
    kt_expect(1, "--tolerance takes", "$K run p.yaml --tolerance 1e-9,");
    kt_expect(1, "--tolerance takes", "$K run p.yaml --tolerance 0");
    kt_expect(1, "--quiet takes nothing; leave out '=yes'", "$K run p.yaml --quiet=yes");
    kt_expect(1, "there is no option '-q'", "$K run p.yaml -q");
    kt_expect(1, "the list is empty", "$K run p.yaml --record=");
    kt_expect(1, "BODY.MARKER", "$K run p.yaml --markers bob");
    kt_expect(1, "fixed step and --tolerance", "$K run p.yaml --step 1e-3 --tolerance 1e-3");
    kt_expect(1, "needs a fixed step: --step 1e-3", "$K run p.yaml --integrator rk4");
    kt_expect(1, "both be standard output", "$K run p.yaml --out - --summary -");
    kt_expect(1, "is the scene itself", "$K run p.yaml --out ./p.yaml");
    kt_expect(1, "is the scene itself", "$K run p.yaml --summary p.yaml");
    kt_expect(1, "kinetree: view: p.yaml is the scene itself", "$K view p.yaml --out p.yaml");
    kt_expect(1, "kinetree: view: --step sets", "$K view p.yaml --step 1e-3 --tolerance 1e-6");
    kt_expect(1, "kinetree: view: --markers: there is no body 'u'", "$K view p.yaml --markers u.tip");
    kt_check_text("the scene is untouched", kt_read_file("p.yaml"), pendulum);
    kt_expect(1, "--links takes a whole number, not '-3'", "$K make chain --links=-3");
    kt_expect(1, "--links takes a number from 1", "$K make chain --links 0");
    kt_expect(1, "--angle takes an angle", "$K make chain --angle 3turns");
    kt_expect(1, "--branching is for a tree", "$K make chain --branching 3");
    kt_expect(1, "point masses", "$K make chain --joint spherical --shape point");
    kt_expect(1, "has 2 numbers, and the scene has 1 velocity coordinate", "$K evaluate p.yaml --acceleration=1,2");
    kt_expect(1, "takes numbers with commas between, not 'x'", "$K evaluate p.yaml --acceleration=x");
}

KT_TEST(options_that_time_stepping_has_not_are_rejected) {
    static const char *const options[] = {"integrator rk4", "tolerance 1e-6",       "max-step 1",
                                          "rho 0.5",        "formulation absolute", "unprojected"};
    kt_write_file("steps.yaml", "kinetree: 1\nbodies:\n  - {name: b, joint: {type: prismatic, axis: z}, mass: 1}\n"
                                "effects:\n  - {type: joint_limit, joint: b, lower: 0, restitution: 0}\n"
                                "simulate: {duration: 0.1, contact: steps, step: 1e-2}\n");
    for (size_t i = 0; i < sizeof options / sizeof options[0]; i++)
        kt_expect(1, "the scene has 'simulate.contact: steps'", "$K run steps.yaml --%s", options[i]);
    kt_expect(0, NULL, "$K run steps.yaml --step 1e-3 --quiet --out a.csv");
    kt_expect(0, NULL, "$K run steps.yaml --set simulate.contact=events --integrator rk4 --quiet --out a.csv");
}

/* The scene has the step that rk4 needs, so that a step is no remedy. */
KT_TEST(tolerance_of_a_method_with_fixed_steps_is_rejected_with_a_remedy) {
    kt_write_file("rk4.yaml", "kinetree: 1\nbodies:\n  - {name: b, joint: {type: prismatic, axis: z}, mass: 1}\n"
                              "simulate: {duration: 0.1, integrator: rk4, step: 1e-3}\n");
    kt_expect(1, "rk4 has a fixed step: leave the option out, or add --integrator dopri5",
              "$K run rk4.yaml --tolerance 1e-9");
    kt_expect(0, NULL, "$K run rk4.yaml --tolerance 1e-9 --integrator dopri5 --quiet --out a.csv");
}

/* A scene may leave the step to --step, and the rows are those of a scene that has it. */
KT_TEST(step_of_an_option_serves_scenes_without_one) {
    static const char *const methods[] = {"contact: steps", "integrator: rk4"};
    for (size_t i = 0; i < sizeof methods / sizeof methods[0]; i++) {
        char text[512];
        for (int with = 0; with < 2; with++) {
            (void)snprintf(
                text, sizeof text,
                "kinetree: 1\nbodies:\n  - {name: b, joint: {type: prismatic, axis: z, position: 0.1}, mass: 1}\n"
                "effects:\n  - {type: joint_limit, joint: b, lower: 0, restitution: 0}\n"
                "simulate: {duration: 0.3, %s%s}\n",
                methods[i], with ? ", step: 1e-2" : "");
            kt_write_file(with ? "with.yaml" : "without.yaml", text);
        }
        kt_expect(0, NULL, "$K run with.yaml --quiet --out with.csv");
        kt_expect(0, NULL, "$K run without.yaml --step 1e-2 --quiet --out without.csv");
        kt_check_equal_int("the same rows", kt_shell("cmp with.csv without.csv").code, 0);
        kt_expect(2, "has a fixed step; give 'step' as well", "$K run without.yaml --out without.csv");
        kt_expect(2, "has a fixed step; give 'step' as well", "$K check without.yaml");
    }
    kt_expect(2, "leave one of them out", "$K run with.yaml --set simulate.tolerance=1e-6 --step 1e-2");
    kt_write_file("tolerance.yaml", "kinetree: 1\nbodies:\n  - {name: b, joint: {type: prismatic, axis: z}, mass: 1}\n"
                                    "simulate: {duration: 0.1, integrator: rk4, tolerance: 1e-6}\n");
    kt_expect(2, "rk4 has a fixed step and no tolerance", "$K run tolerance.yaml --step 1e-2");
}

/* strtod accepts more forms than people write as numbers. */
KT_TEST(numbers_of_options_are_decimal) {
    static const struct {
        const char *words, *line;
    } table[] = {
        {"--duration takes a number, not '0x10'", "run p.yaml --duration 0x10"},
        {"--duration takes a number, not 'infinity'", "run p.yaml --duration infinity"},
        {"--duration takes a number, not '1e'", "run p.yaml --duration 1e"},
        {"--step takes a number above zero, not '0x1p-9'", "run p.yaml --step 0x1p-9"},
        {"--interval takes a number above zero, not ' 1'", "run p.yaml --interval ' 1'"},
        {"--tolerance takes a number", "run p.yaml --tolerance 0x1p-20"},
        {"--tolerance takes a number", "run p.yaml --tolerance 1e-6,0x1p-20"},
        {"--tolerance takes a number", "run p.yaml --tolerance 1e-6,1e-6,1e-6"},
        {"--tolerance takes a number", "run p.yaml --tolerance 0,0"},
        {"--tolerance takes a number", "run p.yaml --tolerance 1e-6,-1e-6"},
        {"--rho takes a number, not '0x1p-1'", "run p.yaml --integrator two-step --step 1e-3 --rho 0x1p-1"},
        {"not '0x1'", "evaluate p.yaml --acceleration=0x1"},
        {"--at takes times", "draw p.yaml --at 0x0,0x1"},
        {"'0x10,0'", "draw p.yaml --view 0x10,0"},
        {"--steps takes numbers above zero", "accuracy p.yaml --steps 0x1p-9"},
        {"--goal takes numbers above zero", "accuracy p.yaml --goal 1e-3,nan"},
        {"--budget takes a number above zero", "accuracy p.yaml --budget 0x10"},
        {"--angle takes an angle", "make chain --angle 0x1deg"},
        {"--links takes a whole number, not '0x10'", "make chain --links 0x10"},
        {"--samples takes a whole number above zero, not '1e1'", "stability p.yaml --samples 1e1"},
        {"--stops takes a number above zero", "import p.urdf --stops 0x10"},
        {"--checkpoint-interval takes a number above zero", "run p.yaml --checkpoint c --checkpoint-interval 0x1"},
    };
    kt_write_file("p.yaml", pendulum);
    for (size_t i = 0; i < sizeof table / sizeof *table; i++)
        kt_expect(1, table[i].words, "$K %s", table[i].line);
    kt_expect(0, NULL, "$K run p.yaml --duration +.1e+0 --tolerance 0,1e-3 --quiet --out a.csv");
    kt_expect(0, NULL, "$K run p.yaml --duration 1.e-1 --tolerance 1e-3,0 --quiet --out a.csv");
}

/* A column, a marker or a method that a list names twice, and an option in place of a value. */
KT_TEST(lists_name_each_thing_once_and_options_are_no_values) {
    static const struct {
        const char *words, *line;
    } table[] = {
        {"run: --markers names 'bob.tip' twice; remove one", "run p.yaml --markers bob.tip,bob.tip"},
        {"run: --record names 'energy' twice", "run p.yaml --record energy,position,energy"},
        {"draw: --trace names 'bob.tip' twice", "draw p.yaml --trace bob.tip,bob.tip"},
        {"sweep: --columns names 'energy.total' twice",
         "sweep p.yaml --vary gravity[1]=-9,-10 --columns energy.total,position.arm,energy.total"},
        {"accuracy: --integrators names 'rk4' twice", "accuracy p.yaml --integrators rk4,rk4"},
        {"export: --functions names 'mass' twice", "export --c p.yaml --functions mass,mass --out p.c"},
        {"plot: --columns names 'time' twice", "plot p.csv --columns time,time"},
        {"export: --functions: a name is missing next to a comma of 'mass,'",
         "export --c p.yaml --functions mass, --out p.c"},
        {"run: --record: a name is missing", "run p.yaml --record position,,energy"},
        {"sweep: --columns: the list is empty", "sweep p.yaml --vary gravity[1]=-9,-10 --columns="},
        {"plot: --marks must be followed by its SUMMARY, and '--out' is an option; --marks=--out takes it as it is",
         "plot p.csv --marks --out p.svg"},
        {"run: --duration must be followed by its S, and '--quiet' is an option", "run p.yaml --duration --quiet"},
        {"run: --out must be followed by its FILE, and '--set=L=1' is an option", "run p.yaml --out --set=L=1"},
        {"run: --out must be followed by its FILE, and '--help' is an option; --out=--help takes it as it is",
         "run p.yaml --out --help"},
        {"run: --out must be followed by its FILE, and '-h' is an option", "run p.yaml --out -h"},
    };
    kt_write_file("p.yaml", pendulum);
    for (size_t i = 0; i < sizeof table / sizeof *table; i++)
        kt_expect(1, table[i].words, "$K %s", table[i].line);
    kt_expect(0, NULL, "$K run p.yaml --duration 0.1 --quiet --markers '' --out /dev/null"); /* none */
    kt_expect(0, NULL, "$K run p.yaml --duration 0.1 --quiet --out=--quiet && test -s ./--quiet");
    kt_expect(0, NULL, "$K run p.yaml --duration 0.1 --quiet --out --else && test -s ./--else");
}

/* Each process of MPI reads the command line. Rank 0 reports for all of them. */
KT_TEST(later_ranks_of_a_sweep_repeat_no_fault) {
    static const char *const words[] = {"p.yaml --nonsense", "p.yaml --repeats 0", "--help"};
    for (size_t k = 0; k < sizeof words / sizeof *words; k++)
        for (int rank = 0; rank < 2; rank++) {
            const kt_ran ran = kt_shell("OMPI_COMM_WORLD_SIZE=2 OMPI_COMM_WORLD_RANK=%d $K sweep %s", rank, words[k]);
            kt_note("rank %d: %s", rank, words[k]);
            kt_check_equal_int("status", ran.code, k < 2 ? 1 : 0);
            kt_check_equal_int("prints", ran.err[0] != '\0' || ran.out[0] != '\0', rank == 0);
        }
    /* Tasks of a starter that do not compute together print each for themselves. */
    const kt_ran task = kt_shell("PMIX_RANK=1 $K sweep --help");
    kt_check_true("a task prints", task.out[0] != '\0');
}

/* An option that describes a file which is not written, and a count of nothing, are no silent defaults. */
KT_TEST(options_without_an_effect_are_rejected) {
    static const struct {
        const char *words, *line;
    } table[] = {
        {"--dark has nothing to act on: --plot FILE goes with it", "run p.yaml --dark"},
        {"--size has nothing to act on: --plot FILE goes with it", "run p.yaml --size 800x600"},
        {"--boxes has nothing to act on: --view FILE.html or --glb", "run p.yaml --boxes"},
        {"--checkpoint-interval has nothing to act on", "run p.yaml --checkpoint-interval 3"},
        {"--view and --glb would not show the time before the checkpoint", "view p.yaml --resume p.state --out p.html"},
        {"--dark has nothing to act on: --plot FILE goes with it", "modes p.yaml --dark"},
        {"--dark has nothing to act on: --plot FILE goes with it", "stability p.yaml --dark"},
        {"--samples takes a whole number above zero, not '0'", "stability p.yaml --samples 0"},
        {"--samples must be 1 to 10000", "stability p.yaml --samples 10001"},
        {"--count takes a whole number above zero, not '0'", "modes p.yaml --count 0"},
        {"--steps takes a whole number above zero, not '0'", "modes p.yaml --period 1 --steps 0"},
        {"--jobs takes a whole number above zero, not '0'", "sweep p.yaml --vary gravity[1]=-9,-10 --jobs 0"},
        {"--repeats has nothing to act on: --random", "sweep p.yaml --vary gravity[1]=-9,-10 --repeats 2"},
        {"--seed has nothing to act on: --random", "sweep p.yaml --vary gravity[1]=-9,-10 --seed 2"},
        {"--out writes lines as CSV, not 'l.csv.gz'", "sweep p.yaml --vary gravity[1]=-9,-10 --out l.csv.gz"},
        {"--out writes lines as CSV, not 'l.svg'", "sweep p.yaml --vary gravity[1]=-9,-10 --out l.svg"},
        {"sweep: a file is missing: SCENE, or with --merge PART...; ", "sweep --merge --out l.csv"},
        {"--quiet and --verbose exclude each other", "run p.yaml --quiet --verbose"},
        {"--quiet and --verbose exclude each other", "info p.yaml --verbose --quiet"},
    };
    kt_write_file("p.yaml", pendulum);
    for (size_t i = 0; i < sizeof table / sizeof *table; i++)
        kt_expect(1, table[i].words, "$K %s", table[i].line);
    kt_expect(
        0, NULL,
        "$K view p.yaml --duration 0.1 --boxes --quiet && $K run p.yaml --duration 0.1 --boxes --quiet --glb p.glb");
}

/* Faults of the scene: status 2, and every fault has its place, in the format of compilers. */
KT_TEST(fault_that_compiling_finds_has_its_place) {
    kt_write_file("still.yaml", "kinetree: 1\nbodies:\n  - {name: a, joint: {type: revolute}}\n");
    static const char *const commands[] = {"run", "check", "info", "evaluate", "modes"};
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++) {
        const kt_ran ran = kt_shell("$K %s still.yaml", commands[i]);
        kt_check_equal_int(commands[i], ran.code, 2);
        kt_check_equal_int("begins with the place", strncmp(ran.err, "still.yaml:3:22: body 'a': its revolute ", 40),
                           0);
    }
}

KT_TEST(faults_that_compiling_finds_are_told_at_once) {
    kt_write_file("stills.yaml", "kinetree: 1\nbodies:\n"
                                 "  - {name: a, joint: {type: revolute}}\n"
                                 "  - {name: b, mass: 1, inertia: [1, 1, 1], joint: {type: revolute}}\n"
                                 "  - {name: c, joint: {type: prismatic}}\n"
                                 "loops:\n"
                                 "  - {name: l, type: weld, between: [world, b]}\n");
    kt_ran ran = kt_shell("$K check stills.yaml");
    kt_check_equal_int("exit code", ran.code, 2);
    kt_check_equal_int("the first", strncmp(ran.err, "stills.yaml:3:22: body 'a': its revolute ", 41), 0);
    kt_check_contains("the second", ran.err, "\nstills.yaml:5:22: body 'c': its prismatic ");
    ran = kt_shell("sed -i 's/mass: 1/mass: -1/; $ a simulate: {step: 0}' stills.yaml; $K check stills.yaml");
    kt_check_equal_int("exit code", ran.code, 2);
    kt_check_equal_int("the first", strncmp(ran.err, "stills.yaml:3:22: body 'a': its revolute ", 41), 0);
    kt_check_contains("a mass", ran.err, "\nstills.yaml:4:21: body 'b': mass is -1;");
    kt_check_contains("the second", ran.err, "\nstills.yaml:5:22: body 'c': its prismatic ");
    kt_check_contains("a step", ran.err, "\nstills.yaml:8:18: simulate.step: ");
}

/* Joints and loops share the names of columns. */
KT_TEST(reactions_of_a_loop_and_a_body_of_one_name_are_rejected) {
    kt_write_file("twice.yaml", "kinetree: 1\nbodies:\n"
                                "  - {name: a, joint: {type: revolute}, mass: 1, com: [1, 0, 0]}\n"
                                "loops:\n  - {name: a, type: motion, joint: a, position: 1}\n");
    kt_expect(2, "loop 'a' has the name of a joint, and with 'reaction' recorded both would have the same columns",
              "$K run twice.yaml --quiet --record reaction");
    kt_expect(0, NULL, "$K run twice.yaml --quiet --duration 0.1");
}

/* A parameter that an event sets is an auxiliary state of the same name, too. */
KT_TEST(known_names_are_listed_once) {
    kt_write_file("n.yaml", "kinetree: 1\nparameters: {L: 1}\nbodies:\n"
                            "  - {name: rod, joint: {type: revolute}, mass: =L, com: [1, 0, 0], inertia: [1, 1, 1]}\n"
                            "events:\n  - {name: a, when: t > 1, then: {set: {L: x}}}\n");
    kt_expect(2,
              "n.yaml:6:44: event 'a': then.set.L: there is no name 'x'; names are L, t, position.rod, velocity.rod, ",
              "$K check n.yaml");
}

KT_TEST(wrong_scene_ends_in_two_with_all_its_faults) {
    kt_write_file("w.yaml", "kinetree: 1\n"
                            "bodies:\n"
                            "  - {name: crank, mass: -1, joint: {type: revolute}}\n"
                            "  - {name: rod, parent: crnak, mass: 1}\n");
    kt_ran ran = kt_shell("$K run w.yaml");
    kt_check_equal_int("run", ran.code, 2);
    kt_check_true("the place starts the line", strncmp(ran.err, "w.yaml:3:", 9) == 0);
    kt_check_contains("the other fault", ran.err, "\nw.yaml:4:");
    kt_check_contains("the way to mend it", ran.err, "did you mean 'crank'?");
    kt_check_true("no results", kt_read_file("w.csv") == NULL);
    kt_expect(2, "w.yaml:3:", "$K evaluate w.yaml");
    kt_expect(2, "w.yaml:3:", "$K info w.yaml");
    kt_expect(2, "(standard input):3:", "$K run - <w.yaml");
    kt_expect(2, "none.yaml", "$K run none.yaml");

    kt_write_file("p.yaml", pendulum);
    ran = kt_shell("$K check p.yaml w.yaml p.yaml");
    kt_check_equal_int("check", ran.code, 2);
    kt_check_text("the right ones", ran.out, "p.yaml: ok\np.yaml: ok\n");
    kt_check_contains("the wrong one", ran.err, "w.yaml:4:");
    ran = kt_shell("$K check p.yaml");
    kt_check_equal_int("all right", ran.code, 0);
    kt_write_file("m.yaml", "kinetree: 1\n"
                            "bodies: [{name: a, mass: 1, joint: {type: prismatic}}]\n"
                            "simulate: {integrator: rk4}\n");
    kt_expect(2, "rk4", "$K run m.yaml");
}
