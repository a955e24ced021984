// SPDX-License-Identifier: Apache-2.0
// The flash memory for Python, alone or in a station.
#include "flash.hpp"

using plant::Flash;

#pragma GCC visibility push(default)
extern "C" {

Flash* flash_create(uint64_t seed, double clock_hz) {
    auto* flash = new Flash(seed);
    flash->configure(clock_hz);
    return flash;
}
void flash_free(Flash* f) { delete f; }

// For firmware on a computer: order 0 deselects, 1 selects, 2 exchanges a byte.
uint8_t flash_order(Flash* f, uint64_t now, uint32_t order, uint8_t byte) {
    if (order == 2)
        return f->exchange(byte, now);
    f->select(order != 0, now);
    return 0;
}

void flash_read(const Flash* f, uint32_t at, uint64_t size, uint8_t* out) {
    for (uint64_t i = 0; i < size; ++i)
        out[i] = f->at(static_cast<uint32_t>(at + i));
}
void flash_write(Flash* f, uint32_t at, uint64_t size, const uint8_t* data) {
    for (uint64_t i = 0; i < size; ++i)
        f->put(static_cast<uint32_t>(at + i), data[i]);
}
void flash_cut(Flash* f, uint64_t now) { f->cut(now); }
void flash_cut_after(Flash* f, int64_t units) { f->cut_after(units); }
uint64_t flash_units(const Flash* f) { return f->units(); }
uint64_t flash_erasures(const Flash* f, uint32_t sector) { return f->erasures(sector); }

}  // extern "C"
#pragma GCC visibility pop
