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
