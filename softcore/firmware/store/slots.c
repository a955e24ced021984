// SPDX-License-Identifier: Apache-2.0
#include "store/slots.h"

#include "hal/hal.h"
#include "store/flash.h"

#define MARK 0x31464b47u        /* GKF1 */
#define TRIED FLASH_PAGE        /* places of the marks in a slot's first sector */
#define CONFIRMED (2 * FLASH_PAGE)
#define SPARE 4096u             /* bytes of the memory that no image has: link.ld */
#define SLICE 32u               /* bytes between two calls of `between` */
#define SLICES 8u               /* in a step that reads */

enum { IMAGE_MARK = 1, IMAGE_EDITION, IMAGE_MEMORY, IMAGE_WORDS };

typedef struct {
    uint32_t mark, sequence, length, digest, base, sum;
} head;

typedef enum { REST, ERASE, ERASING, PROGRAM, PROGRAMMING, READ, LAST_WAIT } stage;

static unsigned running;
static bool confirmed;
static uint32_t base;           /* digest of the built-in firmware */
static bool opened;
static slots_finding finding;
static unsigned found_slot;

static stage doing;
static bool half;               /* the order has begun to work */
static bool ended;
static slots_result result;
static unsigned sector;         /* what is erased or programmed */
static uint32_t at, count;
static const uint8_t *from;
static unsigned more;           /* sectors still to be erased, a slot apart */
static bool taking;             /* an image is being taken */
static unsigned slot;           /* the one for it, from 0 on */
static head coming;
static uint32_t have, sum;      /* bytes of the image that are there; that were read back, and digest */

/* Same function as in softcore/image.py. */
static uint32_t mix(uint32_t total, uint32_t word) {
    total = (total ^ word) * 0x9e3779b1u;
    return total ^ total >> 15;
}

static unsigned sector_of(unsigned number) { return flash_sectors() + number * flash_slot_sectors(); }

uint32_t slots_room(void) {
    return opened && flash_slot_sectors() ? (flash_slot_sectors() - 1) * FLASH_SECTOR : 0;
}

unsigned slots_spare(void) {
    uint32_t longest = hal_image_read().words[IMAGE_MEMORY] - SPARE;
    uint32_t taken = 1 + (longest + FLASH_SECTOR - 1) / FLASH_SECTOR;
    return slots_room() && taken < flash_slot_sectors() ? flash_slot_sectors() - taken : 0;
}

static void read_at(unsigned where, uint32_t place, void *to, uint32_t bytes) {
    flash_read(where + place / FLASH_SECTOR, place % FLASH_SECTOR);
    for (uint8_t *byte = to; bytes--; byte++)
        *byte = flash_byte(0);
    flash_end();
}

static uint32_t sum_of(const head *h) {
    const uint32_t *words = &h->mark;
    uint32_t total = 0;
    for (unsigned i = 0; i < sizeof *h / sizeof *words - 1; i++)
        total = mix(total, words[i]);
    return total;
}

static bool read_head(unsigned number, head *h) {
    read_at(sector_of(number), 0, h, sizeof *h);
    return h->mark == MARK && h->sum == sum_of(h) && h->length <= slots_room();
}

static bool marked(unsigned number, uint32_t mark) {
    uint8_t byte;
    read_at(sector_of(number), mark, &byte, 1);
    return byte == 0;
}

/* Do an image's first words, from IMAGE_MARK on, say that it is for this gateware and memory? */
static bool is_ours(const uint32_t *words) {
    hal_image own = hal_image_read();
    for (unsigned i = IMAGE_MARK; i < IMAGE_WORDS; i++)
        if (words[i] != own.words[i])
            return false;
    return true;
}

static void begin_reading(unsigned number, uint32_t place) {
    flash_read(sector_of(number) + 1 + place / FLASH_SECTOR, place % FLASH_SECTOR);
}

/* ---- power-on */

static void nothing(void) {}

static bool is_whole(unsigned number, const head *h) {
    uint32_t total = 0;
    begin_reading(number, 0);
    for (uint32_t i = 0; i < h->length / 4 - 1; i++)
        total = mix(total, flash_word());
    bool whole = flash_word() == total && total == h->digest;
    flash_end();
    return whole;
}

static void note(slots_finding what, unsigned number) {
    finding = what;
    found_slot = number + 1;
}

static bool fits(unsigned number, const head *h) {
    uint32_t words[IMAGE_WORDS];
    read_at(sector_of(number) + 1, 0, words, sizeof words);
    return h->base == base && is_ours(words);
}

/* Start a slot if it can be; a mark that it has been tried comes before. */
static void try(unsigned number, const head *h) {
    bool stays = marked(number, CONFIRMED);
    if (hal_arm_pressed())
        return note(SLOTS_SKIPPED, number);
    if (!stays && marked(number, TRIED))
        return note(SLOTS_UNCONFIRMED, number);
    if (!is_whole(number, h))
        return note(SLOTS_TORN, number);
    if (!stays) {
        flash_program(sector_of(number), TRIED);
        flash_byte(0);
        flash_end();
        flash_settle(nothing);
    }
    hal_started started = {h->digest, base, number + 1, stays};
    begin_reading(number, 0);
    hal_image_start(&started, h->length / 4);
}

static bool was_started(void) {
    hal_started started = hal_started_read();
    base = hal_image_read().digest;
    if (!base || started.digest != base)
        return false;
    base = started.base;
    running = started.slot;
    confirmed = started.confirmed;
    return true;
}

void slots_boot(void) {
    head heads[SLOTS];
    bool there[SLOTS];
    running = more = 0;
    confirmed = false;
    finding = SLOTS_SOUND;
    doing = REST;
    half = ended = taking = false;
    opened = flash_open(nothing);
    if (was_started() || !slots_room())
        return;
    for (unsigned i = 0; i < SLOTS; i++)
        there[i] = read_head(i, heads + i) && fits(i, heads + i);
    unsigned newest = there[1] && (!there[0] || heads[1].sequence > heads[0].sequence);
    for (unsigned i = 0; i < SLOTS; i++, newest ^= 1) {
        if (there[newest])
            try(newest, heads + newest);
        if (was_started()) /* on a computer */
            return;
    }
}

unsigned slots_running(void) { return running; }
bool slots_confirmed(void) { return confirmed; }

slots_finding slots_found(unsigned *which) {
    *which = found_slot;
    return finding;
}

/* ---- orders */

bool slots_busy(void) { return doing != REST; }
bool slots_begun(void) { return half; }

static void end(slots_result how) {
    doing = REST;
    half = false;
    ended = true;
    result = how;
}

bool slots_ended(void) { return ended; }

slots_result slots_take_result(void) {
    ended = false;
    return result;
}

void slots_stop(void) {
    taking = ended = false;
    doing = half ? LAST_WAIT : REST;
}

static void begin_program(unsigned where, uint32_t place, const void *bytes, uint32_t number) {
    sector = where + place / FLASH_SECTOR;
    at = place % FLASH_SECTOR;
    from = bytes;
    count = number;
    doing = PROGRAM;
}

static void begin_erase(unsigned where, unsigned others) {
    sector = where;
    more = others;
    count = 0;
    doing = ERASE;
}

slots_result slots_begin(uint32_t length, uint32_t digest) {
    head heads[SLOTS];
    taking = false;
    if (!slots_room())
        return SLOTS_NONE;
    if (length % 4 || length < (IMAGE_WORDS + 1) * 4 || length > slots_room() ||
        length + SPARE > hal_image_read().words[IMAGE_MEMORY])
        return SLOTS_LENGTH;
    for (unsigned i = 0; i < SLOTS; i++)
        if (!read_head(i, heads + i))
            heads[i].sequence = 0;
    slot = running ? running % SLOTS : heads[1].sequence < heads[0].sequence;
    uint32_t newest = heads[heads[1].sequence > heads[0].sequence].sequence;
    coming = (head){MARK, newest + 1, length, digest, base, 0};
    coming.sum = sum_of(&coming);
    have = 0;
    taking = true;
    begin_erase(sector_of(slot), 0);
    return SLOTS_WELL;
}

slots_result slots_chunk(uint32_t place, const uint8_t *chunk, uint32_t number) {
    uint32_t left = coming.length - have;
    if (!taking || place != have || !left || number != (left < SLOTS_CHUNK ? left : SLOTS_CHUNK))
        return SLOTS_ORDER;
    if (!place) {
        uint32_t words[IMAGE_WORDS];
        __builtin_memcpy(words, chunk, sizeof words);
        if (!is_ours(words))
            return SLOTS_FOREIGN;
    }
    have += number;
    begin_program(sector_of(slot) + 1, place, chunk, number);
    if (!at)
        doing = ERASE;
    return SLOTS_WELL;
}

slots_result slots_finish(void) {
    if (!taking || have != coming.length)
        return SLOTS_ORDER;
    taking = false;
    have = sum = 0;
    doing = READ;
    return SLOTS_WELL;
}

static const uint8_t FALLEN = 0;

slots_result slots_confirm(void) {
    if (running)
        begin_program(sector_of(running - 1), CONFIRMED, &FALLEN, 1);
    else
        end(SLOTS_WELL);
    return SLOTS_WELL;
}

slots_result slots_clear(void) {
    if (!slots_room())
        return SLOTS_NONE;
    taking = false;
    begin_erase(sector_of(0), SLOTS - 1);
    return SLOTS_WELL;
}

static void read_back(void (*between)(void)) {
    begin_reading(slot, have);
    for (unsigned slice = 0; slice < SLICES && have < coming.length - 4; slice++) {
        for (uint32_t stop = have + SLICE; have < stop && have < coming.length - 4; have += 4)
            sum = mix(sum, flash_word());
        between();
    }
    if (have == coming.length - 4) {
        bool whole = flash_word() == sum && sum == coming.digest;
        flash_end();
        if (whole)
            begin_program(sector_of(slot), 0, &coming, sizeof coming);
        else
            end(SLOTS_DIGEST);
        return;
    }
    flash_end();
}

static slots_result programmed(void) {
    head h;
    if (from == &FALLEN)
        confirmed = true;
    return from != (const uint8_t *)&coming || (read_head(slot, &h) && h.sum == coming.sum)
               ? SLOTS_WELL
               : SLOTS_DIGEST;
}

void slots_step(void (*between)(void)) {
    half = true;
    switch (doing) {
    case REST: break;
    case ERASE:
        flash_erase(sector);
        doing = ERASING;
        break;
    case ERASING:
        if (flash_busy())
            break;
        if (more--) {
            begin_erase(sector + flash_slot_sectors(), more);
            break;
        }
        more = 0;
        if (count)
            doing = PROGRAM;
        else
            end(SLOTS_WELL);
        break;
    case PROGRAM:
        flash_program(sector, at);
        for (uint32_t i = 0; i < count; i++) {
            if (i % SLICE == 0)
                between();
            flash_byte(from[i]);
        }
        flash_end();
        doing = PROGRAMMING;
        break;
    case PROGRAMMING:
        if (!flash_busy())
            end(programmed());
        break;
    case READ: read_back(between); break;
    case LAST_WAIT:
        if (flash_busy())
            break;
        doing = REST;
        half = false;
        break;
    }
}
