// SPDX-License-Identifier: Apache-2.0
#include "gap/conditions.h"

#include "base/settings.h"
#include "base/units.h"
#include "hal/hal.h"

static const condition_row BUILT_IN[] = {CONDITIONS_BUILT_IN};
#define BUILT_IN_ROWS (sizeof BUILT_IN / sizeof *BUILT_IN)

/* A row of the tape hides a row with the same number that was entered by hand. */
static condition_row entered[CONDITIONS_ENTERED];
static enum { FREE, BY_HAND, BY_TAPE } origin[CONDITIONS_ENTERED];
static uint32_t edition;        /* of those by hand */

/* Index of an entered row; CONDITIONS_ENTERED if there is none. */
static unsigned place(uint32_t number, unsigned from) {
    unsigned at = 0;
    while (at < CONDITIONS_ENTERED && (origin[at] != from || entered[at].number != number))
        at++;
    return at;
}

const condition_row *conditions_find(uint32_t number) {
    for (unsigned from = BY_TAPE; from != FREE; from--) {
        unsigned at = place(number, from);
        if (at < CONDITIONS_ENTERED)
            return &entered[at];
    }
    for (unsigned i = 0; i < BUILT_IN_ROWS; i++)
        if (BUILT_IN[i].number == number)
            return &BUILT_IN[i];
    return 0;
}

static void forget(unsigned from) {
    for (unsigned at = 0; at < CONDITIONS_ENTERED; at++)
        if (origin[at] == from)
            origin[at] = FREE;
}

const condition_row *conditions_by_hand(unsigned at) {
    return origin[at] == BY_HAND ? &entered[at] : 0;
}

uint32_t conditions_edition(void) { return edition; }

void conditions_start(void) { forget(BY_TAPE); }

__attribute__((noinline)) void conditions_reset(void) {
    forget(BY_TAPE);
    forget(BY_HAND);
    edition++;
}

condition_row conditions_draft(uint32_t number) {
    const condition_row *row = conditions_find(number);
    return row ? *row : (condition_row){.number = number, CONDITIONS_USUAL};
}

/* Interpolate a time between two currents that are `apart`, for a current `more` above the lower
   one. */
static uint16_t between(uint32_t lower, uint32_t upper, uint32_t more, uint32_t apart) {
    return (uint16_t)(lower + ((upper - lower) * more * 2 + apart) / (apart * 2));
}

condition_row conditions_planned(uint32_t ip) {
    uint32_t milli_ip = ip * 1000;
    const condition_row *lower = BUILT_IN, *upper = 0;
    for (const condition_row *row = BUILT_IN; !upper && !row->negative; row++) {
        if (row->milli_ip <= milli_ip)
            lower = row;
        else
            upper = row;
    }
    bool known = lower->milli_ip == milli_ip;
    uint32_t number = known ? lower->number : CONDITIONS_PLANNED + ip;
    unsigned at = place(number, BY_HAND);
    condition_row row = known ? *lower : (condition_row){.number = number, CONDITIONS_USUAL};
    if (at < CONDITIONS_ENTERED)
        row = entered[at];
    if (known)
        return row;
    uint32_t apart = upper ? upper->milli_ip - lower->milli_ip : lower->milli_ip;
    uint32_t more = milli_ip - lower->milli_ip;
    row.milli_ip = (uint16_t)milli_ip;
    row.on_us = between(lower->on_us, upper ? upper->on_us : 2 * lower->on_us, more, apart);
    row.off_us = between(lower->off_us, upper ? upper->off_us : 2 * lower->off_us, more, apart);
    row.rest_us = row.off_us;
    return row;
}

bool conditions_enter(const condition_row *row, bool by_hand) {
    unsigned hidden = by_hand ? place(row->number, BY_TAPE) : CONDITIONS_ENTERED;
    if (hidden < CONDITIONS_ENTERED)
        origin[hidden] = FREE;
    unsigned at = place(row->number, by_hand ? BY_HAND : BY_TAPE);
    for (unsigned i = 0; at == CONDITIONS_ENTERED && i < CONDITIONS_ENTERED; i++)
        if (origin[i] == FREE)
            at = i;
    if (at == CONDITIONS_ENTERED)
        return false;
    entered[at] = *row;
    origin[at] = by_hand ? BY_HAND : BY_TAPE;
    edition += by_hand;
    return true;
}

bool conditions_level(const condition_row *row, uint32_t *level) {
    uint32_t step_ua = settings_get(SET_CURRENT_STEP_MA) * 1000, ua = row->milli_ip * CONDITIONS_IP_MA;
    *level = (ua + step_ua / 2) / step_ua;
    uint32_t nearest_ua = *level * step_ua, off = nearest_ua < ua ? ua - nearest_ua : nearest_ua - ua;
    return *level <= hal_level_limit() && off <= 10 * CONDITIONS_IP_MA;
}

uint32_t conditions_wait_us(const condition_row *row) {
    return !row->from_ignition ? 0 : row->wait_us ? row->wait_us : row->on_us;
}

uint32_t conditions_lag(void) {
    return HAL_GAP_LATENCY + units_clocks_of_ns(settings_get(SET_IGNITION_LAG_NS));
}

bool conditions_judge(const condition_row *row, uint32_t column, fault *f) {
    uint32_t blanking_ns = settings_get(SET_BLANKING_NS), settle_ns = settings_get(SET_SETTLE_NS);
    uint32_t on_us = row->on_us, wait_us = conditions_wait_us(row);
    if (!wait_us)
        return on_us * 1000 > blanking_ns + settle_ns ||
               fault_at(f, FAULT_CONDITION, column,
                        "a pulse of C%u takes %u us, and the gap is sampled after %u ns only "
                        "($%u, $%u)", row->number, on_us, blanking_ns + settle_ns,
                        settings_number(SET_BLANKING_NS), settings_number(SET_SETTLE_NS));
    uint32_t seen_clocks = conditions_lag() + units_clocks_of_ns(settle_ns);
    if (units_clocks_of_us(on_us) < seen_clocks)
        return fault_at(f, FAULT_CONDITION, column,
                        "a discharge of C%u takes %u us and is sampled after %u clocks only "
                        "($%u, $%u)", row->number, on_us, seen_clocks,
                        settings_number(SET_IGNITION_LAG_NS), settings_number(SET_SETTLE_NS));
    /* A short shows at the blanking's end, and begins the on-time a clock later. */
    return units_clocks_of_us(wait_us) > units_clocks_of_ns(blanking_ns) + 1 ||
           fault_at(f, FAULT_CONDITION, column,
                    "a pulse of C%u waits %u us for its ignition, and the gap is sampled after %u ns "
                    "only ($%u)", row->number, wait_us, blanking_ns,
                    settings_number(SET_BLANKING_NS));
}

bool conditions_seen(const condition_row *row) {
    fault unused;
    return conditions_judge(row, 0, &unused);
}
