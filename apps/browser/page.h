/* The engine of a live page: an instance of an FMU (apps/fmu), and runs of its scene as frames for the viewer.
 *
 *     page = kt_page_open(text, size, settings);              the scene in flow style, with settings
 *     fmi3SetFloat64(kt_page_instance(page), ...);            parameters
 *     code = kt_page_run(page, false);
 *     kt_page_json(page), kt_page_frames(page)                what view/motion.js reads
 *     kt_page_close(page);
 *
 * A step of co-simulation ends where the importer says, which would add a step for each frame. A page shows what
 * accuracy costs. The runs of a page therefore are those of `kinetree view`, whose frames lie between the steps.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BROWSER_PAGE_H
#define KT_BROWSER_PAGE_H

#include <stdbool.h>
#include <stddef.h>

typedef struct kt_page kt_page;

/* Declares a function that the page calls. */
#define KT_PAGE(...)                                                                                                   \
    __attribute__((visibility("default"))) __VA_ARGS__;                                                                \
    __attribute__((visibility("default"))) __VA_ARGS__

#endif
