/* Names of functions and constants that are compiled once for each instruction set (KT_ISA): KT_KERNEL(kt_forward) is
 * kt_forward_v3 where KT_ISA is v3. */
#ifndef KT_BASE_ISA_H
#define KT_BASE_ISA_H

#define KT_PASTE_(a, b) a##b
#define KT_PASTE(a, b) KT_PASTE_(a, b)
#define KT_KERNEL(name) KT_PASTE(name##_, KT_ISA)

#endif
