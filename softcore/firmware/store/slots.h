// SPDX-License-Identifier: Apache-2.0
/* Two slots of the flash memory for firmware that takes the place of the built-in one, with which the
   gateware was loaded.

   A slot: in its first sector the head (page 0: mark GKF1, sequence number, bytes of the image, its
   digest, the digest of the built-in firmware that it replaces, the sum of these words), a mark that
   it has been tried (page 1) and one that it was confirmed (page 2): a byte 00. The image
   is in the sectors behind. The words of an image: a jump; the mark GKFI; the edition of the gateware
   that it knows; the bytes of memory that it is linked for; at its end its digest. All words have the
   lowest byte first.

   The head is written last, when the image has been read back whole. At power-on the newest whole slot
   is started, if it was made for this gateware, this memory and this built-in firmware, and was
   confirmed or has not been tried. So a power cut leaves the old firmware or the new one, and firmware
   that does not answer is not tried twice. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#define SLOTS 2u
#define SLOTS_CHUNK 128u    /* bytes; a page is a multiple of it */

/* At power-on, before all else. Does not come back on the target if it starts other firmware. */
void slots_boot(void);

/* The slot that the firmware was started from, from 1 on; 0: it is the built-in one. */
unsigned slots_running(void);
bool slots_confirmed(void);
uint32_t slots_room(void);          /* bytes of the longest image */
unsigned slots_spare(void);         /* sectors at the end of each slot that no image reaches */

/* What power-on found out about a slot that could not be used, and which slot. */
typedef enum { SLOTS_SOUND, SLOTS_SKIPPED, SLOTS_UNCONFIRMED, SLOTS_TORN } slots_finding;
slots_finding slots_found(unsigned *slot);

typedef enum {
    SLOTS_WELL,
    SLOTS_NONE,         /* there is no flash memory, or it has no slots */
    SLOTS_LENGTH,       /* the image is too long, empty, or no whole number of words */
    SLOTS_ORDER,        /* not begun, or not the place of the next chunk */
    SLOTS_FOREIGN,      /* no image of Gapkeeper, or for another gateware or memory */
    SLOTS_DIGEST        /* the memory does not hold what was sent */
} slots_result;

/* Orders. One that is SLOTS_WELL is carried out by slots_step; then slots_ended, until its result is
   taken. Only one at a time: not while slots_busy. `chunk` must stay until then. */
slots_result slots_begin(uint32_t length, uint32_t digest); /* makes the older slot empty */
slots_result slots_chunk(uint32_t at, const uint8_t *chunk, uint32_t count);
slots_result slots_finish(void);    /* read all back, and put it in force from the next power-on on */
slots_result slots_confirm(void);   /* the firmware that runs stays */
slots_result slots_clear(void);     /* the built-in firmware from the next power-on on */

bool slots_busy(void);
bool slots_begun(void);             /* an order is half carried out: the journal has to wait */
void slots_step(void (*between)(void)); /* some 3000 clocks between two calls of `between` */
bool slots_ended(void);
slots_result slots_take_result(void);
void slots_stop(void);              /* give up what is under way */
