/* Files that SDF includes, and versions.
 *
 * A URI names a file, or a folder with a model.config, which names the files of a model by their versions. The URI
 * `model://NAME` is the folder NAME in that of the robot. Other paths start from the folder of the file that includes
 * them. A file that is not there is searched on the search path, as FOLDER/NAME. A file that is found nowhere is left
 * out and noted, since worlds name models that simulators provide. A file of lights and actors alone changes no motion.
 * The URI `package://NAME` is FOLDER/NAME on the search path. Files of other schemes are left out and noted, too.
 *
 * A URI `https://HOST/API/OWNER/models/NAME/VERSION` names a model on a server. Gazebo keeps what it has loaded from
 * there as HOST/OWNER/models/NAME/VERSION, in lower case, in a folder of its own (LocalCache.cc of gz-fuel-tools).
 * Without VERSION, the newest one is meant. That folder is on the search path of the command. A folder NAME on the
 * search path is taken, too. Its version is unknown, which is noted if the URI names one.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/sdf.h"

#include <ctype.h>
#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { DEPTH_MOST = 32 /* files within one another */ };

/* The number of a version, such as 112 for 1.12; zero if the text is no version of SDF. */
static int version_of(const char *text) {
    char *end;
    const long major = strtol(text, &end, 10);
    if (end == text || *end != '.' || major != 1)
        return 0;
    const char *rest = end + 1;
    const long minor = strtol(rest, &end, 10);
    return end != rest && minor >= 0 && minor < 100 && (*end == '\0' || *end == '.') ? 100 + (int)minor : 0;
}

int kt_sdf_version(kt_sdf *m, kt_element *sdf) {
    enum { CURRENT = 104, NEWEST = 112 };
    const char *text = kt_xml_attribute(sdf, "version");
    const int version = text != NULL ? version_of(text) : 0;
    if (version == 0) {
        (void)kt_robot_fault(m->r, sdf, "version: expected 1.0 to 1.12, found '%.40s'", text != NULL ? text : "");
        return 0;
    }
    if (version < CURRENT)
        kt_sdf_convert(m, sdf);
    if (version > NEWEST)
        kt_left_count(&m->newer, sdf);
    return version > CURRENT ? version : CURRENT;
}

/* ---- paths ------------------------------------------------------------------------------------------------------- */

enum { SERVED_NAME = 400, VERSION_DIGITS = 9 };

/* Copies a part of a URI, and decodes `%XX`, where XX are two hexadecimal digits. Returns false if a decoded character
 * is a slash or the end of a text. No name of a folder has these. */
static bool copy_part(char *to, const char *from, size_t length) {
    size_t used = 0;
    for (size_t i = 0; i < length && used + 1 < SERVED_NAME; i++) {
        const bool is_code = from[i] == '%' && i + 2 < length && isxdigit((unsigned char)from[i + 1]) != 0 &&
                             isxdigit((unsigned char)from[i + 2]) != 0;
        if (is_code) {
            const char digits[] = {from[i + 1], from[i + 2], '\0'};
            to[used] = (char)strtol(digits, NULL, 16);
            if (to[used] == '\0' || to[used] == '/')
                return false;
            i += 2;
        } else
            to[used] = from[i];
        used++;
    }
    to[used] = '\0';
    return true;
}

/* The number that a folder of a version has for its name, from 1 on; 0: it is another name. */
static long version_number(const char *name) {
    const size_t length = strspn(name, "0123456789");
    return length > 0 && length <= VERSION_DIGITS && name[length] == '\0' && name[0] != '0' ? strtol(name, NULL, 10)
                                                                                            : 0;
}

/* The newest version in the folder of a model; NULL: none. */
static const char *newest_of(kt_sdf *m, const char *folder) {
    const char *best = NULL;
    DIR *versions = opendir(folder);
    long newest = 0;
    for (const struct dirent *entry = versions != NULL ? readdir(versions) : NULL; entry != NULL;
         entry = readdir(versions)) {
        const long version = version_number(entry->d_name);
        const char *path = version > newest ? kt_robot_print(m->r, &m->r->scratch, "%s/%ld", folder, version) : NULL;
        if (path != NULL && kt_include_exists(path, true)) {
            newest = version;
            best = path;
        }
    }
    if (versions != NULL)
        (void)closedir(versions);
    return best;
}

/* Returns the folder in which Gazebo keeps a model of a server on this machine; NULL if there is none. */
static const char *kept_model(kt_sdf *m, const kt_element *e, const char *plain) {
    static const char models[] = "/models/";
    const char *at = strstr(plain, models), *owner = at;
    char kept[5 * SERVED_NAME], part[SERVED_NAME], name[SERVED_NAME];
    if (at == NULL || strlen(plain) >= SERVED_NAME)
        return NULL;
    while (owner > plain && owner[-1] != '/')
        owner--;
    const char *own = at + strlen(models), *version = own + strcspn(own, "/");
    if (!copy_part(name, own, (size_t)(version - own)) || !copy_part(part, owner, (size_t)(at - owner)))
        return NULL;
    const bool is_given = version[0] == '/' && isdigit((unsigned char)version[1]) != 0;
    (void)snprintf(kept, sizeof kept, "%.*s/%s/models/%s%s", (int)strcspn(plain, "/"), plain, part, name,
                   is_given ? version : "");
    for (char *c = kept; *c != '\0'; c++)
        *c = (char)tolower((unsigned char)*c);
    const char *found = kt_search_path(m->r, m->source, kept);
    if (found != NULL && !is_given)
        found = newest_of(m, found);
    if (found != NULL)
        return found;
    found = kt_search_path(m->r, m->source, name);
    if (found != NULL && is_given)
        kt_left_count(&m->unversioned, e);
    return found;
}

/* The path that a URI names; NULL if there is none, reported where it leads out of the folder. */
static const char *uri_path_of(kt_sdf *m, const kt_element *e, const char *uri) {
    const char *scheme = strstr(uri, "://"), *plain = scheme != NULL ? scheme + 3 : uri;
    if (m->source->folder == NULL)
        return NULL;
    const bool is_served = strncmp(uri, "https://", 8) == 0 || strncmp(uri, "http://", 7) == 0;
    if (scheme != NULL && strncmp(uri, "model://", 8) != 0 && strncmp(uri, "file://", 7) != 0) {
        const bool is_package = strncmp(uri, "package://", 10) == 0;
        const char *served = is_served    ? kept_model(m, e, plain)
                             : is_package ? kt_search_path(m->r, m->source, plain)
                                          : NULL;
        return served != NULL ? kt_include_path(m->r, m->source, e, served) : NULL;
    }
    const char *own = scheme != NULL ? plain : kt_include_relative(m->r, m->source, e, uri);
    const bool is_there = own != NULL && kt_include_is_there(m->r, m->source, own);
    const char *found = is_there ? NULL : kt_search_path(m->r, m->source, plain);
    return own != NULL ? kt_include_path(m->r, m->source, e, found != NULL ? found : own) : NULL;
}

/* ---- folders of models ------------------------------------------------------------------------------------------- */

/* The name of a model's newest file, up to the newest version that is read, by its model.config; else model.sdf. */
static const char *model_file_of(kt_sdf *m, const kt_element *e, const char *folder) {
    const char *config = kt_robot_print(m->r, &m->r->scratch, "%s/%s", folder, "model.config"), *best = "model.sdf";
    int newest = 0;
    kt_element *root = config != NULL && kt_include_exists(config, false)
                           ? kt_include_read(m->r, e, config, &m->included_bytes)
                           : NULL;
    for (const kt_element *sdf = root != NULL ? kt_xml_child(root, "sdf") : NULL; sdf != NULL;
         sdf = kt_xml_next(sdf, "sdf")) {
        const char *text = kt_xml_attribute(sdf, "version");
        const int version = text != NULL ? version_of(text) : 0;
        if (sdf->text != NULL && version >= newest && version <= 112) {
            best = sdf->text;
            newest = version;
        }
    }
    return best;
}

/* ---- include ----------------------------------------------------------------------------------------------------- */

static void omit(kt_sdf *m, const kt_element *e, const char *uri) {
    if (m->missing.count == 0)
        m->missing.what = uri;
    kt_left_count(&m->missing, e);
}

const kt_element *kt_sdf_include(kt_sdf *m, const kt_element *e, int *version) {
    const char *uri = kt_sdf_text(e, "uri");
    if (uri == NULL) {
        (void)kt_robot_fault(m->r, e, "<uri> is missing");
        return NULL;
    }
    const size_t faults = m->r->fault_count;
    const char *path = uri_path_of(m, e, uri);
    if (path != NULL && kt_include_exists(path, true)) {
        const bool is_absolute = path[0] == '/';
        const char *file = model_file_of(m, e, path);
        const char *inner = kt_robot_print(m->r, &m->r->scratch, "%s/%s",
                                           is_absolute ? path : path + strlen(m->source->folder) + 1, file);
        const bool is_there = inner != NULL && kt_include_is_there(m->r, m->source, inner);
        path = is_there ? kt_include_path(m->r, m->source, e, inner) : NULL;
        uri = is_there || inner == NULL
                  ? uri
                  : kt_robot_print(m->r, &m->r->keep, "%s, whose folder has no file %s", uri, file);
    }
    if (path == NULL || !kt_include_exists(path, false)) {
        if (m->r->fault_count == faults)
            omit(m, e, uri);
        return NULL;
    }
    if (strcmp(path, m->source->path) == 0 || kt_include_is_circular(e, NULL, path, DEPTH_MOST)) {
        (void)kt_robot_fault(m->r, e, "files include each other in a circle, or more than %d deep", (int)DEPTH_MOST);
        return NULL;
    }
    kt_element *root = kt_include_read(m->r, e, path, &m->included_bytes);
    if (root == NULL)
        return NULL;
    if (!kt_sdf_is_root(root)) {
        (void)kt_robot_fault(m->r, e, "%.200s begins with <%.40s>, not with <sdf>", path, root->name);
        return NULL;
    }
    *version = kt_sdf_version(m, root);
    const kt_element *model = kt_xml_child(root, "model");
    if (model == NULL && kt_xml_child(root, "light") == NULL && kt_xml_child(root, "actor") == NULL)
        omit(m, e, uri);
    else if (model != NULL)
        kt_strange_search(&m->strange, m->known, model);
    return *version > 0 ? model : NULL;
}
