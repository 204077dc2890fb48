/* The page before the JSON, between it and the frames, and after them; made by embed.py. A live page has the scene and
 * the engine behind the frames. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_VIEW_PAGE_H
#define KT_COMMAND_VIEW_PAGE_H

#include <stddef.h>

extern const char kt_page_head[], kt_page_middle[], kt_page_tail[];
extern const size_t kt_page_head_size, kt_page_middle_size, kt_page_tail_size;
extern const char kt_page_live_head[], kt_page_live_middle[], kt_page_live_scene[], kt_page_live_engine[],
    kt_page_live_tail[];
extern const size_t kt_page_live_head_size, kt_page_live_middle_size, kt_page_live_scene_size, kt_page_live_engine_size,
    kt_page_live_tail_size;

#endif
