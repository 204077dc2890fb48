/* Texts that document a type, a key or a method: nothing in the library reads them, and they are NULL in a build for a
 * machine without an operating system. */
#ifndef KT_BASE_WORDS_H
#define KT_BASE_WORDS_H

#ifdef KT_NO_WORDS
#define KT_WORDS(text) NULL
#else
#define KT_WORDS(text) text
#endif

#endif
