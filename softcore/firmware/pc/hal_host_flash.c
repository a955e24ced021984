// SPDX-License-Identifier: Apache-2.0
/* The flash memory of the firmware on a computer: a test's, or a blank one that forgets. */
#include "hal/hal.h"
#include "pc/host.h"

#define FIRST 0xe00u            /* sector */
#define SECTORS 16u
#define IDENTIFY 0x9f
#define STATUS 0x05

static gk_flash_order answers;
static void *memory;
static hal_flash_region region = {FIRST, SECTORS};
static uint32_t count;
static uint8_t command;

void gk_flash(gk_flash_order order, void *handle) {
    answers = order;
    memory = handle;
}

void gk_flash_region(uint32_t first, uint32_t sectors) {
    region = (hal_flash_region){first, sectors};
}

void host_flash_boot(void) { hal_flash_select(false); }

hal_flash_region hal_flash_region_read(void) { return region; }

void hal_flash_select(bool on) {
    count = 0;
    if (answers)
        answers(memory, hal_cycle(), on, 0);
}

uint8_t hal_flash_exchange(uint8_t byte) {
    static const uint8_t IDENTITY[] = {0xef, 0x40, 0x18};
    if (answers)
        return answers(memory, hal_cycle(), 2, byte);
    if (!count++)
        command = byte;
    else if (command == IDENTIFY && count - 2 < sizeof IDENTITY)
        return IDENTITY[count - 2];
    else if (command == STATUS)
        return 0;
    return 0xff;
}
