// SPDX-License-Identifier: Apache-2.0
#include "roughing/basic.h"

#include "base/text.h"
#include "base/watch.h"

/* Compiled for size: nothing waits for the planner. */
#ifdef __clang__
#pragma clang attribute push(__attribute__((minsize)), apply_to = function)
#endif

typedef struct {
    uint16_t ip;                        /* 1/100 */
    uint16_t undersize[BASIC_DEPTHS];   /* 0.1 um */
} row;

static uint32_t depths[BASIC_DEPTHS];   /* um */
static uint32_t areas[BASIC_AREAS];     /* 1/100 mm2 */
static uint8_t begins[BASIC_AREAS + 1]; /* first row of each area */
static row rows[BASIC_ROWS];
static unsigned depth_count, area_count;

static unsigned used(void) { return begins[area_count]; }

/* Does the last area have too few currents? If so, sets the fault. */
static bool lacks(fault *f) {
    if (!area_count || basic_current_count(area_count - 1) >= 2)
        return false;
    fault_at(f, FAULT_TABLE, 0, "basic data: the area of %u mm2 has %u of at least 2 currents",
             areas[area_count - 1] / 100, basic_current_count(area_count - 1));
    return true;
}

void basic_forget(void) { depth_count = area_count = begins[0] = 0; }

bool basic_depths(const uint32_t *values, unsigned count, fault *f) {
    if (!count || count > BASIC_DEPTHS)
        return fault_at(f, FAULT_TABLE, 0, "basic data: 1 to %u depths are needed",
                        (uint32_t)BASIC_DEPTHS);
    for (unsigned i = 0; i < count; i++)
        if (values[i] > 1000000 || (i && values[i] <= values[i - 1]))
            return fault_at(f, FAULT_TABLE, 0,
                            "basic data: the depths must rise, to 1000 mm at most (number %u)", i + 1);
    basic_forget();
    for (; depth_count < count; depth_count++)
        depths[depth_count] = values[depth_count];
    return true;
}

bool basic_area(uint32_t area, fault *f) {
    if (!depth_count)
        return fault_at(f, FAULT_TABLE, 0, "basic data: the depths come first");
    if (lacks(f))
        return false;
    if (area_count == BASIC_AREAS)
        return fault_at(f, FAULT_TABLE, 0, "basic data: no more than %u areas can be entered",
                        (uint32_t)BASIC_AREAS);
    if (!area || area > 10000000 || (area_count && area <= areas[area_count - 1]))
        return fault_at(f, FAULT_TABLE, 0, "basic data: the areas must rise, to 100000 mm2 at most");
    areas[area_count++] = area;
    begins[area_count] = begins[area_count - 1];
    return true;
}

bool basic_current(uint32_t ip, const uint32_t *undersize, unsigned count, fault *f) {
    if (!area_count)
        return fault_at(f, FAULT_TABLE, 0, "basic data: an area comes before its currents");
    unsigned held = basic_current_count(area_count - 1);
    const row *last = held ? &rows[used() - 1] : 0;
    if (used() == BASIC_ROWS || held == BASIC_CURRENTS)
        return fault_at(f, FAULT_TABLE, 0,
                        "basic data: no more than %u currents of an area and %u of all can be entered",
                        (uint32_t)BASIC_CURRENTS, (uint32_t)BASIC_ROWS);
    if (count != depth_count)
        return fault_at(f, FAULT_TABLE, 0, "basic data: %u undersizes for %u depths", count,
                        depth_count);
    if (!ip || ip > 6300 || (last && ip <= last->ip))
        return fault_at(f, FAULT_TABLE, 0, "basic data: the currents must rise, to IP 63 at most");
    for (unsigned i = 0; i < count; i++)
        if (undersize[i] > 60000 || (i && undersize[i] <= undersize[i - 1]) ||
            (last && undersize[i] <= last->undersize[i]))
            return fault_at(f, FAULT_TABLE, 0,
                            "basic data: the undersize must rise with depth and current, to 6000 um "
                            "at most (number %u)", i + 1);
    row *new = &rows[begins[area_count]++];
    new->ip = (uint16_t)ip;
    for (unsigned i = 0; i < count; i++)
        new->undersize[i] = (uint16_t)undersize[i];
    return true;
}

bool basic_drop(uint32_t area, fault *f) {
    unsigned at = 0;
    while (at < area_count && areas[at] != area)
        at++;
    if (at == area_count)
        return fault_at(f, FAULT_TABLE, 0, "basic data: that area is not among them");
    uint8_t gone = begins[at + 1] - begins[at];
    for (unsigned i = begins[at]; i + gone < used(); i++)
        rows[i] = rows[i + gone];
    for (; at + 1 < area_count; at++) {
        areas[at] = areas[at + 1];
        begins[at + 1] = begins[at + 2] - gone;
    }
    area_count--;
    return true;
}

/* Append a separator and a number, without the zeros behind its point. */
static void append(char *text, size_t size, char separator, uint32_t value, uint32_t unit) {
    size_t at = 0;
    while (text[at])
        at++;
    if (separator)
        at += text_print(text + at, size - at, "%c", separator);
    at += text_print(text + at, size - at, "%u", value / unit);
    value %= unit;
    for (char point = '.'; value; point = '\0') {
        unit /= 10;
        at += point ? text_print(text + at, size - at, ".%u", value / unit)
                    : text_print(text + at, size - at, "%u", value / unit);
        value %= unit;
    }
}

bool basic_line(unsigned number, char *text, size_t size) {
    if (!depth_count)
        return false;
    if (number == 0) {
        text_print(text, size, "D");
        for (unsigned i = 0; i < depth_count; i++) {
            append(text, size, i ? ',' : '\0', depths[i], 1000);
            watch_between();
        }
        return true;
    }
    unsigned area = 0;
    for (number--; area < area_count && number > basic_current_count(area); area++)
        number -= basic_current_count(area) + 1;
    if (area == area_count)
        return false;
    if (number == 0) {
        text_print(text, size, "A");
        append(text, size, '\0', areas[area], 100);
        return true;
    }
    const row *one = &rows[begins[area] + number - 1];
    text_print(text, size, "I");
    append(text, size, '\0', one->ip, 100);
    for (unsigned i = 0; i < depth_count; i++) {
        append(text, size, ',', one->undersize[i], 10);
        watch_between();
    }
    return true;
}

bool basic_ready(fault *f) {
    if (!area_count)
        return fault_at(f, FAULT_TABLE, 0, "basic data: none have been entered");
    return !lacks(f);
}

float __attribute__((noinline)) basic_number(uint32_t value, int32_t unit) {
    return (float)(int32_t)value / (float)unit;
}

unsigned basic_area_count(void) { return area_count; }
unsigned basic_depth_count(void) { return depth_count; }
unsigned basic_current_count(unsigned area) { return begins[area + 1] - begins[area]; }
float basic_area_of(unsigned area) { return basic_number(areas[area], 100); }
float basic_depth_of(unsigned depth) { return basic_number(depths[depth], 1000); }
float basic_ip_of(unsigned area, unsigned current) {
    return basic_number(rows[begins[area] + current].ip, 100);
}
float basic_undersize_of(unsigned area, unsigned current, unsigned depth) {
    return basic_number(rows[begins[area] + current].undersize[depth], 10);
}

#ifdef __clang__
#pragma clang attribute pop
#endif
