/* SPDX-License-Identifier: Apache-2.0 */
// A C++ program can use the library through kinetree.h.
#include "kinetree/kinetree.h"

#include <cstring>

int main() {
    return std::strcmp(kt_version(), KT_VERSION) == 0 && std::strcmp(kt_status_text(KT_OK), "done") == 0 ? 0 : 1;
}
