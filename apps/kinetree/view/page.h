/* The page before the JSON, between it and the frames, and after them; made by embed.py. */
#ifndef KT_COMMAND_VIEW_PAGE_H
#define KT_COMMAND_VIEW_PAGE_H

#include <stddef.h>

extern const char kt_page_head[], kt_page_middle[], kt_page_tail[];
extern const size_t kt_page_head_size, kt_page_middle_size, kt_page_tail_size;

#endif
