// SPDX-License-Identifier: Apache-2.0
#include "base/fault.h"

#include <stdarg.h>

#include "base/text.h"

bool fault_at(fault *f, fault_code code, uint32_t column, const char *format, ...) {
    if (f->code != FAULT_NONE)
        return false;
    f->code = code;
    f->column = column;
    va_list arguments;
    va_start(arguments, format);
    text_vprint(f->text, sizeof f->text, format, arguments);
    va_end(arguments);
    return false;
}

typedef struct {
    uint8_t code, number;
} grbl_number;

static uint32_t told(const grbl_number *rows, size_t count, fault_code code) {
    for (size_t row = 0; row < count; row++)
        if (rows[row].code == code)
            return rows[row].number;
    return code;
}

uint32_t fault_error(fault_code code) {
    static const grbl_number ROWS[] = {FAULT_ERRORS};
    return told(ROWS, sizeof ROWS / sizeof *ROWS, code);
}

uint32_t fault_alarm(fault_code code) {
    static const grbl_number ROWS[] = {FAULT_ALARMS};
    return told(ROWS, sizeof ROWS / sizeof *ROWS, code);
}

size_t fault_sentence(const fault *f, char *buffer, size_t size) {
    size_t at = 0;
    if (f->line)
        at += text_print(buffer, size, "Block %u", f->line);
    else if (f->column)
        at += text_print(buffer, size, "MDI");
    if (f->block)
        at += text_print(buffer + at, size - at, " (N%u)", f->block);
    if (f->column)
        at += text_print(buffer + at, size - at, ", character %u", f->column);
    return at + text_print(buffer + at, size - at, "%s%s.", at ? ": " : "", f->text);
}
