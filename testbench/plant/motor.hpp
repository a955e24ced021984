// SPDX-License-Identifier: Apache-2.0
// One axis: amplifier with speed loop, motor, screw and pulse coder.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>

#include "parameters.hpp"

namespace plant {

// What an axis has of its own, from its table of the machine's file.
struct OwnDrive {
    // Pulses. An edge of the coder, if there is one, is as long as a step.
    double pulses_per_step = 1, backlash = 0;
    int32_t turn = 0, index = 0;                // between two indices (0: none), and of one; pulses
    bool reversed = false;
    double slope = 0;                           // of the screw's error, pulses a pulse
    double wave = 0, per_pulse = 0;             // its amplitude, pulses; and phase, radians a pulse
};

// The speed loop closes the torque loop over an inertia:
//   tau_i dA/dt = clamp((U + offset - V) / tau_v, +-A_max) - A;  dV/dt = A - F;  dX/dt = V
// with U the velocity command behind the DAC's filter, tau_f dU/dt = full_speed * density - U,
// later by the dead time, and F the Coulomb friction, friction / tau_v against the motion: at rest
// it holds as much as it must.
// Between motor and axis there is play: the axis stays where it is until the motor has turned
// through it. A motor that goes up pushes it at once, one that goes down after the backlash.
// The screw takes the axis too far up by its error, slope x + wave sin(x per_pulse) at the place x of
// its nut. The coder is on the motor, and sees neither.
// Torque and speed advance once per tick, the position in every clock, at the speed of the tick.
class Motor {
public:
    void configure(const AxisParameters& p, const OwnDrive& own, double pulses_per_mm,
                   double clock_hz, unsigned clocks_per_tick) {
        p_ = p;
        own_ = own;
        turn(0);
        bound();
        pulses_per_mm_ = pulses_per_mm;
        clocks_ = clocks_per_tick;
        dt_ = clocks_per_tick / clock_hz;
        clock_s_ = 1 / clock_hz;
        filter_ = 1 - std::exp(-dt_ / (p.filter_ms * 1e-3));
        torque_ = 1 - std::exp(-dt_ / (p.current_loop_ms * 1e-3));
        friction_ = p.friction_mm_s / (p.speed_loop_ms * 1e-3);
        late_.assign(static_cast<size_t>(std::lround(p.dead_time_ms * 1e-3 / dt_)), 0.0);
    }

    // Before a tick: clocks in which the DAC's pin was high in it, those of a negative voltage off.
    void dac(int clocks) { sum_ = own_.reversed ? -clocks : clocks; }

    // The step pin, on its rising edge.
    void step(bool down) {
        stepping_ = true;
        steps_ += down != own_.reversed ? -1 : 1;
    }

    // Once per tick: the speed of the next one.
    void tick(bool enabled) {
        axis_ = nut();
        double command = p_.full_speed_mm_s * sum_ / clocks_;
        if (stepping_)
            command = (static_cast<double>(steps_) * own_.pulses_per_step - position_) /
                      pulses_per_mm_ * p_.step_gain_per_s;
        filtered_ += (command - filtered_) * filter_;
        double arrived = filtered_;
        if (!late_.empty()) {
            late_.push_back(filtered_);
            arrived = late_.front();
            late_.pop_front();
        }
        arrived += p_.offset_mm_s;
        if (enabled) {
            const double wanted = std::clamp((arrived - speed_) / (p_.speed_loop_ms * 1e-3),
                                             -p_.max_acceleration_mm_s2, p_.max_acceleration_mm_s2);
            acceleration_ += (wanted - acceleration_) * torque_;
            speed_ = std::clamp(slowed(speed_ + acceleration_ * dt_), -p_.max_speed_mm_s,
                                p_.max_speed_mm_s);
        } else {
            acceleration_ = 0;
            speed_ -= std::clamp(speed_, -p_.brake_mm_s2 * dt_, p_.brake_mm_s2 * dt_);
        }
        const bool resting = std::abs(speed_) < 1e-9 && std::abs(filtered_) < 1e-9 &&
                             p_.offset_mm_s == 0 && late_.empty();
        advance_ = resting ? 0 : speed_ * pulses_per_mm_ * clock_s_;
    }

    // Whether the coder stays as it is until the next tick. Then `go` may take the place of `clock`.
    bool stays() const {
        const double end = position_ + advance_ * clocks_;
        return std::max(position_, end) < upper_ - SURE && std::min(position_, end) > lower_ + SURE;
    }

    // So many clocks of a motor that stays.
    void go(unsigned clocks) {
        if (advance_ == 0)
            return;
        double position = position_;
        for (; clocks != 0; --clocks)
            position += advance_;
        position_ = position;
    }

    // Every clock; returns whether the coder may have changed: by one edge at most. The coder has a
    // hysteresis of a fifth of a pulse, so that an axis at rest on an edge does not chatter.
    bool clock() {
        position_ += advance_;
        if (position_ < upper_ && position_ >= lower_)
            return false;
        if (position_ >= static_cast<double>(count_ + 1))
            turn(1);
        else if (position_ < static_cast<double>(count_) - 0.2)
            turn(-1);
        if (own_.pulses_per_step == 1)
            edges_ = count_;
        else if (position_ >= (edges_ + 1) * own_.pulses_per_step)
            ++edges_;
        else if (position_ < edges_ * own_.pulses_per_step - 0.2)
            --edges_;
        bound();
        return true;
    }

    int32_t count() const { return count_; }          // place of the motor, pulses
    int64_t steps() const { return steps_; }          // up less down
    double position() const { return nut() + error(); } // of the axis, pulses
    double speed() const { return speed_; }           // mm/s
    double command() const { return filtered_; }      // mm/s: U above

    // Phases of the coder: A leads B on the way up.
    bool phase_a() const { return (edges_ & 3) == 1 || (edges_ & 3) == 2; }
    bool phase_b() const { return edges_ & 2; }
    // Its index, as wide as one count, at the same counts whichever way it turns.
    bool index() const { return index_; }

private:
    static constexpr double SURE = 1e-3;    // pulses; far more than a sum's rounding

    void turn(int32_t by) {
        count_ += by;
        index_ = own_.turn != 0 && (count_ - own_.index) % own_.turn == 0;
    }

    // The places between which neither count nor edge changes.
    void bound() {
        upper_ = std::min<double>(count_ + 1, (edges_ + 1) * own_.pulses_per_step);
        lower_ = std::max(static_cast<double>(count_) - 0.2,
                          edges_ * own_.pulses_per_step - 0.2);
    }

    // Place of the nut, which the motor has taken along within a tick: it turns one way in it.
    double nut() const { return std::clamp(axis_, position_, position_ + own_.backlash); }

    // A speed after a tick of friction, which never turns it round.
    double slowed(double speed) const {
        const double most = friction_ * dt_;
        return speed - std::clamp(speed, -most, most);
    }

    double error() const {
        if (own_.wave == 0)
            return own_.slope * nut();
        return own_.slope * nut() + own_.wave * std::sin(nut() * own_.per_pulse);
    }

    AxisParameters p_;
    OwnDrive own_;
    double pulses_per_mm_ = 10000, dt_ = 8e-6, clock_s_ = 5e-7, filter_ = 0, torque_ = 0;
    double friction_ = 0;               // mm/s2
    std::deque<double> late_;           // commands on their way, one a tick
    unsigned clocks_ = 16;
    int sum_ = 0;
    bool stepping_ = false;
    int64_t steps_ = 0;
    double filtered_ = 0, acceleration_ = 0, speed_ = 0, advance_ = 0;
    double position_ = 0, axis_ = 0;    // of the motor, and of the nut at the last tick, pulses
    double upper_ = 1, lower_ = -0.2;
    int32_t count_ = 0, edges_ = 0;
    bool index_ = false;
};

}  // namespace plant
