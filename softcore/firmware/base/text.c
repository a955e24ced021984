// SPDX-License-Identifier: Apache-2.0
#include "base/text.h"

#include "base/text_parts.h"
#include "base/units.h"

#define LONGEST_NUMBER 24 /* most characters of a number with its sign; fits TEXT_NUMBER */

/* value / 10 without a division, which would take most of the time of a digit. */
static uint32_t tenth(uint32_t value) { return (uint32_t)((uint64_t)value * 0xcccccccdu >> 35); }

/* The put_ functions write at `at` and return the place behind it. The caller makes sure that there
   is room. */
static char *put_unsigned(char *at, uint32_t value, unsigned digits) {
    unsigned count = 1;
    for (uint32_t power = 10; count < 10 && (value >= power || count < digits); count++)
        power *= 10;
    char *end = at + count;
    for (char *place = end; place > at;) {
        uint32_t quotient = tenth(value);
        *--place = (char)('0' + (value - quotient * 10));
        value = quotient;
    }
    return end;
}

/* The 64-bit division is slow on the soft core, so only large numbers use it. */
static char *put_long(char *at, uint64_t value) {
    if (!(value >> 32))
        return put_unsigned(at, (uint32_t)value, 1);
    uint64_t above = value / 1000000000u;
    at = put_long(at, above);
    return put_unsigned(at, (uint32_t)(value - above * 1000000000u), 9);
}

static char *put_signed(char *at, int32_t value) {
    if (value < 0)
        *at++ = '-';
    return put_unsigned(at, value < 0 ? 0u - (uint32_t)value : (uint32_t)value, 1);
}

static char *put_millimetres(char *at, int32_t pulses) {
    uint32_t tenths = units_tenths_of_um(pulses < 0 ? 0u - (uint32_t)pulses : (uint32_t)pulses);
    if (pulses < 0 && tenths)
        *at++ = '-';
    at = put_unsigned(at, tenths / 10000, 1);
    *at++ = '.';
    return put_unsigned(at, tenths % 10000, 4);
}

/* Write a character or, for a byte from TEXT_PARTS_FIRST on, the characters that it stands for:
   softcore/texts.py stores the sentences so. Stops at the end. */
static inline char *put_stored(char *at, char *end, char stored) {
    unsigned part = (uint8_t)stored;
    if (part < TEXT_PARTS_FIRST) {
        *at = stored;
        return at + 1;
    }
    const uint16_t *edge = &TEXT_PARTS_AT[part - TEXT_PARTS_FIRST];
    const uint8_t *from = TEXT_PARTS + edge[0];
    size_t count = edge[1] - edge[0], room = (size_t)(end - at);
    for (char *behind = at + (count < room ? count : room); at != behind;)
        *at++ = (char)*from++;
    return at;
}

size_t text_vprint(char *buffer, size_t size, const char *format, va_list arguments) {
    static const char hex[] = "0123456789ABCDEF";
    char *at = buffer, *end = buffer + size - 1;
    for (char c; (c = *format) && at < end; format++) {
        if (c != '%') {
            at = put_stored(at, end, c);
            continue;
        }
        c = *++format;
        if (c == 's') {
            for (const char *text = va_arg(arguments, const char *); *text && at < end;)
                at = put_stored(at, end, *text++);
            continue;
        }
        if (end - at < LONGEST_NUMBER)
            break;
        switch (c) {
        case 'c': *at++ = (char)va_arg(arguments, int); break;
        case 'd': at = put_signed(at, va_arg(arguments, int32_t)); break;
        case 'u': at = put_unsigned(at, va_arg(arguments, uint32_t), 1); break;
        case 'U': at = put_long(at, va_arg(arguments, uint64_t)); break;
        case 'p': at = put_millimetres(at, va_arg(arguments, int32_t)); break;
        case 'x': {
            unsigned byte = va_arg(arguments, unsigned);
            *at++ = hex[byte >> 4 & 15];
            *at++ = hex[byte & 15];
            break;
        }
        default: *at++ = '%'; break;
        }
    }
    *at = '\0';
    return (size_t)(at - buffer);
}

size_t text_print(char *buffer, size_t size, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    size_t length = text_vprint(buffer, size, format, arguments);
    va_end(arguments);
    return length;
}
