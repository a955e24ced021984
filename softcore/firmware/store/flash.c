// SPDX-License-Identifier: Apache-2.0
#include "store/flash.h"

#include "hal/hal.h"

enum { READ = 0x03, STATUS = 0x05, WRITE_ENABLE = 0x06, PROGRAM = 0x02, ERASE = 0x20,
       WAKE = 0xab, IDENTIFY = 0x9f };
#define STATUS_BUSY 1u
#define BUSY_S 1u               /* longest wait for a memory that erases: at power-on */

static hal_flash_region region;
static uint32_t identity;

__attribute__((noinline)) uint8_t flash_byte(uint8_t byte) { return hal_flash_exchange(byte); }
uint32_t flash_word(void) {
    uint32_t word = 0;
    for (unsigned i = 0; i < 4; i++)
        word = word >> 8 | (uint32_t)flash_byte(0) << 24;
    return word;
}

void flash_end(void) { hal_flash_select(false); }
uint32_t flash_identity(void) { return identity; }
unsigned flash_sectors(void) { return region.sectors; }
unsigned flash_slot_sectors(void) { return region.slot; }
static uint32_t all_sectors(void) { return region.sectors + 2 * region.slot; }

static void command(uint8_t code) {
    hal_flash_select(true);
    flash_byte(code);
}

static void order(uint8_t code) {
    command(code);
    flash_end();
}

static void command_at(uint8_t code, unsigned sector, unsigned at) {
    uint32_t address = (region.first + sector % all_sectors()) * FLASH_SECTOR + at;
    command(code);
    flash_byte((uint8_t)(address >> 16));
    flash_byte((uint8_t)(address >> 8));
    flash_byte((uint8_t)address);
}

bool flash_open(void (*between)(void)) {
    region = hal_flash_region_read();
    identity = 0;
    if (!region.sectors)
        return false;
    flash_byte(0xff); /* clocks while nothing is selected: the first ones may not come through */
    order(WAKE);
    command(IDENTIFY);
    for (unsigned i = 0; i < 3; i++)
        identity = identity << 8 | flash_byte(0);
    flash_end();
    uint32_t maker = identity >> 16, size = identity & 0xff; /* of 2**size bytes */
    if ((maker != 0xef && maker != 0x9d && maker != 0xc8) || size >= 25 ||
        (region.first + all_sectors()) * FLASH_SECTOR > 1u << size)
        return false;
    flash_settle(between);
    return true;
}

bool flash_busy(void) {
    command(STATUS);
    bool busy = flash_byte(0) & STATUS_BUSY;
    flash_end();
    return busy;
}

void flash_settle(void (*between)(void)) {
    uint32_t began = hal_cycle_low();
    while (flash_busy() && hal_cycle_low() - began < BUSY_S * hal_clock_hz())
        between();
}

void flash_read(unsigned sector, unsigned at) { command_at(READ, sector, at); }

__attribute__((noinline)) void flash_program(unsigned sector, unsigned at) {
    order(WRITE_ENABLE);
    command_at(PROGRAM, sector, at);
}

void flash_erase(unsigned sector) {
    order(WRITE_ENABLE);
    command_at(ERASE, sector, 0);
    flash_end();
}
