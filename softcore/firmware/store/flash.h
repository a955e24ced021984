// SPDX-License-Identifier: Apache-2.0
/* Commands of the serial flash memory. Only the journal's region is ever written. None of these
   functions waits for the memory: whoever begins a program or an erase asks flash_busy later. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

#define FLASH_PAGE 256u
#define FLASH_SECTOR 4096u

/* Ask the memory for its identity (maker, kind, size; 0 before). True if it is a known maker's and
   holds the journal's region. */
bool flash_open(void);
uint32_t flash_identity(void);
unsigned flash_sectors(void);       /* of the journal's region */

bool flash_busy(void);

/* Begin a command at a place of the region: its sector and the byte in it. Reading and programming
   go on with flash_byte, which takes and returns a byte, up to flash_end. A program may not leave
   its page, and begins with flash_end. */
void flash_read(unsigned sector, unsigned at);
void flash_program(unsigned sector, unsigned at);
void flash_erase(unsigned sector);
uint8_t flash_byte(uint8_t byte);
void flash_end(void);
