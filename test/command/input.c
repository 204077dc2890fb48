/* Inputs that are no scene. The command rejects them with a message and exit status 2, at once and in little memory.
 * The library's own limits are tested in test/files/scene/limit.c.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "sanitized.h"
#include "shell.h"

#include <stdio.h>
#include <string.h>

/* The limits are 200 s of the processor and 1.5 GB of addresses. All of it takes a second here, but some machines are
 * slow. The sanitizers take more of these for themselves. */
#if KT_ADDRESS_SANITIZER
#define BOUNDED "ulimit -t 2000; timeout 3000 "
#else
#define BOUNDED "ulimit -t 200; ulimit -v 1500000; OPENBLAS_NUM_THREADS=1 timeout 600 "
#endif

/* The last of a thousand lines. */
#define LAST_WORDS " 2>words; code=$?; tail -n 1 words >&2; exit $code"

KT_TEST(what_is_no_file_is_rejected_by_every_command) {
    static const char *const commands[] = {"run", "check", "info", "evaluate", "modes", "stability", "equilibrium"};
    kt_shell("mkdir folder; mkfifo pipe; : >empty.yaml");
    for (size_t i = 0; i < sizeof commands / sizeof *commands; i++) {
        kt_expect(2, "folder: this is a directory; name a scene file", BOUNDED "$K %s folder", commands[i]);
        /* Nobody writes to it: an open that waits would wait for ever. */
        kt_expect(2, "pipe: this is a pipe; name a scene file", BOUNDED "$K %s pipe", commands[i]);
        kt_expect(2, "/dev/zero: this is a device; name a scene file", BOUNDED "$K %s /dev/zero", commands[i]);
        kt_expect(2, "missing.yaml: cannot be read: No such file", BOUNDED "$K %s missing.yaml", commands[i]);
        kt_expect(2, "empty.yaml:1:1: ", BOUNDED "$K %s empty.yaml", commands[i]);
    }
    kt_expect(2, "(standard input):1:1: ", BOUNDED "$K check - </dev/null");
    kt_shell("$K make pendulum >p.yaml");
    kt_expect(2, "pipe: this is a pipe; name a checkpoint",
              BOUNDED "$K run p.yaml --quiet --out o.csv --checkpoint c --resume pipe");
}

/* A file that cannot be read has one exit status, whichever option names the file. */
KT_TEST(missing_file_has_the_exit_status_of_a_missing_scene) {
    static const char *const commands[] = {"run p.yaml --resume none",
                                           "run p.yaml --from none",
                                           "sweep p.yaml --from none",
                                           "sweep --merge none --out all.csv",
                                           "accuracy p.yaml --reference none",
                                           "plot none",
                                           "import none",
                                           "run none",
                                           "sweep none --vary gravity[1]=-9,-10",
                                           "export --mjcf none"};
    kt_shell("$K make pendulum >p.yaml");
    for (size_t i = 0; i < sizeof commands / sizeof *commands; i++)
        kt_expect(2, "No such file or directory", "$K %s", commands[i]);
    kt_expect(2, "rows.csv:2: a row has a number for each name",
              "printf 'gravity[1]\nx\n' >rows.csv; $K sweep p.yaml --from rows.csv");
}

KT_TEST(missing_file_of_initial_from_is_located) {
    kt_write_file("on.yaml", "kinetree: 1\nbodies:\n"
                             "  - {name: a, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}\n"
                             "initial: {from: none.json}\nsimulate: {duration: 0.1}\n");
    kt_expect(2, "on.yaml:4:17: initial.from: ", "$K run on.yaml");
    kt_expect(2, "none.json: cannot be read: No such file", "$K check on.yaml");
    kt_expect(2, "kinetree: initial.from: ", "$K run on.yaml --set initial.from=other.json");
}

KT_TEST(file_of_100_megabytes_is_rejected) {
    kt_shell("truncate -s 100M large.yaml");
    kt_expect(2, "large.yaml: the file has 100 MB; a scene has at most 64", BOUNDED "$K check large.yaml");
    kt_expect(2, "a scene has at most 67108864", BOUNDED "$K check - <large.yaml");
    kt_expect(2, "a scene has at most 67108864", BOUNDED "$K check - </dev/zero"); /* which never ends */
}

/* The largest allowed file, of the kind that is most work to read; under sanitizers a tenth. */
KT_TEST(large_text_is_rejected_in_bounded_memory) {
    const int lines = KT_ADDRESS_SANITIZER ? 100000 : 1000000;
    char more[64];
    kt_shell("(echo 'kinetree: 1'; echo 'bodies:'; yes '  - {name: a, mass: -1}' | head -n %d) >many.yaml", lines);
    (void)snprintf(more, sizeof more, "%d more faults are not listed", 2 * lines - 1001);
    kt_expect(2, more, BOUNDED "$K check many.yaml" LAST_WORDS);
    kt_shell("(printf 'kinetree: 1\\nname: '; head -c 10000 /dev/zero | tr '\\0' '[') >deep.yaml");
    kt_expect(2, "deep.yaml:2:38: lists and mappings are nested deeper than 32", BOUNDED "$K check deep.yaml");
    kt_shell("(printf 'kinetree: 1\\nbodies: [&a {name: a}'; yes ', *a' | head -n %d | tr -d '\\n'; echo ']') "
             ">aliases.yaml",
             lines);
    (void)snprintf(more, sizeof more, "%d more faults are not listed", lines - 999);
    kt_expect(2, more, BOUNDED "$K check aliases.yaml" LAST_WORDS);
    kt_expect(2, "bytes.yaml:1:20: this is not UTF-8 text",
              "printf 'kinetree: 1 # comme\\377' >bytes.yaml; " BOUNDED "$K check bytes.yaml");
}

/* A place in an error has room for 160 letters. */
KT_TEST(long_paths_are_written_whole) {
    char folder[300], path[320], place[360];
    (void)snprintf(folder, sizeof folder, "%0100d/%0100d", 1, 2);
    (void)snprintf(path, sizeof path, "%s/robot.urdf", folder);
    (void)snprintf(place, sizeof place, "%s:1:1: there is no link", path);
    kt_expect(2, place, "mkdir -p %s && echo \"<robot name='r'/>\" >%s && $K check %s", folder, path, path);
    const kt_ran ran = kt_shell("$K check %s 2>&1 | head -c 3", path);
    kt_check_text("begins with the path", ran.out, "000");
}

/* Faults that compilation alone finds, of scenes and of robots, name the whole path, however long it is. */
KT_TEST(paths_of_any_length_are_written_whole_in_every_fault) {
    static const char robot[] = "<sdf version='1.7'><model name='m'><link name='l'><inertial><mass>1</mass><inertia>"
                                "<ixx>0</ixx><iyy>0</iyy><izz>0</izz></inertia></inertial></link></model></sdf>\n";
    static const char *const files[] = {"kinetree: 1\nbodies:\n  - {name: a, joint: {type: revolute}}\n",
                                        "kinetree: 1\nbodies:\n  - {name: a, joint: {type: revolute}, mass: -1}\n",
                                        robot};
    static const char *const places[] = {":3:", ":3:", ":1:"}, *const names[] = {"s.yaml", "t.yaml", "r.sdf"};
    int wrong = 0, told = 0;
    for (int length = 1; length < 400; length += 1 + length / 5)
        for (int k = 0; k < 3; k++) {
            char folder[500], path[600];
            (void)snprintf(folder, sizeof folder, "%0*d/%0*d", (length + 1) / 2, 1, (length + 1) / 2, 2);
            (void)snprintf(path, sizeof path, "%s/%s", folder, names[k]);
            kt_write_file("given", files[k]);
            const kt_ran ran =
                kt_shell("mkdir -p %s && cp given %s && $K check %s 2>&1 | grep -v ' note: '", folder, path, path);
            const size_t size = strlen(path);
            const bool good = strncmp(ran.out, path, size) == 0 && strncmp(ran.out + size, places[k], 3) == 0;
            told++;
            if (!good && wrong++ == 0)
                kt_check_text("the first one that is not", ran.out, path);
        }
    kt_check_true("some twenty lengths of three files", told > 60);
    kt_check_equal_int("faults without the whole path", wrong, 0);
}

/* For a file of another kind, the message names its kind. */
KT_TEST(results_and_checkpoints_are_told_from_scenes_and_records) {
    kt_write_file("swing.yaml",
                  "kinetree: 1\nbodies:\n  - {name: a, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}\n"
                  "simulate: {duration: 0.1}\n");
    kt_expect(0, NULL, "$K run swing.yaml --quiet --out swing.csv --summary swing.json");
    kt_expect(1, "swing.yaml is a scene and no result of a run", "$K run swing.yaml --quiet --from swing.yaml");
    kt_expect(1, "swing.csv is no checkpoint; --resume takes the file that --checkpoint has written",
              "$K run swing.yaml --quiet --resume swing.csv");
    kt_expect(1, "swing.json is no checkpoint", "$K run swing.yaml --quiet --resume swing.json");
    kt_expect(0, NULL, "$K run swing.yaml --quiet --from swing.csv --out again.csv");
}

/* Only rounding is called rounding, and a negative inertia is not called none. */
KT_TEST(inertias_that_no_body_has_are_named_as_what_they_are) {
    static const char scene[] =
        "kinetree: 1\ninertia_check: accept\nbodies:\n"
        "  - {name: a, joint: {type: revolute}, mass: 1, inertia: [%s]}\nsimulate: {duration: 0.1}\n";
    char text[400];
    (void)snprintf(text, sizeof text, scene, "1, 1, 1200");
    kt_write_file("i.yaml", text);
    kt_expect(0, "this is more than rounding; check the units", "$K run i.yaml --out i.csv");
    (void)snprintf(text, sizeof text, scene, "1, 1, 2.001");
    kt_write_file("i.yaml", text);
    kt_expect(0, "give inertias with more digits", "$K run i.yaml --out i.csv");
    (void)snprintf(text, sizeof text, scene, "1, 1, -0.5");
    kt_write_file("i.yaml", text);
    kt_expect(4, "no positive inertia along", "$K run i.yaml --out i.csv");
    kt_write_file("massless.yaml",
                  "kinetree: 1\ninertia_check: accept\nbodies:\n"
                  "  - {name: a, joint: {name: hinge, type: revolute}, mass: 0, markers: {tip: [1, 0, 0]}}\n"
                  "  - {name: b, joint: {name: wheel, type: revolute}, mass: 0, markers: {tip: [1, 0, 0]}}\n"
                  "loops: [{name: l, type: coupling, coefficients: {hinge: 1, wheel: -1}}]\n");
    kt_expect(4, "joint 'hinge', t = 0 s: the mechanism has no positive inertia", "$K run massless.yaml");
}

/* The contents identify a robot. Without masses it has places, and an acceleration that is null. */
KT_TEST(robots_are_known_by_their_contents_and_need_no_masses) {
    kt_shell("echo \"<robot name='r'><link name='a'/><link name='b'><visual><geometry><sphere radius='1'/></geometry>"
             "</visual></link><joint name='j' type='continuous'><parent link='a'/><child link='b'/></joint></robot>\" "
             ">robot.txt");
    kt_expect(0, "ok, 1 warning", "$K check robot.txt 1>&2");
    kt_expect(0, "no link has a mass", "$K info robot.txt 1>&2");
    kt_expect(0, "\"acceleration\": null", "$K evaluate robot.txt 1>&2");
    kt_expect(4, "no positive inertia along one of its degrees of freedom", "$K run robot.txt --out robot.csv");
    kt_expect(0, "\"acceleration\": [",
              "$K import robot.txt --mass b=2 --out robot.yaml && "
              "$K evaluate robot.yaml 1>&2");
    kt_shell("echo \"<mujoco><worldbody><body name='a'><joint axis='0 1 0'/><geom size='0.1' pos='0 0 -1'/></body>"
             "</worldbody></mujoco>\" >model.txt");
    kt_expect(0, "dof        1", "$K info model.txt 1>&2");
    kt_expect(0, "dof        1", "$K info - <model.txt 1>&2");
    kt_expect(1, "has no keys of a scene", "$K run model.txt --set L=1");
}

/* A robot whose every joint is wrong: the first faults, and the number of the others. Another one has notes: a line for
 * each warning, a line for the start and the limits, and details on demand. The file is named once. */
KT_TEST(robots_say_no_more_than_is_of_use) {
    kt_shell(
        "(echo '<mujoco><worldbody>'; for i in $(seq 30); do echo '<body><joint axis=\"0 0 0\"/></body>'; done; "
        "echo '</worldbody></mujoco>') >wrong.xml; echo '<mujoco><worldbody><body name=\"a\"><joint range=\"0 1\"/>"
        "<geom size=\"1 1 1\" type=\"ellipsoid\"/></body><plugin/><body mocap=\"true\"/></worldbody></mujoco>' "
        ">right.xml");
    const kt_ran wrong = kt_shell("$K import wrong.xml");
    kt_check_equal_int("lines of faults", kt_count_lines(wrong.err), 13);
    kt_check_contains("words", wrong.err, "wrong.xml has 18 more errors");
    kt_check_text(
        "notes", kt_shell("$K import right.xml --out o.yaml").err,
        "right.xml:1:35: warning: limits of position, which do not act without --stops: 1\n"
        "  1:99: warning: 'plugin' is left out: 1\n"
        "  note: start and limits: bodies that are fixed to the world (--floating lets them move): 1; bodies that "
        "a program moves (mocap), fixed to the world: 1; geoms that could touch others, left out, since contacts are "
        "effects: 1\n");
    const kt_ran all = kt_shell("$K import right.xml --verbose --out o.yaml");
    kt_check_equal_int("lines of all notes", kt_count_lines(all.err), 7);
    kt_check_contains("of pictures", all.err, "\n  1:55: note: ellipsoids, which pictures have");
    kt_check_contains("of the start", all.err, "\n  1:108: note: bodies");
    kt_check_contains("a run", kt_shell("$K run right.xml --duration 0.01 --out o.csv").err,
                      "1:99: warning: 'plugin' is left out");
    kt_expect(0, NULL, "$K import right.xml --quiet --out o.yaml && $K info right.xml --quiet >o.txt");
    kt_expect(0, NULL, "$K run right.xml --quiet --duration 0.01 --out o.csv");
    kt_expect(0, NULL, "$K info right.xml --quiet --stops 1 >o.txt");
    kt_expect(1, "'--stops' is an option of 'kinetree import'", "$K sweep right.xml --stops 1");
    kt_expect(2, "there is no keyframe 'k'", "$K run right.xml --keyframe k");
}

KT_TEST(an_unknown_keyframe_is_answered_with_names) {
    static const char robot[] =
        "<mujoco><worldbody><body name='a'><joint name='j'/><geom size='.1' mass='1'/></body></worldbody>"
        "<keyframe><key name='start' qpos='.1'/><key qpos='.2'/><key name='home' qpos='.3'/></keyframe></mujoco>";
    kt_write_file("keys.xml", robot);
    kt_expect(2, "there is no keyframe 'strat'; did you mean 'start'?", "$K run keys.xml --keyframe strat");
    kt_expect(2, "there is no keyframe 'squat'; the names are start, home\n", "$K run keys.xml --keyframe squat");
    kt_write_file("none.xml",
                  "<mujoco><worldbody><body><joint/><geom size='.1' mass='1'/></body></worldbody></mujoco>");
    kt_expect(2, "there is no keyframe 'squat'; the robot has no keyframe with a name",
              "$K run none.xml --keyframe squat");
}

KT_TEST(run_reads_robots_with_their_ground) {
    kt_write_file("ball.urdf",
                  "<robot name='r'><link name='a'><inertial><mass value='2'/><inertia ixx='1' iyy='1' izz='1' "
                  "ixy='0' ixz='0' iyz='0'/></inertial><collision><geometry><sphere radius='.1'/></geometry>"
                  "</collision></link></robot>");
    kt_write_file("p.yaml",
                  "bodies: [{name: a, mass: 1, joint: {type: revolute, axis: [0, 1, 0]}, com: [0, 0, -1]}]\n");
    kt_expect(0, "falls, 4.9 m in the first second", "$K run ball.urdf --floating --duration 0.1 --out b.csv");
    kt_check_contains(
        "it touches",
        kt_shell("$K run ball.urdf --floating --contacts --ground -0.1 --duration 0.1 --out b.csv --summary -").err,
        "collision shapes that touch planes (1), and nothing else: 1");
    kt_expect(1, "--ground is for contacts", "$K run ball.urdf --floating --ground 0");
    kt_expect(1, "--ground is a height in m, such as 0, not 'low'", "$K run ball.urdf --contacts --ground low");
    kt_expect(1, "are for robots in URDF, MJCF or SDF; this is a scene", "$K run p.yaml --contacts");
    kt_expect(1, "are for robots in URDF, MJCF or SDF; this is a scene", "$K run p.yaml --ground 0");
    kt_expect(1, "are for robots in URDF, MJCF or SDF; this is a scene", "$K check p.yaml ball.urdf --floating");
    kt_expect(1, "are for robots in URDF, MJCF or SDF; this is a scene", "cat p.yaml | $K info - --floating");
    kt_expect(2, "did you mean 'ball.urdf'", "$K run ball.udrf --floating");
    kt_expect(2, "did you mean 'ball.urdf'", "$K sweep ball.udrf --vary gravity=1:2:2");
    kt_expect(2, "kinetree import ball.urdf >robot.yaml", "$K sweep ball.urdf --vary gravity=1:2:2");
}

/* Servers are the place of some models only: the remedy of the others is a folder. */
KT_TEST(a_world_without_its_models_names_the_remedy) {
    static const char world[] = "printf \"<sdf version='1.9'><world name='w'><include><uri>%s</uri></include></world>"
                                "</sdf>\" $u > w.sdf; HOME=none GZ_FUEL_CACHE_PATH= $K check w.sdf";
    kt_ran ran = kt_shell("u=https://fuel.gazebosim.org/1.0/a/models/b; %s", world);
    kt_check_contains("of a server", ran.err, "or --search, or open the world once in Gazebo, which keeps models of");
    kt_check_contains("of a server", ran.err, "servers (GZ_FUEL_CACHE_PATH)");
    ran = kt_shell("u=model://b; %s", world);
    kt_check_contains("of a folder", ran.err, "GAZEBO_MODEL_PATH or --search");
    kt_check_true("of a folder, no server", strstr(ran.err, "open the world") == NULL);
}

/* The world has a mesh of the same name, whose vertices lie elsewhere. */
KT_TEST(meshes_of_an_included_model_are_next_to_it) {
    kt_shell("mkdir -p kept/box/meshes meshes; v='v 0 0 0\nv 0 1 0\nv 0 0 1\n'; f='f 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 "
             "4\n'; printf \"${v}v 5 0 0\n$f\" >kept/box/meshes/a.obj; printf \"${v}v 9 0 0\n$f\" >meshes/a.obj");
    kt_write_file("kept/box/model.sdf", "<sdf version='1.9'><model name='box'><link name='l'><collision name='c'>"
                                        "<geometry><mesh><uri>meshes/a.obj</uri></mesh></geometry></collision></link>"
                                        "</model></sdf>");
    kt_write_file("w.sdf",
                  "<sdf version='1.9'><world name='w'><include><uri>model://box</uri></include></world></sdf>");
    const kt_ran ran = kt_shell("$K import w.sdf --search kept --contacts --ground -1");
    kt_check_contains("of the model", ran.out, "at: [5, 0, 0]");
    kt_check_true("none of the world", strstr(ran.out, "at: [9, 0, 0]") == NULL);
}

/* The folder of a model is found, but not the file that it names. */
KT_TEST(a_model_without_its_file_is_told_from_a_missing_one) {
    kt_shell("mkdir -p cfg");
    kt_write_file("cfg/model.config", "<model><sdf version='1.9'>gone.sdf</sdf></model>");
    kt_write_file("w.sdf",
                  "<sdf version='1.9'><world name='w'><include><uri>model://cfg</uri></include></world></sdf>");
    kt_expect(2, "model://cfg, whose folder has no file gone.sdf", "$K check w.sdf");
}

/* Every subcommand that reads a robot finds its files in the same folders. The world and its model lie apart, and the
 * path of the arm leads out of the folder of the world. */
KT_TEST(all_subcommands_find_the_files_of_robots) {
    static const char *const commands[] = {
        "check",
        "info",
        "evaluate",
        "equilibrium",
        "modes",
        "stability --samples 1",
        "draw",
        "export --mjcf",
        "export --c --out arm.c",
        "run --duration 0.1",
        "import",
        "view --duration 0.1",
        "accuracy --duration 0.1 --integrators rk4 --goal 1e-3 --plot /dev/null --out /dev/null"};
    kt_shell("mkdir -p world store/pole shared");
    kt_write_file("store/pole/model.sdf",
                  "<sdf version='1.9'><model name='pole'><link name='rod'><pose>0 0 -1 0 0 0</pose></link>"
                  "<joint name='pin' type='revolute'><parent>world</parent><child>rod</child><pose>0.1 0 1 0 0 0</pose>"
                  "<axis><xyz>0 1 0</xyz></axis></joint></model></sdf>");
    kt_write_file("world/pole.sdf", "<sdf version='1.9'><world name='w'><include><uri>model://pole</uri></include>"
                                    "</world></sdf>");
    kt_write_file("shared/arm.xml", "<mujocoinclude><body name='arm'><joint axis='0 1 0' damping='1'/>"
                                    "<geom size='0.1' pos='0.1 0 -1'/></body></mujocoinclude>");
    kt_write_file("world/arm.xml", "<mujoco><worldbody><include file='../shared/arm.xml'/></worldbody></mujoco>");
    for (size_t i = 0; i < sizeof commands / sizeof *commands; i++) {
        const char *words = commands[i];
        kt_note("%s", words);
        kt_expect(2, "pole", "$K %s world/pole.sdf", words);
        kt_expect(2, "arm.xml", "$K %s world/arm.xml", words);
        kt_expect(0, "links without a mass or an inertia", "$K %s world/pole.sdf --search store >o.txt", words);
        kt_expect(0, "geoms that could touch others", "$K %s world/arm.xml --allow shared >o.txt", words);
        kt_expect(2, "there is no keyframe 'k'", "$K %s world/arm.xml --allow shared --keyframe k", words);
    }
    kt_expect(1, "--search and --allow are for robots", "$K run p.yaml --search store");
}
