/* Whether this machine can compile for WebAssembly (meson.build). */
/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>
#include <stdio.h>

__attribute__((export_name("trial"))) double trial(double x);
double trial(double x) {
    (void)printf("%g", x);
    return sin(x);
}
