/* The whip in MuJoCo: links on hinges, and a tendon with a limit as its rope. Its time constant is two steps, and its
 * damping ratio 1/2. The search covered time constants of two, four and eight steps. It covered damping ratios of 1/2,
 * one and two. The methods were RK4, Euler and implicit. The chosen values have the least error. Others have errors up
 * to 2e-2. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "../../test/motion/contact/whip.h"

#include "events.h"
#include "mujoco.h"

/* Half of them are in a file of their own. */
enum { HALF = KT_WHIP_LINKS / 2 };

static void begin_links(FILE *xml, int first, int count) {
    const double l = KT_WHIP_LINK, m = KT_WHIP_MASS, inertia = m * l * l / 12.0;
    for (int i = first; i < first + count; i++)
        (void)fprintf(xml,
                      "<body pos='%.17g 0 0'><joint type='hinge' axis='0 0 1'/>"
                      "<inertial pos='%.17g 0 0' mass='%.17g' diaginertia='%.17g %.17g %.17g'/>",
                      i > 0 ? l : 0.0, 0.5 * l, m, inertia, inertia, inertia);
}

static void end_links(FILE *xml, int count) {
    for (int i = 0; i < count; i++)
        (void)fputs("</body>", xml);
}

static void write_part(FILE *xml) {
    (void)fputs("<mujocoinclude>", xml);
    begin_links(xml, HALF, KT_WHIP_LINKS - HALF);
    (void)fprintf(xml, "<site name='tip' pos='%.17g 0 0'/>", KT_WHIP_LINK);
    end_links(xml, KT_WHIP_LINKS - HALF);
    (void)fputs("</mujocoinclude>", xml);
}

static void write_whip(FILE *xml, const kt_events_problem *p) {
    (void)fprintf(xml,
                  "<mujoco><size nstack='1000000'/><option gravity='0 %.17g 0' timestep='%.17g' integrator='RK4' "
                  "solver='Newton' iterations='100' tolerance='1e-14'/>"
                  "<default><geom contype='0' conaffinity='0'/></default>"
                  "<worldbody><site name='point' pos='%.17g %.17g 0'/>",
                  -KT_WHIP_GRAVITY, p->step, KT_WHIP_X, KT_WHIP_Y);
    begin_links(xml, 0, HALF);
    (void)fputs("<include file='part.xml'/>", xml);
    end_links(xml, HALF);
    (void)fprintf(
        xml,
        "</worldbody><tendon><spatial limited='true' range='0 %.17g' solreflimit='%.17g 0.5'"
        " solimplimit='0.9999 0.9999 0.001'><site site='point'/><site site='tip'/></spatial></tendon></mujoco>",
        KT_WHIP_ROPE, 2.0 * p->step);
}

static void see(kt_events_watch *watch, const mjModel *m, mjData *d, double t) {
    double x, y;
    (void)m;
    kt_whip_tip(d->qpos, &x, &y);
    kt_events_see(watch, 0, t, x);
    kt_events_see(watch, 1, t, y);
}

bool kt_events_whip_mujoco(kt_events_watch *watch) {
    static const kt_mujoco_motion motion = {.write = write_whip, .see = see, .write_part = write_part};
    return kt_mujoco_run(watch, &motion);
}
