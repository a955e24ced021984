// SPDX-License-Identifier: Apache-2.0
#include "roughing/staircase.h"

#include "roughing/basic.h"
#include "roughing/network.h"
#include "base/rare.h"

#define GRANTED 0x1p-10f
#define DEGREE 0.017453292519943295f
#define TERMS 8
#define CURRENT_SHARE 0.1f
#define DEPTH_SHARE 0.05f
#define NEAR 2                  /* neighbours on every side */

/* The two neighbours of a value: their indices and their values. `count` is 1 if there is only
   one. */
typedef struct {
    unsigned at, count;
    float value[NEAR];
} pair;

static staircase_job job;
static staircase_result found;
static fault refusal;

static unsigned near_area;      /* index of the first neighbouring area */
static pair areas, depths;
static pair currents[NEAR];     /* of each area, next to `ip` */
static pair chosen;             /* undersizes of an area at a depth */
static float area_mm2, depth_mm;
static float correction;        /* of the stock on the side, for the roughness, um */
static float ip;               /* the current asked about */
static float by_area[NEAR], by_depth[NEAR];
static float needed[NEAR];      /* undersizes at the two depths on either side of `sought` */
static float sought;            /* the undersize for which a depth is searched */
static float least, greatest, between;
static float interpolated_um;   /* beta as interpolation alone gives it */
static float cosine, square;
static uint32_t level;
static unsigned column;         /* depth at which `needed[0]` is */

static unsigned phase, turn;
static bool over;               /* the last current reached no depth */

static float __attribute__((noinline)) line(const pair *x, const float *y, float at) {
    if (x->count == 1)
        return y[0];
    return y[0] + (y[1] - y[0]) * ((at - x->value[0]) / (x->value[1] - x->value[0]));
}

/* Lists of ascending values in which next_to searches. */
static float of_areas(unsigned i, unsigned unused, unsigned unused_too) {
    (void)unused, (void)unused_too;
    return basic_area_of(i);
}
static float of_depths(unsigned i, unsigned unused, unsigned unused_too) {
    (void)unused, (void)unused_too;
    return basic_depth_of(i);
}
static float of_currents(unsigned i, unsigned area, unsigned unused) {
    (void)unused;
    return basic_ip_of(area, i);
}
static float of_finishes(unsigned i, unsigned unused, unsigned unused_too) {
    (void)unused, (void)unused_too;
    return basic_roughness_of(i);
}
static float of_column(unsigned i, unsigned area, unsigned depth) {
    return basic_undersize_of(area, i, depth);
}

/* Find the neighbours by bisection, as each value costs a division. */
static pair __attribute__((noinline)) next_to(float (*of)(unsigned, unsigned, unsigned), unsigned a, unsigned b,
                    unsigned count, float value) {
    if (count == 1)
        return (pair){.count = 1, .value = {of(0, a, b)}};
    unsigned low = 0, high = count - 1;     /* the first neighbour is low to high - 1 */
    while (high - low > 1) {
        unsigned middle = (low + high) / 2;
        if (of(middle, a, b) <= value)
            low = middle;
        else
            high = middle;
    }
    return (pair){low, 2, {of(low, a, b), of(high, a, b)}};
}

static void __attribute__((noinline)) refuse(const char *why) {
    fault_at(&refusal, FAULT_TABLE, 0, "%s", why);
}

static float __attribute__((noinline)) undersize(unsigned area, unsigned depth) {
    const pair *rows = &currents[area];
    float y[NEAR];
    for (unsigned i = 0; i < rows->count; i++)
        y[i] = basic_undersize_of(near_area + area, rows->at + i, depth);
    return line(rows, y, ip);
}

/* Phases. Each gets how often it has run, and returns whether it has to run again. */

static bool gradient(unsigned at) {
    if (at == 0) {
        area_mm2 = basic_number(job.area, 100);
        depth_mm = basic_number(job.depth_um, 1000);
        found.undersize_um = basic_number(job.undersize, 10);
        float angle = basic_number(job.taper, 100) * DEGREE;
        square = angle * angle;
        cosine = 1;
        return job.taper != 0;
    }
    unsigned k = TERMS + 1 - at;
    if (k) {
        cosine = 1.0f - square / (float)(int32_t)((2 * k - 1) * (2 * k)) * cosine;
        return true;
    }
    found.undersize_um = found.undersize_um * cosine;
    return false;
}

static bool choose_areas(unsigned at) {
    unsigned count = basic_area_count();
    (void)at;
    if (area_mm2 < basic_area_of(0) || area_mm2 > basic_area_of(count - 1))
        refuse("the area is outside of the basic data");
    areas = next_to(of_areas, 0, 0, count, area_mm2);
    near_area = areas.at;
    return false;
}

static bool choose_depths(unsigned at) {
    unsigned count = basic_depth_count();
    (void)at;
    if (depth_mm < basic_depth_of(0) || depth_mm > basic_depth_of(count - 1))
        refuse("the depth is outside of the basic data");
    depths = next_to(of_depths, 0, 0, count, depth_mm);
    return false;
}

static bool choose_finish(unsigned at) {
    unsigned count = basic_finish_count();
    float rmax = basic_number(job.rmax, 10), y[NEAR];
    (void)at;
    if (rmax < basic_roughness_of(0) || rmax > basic_roughness_of(count - 1))
        refuse("the roughness is outside of the basic data");
    pair finishes = next_to(of_finishes, 0, 0, count, rmax);
    for (unsigned i = 0; i < finishes.count; i++)
        y[i] = basic_difference_of(finishes.at + i);
    correction = line(&finishes, y, rmax);
    return false;
}

/* Currents that both areas have. */
static bool common(unsigned at) {
    float first = basic_ip_of(near_area + at, 0);
    float last = basic_ip_of(near_area + at, basic_current_count(near_area + at) - 1);
    if (at == 0 || first > least)
        least = first;
    if (at == 0 || last < greatest)
        greatest = last;
    if (at + 1 < areas.count)
        return true;
    if (least > greatest)
        refuse("the areas next to the job have no current in common");
    ip = least;
    return false;
}

static bool choose_currents(unsigned at) {
    unsigned area = near_area + at;
    currents[at] = next_to(of_currents, area, 0, basic_current_count(area), ip);
    return at + 1 < areas.count;
}

/* Interpolate the undersize that `ip` needs at the job's depth. */
static bool interpolate(unsigned at) {
    unsigned area = at / depths.count, depth = at % depths.count;
    by_depth[depth] = undersize(area, depths.at + depth);
    if (depth + 1 == depths.count)
        by_area[area] = line(&depths, by_depth, depth_mm);
    if (at + 1 < areas.count * depths.count)
        return true;
    between = line(&areas, by_area, area_mm2);
    return false;
}

static bool large_enough(unsigned at) {
    (void)at;
    if (found.undersize_um < between)
        refuse("the undersize is too small: the least current of the basic data needs more");
    return false;
}

/* Two steps for each area and depth: find the currents, take them. */
static bool sample_currents(unsigned at) {
    unsigned area = at / 2 / depths.count, depth = at / 2 % depths.count, of = near_area + area;
    if (at == 0)
        network_begin(job.seed);
    if (at % 2 == 0) {
        chosen = next_to(of_column, of, depths.at + depth, basic_current_count(of),
                         found.undersize_um);
        return true;
    }
    float y[NEAR];
    for (unsigned i = 0; i < chosen.count; i++) {
        y[i] = basic_ip_of(of, chosen.at + i);
        network_sample(areas.value[area], depths.value[depth], chosen.value[i], y[i]);
    }
    by_depth[depth] = line(&chosen, y, found.undersize_um);
    if (depth + 1 == depths.count)
        by_area[area] = line(&depths, by_depth, depth_mm);
    return at + 1 < areas.count * depths.count * 2;
}

static bool ask_current(unsigned at) {
    static const int8_t signs[NETWORK_INPUTS] = {0, -1, 1};
    (void)at;
    between = line(&areas, by_area, area_mm2);
    network_ask(area_mm2, depth_mm, found.undersize_um, signs);
    return false;
}

static bool learn(unsigned at) {
    (void)at;
    return network_step();
}

static float magnitude(float value) { return value < 0 ? -value : value; }
static float inside_data(float current) {
    current = current > least ? current : least;
    return current < greatest ? current : greatest;
}

/* How an answer is compared with the interpolation. */
static bool any(float one, float two) {
    (void)one, (void)two;
    return true;
}
static bool same_current(float one, float two) {
    return magnitude(inside_data(one) - inside_data(two)) * (float)(int32_t)job.parts <=
           CURRENT_SHARE;
}
static bool same_depth(float one, float two) {
    return (one <= 0 && two <= 0) || magnitude(one - two) <= DEPTH_SHARE * two;
}

static float __attribute__((noinline)) answer(bool (*agree)(float, float)) {
    float value;
    if (network_answer(&value) && agree(value, between))
        return value;
    found.untrusted++;
    return between;
}

/* Round down to a current that the power supply can be set to. */
static bool round_current(unsigned at) {
    (void)at;
    found.ip = inside_data(answer(same_current));
    found.greatest = found.ip == greatest;
    level = (uint32_t)(int32_t)(found.ip * (float)(int32_t)job.parts + GRANTED);
    ip = basic_number(level, (int32_t)job.parts);
    if (ip < least)
        refuse("the supply has no step between the least current of the basic data and what the "
               "undersize allows");
    return false;
}

static bool sample_undersizes(unsigned at) {
    unsigned area = at / depths.count, depth = at % depths.count;
    const pair *rows = &currents[area];
    if (at == 0)
        network_begin(job.seed);
    for (unsigned i = 0; i < rows->count; i++)
        network_sample(areas.value[area], depths.value[depth], rows->value[i],
                       basic_undersize_of(near_area + area, rows->at + i, depths.at + depth));
    return at + 1 < areas.count * depths.count;
}

static bool ask_undersize(unsigned at) {
    static const int8_t signs[NETWORK_INPUTS] = {0, 1, 1};
    (void)at;
    network_ask(area_mm2, depth_mm, ip, signs);
    return false;
}

/* Interpolate the stock that the last step leaves: on the bottom, then on the side, which the finish
   corrects. One area in each step. */
static bool stock(unsigned at) {
    unsigned side = at / areas.count, area = at % areas.count;
    const pair *rows = &currents[area];
    float y[NEAR];
    for (unsigned i = 0; i < rows->count; i++)
        y[i] = basic_stock_of(near_area + area, rows->at + i, side);
    by_area[area] = line(rows, y, ip);
    if (area + 1 < areas.count)
        return true;
    float left = line(&areas, by_area, area_mm2);
    if (!side) {
        found.bottom_um = left;
        return true;
    }
    left = left + correction;
    found.side_um = left > 0 ? left : 0;
    return false;
}

static bool keep_last(unsigned at) {
    (void)at;
    float inferred = answer(any), has = found.undersize_um;
    found.beta_um = inferred < has ? inferred : has;
    interpolated_um = between < has ? between : has;
    found.runs[0] = (staircase_run){level, job.depth_um};
    found.count = 1;
    found.single = basic_depth_count() == 1;
    return false;
}

/* Step S20: take the next current, if the data have it. Interpolation alone first finds its
   depth. */
static bool next_current(unsigned at) {
    (void)at;
    level++;
    ip = basic_number(level, (int32_t)job.parts);
    found.ended = ip > greatest;
    sought = interpolated_um;
    return false;
}

/* Go down from the shallowest depth until two depths lie on either side of an undersize. One area
   in each step. */
static bool search(unsigned at) {
    unsigned depth = at / areas.count, area = at % areas.count;
    by_area[area] = undersize(area, depth);
    if (area + 1 < areas.count)
        return true;
    float here = line(&areas, by_area, area_mm2);
    if (depth < NEAR) {
        needed[depth] = here;
        column = 0;
        if (depth == 0)
            return true;
    } else {
        needed[0] = needed[1];
        needed[1] = here;
        column = depth - 1;
    }
    return !(needed[1] > sought) && depth + 1 < basic_depth_count();
}

static bool interpolate_depth(unsigned at) {
    (void)at;
    pair x = {column, NEAR, {needed[0], needed[1]}};
    float y[NEAR] = {basic_depth_of(column), basic_depth_of(column + 1)};
    between = line(&x, y, sought);
    sought = found.beta_um;
    return false;
}

static bool sample_depths(unsigned at) {
    unsigned area = at / NEAR, row = at % NEAR;
    const pair *rows = &currents[area];
    if (at == 0)
        network_begin(job.seed);
    for (unsigned depth = column; depth < column + NEAR; depth++)
        network_sample(areas.value[area], rows->value[row],
                       basic_undersize_of(near_area + area, rows->at + row, depth),
                       basic_depth_of(depth));
    return at + 1 < areas.count * NEAR;
}

static bool ask_depth(unsigned at) {
    static const int8_t signs[NETWORK_INPUTS] = {0, -1, 1};
    (void)at;
    network_ask(area_mm2, ip, found.beta_um, signs);
    return false;
}

/* Steps S23 and S24. */
static bool keep_depth(unsigned at) {
    (void)at;
    float gamma = answer(same_depth);
    uint32_t depth_um = gamma > 0 ? (uint32_t)(int32_t)(gamma * 1000 + GRANTED) : 0;
    over = !depth_um;
    if (over || depth_um >= found.runs[found.count - 1].depth_um)
        return false;
    if (found.count == STAIRCASE_STEPS) {
        refuse("the staircase has more steps than a series takes");
        return false;
    }
    found.beyond += gamma < basic_depth_of(0);
    found.runs[found.count++] = (staircase_run){level, depth_um};
    return false;
}

static bool (*const PHASES[])(unsigned at) = {
    gradient, choose_areas, choose_depths, choose_finish, common, choose_currents, interpolate, large_enough,
    sample_currents, ask_current, learn, round_current,
    choose_currents, interpolate, stock, sample_undersizes, ask_undersize, learn, keep_last,
#define STAIRS 19
    next_current,
#define STAIR 20
    choose_currents, search, interpolate_depth, search, sample_depths, ask_depth, learn, keep_depth,
};
#define PHASE_COUNT (sizeof PHASES / sizeof *PHASES)

bool staircase_begin(const staircase_job *wanted, fault *f) {
    if (!basic_ready(f))
        return false;
    job = *wanted;
    found = (staircase_result){0};
    refusal = (fault){0};
    phase = turn = 0;
    return true;
}

bool staircase_step(void) {
    if (phase == PHASE_COUNT)
        return false;
    if (PHASES[phase](turn++))
        return true;
    turn = 0;
    phase++;
    if (refusal.code != FAULT_NONE || (phase == STAIRS && found.single) ||
        (phase == STAIR && found.ended))
        phase = PHASE_COUNT;
    else if (phase == PHASE_COUNT && !over)
        phase = STAIRS;
    return phase < PHASE_COUNT;
}

const staircase_result *staircase_found(fault *f) {
    if (refusal.code == FAULT_NONE)
        return &found;
    *f = refusal;
    return 0;
}
