// SPDX-License-Identifier: Apache-2.0
#include "store/journal.h"

#include "hal/hal.h"
#include "store/crc32.h"
#include "store/flash.h"

#define PAGES (FLASH_SECTOR / FLASH_PAGE)
#define HEAD 12u
#define CHECK 4u
#define MARK 0x314a4b47u        /* GKJ1 */
#define OPENING 0xffu           /* kind of a sector's first page */
#define SLICE 32u               /* bytes in a step */
#define FAILURES 3u             /* pages in a row that do not read back, until the journal ends */

typedef enum { REST, JUDGE, ERASE, ERASING, FILL, SEND, PROGRAMMING, COMPARE } stage;

static const journal_source *source;
static journal_state state;
/* The page under way; the processor has the lowest byte first, too. */
static union {
    uint8_t bytes[FLASH_PAGE];
    struct {
        uint32_t sequence;
        uint8_t kind, part, parts, count;
        uint32_t mark, words[JOURNAL_PART + 1]; /* with the check behind the last */
    };
} of;
static stage doing;
static unsigned sector, page;   /* the next page of the present sector; PAGES if it is full */
static bool renewing;           /* the sector is a new one, without its first page */
static uint32_t sequence;
static unsigned kind, part, parts;
static uint32_t at, length;     /* of the page under way */
static uint32_t check, digest;
static unsigned failures;
static uint32_t dirty, changed; /* kinds that may differ from the journal, and since when: clock */
static uint32_t stored[JOURNAL_KINDS];  /* digests of what the journal has */
static struct {
    uint8_t page, pages;        /* pages 0: none */
} newest[JOURNAL_KINDS];

/* Digest of a kind, part by part: tells whether the state differs from the journal. */
static uint32_t mix(uint32_t sum, uint32_t count) {
    sum += count;
    for (uint32_t i = 0; i < count; i++) {
        sum = (sum ^ of.words[i]) * 0x9e3779b1u;
        sum ^= sum >> 15;
    }
    return sum;
}

/* ---- power-on */

typedef enum { BLANK, TORN, WHOLE } found;

static uint32_t run;            /* sequence number of the record that the last pages belong to */
static unsigned come;           /* its pages so far */

static found read_page(unsigned from, unsigned number, void (*between)(void)) {
    flash_read(from, number * FLASH_PAGE);
    bool blank = true;
    uint32_t value = CRC32_START;
    for (unsigned i = 0; i < HEAD; i++) {
        of.bytes[i] = flash_byte(0);
        value = crc32_step(value, of.bytes[i]);
        blank = blank && of.bytes[i] == 0xff;
    }
    found what = blank ? BLANK : TORN;
    if (of.mark == MARK && of.count <= JOURNAL_PART) {
        length = HEAD + 4u * of.count;
        for (unsigned i = HEAD; i < length + CHECK; i++) {
            of.bytes[i] = flash_byte(0);
            if (i < length)
                value = crc32_step(value, of.bytes[i]);
            if (i % SLICE == 0)
                between();
        }
        if (of.words[of.count] == ~value)
            what = WHOLE;
    }
    flash_end();
    between();
    return what;
}

/* Note the page as a part of the newest record of its kind, if all parts before it are there. */
static void note_part(unsigned number) {
    if (of.kind >= JOURNAL_KINDS)
        return;
    come = of.part == 0 ? 1 : of.sequence == run && of.part == come ? come + 1 : 0;
    run = of.sequence;
    if (come && come == of.parts) {
        newest[of.kind].page = (uint8_t)(number + 1 - come);
        newest[of.kind].pages = (uint8_t)come;
    }
}

journal_state journal_open(const journal_source *whose, void (*between)(void)) {
    source = whose;
    doing = REST;
    dirty = sequence = failures = 0;
    renewing = false;
    __builtin_memset(newest, 0, sizeof newest);
    if (!flash_open(between))
        return state = JOURNAL_NONE;
    state = JOURNAL_KEEPS;
    sector = flash_sectors() - 1; /* of an empty region the first one follows */
    page = PAGES;
    bool any = false, blank = true;
    for (unsigned s = 0; s < flash_sectors(); s++) {
        found what = read_page(s, 0, between);
        blank = blank && what == BLANK;
        if (what == WHOLE && of.kind == OPENING && (!any || of.sequence > sequence)) {
            any = true;
            sequence = of.sequence;
            sector = s;
        }
    }
    if (!any)
        return state = blank ? JOURNAL_KEEPS : JOURNAL_UNREADABLE;
    page = 1;
    come = 0;
    for (unsigned number = 1; number < PAGES; number++) {
        found what = read_page(sector, number, between);
        if (what != BLANK)
            page = number + 1;
        if (what != WHOLE)
            continue;
        sequence = of.sequence > sequence ? of.sequence : sequence;
        note_part(number);
    }
    for (unsigned i = 0; i < JOURNAL_KINDS; i++)
        if (!newest[i].pages) {
            state = JOURNAL_UNREADABLE;
            page = PAGES; /* the next change begins a sector with all kinds */
        }
    return state;
}

journal_state journal_now(void) { return state; }

static void nothing(void) {}

const uint32_t *journal_load(unsigned which, unsigned number, unsigned *count) {
    if (number >= newest[which].pages ||
        read_page(sector, newest[which].page + number, nothing) != WHOLE)
        return 0;
    *count = of.count;
    return of.words;
}

void journal_begin(void (*between)(void)) {
    for (unsigned which = 0; which < JOURNAL_KINDS; which++) {
        uint32_t sum = 0;
        for (unsigned i = 0; i < source->pages(which); i++) {
            sum = mix(sum, source->fill(which, i, of.words));
            between();
        }
        stored[which] = sum;
    }
}

/* ---- writing */

void journal_note(unsigned which) {
    dirty |= 1u << which;
    changed = hal_cycle_low();
}

bool journal_waits(void) {
    return (state == JOURNAL_KEEPS || state == JOURNAL_UNREADABLE) && (dirty || doing != REST);
}

bool journal_holds(void) { return journal_waits() && doing >= ERASING && doing != FILL; }

static bool has_changed(void) { return kind < JOURNAL_KINDS && dirty >> kind & 1; }

static void begin_record(unsigned which) {
    kind = which;
    part = 0;
    parts = which == OPENING ? 1 : source->pages(which);
    sequence++;
    digest = 0;
    if (which != OPENING && page + parts > PAGES) {
        /* A sector that is not whole yet is begun again: the one before it must stay. */
        if (!renewing)
            sector = (sector + 1) % flash_sectors();
        renewing = true;
        doing = ERASE;
    } else {
        doing = FILL;
    }
}

static void finish_record(void) {
    doing = REST;
    if (kind == OPENING) {
        renewing = false;
        return;
    }
    stored[kind] = digest;
    if (renewing)
        begin_record(kind + 1 < JOURNAL_KINDS ? kind + 1 : OPENING);
}

static unsigned place(void) { return (kind == OPENING ? 0 : page) * FLASH_PAGE; }

/* Compare the next part of the kind with what the journal has. */
static void judge(void) {
    if (has_changed()) {
        doing = REST; /* it is judged anew when it is quiet */
        return;
    }
    digest = mix(digest, source->fill(kind, part, of.words));
    if (++part < parts)
        return;
    if (digest == stored[kind])
        doing = REST;
    else
        begin_record(kind);
}

static void fill(void) {
    if (has_changed()) {
        /* Parts of two states make no record. The pages so far are left as they are. */
        if (renewing)
            dirty &= ~(1u << kind);
        doing = REST;
        if (renewing)
            begin_record(kind);
        return;
    }
    of.count = (uint8_t)(kind == OPENING ? 0 : source->fill(kind, part, of.words));
    digest = mix(digest, of.count);
    of.sequence = sequence;
    of.kind = (uint8_t)kind;
    of.part = (uint8_t)part;
    of.parts = (uint8_t)parts;
    of.mark = MARK;
    length = HEAD + 4u * of.count;
    check = CRC32_START;
    at = 0;
    flash_program(sector, place());
    doing = SEND;
}

static void send(void) {
    for (uint32_t end = at + SLICE; at < end && at < length; at++) {
        check = crc32_step(check, of.bytes[at]);
        flash_byte(of.bytes[at]);
    }
    if (at < length)
        return;
    of.words[of.count] = ~check;
    for (length += CHECK; at < length; at++)
        flash_byte(of.bytes[at]);
    flash_end(); /* the memory begins to program */
    doing = PROGRAMMING;
}

static void compare(void) {
    bool same = true;
    for (uint32_t end = at + SLICE; at < end && at < length; at++)
        same = flash_byte(0) == of.bytes[at] && same;
    if (same && at < length)
        return;
    flash_end();
    page += kind != OPENING;
    if (!same) {
        if (++failures > FAILURES) {
            state = JOURNAL_FAILED;
            return;
        }
        page = kind == OPENING ? PAGES : page; /* then the next sector */
        begin_record(kind == OPENING ? 0 : kind);
        return;
    }
    failures = 0;
    if (++part < parts)
        doing = FILL;
    else
        finish_record();
}

static bool begin_next(void) {
    if (hal_cycle_low() - changed < hal_clock_hz() / 4)
        return false;
    for (kind = 0; !(dirty >> kind & 1);)
        kind++;
    dirty &= ~(1u << kind);
    part = 0;
    parts = source->pages(kind);
    digest = 0;
    doing = JUDGE;
    return true;
}

bool journal_step(void) {
    switch (doing) {
    case REST: return dirty && begin_next();
    case JUDGE: judge(); break;
    case ERASE:
        flash_erase(sector);
        doing = ERASING;
        return false;
    case ERASING:
        if (flash_busy())
            return false;
        page = 1;
        begin_record(0);
        break;
    case FILL: fill(); break;
    case SEND: send(); break;
    case PROGRAMMING:
        if (flash_busy())
            return false;
        flash_read(sector, place());
        at = 0;
        doing = COMPARE;
        break;
    case COMPARE: compare(); break;
    }
    return true;
}
