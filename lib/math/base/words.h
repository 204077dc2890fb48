/* Texts that document a type, a key or a method. The library itself does not read them. They are NULL in a build for a
 * machine without an operating system. */
#ifndef KT_BASE_WORDS_H
#define KT_BASE_WORDS_H

#ifdef KT_NO_WORDS
#define KT_WORDS(text) NULL
#else
#define KT_WORDS(text) text
#endif

#endif
