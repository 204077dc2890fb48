/* Names of what is compiled once for each instruction-set level: KT_KERNEL(kt_forward) is kt_forward_v3 there. */
#ifndef KT_BASE_ISA_H
#define KT_BASE_ISA_H

#define KT_PASTE_(a, b) a##b
#define KT_PASTE(a, b) KT_PASTE_(a, b)
#define KT_KERNEL(name) KT_PASTE(name##_, KT_ISA)

#endif
