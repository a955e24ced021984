// SPDX-License-Identifier: Apache-2.0
#include "roughing/basic.h"

#include "base/text.h"
#include "base/watch.h"
#include "base/rare.h"

typedef struct {
    uint16_t ip;                        /* 1/100 */
    uint16_t undersize[BASIC_DEPTHS];   /* 0.1 um */
    uint16_t stock[BASIC_STOCKS];       /* 0.1 um */
} row;

typedef struct {
    char name[BASIC_NAME];
    uint8_t depth_count, area_count, finish_count;
    uint32_t depths[BASIC_DEPTHS];      /* um */
    struct {
        uint16_t roughness;             /* 0.1 um Rmax */
        int16_t difference;             /* 0.1 um */
    } finishes[BASIC_FINISHES];
} pair;

/* Pairs in the order in which they were entered; their areas and the rows of these follow each other
   in the same order. */
static pair pairs[BASIC_PAIRS];
static uint32_t areas[BASIC_AREAS];     /* 1/100 mm2 */
static uint8_t begins[BASIC_AREAS + 1]; /* first row of each area */
static row rows[BASIC_ROWS];
static unsigned pair_count, all_areas;

static char selected[BASIC_NAME];
static unsigned now;    /* the pair selected; pair_count if there are no data of it */
static unsigned first;  /* its first area */

static unsigned used(void) { return begins[all_areas]; }
static unsigned count_of(unsigned area) { return (unsigned)(begins[area + 1] - begins[area]); }

/* Does the last area of the pair in force have too few currents? If so, sets the fault. */
static bool lacks(fault *f) {
    unsigned count = basic_area_count();
    if (!count || basic_current_count(count - 1) >= 2)
        return false;
    fault_at(f, FAULT_TABLE, 0, "basic data: the area of %u mm2 has %u of at least 2 currents",
             areas[first + count - 1] / 100, basic_current_count(count - 1));
    return true;
}

static bool same(const char *one, const char *other) {
    while (*one && *one == *other)
        one++, other++;
    return *one == *other;
}

static void copy(char *to, const char *from) {
    while ((*to++ = *from++))
        ;
}

/* The pair of that name, and its first area. */
static unsigned find(const char *name, unsigned *begin) {
    unsigned at = 0;
    for (*begin = 0; at < pair_count && !same(pairs[at].name, name); at++)
        *begin += pairs[at].area_count;
    return at;
}

/* Take areas out, with their rows. */
static void drop(unsigned at, unsigned count) {
    uint8_t gone = begins[at + count] - begins[at];
    for (unsigned i = begins[at]; i + gone < used(); i++) {
        rows[i] = rows[i + gone];
        watch_between();
    }
    for (; at + count < all_areas; at++) {
        areas[at] = areas[at + count];
        begins[at + 1] = begins[at + 1 + count] - gone;
    }
    all_areas -= count;
}

/* Take a pair out; the same one is selected afterwards. */
static void remove_pair(unsigned at, unsigned begin) {
    drop(begin, pairs[at].area_count);
    for (pair_count--; at < pair_count; at++)
        pairs[at] = pairs[at + 1];
    now = find(selected, &first);
}

void basic_forget(void) { pair_count = all_areas = begins[0] = now = first = selected[0] = 0; }

void basic_select(const char *name) {
    copy(selected, name);
    now = find(selected, &first);
}

const char *basic_selected(void) { return selected; }

bool basic_remove(const char *name, fault *f) {
    unsigned begin, at = find(name, &begin);
    if (at == pair_count)
        return fault_at(f, FAULT_TABLE, 0, "basic data: that pair is not among them");
    remove_pair(at, begin);
    return true;
}

bool basic_depths(const uint32_t *values, unsigned count, fault *f) {
    if (!count || count > BASIC_DEPTHS)
        return fault_at(f, FAULT_TABLE, 0, "basic data: 1 to %u depths are needed",
                        (uint32_t)BASIC_DEPTHS);
    for (unsigned i = 0; i < count; i++)
        if (values[i] > 1000000 || (i && values[i] <= values[i - 1]))
            return fault_at(f, FAULT_TABLE, 0,
                            "basic data: the depths must rise, to 1000 mm at most (number %u)", i + 1);
    if (now < pair_count)
        remove_pair(now, first);
    if (pair_count == BASIC_PAIRS)
        return fault_at(f, FAULT_TABLE, 0,
                        "basic data: no more than %u pairs of materials can be entered",
                        (uint32_t)BASIC_PAIRS);
    pair *new = &pairs[pair_count++];
    copy(new->name, selected);
    new->area_count = new->finish_count = 0;
    new->depth_count = (uint8_t)count;
    for (unsigned i = 0; i < count; i++)
        new->depths[i] = values[i];
    return true;
}

/* Areas and currents can be added to the last pair only. */
static bool is_last(fault *f) {
    return now + 1 >= pair_count ||
           fault_at(f, FAULT_TABLE, 0, "basic data: another pair follows; begin this one with $BD");
}

static bool has_depths(fault *f) {
    return now < pair_count || fault_at(f, FAULT_TABLE, 0, "basic data: the depths come first");
}

bool basic_finish(const uint32_t *values, unsigned count, fault *f) {
    if (!has_depths(f) || !is_last(f))
        return false;
    if (count % 2 || count > 2 * BASIC_FINISHES)
        return fault_at(f, FAULT_TABLE, 0,
                        "basic data: at most %u finishes, each a roughness and a difference of the stock",
                        (uint32_t)BASIC_FINISHES);
    pair *to = &pairs[now];
    bool at_1_um = false;
    for (unsigned i = 0; i < count; i += 2) {
        int32_t difference = (int32_t)values[i + 1];
        if (values[i] > 1000 || difference > 30000 || difference < -30000 ||
            (i && (values[i] <= values[i - 2] || difference > (int32_t)values[i - 1])))
            return fault_at(f, FAULT_TABLE, 0,
                            "basic data: the roughness must rise, to 100 um at most, and the stock "
                            "not rise with it (number %u)", i + 1);
        at_1_um = at_1_um || (values[i] == 10 && !difference);
    }
    if (!at_1_um)
        return fault_at(f, FAULT_TABLE, 0,
                        "basic data: a roughness of 1 um with a difference of 0 is needed");
    to->finish_count = (uint8_t)(count / 2);
    for (unsigned i = 0; i < to->finish_count; i++) {
        to->finishes[i].roughness = (uint16_t)values[2 * i];
        to->finishes[i].difference = (int16_t)values[2 * i + 1];
    }
    return true;
}

bool basic_area(uint32_t area, fault *f) {
    unsigned count = basic_area_count();
    if (!has_depths(f))
        return false;
    if (!is_last(f) || lacks(f))
        return false;
    if (all_areas == BASIC_AREAS)
        return fault_at(f, FAULT_TABLE, 0, "basic data: no more than %u areas can be entered",
                        (uint32_t)BASIC_AREAS);
    if (!area || area > 10000000 || (count && area <= areas[all_areas - 1]))
        return fault_at(f, FAULT_TABLE, 0, "basic data: the areas must rise, to 100000 mm2 at most");
    areas[all_areas++] = area;
    begins[all_areas] = begins[all_areas - 1];
    pairs[now].area_count++;
    return true;
}

bool basic_current(uint32_t ip, const uint32_t *values, unsigned count, fault *f) {
    unsigned depth_count = basic_depth_count();
    if (!basic_area_count())
        return fault_at(f, FAULT_TABLE, 0, "basic data: an area comes before its currents");
    if (!is_last(f))
        return false;
    unsigned held = basic_current_count(basic_area_count() - 1);
    const row *last = held ? &rows[used() - 1] : 0;
    if (used() == BASIC_ROWS || held == BASIC_CURRENTS)
        return fault_at(f, FAULT_TABLE, 0,
                        "basic data: no more than %u currents of an area and %u of all can be entered",
                        (uint32_t)BASIC_CURRENTS, (uint32_t)BASIC_ROWS);
    if (count != depth_count && count != depth_count + BASIC_STOCKS)
        return fault_at(f, FAULT_TABLE, 0,
                        "basic data: %u undersizes for %u depths; bottom and side stock may follow",
                        count, depth_count);
    if (!ip || ip > 6300 || (last && ip <= last->ip))
        return fault_at(f, FAULT_TABLE, 0, "basic data: the currents must rise, to IP 63 at most");
    for (unsigned i = 0; i < depth_count; i++)
        if (values[i] > 60000 || (i && values[i] <= values[i - 1]) ||
            (last && values[i] <= last->undersize[i]))
            return fault_at(f, FAULT_TABLE, 0,
                            "basic data: the undersize must rise with depth and current, to 6000 um "
                            "at most (number %u)", i + 1);
    const uint32_t *stock = values + depth_count;
    for (unsigned i = 0; i < BASIC_STOCKS; i++)
        if (last && (count == depth_count ? 0 : stock[i]) < last->stock[i])
            return fault_at(f, FAULT_TABLE, 0,
                            "basic data: the stock must not fall with the current");
    for (unsigned i = depth_count; i < count; i++)
        if (values[i] > 60000)
            return fault_at(f, FAULT_TABLE, 0, "basic data: the stock is at most 6000 um");
    row *new = &rows[begins[all_areas]++];
    new->ip = (uint16_t)ip;
    for (unsigned i = 0; i < depth_count; i++)
        new->undersize[i] = (uint16_t)values[i];
    for (unsigned i = 0; i < BASIC_STOCKS; i++)
        new->stock[i] = count == depth_count ? 0 : (uint16_t)stock[i];
    return true;
}

bool basic_drop(uint32_t area, fault *f) {
    unsigned at = 0, count = basic_area_count();
    while (at < count && areas[first + at] != area)
        at++;
    if (at == count)
        return fault_at(f, FAULT_TABLE, 0, "basic data: that area is not among them");
    drop(first + at, 1);
    pairs[now].area_count--;
    return true;
}

/* Append what comes before a number, and the number without the zeros behind its point. */
static void append(char *text, size_t size, const char *before, uint32_t value, uint32_t unit) {
    size_t at = 0;
    while (text[at])
        at++;
    at += text_print(text + at, size - at, "%s%u", before, value / unit);
    value %= unit;
    for (char point = '.'; value; point = '\0') {
        unit /= 10;
        at += point ? text_print(text + at, size - at, ".%u", value / unit)
                    : text_print(text + at, size - at, "%u", value / unit);
        value %= unit;
    }
}

/* Lines of a pair: its name, unless it has none, its depths, its finishes if there are any, its areas
   and their currents. */
static unsigned lines_of(const pair *one, unsigned begin) {
    return (one->name[0] != '\0') + 1u + (one->finish_count != 0) + one->area_count +
           begins[begin + one->area_count] - begins[begin];
}

bool basic_line(unsigned number, char *text, size_t size) {
    unsigned at = 0, area = 0, lines;
    while (at < pair_count && number >= (lines = lines_of(&pairs[at], area))) {
        number -= lines;
        area += pairs[at++].area_count;
    }
    if (at == pair_count)
        return false;
    const pair *one = &pairs[at];
    if (one->name[0] && number-- == 0) {
        text_print(text, size, "M%s", one->name);
        return true;
    }
    if (number == 0) {
        text_print(text, size, "D");
        for (unsigned i = 0; i < one->depth_count; i++) {
            append(text, size, i ? "," : "", one->depths[i], 1000);
            watch_between();
        }
        return true;
    }
    number--;
    if (one->finish_count && number-- == 0) {
        text_print(text, size, "R");
        for (unsigned i = 0; i < one->finish_count; i++) {
            int32_t difference = one->finishes[i].difference;
            append(text, size, i ? "," : "", one->finishes[i].roughness, 10);
            append(text, size, difference < 0 ? ",-" : ",",
                   (uint32_t)(difference < 0 ? -difference : difference), 10);
            watch_between();
        }
        return true;
    }
    for (; number > count_of(area); area++)
        number -= count_of(area) + 1;
    if (number == 0) {
        text_print(text, size, "A");
        append(text, size, "", areas[area], 100);
        return true;
    }
    const row *current = &rows[begins[area] + number - 1];
    text_print(text, size, "I");
    append(text, size, "", current->ip, 100);
    for (unsigned i = 0; i < one->depth_count; i++) {
        append(text, size, ",", current->undersize[i], 10);
        watch_between();
    }
    for (unsigned i = 0; i < BASIC_STOCKS && (current->stock[0] || current->stock[1]); i++)
        append(text, size, ",", current->stock[i], 10);
    return true;
}

bool basic_ready(fault *f) {
    if (!basic_area_count())
        return fault_at(f, FAULT_TABLE, 0, selected[0] ? "basic data: none of %s have been entered"
                                                       : "basic data: none have been entered",
                        selected);
    return !lacks(f);
}

float __attribute__((noinline)) basic_number(uint32_t value, int32_t unit) {
    return (float)(int32_t)value / (float)unit;
}

unsigned basic_area_count(void) { return now < pair_count ? pairs[now].area_count : 0; }
unsigned basic_depth_count(void) { return now < pair_count ? pairs[now].depth_count : 0; }
unsigned basic_current_count(unsigned area) { return count_of(first + area); }
float basic_area_of(unsigned area) { return basic_number(areas[first + area], 100); }
float basic_depth_of(unsigned depth) { return basic_number(pairs[now].depths[depth], 1000); }
float basic_ip_of(unsigned area, unsigned current) {
    return basic_number(rows[begins[first + area] + current].ip, 100);
}
float basic_undersize_of(unsigned area, unsigned current, unsigned depth) {
    return basic_number(rows[begins[first + area] + current].undersize[depth], 10);
}
float basic_stock_of(unsigned area, unsigned current, unsigned side) {
    return basic_number(rows[begins[first + area] + current].stock[side], 10);
}

unsigned basic_finish_count(void) {
    return now < pair_count && pairs[now].finish_count ? pairs[now].finish_count : 1;
}
float basic_roughness_of(unsigned finish) {
    return pairs[now].finish_count ? basic_number(pairs[now].finishes[finish].roughness, 10) : 1;
}
float basic_difference_of(unsigned finish) {
    return pairs[now].finish_count
               ? (float)pairs[now].finishes[finish].difference / (float)(int32_t)10
               : 0;
}
