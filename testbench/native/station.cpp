// SPDX-License-Identifier: Apache-2.0
// The station for Python, the same in the native and in the cocotb simulation.
#include "station.hpp"

using bench::Station;

#pragma GCC visibility push(default)
extern "C" {

int station_set(Station* s, const char* name, double value) { return s->machine.set(name, value); }
int station_get(Station* s, const char* name, double* value) {
    return s->machine.get(name, *value);
}
plant::Flash* station_flash(Station* s) { return &s->machine.flash(); }
uint64_t station_clock(Station* s) { return s->clock; }
int32_t station_count(Station* s, int axis) { return s->machine.count(axis); }
// Returns whether there is a clock to run.
int station_arm(Station* s, uint64_t clocks, int until_byte) {
    s->arm(clocks, until_byte != 0);
    return s->clock < s->stop_at;
}

void station_send(Station* s, const uint8_t* data, uint64_t size) {
    s->serial.to_send.insert(s->serial.to_send.end(), data, data + size);
}
uint64_t station_waiting(Station* s) { return s->serial.received.size(); }
void station_receive(Station* s, uint8_t* out) {
    for (; !s->serial.received.empty(); s->serial.received.pop_front())
        *out++ = s->serial.received.front();
}
void station_send_broken(Station* s, uint8_t byte) {
    s->serial.to_send.push_back(static_cast<uint16_t>(byte | bench::BROKEN));
}
void station_damage(Station* s, uint64_t seed, const double* shares) {
    s->serial.damage(seed, shares);
}
uint64_t station_hits(Station* s) { return s->serial.hits.size(); }
void station_hit(Station* s, uint64_t index, uint64_t* out) {
    const bench::Hit& hit = s->serial.hits[index];
    out[0] = hit.harm;
    out[1] = hit.sent;
    out[2] = hit.came;
}
uint64_t station_framing_errors(Station* s) { return s->serial.framing_errors; }

uint64_t station_auxiliaries(Station* s) { return s->machine.auxiliaries().size(); }
void station_auxiliary(Station* s, uint64_t index, uint64_t* out) {
    const plant::Auxiliary& one = s->machine.auxiliaries()[index];
    out[0] = one.clock;
    out[1] = one.strobe;
    out[2] = one.code;
}

// What is left of a wire machine's workpiece; see Workpiece.
void station_extent(Station* s, int64_t* out) { s->machine.workpiece().extent(out); }
void station_left(Station* s, int64_t x, int64_t y, int64_t columns, int64_t rows, uint16_t* out) {
    s->machine.workpiece().copy(x, y, columns, rows, out);
}

// The walls of a sinker's cavity, layer by layer: depth of the lower end, and opening; see Cavity.
void station_keep_discharges(Station* s) { s->machine.keep_discharges(); }
plant::Cavity* station_cavity(Station* s) { return new plant::Cavity(s->machine.cavity()); }
plant::Cavity* station_cavity_with(Station* s, uint64_t count, const char* const* names,
                                   const double* values) {
    std::map<std::string, double> numbers;
    for (uint64_t i = 0; i < count; ++i)
        numbers[names[i]] = values[i];
    return new plant::Cavity(s->machine.cavity_with(numbers));
}
uint64_t cavity_layers(const plant::Cavity* c) { return c->layers(); }
void cavity_walls(const plant::Cavity* c, double* out) {
    for (size_t layer = 0; layer < c->layers(); ++layer) {
        *out++ = c->bottom_um(layer);
        *out++ = c->opening_um(layer);
    }
}
void cavity_free(plant::Cavity* c) { delete c; }

}  // extern "C"
#pragma GCC visibility pop
