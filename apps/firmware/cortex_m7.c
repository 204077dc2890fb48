/* The start of a program on a Cortex-M7: the vector table, and what comes before newlib's own start, which is given a stack and
 * a heap by the linker script and speaks to the debugger or emulator by semihosting (librdimon).
 */
#include <stdint.h>
#include <stdlib.h>

extern char stack_top[];
void _mainCRTStartup(void); /* newlib's: clears .bss, opens the files of semihosting, calls main and exit */
void reset(void);
void fault(void);

__attribute__((section(".vectors"), used)) static void (*const vectors[])(void) = {
    (void (*)(void))stack_top,
    reset,
    fault, /* not masked */
    fault, /* hard */
    fault, /* memory */
    fault, /* bus */
    fault, /* usage */
};

/* Floating point is off after a reset: full access to coprocessors 10 and 11 (CPACR). */
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

/* Whatever happens that must not: the program ends with a status of its own. */
void fault(void) { _Exit(3); }
