// SPDX-License-Identifier: Apache-2.0
/* The flash memory of the firmware on a computer: a test's, or one that is blank after each start
   and never busy. */
#include <string.h>

#include "hal/hal.h"
#include "pc/host.h"

#define FIRST 0xe00u            /* sector */
#define SECTORS 16u
#define SLOT 80u
#define SECTOR 4096u
#define HEAD 4u                 /* bytes of a command and its address */
#define BYTE_CLOCKS 20u         /* that the processor waits for a byte */

enum { PROGRAM = 0x02, READ = 0x03, STATUS = 0x05, ERASE = 0x20, IDENTIFY = 0x9f };

static gk_flash_order answers;
static void *memory;
static hal_flash_region region = {FIRST, SECTORS, SLOT};
static uint8_t cells[SECTORS * SECTOR];
static uint32_t count;          /* bytes of the command so far */
static uint8_t command;
static uint32_t address;

void gk_flash(gk_flash_order order, void *handle) {
    answers = order;
    memory = handle;
}

void gk_flash_region(uint32_t first, uint32_t sectors) {
    region = (hal_flash_region){first, sectors, sectors ? SLOT : 0};
}

void host_flash_boot(void) {
    memset(cells, 0xff, sizeof cells);
    hal_flash_select(false);
}

hal_flash_region hal_flash_region_read(void) { return region; }

void hal_flash_select(bool on) {
    count = 0;
    if (answers)
        answers(memory, hal_cycle(), on, 0);
}

/* The cell that the next byte of a command is for; cells outside the region have no effect. */
static uint8_t *cell(void) {
    static uint8_t outside;
    uint32_t at = address++ - FIRST * SECTOR;
    return at < sizeof cells ? cells + at : &outside;
}

uint8_t hal_flash_exchange(uint8_t byte) {
    static const uint8_t IDENTITY[] = {0xef, 0x40, 0x18};
    host_cost(BYTE_CLOCKS);
    if (answers)
        return answers(memory, hal_cycle(), 2, byte);
    uint32_t place = count++;
    if (!place)
        command = byte;
    else if (command == STATUS)
        return 0;
    else if (command == IDENTIFY)
        return place <= sizeof IDENTITY ? IDENTITY[place - 1] : 0xff;
    else if (place < HEAD)
        address = address << 8 | byte;
    if (place == HEAD - 1) {
        address &= 0xffffff;
        if (command == ERASE)
            for (uint32_t left = SECTOR; left; left--)
                *cell() = 0xff;
    } else if (place >= HEAD && command == READ) {
        return *cell();
    } else if (place >= HEAD && command == PROGRAM) {
        *cell() &= byte;
    }
    return 0xff;
}
