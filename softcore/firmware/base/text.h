// SPDX-License-Identifier: Apache-2.0
/* Text without a C library. */
#pragma once
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

/* Write `format` into `buffer`, cut to its size (before a number that may not fit) and always
   terminated; returns the length written.
   %s string, %c character, %d int32_t, %u uint32_t, %U uint64_t, %x byte as two digits, %p int32_t
   pulses as millimetres with four decimals, %% percent sign. */
#define TEXT_NUMBER 32 /* size of a buffer for one number */
size_t text_print(char *buffer, size_t size, const char *format, ...);
size_t text_vprint(char *buffer, size_t size, const char *format, va_list arguments);
