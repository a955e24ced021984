// SPDX-License-Identifier: Apache-2.0
// The station of the native simulation, for bench.sv.
#include <svdpi.h>

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <vector>

#include "recorder.hpp"
#include "station.hpp"

#include "waves.inc"  // WAVES, PLACE and machine_values: made from testbench/native/probes.py

namespace {

std::unique_ptr<bench::Station> station;
plant::ToController inputs;

struct Watch {
    bool wanted = false, known = false;
    uint64_t last = 0;
};
struct Change {
    uint64_t clock, probe, value;
};
std::vector<Watch> watches;       // by probe
std::vector<uint64_t> watched;    // a bit for each, whose value is wanted in every clock
std::vector<Change> changes;
bench::Recorder recorder;
uint64_t values[WAVES];           // of the recorder, in this clock

void want(size_t probe) {
    if (watched.size() <= probe / 64)
        watched.resize(probe / 64 + 1);
    watched[probe / 64] |= uint64_t{1} << probe % 64;
}

class Unpacker {
public:
    explicit Unpacker(uint64_t word) : word_(word) {}
    uint64_t take(unsigned bits) {
        const uint64_t value = word_ & ((1ull << bits) - 1);
        word_ >>= bits;
        return value;
    }

private:
    uint64_t word_;
};

uint64_t packed(const plant::ToController& to, bool rx) {
    return static_cast<uint64_t>(rx) | static_cast<uint64_t>(to.enc_a) << 1 |
           static_cast<uint64_t>(to.enc_b) << 4 | static_cast<uint64_t>(to.gap_high) << 7 |
           static_cast<uint64_t>(to.gap_arc) << 8 | static_cast<uint64_t>(to.gap_short) << 9 |
           static_cast<uint64_t>(to.gap_current) << 10 | static_cast<uint64_t>(to.estop) << 11 |
           static_cast<uint64_t>(to.fluid_low) << 12 | static_cast<uint64_t>(to.fin) << 13 |
           static_cast<uint64_t>(to.drive_fault) << 14 |
           static_cast<uint64_t>(to.limit_low) << 17 | static_cast<uint64_t>(to.limit_high) << 20 |
           static_cast<uint64_t>(to.gap_noise) << 23 | static_cast<uint64_t>(to.adc_data) << 24 |
           static_cast<uint64_t>(to.arm) << 25 | static_cast<uint64_t>(to.power_good) << 26 |
           static_cast<uint64_t>(to.flash_data) << 27 | static_cast<uint64_t>(to.enc_index) << 28;
}

}  // namespace

extern "C" {

// For Python, before the first clock.
void* bench_station(uint64_t seed) {
    station = std::make_unique<bench::Station>(seed);
    return station.get();
}

void bench_watch(const uint32_t* probes, uint64_t count) {
    watches.clear();
    watched.clear();
    for (uint64_t i = 0; i < count; ++i) {
        const size_t at = probes[i];
        if (watches.size() <= at)
            watches.resize(at + 1);
        watches[at].wanted = true;
        want(at);
    }
    for (const uint32_t probe : recorder.probes())
        want(probe);
}
void bench_waves(void* writer, uint64_t time, uint64_t value, uint64_t step) {
    recorder.open(writer, time, value, step);
}
void bench_wave(uint32_t probe, uint32_t low, uint32_t bits) {
    recorder.add(probe, low, bits);
    want(probe);
}
void bench_waves_end() { recorder = {}; }
uint64_t bench_changes() { return changes.size(); }
void bench_changes_take(uint64_t* out) {
    for (const Change& change : changes) {
        *out++ = change.clock;
        *out++ = change.probe;
        *out++ = change.value;
    }
    changes.clear();
}

unsigned long long bench_watched(int word) {
    const size_t at = static_cast<size_t>(word);
    return at < watched.size() ? watched[at] : 0;
}

// Of a watched probe.
void bench_probe(int index, unsigned long long value) {
    const size_t at = static_cast<size_t>(index);
    if (PLACE[at] < WAVES)
        values[PLACE[at]] = value;
    if (at >= watches.size() || !watches[at].wanted)
        return;
    Watch& watch = watches[at];
    if (watch.known && watch.last == value)
        return;
    watch.known = true;
    watch.last = value;
    changes.push_back({station->clock, at, value});
}

unsigned long long bench_begin() { return packed(inputs, true); }

unsigned long long bench_clock(unsigned long long word) {
    if (!station) {
        std::fprintf(stderr, "the clock runs before Python has made the station\n");
        std::abort();
    }
    if (!recorder.probes().empty()) {
        machine_values(station->machine, values);
        recorder.take(station->clock, values);
    }
    Unpacker pins(word);
    plant::FromController from;
    from.dac = static_cast<uint8_t>(pins.take(3));
    from.dac_negative = static_cast<uint8_t>(pins.take(3));
    from.step = static_cast<uint8_t>(pins.take(3));
    from.dir = static_cast<uint8_t>(pins.take(3));
    from.drive_enable = static_cast<uint8_t>(pins.take(3));
    from.gap_on = static_cast<uint8_t>(pins.take(1));
    from.gap_sense = static_cast<uint8_t>(pins.take(1));
    from.gap_level = static_cast<uint8_t>(pins.take(6));
    from.auxiliary_strobe = static_cast<uint8_t>(pins.take(3));
    from.auxiliary_code = static_cast<uint16_t>(pins.take(16));
    from.safe = static_cast<uint8_t>(pins.take(1));
    const bool tx = pins.take(1) != 0;
    from.gap_reference = static_cast<uint8_t>(pins.take(3));
    from.gap_supply = static_cast<uint8_t>(pins.take(5));
    from.adc_select = static_cast<uint8_t>(pins.take(1));
    from.adc_clock = static_cast<uint8_t>(pins.take(1));
    from.adc_command = static_cast<uint8_t>(pins.take(1));
    from.contactor = static_cast<uint8_t>(pins.take(1));
    from.flash_select = static_cast<uint8_t>(pins.take(1));
    from.flash_clock = static_cast<uint8_t>(pins.take(1));
    from.flash_command = static_cast<uint8_t>(pins.take(1));
    uint8_t rx;
    station->step(from, tx, inputs, rx);
    const bool stop = station->clock == station->stop_at;
    return packed(inputs, rx != 0) | static_cast<uint64_t>(stop) << 63;
}

}  // extern "C"
