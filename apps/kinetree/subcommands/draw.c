/* kinetree draw: a picture of a mechanism in one state or several. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "draw/draw.h"

#include "command.h"
#include "open/play.h"
#include "open/released.h"
#include "open/start.h"
#include "plot/plot.h"
#include "records/output.h"
#include "subcommands/run.h"
#include "text/arguments.h"
#include "text/list.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

enum {
    STATES_MOST = 60,
    FRAMES_MOST = 600, /* of an animation, besides the first */
    FRAME_RATE = 25,   /* frames a second, at first */
    FRAME_UNIT = 12,   /* their number is a multiple of this, so that each second, third, ... may be left out */
    PATH_POINTS = 800, /* of each path */
    SVG_BYTES = 60000, /* more would load slowly within a page */
};

typedef struct kt_draw_arguments {
    kt_settings settings;
    const char *out, *view, *at, *trace, *records, *clear;
    long strobe;  /* -1: not given */
    double until; /* s; 0: the duration of the scene */
    double speed; /* of an animation, times real time; 0: 1 */
    bool animate, axes, names, dark, boxes;
} kt_draw_arguments;

#define KT_AT(member) offsetof(kt_draw_arguments, member)

static const kt_option options[] = {
    KT_SET_OPTION,
    KT_OPTION(TEXT, "out", out, "FILE", "write the picture here, .svg, .png or .pdf; default: NAME.svg"),
    KT_OPTION(
        TEXT, "view", view, "VIEW",
        "set the direction of the view: x, y or z (the normal of the plane), iso, or AZIMUTH,ELEVATION in "
        "degrees, from the front to the right and up; default: the plane of a planar mechanism, else from 25 above"),
    KT_OPTION(TEXT, "at", at, "T,...", "draw the states at these times of a run, side by side, s"),
    KT_OPTION(COUNT, "strobe", strobe, "N", "draw N states of a run over each other, earlier ones paler"),
    KT_OPTION(TEXT, "records", records, "FILE", "show the motion of these records (CSV, HDF5) instead of a run"),
    KT_FLAG("animate", animate,
            "write an SVG that plays the run again and again, light or dark as its page; or with --out FILE.png, its "
            "frames: FILE-0001.png, FILE-0002.png, ..."),
    KT_OPTION(POSITIVE, "speed", speed, "X", "play --animate at X times real time; default: 1"),
    KT_OPTION(POSITIVE, "until", until, "T",
              "end --strobe, --trace and --animate at this time, s; default: the duration of the scene"),
    KT_OPTION(NAMES, "trace", trace, "B.M,...", "draw the paths of these markers, over the same time"),
    KT_OPTION(NAMES, "see-through", clear, "BODY,...", "draw these bodies see-through, such as a housing"),
    KT_FLAG("axes", axes, "draw the axes of joints"),
    KT_FLAG("names", names, "print the names of bodies, loops and markers"),
    KT_FLAG("boxes", boxes, "draw boxes with mass and inertia of the bodies instead of shapes and meshes"),
    KT_FLAG("dark", dark, "draw on a dark page"),
    KT_READER_OPTIONS,
};

static const char end_of[] =
    "--until is the end of --strobe or --trace without --at, or of --animate; give one of these, or leave it out";

static const kt_option_rule rules[] = {
    {"at", false, "strobe", NULL},
    {"animate", false, "at,strobe", "--animate shows the whole run; leave out --at and --strobe"},
    {"speed", true, "animate", NULL},
    {"until", false, "at", end_of},
    {"until", true, "strobe,trace,animate", end_of},
};

const kt_usage kt_usage_draw = {
    .command = "draw",
    .examples = "  kinetree draw four-bar.yaml                         its assembled start, in its plane\n"
                "  kinetree draw robot.yaml --axes --names --view iso --out robot.png\n"
                "  kinetree draw pendulum.yaml --strobe 12 --until 0.8 --trace lower.tip\n"
                "  kinetree draw four-bar.yaml --at 0,0.5,1,1.5\n"
                "  kinetree draw four-bar.yaml --animate --until 2 --trace coupler.tip\n"
                "  kinetree draw four-bar.yaml --animate --out frame.png     frames for ffmpeg\n",
    .operands = "SCENE",
    .about = "Draws shapes, joints, loops, springs, markers and planes to scale.\n"
             "A body without a shape is drawn as thin rods between its joints, with a ball at its centre of mass.\n"
             "Rods without a radius and points are drawn with a visible size.\n"
             "Joints and loops (with a dot) are circles in a plane, and pins and balls in space. Parts that are fixed "
             "to the ground are grey.\n"
             "States after the start come from 'kinetree run', with the events and 'until' of the scene.\n"
             "If loops cannot be closed, the picture shows the given state with the gaps in red, and the exit status "
             "is 3.\n",
    KT_OPTIONS_OF(options),
    KT_RULES_OF(rules),
};

/* ---- states ------------------------------------------------------------------------------------------------------ */

/* The scene, its simulation and the drawn states and paths, with their memory. */
typedef struct motion {
    kt_scene scene;
    kt_model *model;
    kt_absolute *absolute;
    kt_data *data;
    double *q, *v;
    kt_play play;
    kt_recorded recorded;        /* of --records */
    kt_picture *picture, *shown; /* of all, and at each state; NULL: nothing is ever released */
    uint64_t released[FRAMES_MOST + 1];
    double times[FRAMES_MOST + 1];
    int state_count, shown_count;
    kt_pose *poses; /* of each state, and a room for one more */
    kt_marker_pair *markers;
    int marker_count;
    kt_drawn_path *paths;
    kt_vec3 *points; /* PATH_POINTS + 1 of each path */
    int point_count;
    bool *clear; /* bodies of --see-through; NULL: none */
    char *name;
} motion;

static int reject_times(const char *list) {
    return kt_misuse("draw: --at takes times in rising order, such as 0,0.5,1, not '%s'", list);
}

static int read_times(const char *list, motion *m) {
    m->state_count = kt_numbers_read(list, m->times, STATES_MOST);
    if (m->state_count > STATES_MOST)
        return kt_misuse("draw: --at takes up to %d times", STATES_MOST);
    for (int i = 0; i < m->state_count; i++) {
        if (m->times[i] < 0.0)
            return kt_misuse("draw: --at takes times from 0 on, and %g s is negative", m->times[i]);
        if (i > 0 && m->times[i] <= m->times[i - 1])
            return reject_times(list);
    }
    return m->state_count > 0 ? -1 : reject_times(list);
}

/* Returns the k-th of evenly spaced times from 0 to `end`. The last one is `end` itself: end * n / n may be rounded to
 * a later time, which the run does not reach. */
static double even_time(double end, int k, int intervals) { return k < intervals ? end * k / intervals : end; }

static void lay_times(motion *m, double end) {
    for (int i = 0; i < m->state_count; i++)
        m->times[i] = m->state_count > 1 ? even_time(end, i, m->state_count - 1) : 0.0;
}

static double film_speed_of(const kt_draw_arguments *arguments) {
    return arguments->speed > 0.0 ? arguments->speed : 1.0;
}

/* Returns the number of pictures of an animation of this length in seconds. */
static int count_pictures(double seconds) {
    return (int)fmin(fmax(rint(FRAME_RATE * seconds), 1.0), (double)FRAMES_MOST) + 1;
}

/* Returns whether the frames of --animate are pictures of their own. */
static bool makes_pictures(const kt_draw_arguments *arguments, const char *path) {
    return arguments->animate && kt_stem_length(path, ".png") > 0;
}

/* Returns the number of frames of an animation of this length in seconds. */
static int count_frames(double seconds) {
    const double units = ceil(FRAME_RATE * fmin(seconds, FRAMES_MOST) / FRAME_UNIT);
    return FRAME_UNIT * (int)fmin(fmax(units, 1.0), (double)FRAMES_MOST / FRAME_UNIT) + 1;
}

/* Chooses the times of all states. Returns -1, or an exit code after printing the error. */
static int choose_times(const kt_draw_arguments *arguments, const char *path, motion *m, double until) {
    if (arguments->strobe == 0 || arguments->strobe > STATES_MOST)
        return kt_misuse("draw: --strobe takes a number of states from 1 up to %d, not %ld", STATES_MOST,
                         arguments->strobe);
    if (arguments->at != NULL)
        return read_times(arguments->at, m);
    const double seconds = until / film_speed_of(arguments);
    m->state_count = makes_pictures(arguments, path) ? count_pictures(seconds)
                     : arguments->animate            ? count_frames(seconds)
                     : arguments->strobe > 0         ? (int)arguments->strobe
                                                     : 1;
    lay_times(m, until);
    return -1;
}

static void take_points(motion *m) {
    for (int i = 0; i < m->marker_count; i++) {
        const int body = kt_body_find(m->model, m->markers[i].body);
        m->points[(ptrdiff_t)i * (PATH_POINTS + 1) + m->point_count] =
            kt_play_point(&m->play, body, kt_marker_find(m->model, body, m->markers[i].marker));
    }
    m->point_count++;
}

/* Advances to a state and takes its poses. If the run ends before this state, the end of the run replaces the state. */
static kt_status take_drawn_state(motion *m, int state, kt_error *error) {
    kt_status status = kt_play_to(&m->play, m->times[state], error);
    if (status == KT_OK)
        status = kt_play_poses(&m->play, m->poses + (ptrdiff_t)state * kt_model_body_count(m->model), error);
    if (m->play.simulation != NULL)
        m->released[state] = kt_released_set(&m->scene, m->play.simulation);
    if (m->play.is_over)
        m->times[state] = fmin(m->times[state], m->play.ended);
    return status;
}

/* Takes a point of each path, at a time that no state has. */
static kt_status take_path_point(motion *m, double time, kt_error *error) {
    kt_pose *scratch = m->poses + (ptrdiff_t)m->state_count * kt_model_body_count(m->model);
    kt_status status = kt_play_to(&m->play, time, error);
    if (status == KT_OK)
        status = kt_play_poses(&m->play, scratch, error);
    if (status == KT_OK)
        take_points(m);
    return status;
}

/* Follows the run up to `end`, and takes the poses and the points of paths on its way. */
static kt_status follow_run(motion *m, double end, kt_error *error) {
    const int steps = m->marker_count > 0 ? PATH_POINTS : 1;
    kt_status status = KT_OK;
    int state = 0;
    for (int k = 0; k <= steps && status == KT_OK; k++) {
        const double time = even_time(end, k, steps);
        for (; status == KT_OK && state < m->state_count && m->times[state] <= time; state++)
            status = take_drawn_state(m, state, error);
        if (status == KT_OK && m->marker_count > 0)
            status = take_path_point(m, time, error);
    }
    return status;
}

/* Shortens the list of --at if times lie behind the end of the run. The first of these times becomes the end, and the
 * others are left out. */
static void cut_times(motion *m, double end) {
    int kept = 0;
    for (int i = 0; i < m->state_count && (i == 0 || m->times[i - 1] < end); i++)
        kept = i + 1;
    if (m->recorded.count > 0)
        kt_say("draw: --at %.6g: the records end at t = %.6g s: the last state is the one at their end",
               m->times[m->state_count - 1], end);
    else
        kt_say("draw: --at %.6g: the run ends at t = %.6g s, by %s'%s': the last state is the one at its end",
               m->times[m->state_count - 1], end, strcmp(m->play.ended_by, "until") == 0 ? "" : "event ",
               kt_show(m->play.ended_by).text);
    m->state_count = kept;
    m->times[kept - 1] = end;
}

/* Lays the times of all states within the run, whose end is at most `limit`, and runs it. */
static kt_status simulate_states(motion *m, const kt_draw_arguments *arguments, double limit, kt_error *error) {
    const double duration = m->scene.run.duration;
    double end = limit;
    kt_status status = m->recorded.count > 0
                           ? kt_play_start_recorded(&m->play, &m->scene, m->model, &m->recorded, error)
                           : kt_play_start(&m->play, &m->scene, m->model, m->absolute, error);
    if (status == KT_OK)
        status = kt_play_find_end(&m->play, limit, &end, error);
    if (status != KT_OK)
        return status;
    if (arguments->at == NULL)
        lay_times(m, end);
    else if (end < limit)
        cut_times(m, end);
    if (end == limit && limit > duration && m->recorded.count == 0)
        kt_say("draw: --%s %.6g is after the end of the scene's run, %.6g s (simulate.duration): the motion goes on "
               "from there",
               arguments->at != NULL ? "at" : "until", limit, duration);
    return follow_run(m, end, error);
}

/* ---- the picture ------------------------------------------------------------------------------------------------- */

static void name_states(const motion *m, const kt_draw_arguments *arguments, bool is_open, const char *view, char *text,
                        size_t size) {
    const double last = m->times[m->state_count - 1];
    const char *seen = strncmp(view, "in ", 3) == 0 || strcmp(view, "isometric") == 0 ? "" : "seen ";
    if (is_open)
        snprintf(text, size, "as given: loops are open, in red; %s%s", seen, view);
    else if (arguments->animate && arguments->speed > 0.0)
        snprintf(text, size, "0 to %.4g s, at %.4g times real time; %s%s", last, arguments->speed, seen, view);
    else if (arguments->animate)
        snprintf(text, size, "0 to %.4g s; %s%s", last, seen, view);
    else if (arguments->strobe > 1)
        snprintf(text, size, "%d states from 0 to %.4g s; %s%s", m->state_count, last, seen, view);
    else if (arguments->at != NULL && m->state_count > 1)
        snprintf(text, size, "%d states up to %.4g s; %s%s", m->state_count, last, seen, view);
    else if (last > 0.0)
        snprintf(text, size, "at %.4g s; %s%s", last, seen, view);
    else
        snprintf(text, size, "at the start; %s%s", seen, view);
}

/* Keeps `count` of the states, evenly, the first and the last among them. */
static void thin_states(motion *m, int count) {
    const int last = m->state_count - 1;
    const size_t bodies = (size_t)kt_model_body_count(m->model);
    for (int i = 0; i < count; i++) {
        const int from = (int)lround((double)last * i / (count - 1));
        m->times[i] = m->times[from];
        if (m->shown != NULL) {
            const kt_picture shown = m->shown[i];
            m->shown[i] = m->shown[from];
            m->shown[from] = shown;
        }
        memmove(m->poses + (size_t)i * bodies, m->poses + (size_t)from * bodies, bodies * sizeof *m->poses);
    }
    m->state_count = count;
}

/* Returns the size of an SVG in bytes; 0 for other files. */
static long long svg_size(const char *path) {
    struct stat status;
    return kt_stem_length(path, ".svg") >= 0 && stat(path, &status) == 0 ? (long long)status.st_size : 0;
}

/* Writes the drawing. A strobe picture that is larger than SVG_BYTES is written again with flat colours. Its earlier
 * states then have no symbols and no edges. If it is still too large, it has fewer states. view: the part of the
 * subtitle that describes the view. */
static int write_small(motion *m, const kt_draw_arguments *arguments, const char *view, kt_drawing *drawing,
                       const char *path) {
    const int states = m->state_count;
    char subtitle[200];
    int code = KT_EXIT_DONE, nameless = 0;
    drawing->subtitle = subtitle;
    drawing->nameless = &nameless;
    for (bool is_small = false; !is_small && code == KT_EXIT_DONE;) {
        drawing->state_count = m->state_count;
        name_states(m, arguments, drawing->shows_gaps, view, subtitle, sizeof subtitle);
        code = kt_drawing_write(drawing, path);
        const double share = SVG_BYTES / fmax((double)svg_size(path), 1.0);
        is_small = share >= 1.0 || !drawing->is_strobe || (drawing->is_plain && m->state_count <= 2);
        if (!is_small && drawing->is_plain)
            thin_states(m, (int)fmax(fmin(0.97 * share * m->state_count, m->state_count - 1), 2.0));
        drawing->is_plain = drawing->is_plain || !is_small;
    }
    drawing->subtitle = NULL; /* its memory ends here */
    drawing->nameless = NULL;
    if (code != KT_EXIT_DONE)
        return code;
    if (nameless > 0)
        kt_say("%s lacks %d name%s, for which there is no room", path, nameless, nameless > 1 ? "s" : "");
    if (kt_drawing_grain(drawing) > 0.0)
        kt_say(
            "%s shows nothing finer than %.2g m, to which positions are rounded so far from the origin; describe the "
            "mechanism nearer to it",
            path, kt_drawing_grain(drawing));
    if (drawing->is_plain)
        kt_say("%s shows %d of %d states in flat colours, the earlier ones without symbols and edges, to have %d kB "
               "(%d kB at most); a .png shows all",
               path, m->state_count, states, (int)(svg_size(path) / 1000), SVG_BYTES / 1000);
    else if (svg_size(path) > SVG_BYTES)
        kt_say("%s has %d kB; a .png is smaller", path, (int)(svg_size(path) / 1000));
    return code;
}

static int write_moving(motion *m, const kt_draw_arguments *arguments, const char *view, kt_drawing *drawing,
                        const char *path) {
    char subtitle[200];
    int frames = 0;
    size_t bytes = 0;
    const double seconds = m->times[m->state_count - 1] / film_speed_of(arguments);
    name_states(m, arguments, false, view, subtitle, sizeof subtitle);
    drawing->subtitle = subtitle;
    const bool has_pictures = makes_pictures(arguments, path);
    const int code = has_pictures ? kt_drawing_write_frames(drawing, path)
                                  : kt_animation_write(drawing, seconds, path, &frames, &bytes);
    drawing->subtitle = NULL; /* its memory ends here */
    if (has_pictures && code == KT_EXIT_DONE)
        kt_say("frames: %.*s-0001.png to -%04d.png, %.6g a second", (int)kt_stem_length(path, ".png"), path,
               m->state_count, (m->state_count - 1) / seconds);
    if (code == KT_EXIT_DONE && bytes > KT_ANIMATION_BYTES)
        kt_say(
            "%s has %zu kB with %d frames in %.4g s, more than the %d kB that pages load at once: a shorter --until%s "
            "makes it smaller",
            path, bytes / 1000, frames, seconds, KT_ANIMATION_BYTES / 1000,
            m->picture->mesh_count > 0 && !arguments->boxes ? ", or --boxes in place of meshes," : "");
    return code;
}

static int write_picture(motion *m, const kt_draw_arguments *arguments, bool is_open, const char *path) {
    kt_camera camera;
    kt_view_words words;
    const int code = kt_draw_direction_choose(arguments->view, m->picture, m->poses, &camera, &words);
    if (code >= 0)
        return code;
    if (kt_switch_count(m->model) > 0 && !is_open) {
        m->shown = kt_shown_create(&m->scene, m->picture, m->released, m->state_count);
        if (m->shown == NULL)
            return kt_say_no_memory("the picture");
    }
    m->shown_count = m->state_count;
    kt_drawing drawing = {.picture = m->picture,
                          .pictures = m->shown,
                          .camera = camera,
                          .is_diagram = m->picture->is_planar &&
                                        fabs(kt_vec3_dot(camera.axes.z, m->picture->normal)) > 1.0 - 1e-9,
                          .state_count = m->state_count,
                          .poses = m->poses,
                          .times = m->times,
                          .is_strobe = arguments->strobe > 0 || arguments->animate,
                          .is_moving = arguments->animate,
                          .paths = m->paths,
                          .path_count = m->point_count > 1 ? m->marker_count : 0,
                          .clear = m->clear,
                          .shows_axes = arguments->axes,
                          .shows_names = arguments->names,
                          .shows_gaps = is_open,
                          .is_dark = arguments->dark,
                          .title = m->name};
    return arguments->animate && !is_open ? write_moving(m, arguments, words.text, &drawing, path)
                                          : write_small(m, arguments, words.text, &drawing, path);
}

/* Creates the picture of the first state, and reports lost meshes. */
static kt_status create_picture(motion *m, const kt_draw_arguments *arguments, kt_error *error) {
    const kt_picture_options shown = {.boxes = arguments->boxes};
    const kt_status status = kt_picture_create(&m->scene, m->model, m->poses, &shown, &m->picture, error);
    if (status == KT_OK && m->picture->lost_meshes > 0)
        kt_say("%d mesh%s not shown; the first is %s", m->picture->lost_meshes,
               m->picture->lost_meshes == 1 ? " is" : "es are", m->picture->lost_reason);
    return status;
}

/* Draws the given state of a scene whose loops cannot be closed, after the error has been printed. */
static int draw_open(motion *m, const kt_draw_arguments *arguments, const char *path) {
    kt_error error = {0};
    kt_model_initial(m->model, m->q, m->v);
    m->state_count = 1;
    m->times[0] = 0.0;
    kt_status status = kt_poses_take(m->model, m->data, m->q, m->poses, &error);
    if (status == KT_OK)
        status = create_picture(m, arguments, &error);
    if (status != KT_OK)
        return kt_say_status(status, &error);
    const int code = write_picture(m, arguments, true, path);
    if (code == KT_EXIT_DONE)
        kt_say("%s shows the given state", path);
    return code == KT_EXIT_DONE ? KT_EXIT_ASSEMBLY : code;
}

static int draw_run_states(motion *m, const kt_draw_arguments *arguments, const char *path, double end) {
    kt_error error = {0};
    const bool moves = m->marker_count > 0 || kt_switch_count(m->model) > 0 || m->times[m->state_count - 1] > 0.0;
    kt_status status =
        moves ? simulate_states(m, arguments, end, &error) : kt_poses_take(m->model, m->data, m->q, m->poses, &error);
    if (status == KT_OK)
        status = create_picture(m, arguments, &error);
    if (status != KT_OK)
        return kt_say_status(status, &error);
    kt_bounds bounds = kt_bounds_empty();
    for (int i = 0; i < m->state_count; i++)
        bounds = kt_picture_widen(m->picture, m->poses + (ptrdiff_t)i * kt_model_body_count(m->model), bounds);
    if (m->state_count > 1)
        kt_picture_fit_planes(m->picture, m->poses, bounds);
    return write_picture(m, arguments, false, path);
}

static bool allocate_motion(motion *m) {
    const size_t states = (size_t)m->state_count, bodies = (size_t)kt_model_body_count(m->model);
    const size_t markers = (size_t)m->marker_count;
    m->q = calloc((size_t)kt_model_nq(m->model) + 1, sizeof *m->q);
    m->v = calloc((size_t)kt_model_nv(m->model) + 1, sizeof *m->v);
    m->poses = calloc((states + 1) * bodies, sizeof *m->poses);
    m->paths = calloc(markers + 1, sizeof *m->paths);
    m->points = calloc(markers * (PATH_POINTS + 1) + 1, sizeof *m->points);
    for (size_t i = 0; i < markers && m->paths != NULL && m->points != NULL; i++)
        m->paths[i] = (kt_drawn_path){.body = kt_body_find(m->model, m->markers[i].body),
                                      .points = m->points + i * (PATH_POINTS + 1),
                                      .count = PATH_POINTS + 1};
    return m->q != NULL && m->v != NULL && m->poses != NULL && m->paths != NULL && m->points != NULL;
}

/* Counts the times of records from the first one, as those of a run. Returns the last one. */
static double begin_at_zero(kt_recorded *recorded) {
    const double first = recorded->time[0];
    if (first != 0.0)
        kt_say("draw: --records begins at t = %.6g s: times of the picture count from there", first);
    for (size_t i = 0; i < recorded->count; i++)
        recorded->time[i] -= first;
    return recorded->time[recorded->count - 1];
}

/* Finds the bodies of --see-through. Returns -1, or an exit code after printing the error. */
static int choose_clear(motion *m, const kt_draw_arguments *arguments, const char *path) {
    const char *rest = arguments->clear;
    char name[160];
    if (rest == NULL)
        return -1;
    if (arguments->animate && !makes_pictures(arguments, path))
        return kt_misuse("draw: an SVG that moves has no see-through bodies; give --out FILE.png, which writes frames");
    m->clear = calloc((size_t)kt_model_body_count(m->model), sizeof *m->clear);
    if (m->clear == NULL)
        return kt_say_no_memory("the picture");
    while (kt_list_next(&rest, name, sizeof name)) {
        const int body = kt_body_find(m->model, name);
        if (body == 0)
            return kt_misuse("draw: --see-through: the world has no solids; name a body");
        if (body < 0)
            return kt_say_no_body("draw: --see-through", m->model, name);
        m->clear[body] = true;
    }
    return -1;
}

static int draw_scene(motion *m, const kt_draw_arguments *arguments, const char *path) {
    kt_error error = {0};
    kt_run run = m->scene.run;
    int code = arguments->records != NULL ? kt_recorded_open(&m->recorded, arguments->records, m->model) : -1;
    if (code > 0)
        return code;
    const double last = m->recorded.count > 0 ? begin_at_zero(&m->recorded) : run.duration;
    const double until = arguments->until > 0.0 ? arguments->until : last;
    code = choose_times(arguments, path, m, until);
    code = code < 0 ? choose_clear(m, arguments, path) : code;
    if (code < 0)
        code = kt_run_override_markers("draw: --trace", arguments->trace, m->model, &run, &m->markers);
    if (code >= 0)
        return code;
    m->marker_count = m->markers != NULL ? run.marker_count : 0;
    if (!allocate_motion(m))
        return kt_say_no_memory("the picture");
    const kt_status status = kt_data_create(m->model, &m->data, &error);
    if (status != KT_OK)
        return kt_say_status(status, &error);
    code = m->recorded.count > 0 ? KT_EXIT_DONE : kt_start_assemble(&m->scene, m->model, m->data, m->q, m->v);
    if (m->recorded.count > 0)
        kt_recorded_positions(&m->recorded, m->model, 0.0, m->q);
    if (code == KT_EXIT_ASSEMBLY)
        return draw_open(m, arguments, path);
    const double end = arguments->at != NULL ? m->times[m->state_count - 1] : until;
    return code == KT_EXIT_DONE ? draw_run_states(m, arguments, path, end) : code;
}

static void release_motion(motion *m) {
    kt_shown_free(m->shown, m->shown_count);
    kt_picture_free(m->picture);
    kt_play_end(&m->play);
    kt_recorded_close(&m->recorded);
    kt_data_free(m->data);
    kt_absolute_free(m->absolute);
    kt_model_free(m->model);
    kt_scene_free(&m->scene);
    free(m->q);
    free(m->v);
    free(m->poses);
    free(m->markers);
    free(m->paths);
    free(m->points);
    free(m->clear);
    free(m->name);
}

int kt_command_draw(int argc, char **argv) {
    kt_draw_arguments arguments = {.strobe = -1};
    int code = kt_arguments_read(&kt_usage_draw, argc, argv, &arguments, NULL);
    if (code >= 0)
        return code;
    char *base = kt_base_name(argv[1]), own[4096];
    if (base == NULL)
        return kt_say_no_memory("the picture");
    snprintf(own, sizeof own, "%s.svg", base);
    const char *path = arguments.out != NULL ? arguments.out : own;
    code = kt_check_result("draw", "the scene", argv[1], "--out", path);
    code = code < 0 ? kt_plot_check(path) : code;
    if (code < 0 && arguments.animate && !makes_pictures(&arguments, path))
        code = kt_check_ending("--animate: --out", path, ".svg");
    motion m = {.state_count = 0};
    char replaced[600] = "";
    int bodies = 0;
    kt_note_replaced(path, replaced, sizeof replaced);
    if (code < 0)
        code = kt_load_model(argv[1], &arguments.settings, &m.scene, &m.model);
    if (m.model != NULL)
        code = kt_compile_absolute(&m.scene, m.model, &m.absolute);
    if (m.model != NULL) {
        bodies = kt_model_body_count(m.model); /* the ground is one */
        m.name = strdup(kt_title_of(m.model, base));
        if (code == KT_EXIT_DONE)
            code = m.name != NULL ? draw_scene(&m, &arguments, path) : kt_say_no_memory("the picture");
        release_motion(&m);
    }
    if (code == KT_EXIT_DONE && !makes_pictures(&arguments, path))
        kt_say_written("picture", path, bodies == 1 ? ", which is empty: the scene has no bodies" : "", replaced);
    free(base);
    return code;
}
