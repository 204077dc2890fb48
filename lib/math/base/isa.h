/* Names of functions and constants that are compiled once for each instruction set (KT_ISA): KT_KERNEL(kt_forward) is
 * kt_forward_v3 where KT_ISA is v3. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BASE_ISA_H
#define KT_BASE_ISA_H

#define KT_PASTE_(a, b) a##b
#define KT_PASTE(a, b) KT_PASTE_(a, b)
#ifdef KT_LANES /* for several states at once (algebra/real3.h) */
#define KT_KERNEL(name) KT_PASTE(name##_lanes_, KT_ISA)
#else
#define KT_KERNEL(name) KT_PASTE(name##_, KT_ISA)
#endif

/* Expands a macro for each instruction set, for declarations. KT_EACH_KERNEL: in code for several states at once, for
 * the functions of KT_KERNEL alone, lanes_v3 where KT_ISA is v3. */
#define KT_EACH_ISA(X) X(baseline) X(v3) X(v4)
#ifdef KT_LANES
#define KT_EACH_KERNEL(X) KT_EACH_KERNEL_(X, KT_PASTE(lanes_, KT_ISA))
#define KT_EACH_KERNEL_(X, isa) X(isa)
#else
#define KT_EACH_KERNEL KT_EACH_ISA
#endif

/* Calls name_ISA with arguments in parentheses; result: `x =`, `return`, or nothing. The macro also serves other
 * expressions, such as the address of a table. */
#ifdef KT_ISAS
#define KT_BY_ISA(isa, result, name, arguments)                                                                        \
    do {                                                                                                               \
        if ((isa) == KT_ISA_V4)                                                                                        \
            result name##_v4 arguments;                                                                                \
        else if ((isa) == KT_ISA_V3)                                                                                   \
            result name##_v3 arguments;                                                                                \
        else                                                                                                           \
            result name##_baseline arguments;                                                                          \
    } while (0)
#else
#define KT_BY_ISA(isa, result, name, arguments)                                                                        \
    do {                                                                                                               \
        (void)(isa); /* a parameter that is for it alone counts as used */                                             \
        result name##_baseline arguments;                                                                              \
    } while (0)
#endif

#endif
