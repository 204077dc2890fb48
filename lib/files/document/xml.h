/* An XML file as a tree of elements, each with its line and column. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DOCUMENT_XML_H
#define KT_DOCUMENT_XML_H

#include "document/document_reader.h"

#include <stdarg.h>

/* Children are chained by `next`. Text is kept of elements that have nothing else. */
typedef struct kt_element {
    const char *name;
    const char *const *attributes; /* name, value, name, value, ..., NULL */
    const char *text;              /* without the blanks around it; NULL: none */
    struct kt_element *first, *last, *next, *parent;
    uint32_t line, column; /* place of the element's tag, from 1, in characters */
    int number, document;  /* for the format's reader; 0 */

    const char *file;                  /* the included file that has it; NULL: the file itself has it */
    const struct kt_element *included; /* then the element that includes it, in the file itself */
    const struct kt_element *by;       /* the element that includes that file, in the file that includes `file` */
} kt_element;

/* An XML declaration that is not at the very beginning, but before the root. Such a declaration is accepted
 * nevertheless. */
typedef struct kt_xml_late {
    uint32_t line, column; /* 0: there is none */
} kt_xml_late;

enum { KT_XML_DEPTH_MAX = 4096 /* elements within one another */ };

/* The most elements of all files that a reader reads. A file that is included several times counts as often. This
 * limits the memory that small files can claim. */
enum { KT_XML_ELEMENTS_MAX = 1 << 20 };

/* Reads a text into *root; the elements live in reader->scratch. Returns false after reporting a fault of form. A
 * document type is rejected: with its own entities, a small file could expand to a large one. */
bool kt_xml_parse(kt_reader *reader, const char *text, size_t size, kt_element **root, kt_xml_late *late);

/* Parses a file that an element of another file includes, as kt_xml_parse does. */
bool kt_xml_parse_included(kt_reader *reader, const char *text, size_t size, const char *file,
                           const kt_element *include, kt_element **root);

/* Puts a fault at an element, or in the file that includes it. Returns false. */
bool kt_xml_fault(kt_reader *reader, const kt_element *e, const char *format, ...) KT_PRINTF(3, 4);

/* Reports a fault with words before the message that identify the element. The arguments of the format are a list. */
bool kt_xml_fault_in(kt_reader *reader, const kt_element *e, const char *context, const char *format, va_list arguments)
    KT_PRINTF(4, 0);

/* The value of an attribute, and the first child or the next sibling of a name; NULL if there is none. */
const char *kt_xml_attribute(const kt_element *element, const char *name);
kt_element *kt_xml_child(const kt_element *element, const char *name);
kt_element *kt_xml_next(const kt_element *element, const char *name);

#endif
