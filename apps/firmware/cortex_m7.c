/* Start-up code for a Cortex-M7: the vector table, and the reset handler, which calls newlib's start-up code. Stack and
 * heap come from the linker script; input and output use semihosting (librdimon) by the debugger or emulator.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include <stdint.h>
#include <stdlib.h>

extern char stack_top[];
void _mainCRTStartup(void); /* newlib: clears .bss, opens the files of semihosting, calls main and exit */
void reset(void);
void fault(void);

__attribute__((section(".vectors"), used)) static void (*const vectors[])(void) = {
    (void (*)(void))stack_top,
    reset,
    fault, /* NMI */
    fault, /* HardFault */
    fault, /* MemManage */
    fault, /* BusFault */
    fault, /* UsageFault */
};

/* The floating-point unit is disabled after a reset: enable full access to coprocessors 10 and 11 (CPACR). */
__attribute__((naked)) void reset(void) {
    __asm__ volatile("movw r0, #0xed88\n"
                     "movt r0, #0xe000\n"
                     "ldr r1, [r0]\n"
                     "orr r1, r1, #0x00f00000\n"
                     "str r1, [r0]\n"
                     "dsb\n"
                     "isb\n"
                     "b _mainCRTStartup\n");
}

/* Handles all unexpected exceptions: the program ends with an exit status of its own. */
void fault(void) { _Exit(3); }
