// SPDX-License-Identifier: Apache-2.0
#include "app/firmware.h"

#include "app/homing.h"
#include "app/jog.h"
#include "app/machine.h"
#include "app/meter.h"
#include "app/program.h"
#include "app/status.h"
#include "base/watch.h"
#include "hal/hal.h"
#include "link/output.h"
#include "path/path.h"
#include "store/bookmark.h"
#include "store/journal.h"
#include "store/slots.h"

#define VERSION "0.1"
#define COMMAND 9u      /* characters of $FIRMWARE */

static fault refusal;

/* At rest, without permission to discharge. With safe outputs an axis may rest away from its command. */
static bool may(void) {
    return !hal_armed() && !machine_machining() && !program_running() && !jog_active() &&
           !homing_active() && (hal_safe() ? !hal_motion_read().moving : meter_rests());
}

void firmware_boot(void) { slots_boot(); }

static void tell(void) {
    hal_image own = hal_image_read();
    const char *state = !slots_running() ? "built-in" : slots_confirmed() ? "kept" : "trial";
    output_line("[FIRMWARE:%u,%s,%u,%u,%u,%u]", slots_running(), state, own.digest, own.words[2],
                own.words[3], slots_room());
}

/* As grbl sends it: its version followed by our name, then its options. There are none; the two
   numbers are the most blocks and bytes that `Bf` can report. The bytes are those that the gateware's
   queue alone holds while lines wait for their answers. Then the firmware: its slot, whether it was
   confirmed, its digest, the edition of the gateware and the memory that it was made for, and the
   bytes of the longest image that a slot takes. */
void firmware_tell_version(void) {
    output_line("[VER:1.1h:Gapkeeper " VERSION "]");
    output_line("[OPT:,%u,%u]", (uint32_t)PATH_LEAD, (uint32_t)STATUS_BYTES);
    tell();
}

void firmware_tell_found(void) {
    static const char *const SAYS[] = {
        [SLOTS_SKIPPED] = "the firmware in slot %u is not used: ARM was held at power-on",
        [SLOTS_UNCONFIRMED] = "the firmware in slot %u was tried and not confirmed: it is not used",
        [SLOTS_TORN] = "the firmware in slot %u is damaged: it is not used",
    };
    unsigned slot;
    slots_finding what = slots_found(&slot);
    fault said = {0};
    if (what == SLOTS_SOUND)
        return;
    fault_at(&said, FAULT_NONE, 0, SAYS[what], slot);
    output_message(&said);
}

static void explain(slots_result why, fault *f) {
    static const char *const SAYS[] = {
        [SLOTS_NONE] = "no flash memory with room for firmware answers",
        [SLOTS_LENGTH] = "the firmware is too long, or cut short",
        [SLOTS_ORDER] = "this piece of firmware is not the next one: begin again",
        [SLOTS_FOREIGN] = "the firmware is made for another controller",
        [SLOTS_DIGEST] = "the flash memory does not hold what was sent: the old firmware stays",
    };
    if (why != SLOTS_WELL)
        fault_at(f, FAULT_BUSY, 0, "%s", SAYS[why]);
}

/* ---- lines */

/* Decode characters of 6 bits in place: 0 to 61 are `@` to `}`, 62 and 63 are `=` and `>`; the highest
   bits first. None of them is a real-time byte. Returns the bytes. */
static uint32_t decode(char *text, uint32_t length) {
    uint32_t bits = 0, held = 0, count = 0;
    for (uint32_t at = 0; at < length; at++) {
        uint32_t c = (uint8_t)text[at];
        held = held << 6 | ((c < '@' ? c + 1 : c) & 63);
        bits += 6;
        if (bits >= 8)
            text[count++] = (char)(held >> (bits -= 8));
    }
    return count;
}

static slots_result obey(char what, char *payload, uint32_t count) {
    uint32_t words[2];
    __builtin_memcpy(words, payload, sizeof words);
    switch (what) {
    case 'B': return count == sizeof words ? slots_begin(words[0], words[1]) : SLOTS_ORDER;
    case 'D': return slots_chunk(words[0], (uint8_t *)payload + 4, count - 4);
    case 'E': return slots_finish();
    case 'K': return slots_confirm();
    default: return slots_clear();
    }
}

bool firmware_line(char *line, uint32_t length, fault *f) {
    if (length == COMMAND) {
        tell();
        return false;
    }
    char what = length > COMMAND + 1 && line[COMMAND] == '=' ? line[COMMAND + 1] : 0;
    char *payload = line + COMMAND + 2;
    if (what != 'B' && what != 'D' && what != 'E' && what != 'K' && what != 'C')
        return fault_at(f, FAULT_COMMAND, 0, "$FIRMWARE takes =B, =D, =E, =K or =C");
    if (!may())
        return fault_at(f, FAULT_BUSY, 0, "firmware is taken only at rest and disarmed: Ctrl-X first");
    if (slots_busy() || journal_holds() || bookmark_holds())
        return fault_at(f, FAULT_BUSY, 0, "the flash memory is busy: send this again");
    slots_result why = obey(what, payload, decode(payload, length - COMMAND - 2));
    explain(why, f);
    return why == SLOTS_WELL;
}

bool firmware_answers(void) { return slots_ended(); }

const fault *firmware_answer(void) {
    refusal.code = FAULT_NONE;
    explain(slots_take_result(), &refusal);
    return &refusal;
}

void firmware_stop(void) { slots_stop(); }

bool firmware_step(bool journal_works) {
    if (!slots_busy() || (journal_works && !slots_begun()) || !may())
        return slots_begun();
    watch_between();
    slots_step(watch_between);
    return true;
}
