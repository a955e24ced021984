// SPDX-License-Identifier: Apache-2.0
/* To be included last by a source whose code no block of a program needs: the linker script places it
   behind all other code and the constants. So a change of it does not move what every block needs,
   whose time depends on its places in the processor's caches of 4 KiB. gcc, which only compiles the
   library for this computer, leaves it where it is. */
#pragma once
#ifdef __clang__
#pragma clang section text = ".rare"
#endif
