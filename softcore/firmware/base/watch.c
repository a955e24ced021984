// SPDX-License-Identifier: Apache-2.0
#include "base/watch.h"

__attribute__((noinline)) void watch_between(void) {
    watch_end();
    watch_begin();
}
