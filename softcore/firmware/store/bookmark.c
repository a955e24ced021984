// SPDX-License-Identifier: Apache-2.0
#include "store/bookmark.h"

#include "store/crc32.h"
#include "store/flash.h"
#include "store/journal.h"
#include "store/slots.h"

#define PLACE 16u               /* bytes of a mark; a head has FIRST places */
#define FIRST 3u
#define PLACES (FLASH_SECTOR / PLACE)
#define FAILURES 3u             /* in a row that do not read back, until nothing is written any more */
#define BLANK 0xffffffffu
#define HEAD_WORDS (2 + sizeof(bookmark) / 4)
#define MARK_WORDS 3u

_Static_assert(4 * HEAD_WORDS <= FIRST * PLACE && 4 * MARK_WORDS <= PLACE, "they fit");

static bookmark now;
static unsigned spare;          /* sectors of the ring in each slot; 0: there is no ring */
static unsigned sector, place;  /* of the ring, and where the next mark in it goes */
static uint32_t sequence;       /* of the sector's head */
static bool opens;              /* what is written next is a head, in the next sector */
static bool blank;              /* that sector is erased */
static bool ahead;              /* it may be erased before it is needed */
static bool changed;            /* `now` is not written yet */
static uint32_t written;        /* clock of the last write */
static unsigned failures;
static enum { REST, ERASING, SEND, PROGRAMMING } doing;
static uint32_t words[HEAD_WORDS], count;   /* what is read or written */
static bool heads;              /* it is a head */

static unsigned sector_of(unsigned number) {
    return flash_sectors() + (number / spare + 1) * flash_slot_sectors() - spare + number % spare;
}

static uint32_t check(void) {
    uint32_t value = CRC32_START;
    for (uint32_t i = 0; i < 4 * (count - 1); i++)
        value = crc32_step(value, ((const uint8_t *)words)[i]);
    return ~value;
}

/* ---- power-on */

/* Read what begins at a place; true if it is sound. Of a blank one only the first word is read. */
static bool reads(unsigned number, unsigned at, uint32_t length) {
    count = length;
    flash_read(sector_of(number), at * PLACE);
    words[0] = flash_word();
    for (uint32_t i = 1; i < count && words[0] != BLANK; i++)
        words[i] = flash_word();
    flash_end();
    return words[0] != BLANK && words[count - 1] == check();
}

void bookmark_open(void (*between)(void)) {
    now = (bookmark){0};
    doing = REST;
    opens = true;
    blank = ahead = changed = false;
    failures = sequence = sector = 0;
    written = hal_cycle_low() - hal_clock_hz(); /* the first change is written at once */
    spare = journal_now() == JOURNAL_NONE ? 0 : slots_spare();
    for (unsigned number = 0; number < SLOTS * spare; number++) {
        if (reads(number, 0, HEAD_WORDS) && words[0] > sequence) {
            sequence = words[0];
            sector = number;
            __builtin_memcpy(&now, words + 1, sizeof now);
        }
        between();
    }
    if (!sequence)
        return;
    for (unsigned at = PLACES; at-- > FIRST; between())
        if (reads(sector, at, MARK_WORDS)) {
            now.line = words[0];
            now.digest = words[1];
            return;
        }
}

const bookmark *bookmark_now(void) { return &now; }

/* ---- writing */

void bookmark_move(uint32_t line, uint32_t digest) {
    now.line = line;
    now.digest = digest;
    changed = true;
}

void bookmark_put(const bookmark *other) {
    now = *other;
    opens = changed = true;
}

bool bookmark_failed(void) { return failures > FAILURES; }
bool bookmark_holds(void) { return doing != REST; }

static bool due(void) {
    return changed && (!now.line || hal_cycle_low() - written >= hal_clock_hz());
}

static bool erases(void) { return opens && !blank && (ahead || changed); }

bool bookmark_waits(void) {
    return (doing != REST || due() || (ahead && erases())) && spare && !bookmark_failed();
}

static bool begin(void) {
    unsigned next = (sector + 1) % (SLOTS * spare);
    if (erases()) {
        flash_erase(sector_of(next));
        ahead = false;
        doing = ERASING;
        return false;
    }
    if (!due())
        return false;
    changed = false;
    heads = opens;
    if (heads) {
        sector = next;
        place = 0;
        words[0] = ++sequence;
        __builtin_memcpy(words + 1, &now, sizeof now);
        opens = blank = false;
    } else {
        words[0] = now.line;
        words[1] = now.digest;
    }
    count = heads ? HEAD_WORDS : MARK_WORDS;
    words[count - 1] = check();
    written = hal_cycle_low();
    doing = SEND;
    return true;
}

static void send(void) {
    flash_program(sector_of(sector), place * PLACE);
    for (uint32_t i = 0; i < 4 * count; i++)
        flash_byte(((const uint8_t *)words)[i]);
    flash_end(); /* the memory begins to program */
    doing = PROGRAMMING;
}

/* Read back what was written. */
static void compare(void) {
    bool same = true;
    flash_read(sector_of(sector), place * PLACE);
    for (uint32_t i = 0; i < count; i++)
        same = flash_word() == words[i] && same;
    flash_end();
    doing = REST;
    place += heads ? FIRST : 1;
    failures = same ? 0 : failures + 1;
    if (!same) {
        changed = true;
        written -= hal_clock_hz(); /* it is written again at once */
    }
    ahead = same;
    opens = opens || place == PLACES || (heads && !same) || !now.line;
}

bool bookmark_step(void) {
    switch (doing) {
    case REST: return begin();
    case SEND: send(); return false;
    default: break;
    }
    if (flash_busy())
        return false;
    if (doing == ERASING) {
        blank = true;
        doing = REST;
    } else {
        compare();
    }
    return true;
}
