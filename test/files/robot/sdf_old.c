/* Models in SDF of versions before 1.4, which are read as the newest writes them. */
/* SPDX-License-Identifier: Apache-2.0 */
#define ROBOT "m.sdf"
#include "robot.h"
#include "sdf_text.h"

#include "kinetree/kinetree.h"

#include <stdio.h>
#include <string.h>

/* One model in the words of three versions: `1.0, 1.3, and 1.4`. The last is written in our order of elements. */
KT_TEST(versions_before_1_4_are_the_same_models) {
    static const char *const texts[] = {
        "<gazebo version='1.0'><model name='m' static='false'><origin pose='1 2 3 0.1 0.2 0.3'/>"
        "<link name='a' gravity='false'><inertial mass='2'><origin pose='0.1 0 0 0 0 0.5'/>"
        "<inertia ixx='1' ixy='0.1' ixz='0' iyy='2' iyz='0' izz='2.5'/></inertial>"
        "<visual name='v'><geometry><box size='1 2 3'/></geometry></visual></link>"
        "<link name='b'><origin pose='0 0 1 0 0 0'/><inertial mass='3'><inertia ixx='1' ixy='0' ixz='0' iyy='1' "
        "iyz='0' "
        "izz='1'/></inertial><visual name='v'><geometry><cylinder radius='0.5' length='2'/></geometry></visual></link>"
        "<joint name='j' type='revolute'><parent link='a'/><child link='b'/><axis xyz='0 1 0'>"
        "<dynamics damping='0.7' friction='0'/><limit lower='-1' upper='2' "
        "effort='30'/></axis></joint></model></gazebo>",
        "<sdf version='1.3'><model name='m'><static>false</static><pose>1 2 3 0.1 0.2 0.3</pose><link "
        "name='a'><gravity>"
        "false</gravity><inertial><mass>2</mass><pose>0.1 0 0 0 0 0.5</pose><inertia><ixx>1</ixx><ixy>0.1</ixy><ixz>0"
        "</ixz><iyy>2</iyy><iyz>0</iyz><izz>2.5</izz></inertia></inertial><visual name='v'><geometry><box><size>1 2 3"
        "</size></box></geometry></visual></link><link name='b'><pose>0 0 1 0 0 "
        "0</pose><inertial><mass>3</mass><inertia>"
        "<ixx>1</ixx><ixy>0</ixy><ixz>0</ixz><iyy>1</iyy><iyz>0</iyz><izz>1</izz></inertia></inertial><visual name='v'>"
        "<geometry><cylinder><radius>0.5</radius><length>2</length></cylinder></geometry></visual></link><joint "
        "name='j' "
        "type='revolute'><parent>a</parent><child>b</child><axis><xyz>0 1 "
        "0</xyz><dynamics><damping>0.7</damping><friction>"
        "0</friction></dynamics><limit><lower>-1</lower><upper>2</upper><effort>30</effort></limit></axis></joint></"
        "model>"
        "</sdf>"};
    char copy[3000];
    (void)snprintf(copy, sizeof copy, "%s", texts[1]);
    strstr(copy, "1.3")[2] = '4';
    const char *current = kt_test_written(test_robot(copy, NULL));
    kt_check_text("1.0", kt_test_written(test_robot(texts[0], NULL)), current);
    kt_check_text("1.3", kt_test_written(test_robot(texts[1], NULL)), current);
    kt_check_contains("of which the damper is one", current, "damping: 0.7");
}

/* Before 1.7, frames have names of their own only as far as they need them: others keep theirs. */
KT_TEST(frames_of_old_versions_are_renamed_if_others_have_their_name) {
    static const char text[] =
        "<sdf version='1.6'><model name='m'><frame name='a'><pose>0 0 3 0 0 0</pose></frame><link name='a'>"
        "<pose>0 0 1 0 0 0</pose></link><frame name='a'><pose>0 0 5 0 0 0</pose></frame>"
        "<link name='b'><pose relative_to='a_frame'>1 0 0 0 0 0</pose></link>"
        "<link name='c'><pose relative_to='a'>2 0 0 0 0 0</pose></link></model></sdf>";
    static const kt_vec3 places[] = {{0.0, 0.0, 1.0}, {1.0, 0.0, 3.0}, {2.0, 0.0, 1.0}};
    kt_scene *scene = test_robot(text, NULL);
    kt_check_true("it is told", has_note(scene, "called NAME_frame in the scene: 2"));
    for (int i = 0; i < 3; i++) {
        const char name[] = {(char)('a' + i), '\0'};
        const double *at = find_body(scene, name)->joint.position;
        kt_check_near("x", at[0], places[i].x, 0.0);
        kt_check_near("z", at[2], places[i].z, 0.0);
    }
}

KT_TEST(velocity_decay_of_old_versions_and_masses_of_meshes_are_told) {
    static const char *const texts[][2] = {
        {"<sdf version='1.2'><model name='m'><link "
         "name='a'><damping><linear>0.1</linear></damping></link></model></sdf>",
         "'velocity_decay' is left out: 1"},
        {SDF("<link name='a'><inertial auto='true'/><collision "
             "name='c'><geometry><mesh><uri>x.stl</uri></mesh></geometry>"
             "</collision><collision name='d'><geometry><box><size>1 1 1</size></box></geometry></collision></link>"),
         "collisions that are meshes have no inertia in the scene, and without <mass> no mass: of 1 link (a); --mass "
         "LINK=MASS "
         "gives one"}};
    for (int i = 0; i < 2; i++) {
        kt_scene *scene = test_robot(texts[i][0], NULL);
        bool warned = false;
        for (int k = 0; k < scene->note_count; k++)
            warned = warned ||
                     (scene->notes[k].rank == KT_NOTE_RANK_MOTION && strstr(scene->notes[k].what, texts[i][1]) != NULL);
        kt_check_true(texts[i][1], warned);
    }
}
