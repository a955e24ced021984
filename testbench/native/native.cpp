// SPDX-License-Identifier: Apache-2.0
// The controller with its station, as a library with a C interface for Python.
#include <cstddef>
#include <cstring>
#include <memory>
#include <vector>

#include "controller.hpp"  // made by testbench/native/controller.py
#include "pins.hpp"
#include "recorder.hpp"
#include "shorts.hpp"
#include "station.hpp"

#include "probes.inc"  // struct Probe, PROBES and snapshot: made from testbench/native/probes.py

namespace {

constexpr uint64_t STOPPING = 1;      // state of rtl/motion/retraction.py
constexpr uint64_t AFTER_SHORT = 60;  // rows of the trace for which an electrode is followed
constexpr size_t COLUMNS = 18;  // of the trace: see testbench/native/simulation.py

struct Change {
    uint64_t clock;
    int64_t value;
    uint32_t probe;
};

class Session {
public:
    explicit Session(uint64_t seed) : station_(seed) {
        bench::apply(controller_, to_, 1);
        controller_.settle();
    }

    bench::Station& station() { return station_; }

    // Words and their parities.
    void load(const uint32_t* words, const uint8_t* parities, size_t count) {
        for (size_t at = 0; at < count; ++at) {
            controller_.memory()[at] = words[at];
            controller_.parity()[at] = parities[at];
        }
        settle();
    }

    // Inverts one bit of a word of the memory, or its parity.
    void flip(size_t word, unsigned bit) {
        if (bit == 32)
            controller_.parity()[word] ^= 1;
        else
            controller_.memory()[word] ^= 1u << bit;
        settle();
    }

    void run(uint64_t clocks, bool until_byte) {
        station_.arm(clocks, until_byte);
        if (tapped_.empty() && waves.probes().empty())
            advance<false>();
        else
            advance<true>();
    }

    // Runs the netlist alone, on the inputs that another session has kept.
    void replay(const Session& other) {
        uint64_t clock = 0;
        for (const bench::Inputs& inputs : other.kept) {
            for (; clock < inputs.clock; ++clock)
                controller_.edge();
            bench::apply(controller_, inputs.to, inputs.rx);
        }
        for (; clock < other.station_.clock; ++clock)
            controller_.edge();
    }

    // The power of the controller is off for so many clocks, and comes back. The machine goes on
    // meanwhile with all outputs low: drives and gates off, the contactor open. Then the controller
    // is as after configuration, with a blank memory; bytes under way to it are lost.
    void power_off(uint64_t clocks) {
        const plant::FromController off;
        station_.machine.flash().cut(station_.machine.now());
        station_.serial.to_send.clear();
        station_.arm(clocks, false);
        for (uint8_t rx = 1; station_.clock < station_.stop_at;)
            station_.step(off, true, to_, rx);
        controller_ = *std::make_unique<Controller>();
        bench::apply(controller_, to_, 1);
        applied_ = to_;
        rx_ = 1;
        controller_.settle();
    }

    int64_t probe(size_t index) { return read(PROBES[index]); }
    void poke(size_t index, int64_t value) { PROBES[index].write(controller_, value); }

    // Inverts a bit of a register.
    void turn_over(size_t member, unsigned bit) {
        uint8_t& byte = *(reinterpret_cast<uint8_t*>(&controller_) + STATE[member].offset + bit / 8);
        byte ^= static_cast<uint8_t>(1u << bit % 8);
        settle();
    }

    void tap(const uint32_t* probes, size_t count) {
        tapped_.assign(probes, probes + count);
        last_.assign(count, INT64_MIN);
    }

    std::vector<Change> changes;
    std::vector<bench::Inputs> kept;
    bool keep = false;
    bench::Recorder waves;
    std::vector<double> trace;
    bench::Shorts shorts;
    uint64_t trace_period = 0;

    // A row of the trace every so many clocks; of the way after a short 16 rows in that time.
    void record(uint64_t period) {
        trace_period = period;
        shorts.configure(period / 16 + 1, AFTER_SHORT * period);
    }

private:
    // Called after a change from outside.
    void settle() {
        controller_.touch();
        controller_.settle();
    }

    template <bool TAPPED>
    void advance() {
        if (trace_period != 0 && trace.empty())
            sample_at_ = station_.clock;
        while (station_.clock < station_.stop_at) {
            if (trace_period != 0 && station_.clock >= sample_at_) {
                sample();
                sample_at_ += trace_period;
            }
            do {
                if (TAPPED)
                    look();
                clock();
            } while (station_.clock < station_.stop_at &&
                     (trace_period == 0 || station_.clock < sample_at_));
        }
    }

    [[gnu::always_inline]] void clock() {
        if (trace_period != 0 && shorts.sees(station_.machine.contact(), stopping()))
            follow();
        bench::outputs(controller_, from_);
        uint8_t rx = 1;
        const bool changed = station_.step(from_, controller_.tx(), to_, rx);
        controller_.edge();
        if (rx == rx_ && (!changed || std::memcmp(&applied_, &to_, sizeof to_) == 0))
            return;
        bench::apply(controller_, to_, rx);
        applied_ = to_;
        rx_ = rx;
        if (keep)
            kept.push_back({station_.clock, to_, rx});
    }

    bool stopping() const { return controller_.probe_path_status_state() == STOPPING; }

    void follow() {
        shorts.look(
            station_.clock, station_.machine.contact(), stopping(),
            controller_.probe_gap_status_shorted() != 0,
            [this] { return read(*path_); },
            [this](int axis) { return static_cast<double>(station_.machine.count(axis)); });
    }

    void look() {
        for (size_t i = 0; i < tapped_.size(); ++i) {
            const int64_t value = read(PROBES[tapped_[i]]);
            if (value == last_[i])
                continue;
            last_[i] = value;
            changes.push_back({station_.clock, value, tapped_[i]});
        }
        if (!waves.probes().empty()) {
            uint64_t values[WAVES];
            snapshot(controller_, station_.machine, values);
            waves.take(station_.clock, values);
        }
    }

    void sample() {
        const plant::Plant& machine = station_.machine;
        const double sum = machine.gap().voltage_sum();
        const double clocks = static_cast<double>(station_.clock - sampled_);
        double row[COLUMNS] = {static_cast<double>(station_.clock)};
        size_t at = 1;
        for (int axis = 0; axis < plant::AXES; ++axis)
            row[at++] = machine.count(axis);
        for (const char* name : {"axis_x_error", "axis_y_error", "axis_z_error", "path_position",
                                 "path_status_state", "gap_status_shorted", "gap_open_count",
                                 "gap_ok_count", "gap_dame_count", "gap_short_count"})
            row[at++] = static_cast<double>(named(name));
        row[at++] = clocks > 0 ? (sum - volts_) / clocks : 0;
        row[at++] = machine.gap().gap_um();
        row[at++] = machine.gap().debris();
        row[at++] = machine.gap().removed_mm3();
        volts_ = sum;
        sampled_ = station_.clock;
        trace.insert(trace.end(), row, row + COLUMNS);
    }

    int64_t read(const Probe& probe) const { return probe.read(controller_, station_.machine); }

    static const Probe* found(const char* name) {
        for (const Probe& probe : PROBES)
            if (!std::strcmp(probe.name, name))
                return &probe;
        return nullptr;
    }

    int64_t named(const char* name) const { return read(*found(name)); }

    const Probe* path_ = found("path_position");

    Controller controller_;
    bench::Station station_;
    plant::FromController from_;
    plant::ToController to_, applied_;
    uint8_t rx_ = 1;    // the controller has these two as its inputs
    std::vector<uint32_t> tapped_;
    std::vector<int64_t> last_;
    uint64_t sample_at_ = 0, sampled_ = 0;
    double volts_ = 0;
};

}  // namespace

#pragma GCC visibility push(default)
extern "C" {

void* gk_create(uint64_t seed) { return new Session(seed); }
void gk_free(Session* s) { delete s; }
void* gk_station(Session* s) { return &s->station(); }
void gk_load(Session* s, const uint32_t* words, const uint8_t* parities, uint64_t count) {
    s->load(words, parities, count);
}
void gk_flip(Session* s, uint64_t word, uint64_t bit) { s->flip(word, static_cast<unsigned>(bit)); }
void gk_run(Session* s, uint64_t clocks, int until_byte) { s->run(clocks, until_byte != 0); }
void gk_power_off(Session* s, uint64_t clocks) { s->power_off(clocks); }
void gk_keep(Session* s) { s->keep = true; }
void gk_replay(Session* s, const Session* other) { s->replay(*other); }
const bench::Inputs* gk_kept(const Session* s) { return s->kept.data(); }
uint64_t gk_kept_count(const Session* s) { return s->kept.size(); }
int64_t gk_probe(Session* s, uint64_t index) { return s->probe(index); }
void gk_poke(Session* s, uint64_t index, int64_t value) { s->poke(index, value); }

uint64_t gk_state(void) { return MEMBERS; }
const char* gk_state_name(uint64_t member) { return STATE[member].name; }
uint64_t gk_state_bits(uint64_t member) { return STATE[member].bits; }
void gk_turn_over(Session* s, uint64_t member, uint64_t bit) {
    s->turn_over(member, static_cast<unsigned>(bit));
}

void gk_trace_period(Session* s, uint64_t clocks) { s->record(clocks); }
uint64_t gk_shorts_rows(Session* s) { return s->shorts.rows.size() / bench::Shorts::COLUMNS; }
uint64_t gk_contact_clocks(Session* s) { return s->shorts.contact_clocks; }
void gk_shorts_read(Session* s, double* out) {
    std::memcpy(out, s->shorts.rows.data(), s->shorts.rows.size() * sizeof(double));
}
uint64_t gk_trace_rows(Session* s) { return s->trace.size() / COLUMNS; }
void gk_trace_read(Session* s, double* out) {
    std::memcpy(out, s->trace.data(), s->trace.size() * sizeof(double));
}

void gk_tap(Session* s, const uint32_t* probes, uint64_t count) { s->tap(probes, count); }
uint64_t gk_changes(Session* s) { return s->changes.size(); }
void gk_changes_take(Session* s, int64_t* out) {
    for (const Change& change : s->changes) {
        *out++ = static_cast<int64_t>(change.clock);
        *out++ = change.probe;
        *out++ = change.value;
    }
    s->changes.clear();
}
void gk_waves(Session* s, void* writer, uint64_t time, uint64_t value, uint64_t step) {
    s->waves.open(writer, time, value, step);
}
void gk_wave(Session* s, uint32_t probe, uint32_t low, uint32_t bits) {
    s->waves.add(probe, low, bits);
}

}  // extern "C"
#pragma GCC visibility pop
