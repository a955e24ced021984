// SPDX-License-Identifier: Apache-2.0
/* Commands of the serial flash memory. Only the regions of the journal and of the firmware slots are ever written. None of these
   functions waits for the memory: whoever begins a program or an erase asks flash_busy later. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#define FLASH_PAGE 256u
#define FLASH_SECTOR 4096u

/* Ask the memory for its identity (maker, kind, size; 0 before), and let it settle. True if it is a
   known maker's and holds the journal and the slots. */
bool flash_open(void (*between)(void));
uint32_t flash_identity(void);
unsigned flash_sectors(void);       /* of the journal */
unsigned flash_slot_sectors(void);  /* of each of the two firmware slots behind it */

bool flash_busy(void);
void flash_settle(void (*between)(void)); /* wait while it is busy, for a second at most */

/* Begin a command at a place: its sector, counted from the journal's first, and the byte in it. Reading and programming
   go on with flash_byte, which takes and returns a byte, up to flash_end. A program may not leave
   its page, and begins with flash_end. */
void flash_read(unsigned sector, unsigned at);
void flash_program(unsigned sector, unsigned at);
void flash_erase(unsigned sector);
uint8_t flash_byte(uint8_t byte);
uint32_t flash_word(void);          /* the next four bytes, the lowest first */
void flash_end(void);
