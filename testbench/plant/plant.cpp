// SPDX-License-Identifier: Apache-2.0
#include "plant.hpp"

#include <array>
#include <cmath>

namespace plant {

namespace {

constexpr double PI = 3.14159265358979323846;
constexpr unsigned COMPARATORS = Gap::SHORT | Gap::CURRENT | Gap::ARC | Gap::HIGH;

// The tables of the three axes are alike.
template <typename Table>
OwnDrive own_drive(const Table& table, double pulses_per_mm) {
    auto pulses = [&](double mm) { return static_cast<int32_t>(std::lround(mm * pulses_per_mm)); };
    return {pulses_per_mm * table.pitch_mm / table.steps_per_turn,
            table.backlash_um / 1000 * pulses_per_mm,
            pulses(table.index_mm),
            pulses(table.index_at_mm),
            table.reversed != 0,
            table.screw_um_m * 1e-6,
            table.screw_wave_um / 1000 * pulses_per_mm,
            2 * PI / (table.screw_wave_mm * pulses_per_mm)};
}

}  // namespace

Plant::Plant(uint64_t seed)
    : parameters_(by_name(p_)), coder_lines_(seed), sinker_(seed, p_, gap_forces_),
      wire_(seed, p_, gap_forces_), flash_(seed), presses_(seed, 7) {
    for (auto& ends : switches_)
        for (auto& one : ends)
            one.share = presses_.uniform() - 0.5;
    auto& p = parameters_;
    p["force.short"] = &gap_forces_.short_;
    p["force.gap_um"] = &gap_forces_.gap_um;
    p["force.debris"] = &gap_forces_.debris;
    p["force.fluid_ohm_cm"] = &gap_forces_.fluid_ohm_cm;
    p["force.fluid_sensor"] = &force_fluid_sensor_;
    p["force.converter_silent"] = &force_converter_silent_;
    p["force.estop"] = &force_estop_;
    p["force.drive_fault"] = &force_drive_fault_;
    p["force.fluid_low"] = &force_fluid_low_;
    p["force.limit_low"] = &force_limit_low_;
    p["force.limit_high"] = &force_limit_high_;
    p["force.arm"] = &force_arm_;
    p["force.brown_out"] = &force_brown_out_;
    p["force.encoder_cut"] = &coder_lines_.force.cut;
    p["force.encoder_jump"] = &coder_lines_.force.jump;
    p["force.encoder_a_low"] = &coder_lines_.force.a_low;
    p["force.encoder_a_high"] = &coder_lines_.force.a_high;
    p["force.encoder_b_low"] = &coder_lines_.force.b_low;
    p["force.encoder_b_high"] = &coder_lines_.force.b_high;
    p["force.encoder_swap"] = &coder_lines_.force.swap;
    p["force.encoder_open"] = &coder_lines_.force.open;
    p["force.encoder_a_noise"] = &coder_lines_.force.a_noise;
    p["force.index_cut"] = &coder_lines_.force.index_cut;
    p["force.index_high"] = &coder_lines_.force.index_high;
    p["force.encoder_noise_hz"] = &coder_lines_.force.noise_hz;
    p["force.flash_absent"] = &force_flash_absent_;
    p["force.gate_stuck"] = &force_gate_stuck_;
    p["force.comparator_cut"] = &force_comparator_cut_;
    p["force.comparator_dead"] = &force_comparator_dead_;
    p["force.reference_cut"] = &force_reference_cut_;
    p["force.reference_swap"] = &force_reference_swap_;
    p["force.fin"] = &force_fin_;
    configure();
}

bool Plant::set(const std::string& name, double value) {
    const auto found = parameters_.find(name);
    if (found == parameters_.end())
        return false;
    *found->second = value;
    configure();
    return true;
}

bool Plant::get(const std::string& name, double& value) {
    const auto found = parameters_.find(name);
    if (found != parameters_.end()) {
        value = *found->second;
        return true;
    }
    catch_up();
    const std::map<std::string, double> readings = {
        {"read.gap_um", gap_->gap_um()},
        {"read.depth_um", sinker_.depth_um()},
        {"read.cavity_mm3", sinker_.cavity().volume_mm3()},
        {"read.debris", gap_->debris()},
        {"read.gap_v", gap_->voltage()},
        {"read.gap_v_clocks", gap_->voltage_sum()},
        {"read.gap_a", gap_->current()},
        {"read.fluid_ohm_cm", gap_->fluid_ohm_cm()},
        {"read.open_reference_v", reference_v(0)},
        {"read.arc_reference_v", reference_v(1)},
        {"read.short_reference_v", reference_v(2)},
        {"read.hazard_per_us", gap_->hazard_per_us()},
        {"read.bridged", gap_->bridged()},
        {"read.removed_mm3", gap_->removed_mm3()},
        {"read.spark_uj", gap_->spark_uj()},
        {"read.spark_uj2", gap_->spark_uj2()},
        {"read.sparks", static_cast<double>(gap_->sparks())},
        {"read.arcs", static_cast<double>(gap_->arcs())},
        {"read.bridges", static_cast<double>(gap_->bridges())},
        {"read.engagement", wire_.wire().engagement()},
        {"read.wire_a", wire_.wire().mean_a()},
        {"read.wire_broken", wire_.wire().broken()},
        {"read.wire_x_um", wire_.wire().x_um()},
        {"read.wire_y_um", wire_.wire().y_um()},
        {"read.taken_mm3", wire_.wire().workpiece().taken_um3() * 1e-9},
        {"read.missing_mm3",
         name == "read.missing_mm3" ? wire_.wire().workpiece().missing_um3() * 1e-9 : 0},
        {"read.state", static_cast<double>(gap_->state())},
        {"read.electrode_um", electrode_um()},
        {"read.x_speed_mm_s", axes_[0].speed()},
        {"read.y_speed_mm_s", axes_[1].speed()},
        {"read.z_speed_mm_s", axes_[Z].speed()},
        {"read.x_pulses", axes_[0].position()},
        {"read.y_pulses", axes_[1].position()},
        {"read.z_pulses", axes_[Z].position()},
        {"read.x_steps", static_cast<double>(axes_[0].steps())},
        {"read.y_steps", static_cast<double>(axes_[1].steps())},
        {"read.z_steps", static_cast<double>(axes_[Z].steps())},
    };
    const auto reading = readings.find(name);
    if (reading == readings.end())
        return false;
    value = reading->second;
    return true;
}

Cavity Plant::cavity_with(const std::map<std::string, double>& numbers) const {
    MachineParameters other = p_;
    const auto names = by_name(other);
    for (const auto& [name, value] : numbers)
        if (const auto found = names.find(name); found != names.end())
            *found->second = value;
    return cavity().again(other.cavity);
}

void Plant::configure() {
    catch_up();
    still_ = quiet_ = false;
    clocks_per_tick_ =
        std::max(1u, static_cast<unsigned>(std::lround(p_.tick_us * p_.clock_hz / 1e6)));
    const OwnDrive own[AXES] = {own_drive(p_.x, p_.pulses_per_mm), own_drive(p_.y, p_.pulses_per_mm),
                                own_drive(p_.z, p_.pulses_per_mm)};
    for (int axis = 0; axis < AXES; ++axis)
        axes_[axis].configure(p_.axis, own[axis], p_.pulses_per_mm, p_.clock_hz, clocks_per_tick_);
    gap_ = &sinker_;
    if (static_cast<MachineKind>(static_cast<int>(p_.kind)) == MachineKind::wire)
        gap_ = &wire_;
    gap_->configure();
    if (now_ == 0) {
        sinker_.start();
        wire_.start();
    }
    reference_one_v_ = p_.comparator.reference_full_v / clocks_per_tick_;
    for (auto& filter : filters_)
        filter.configure(p_.tick_us, p_.comparator.reference_rc_us);
    if (p_.comparator.fixed != 0)
        gap_->put_levels(p_.comparator.high_level_v, p_.comparator.arc_level_v,
                         p_.comparator.short_level_v);
    estop_ = force_estop_ != 0;
    arm_ = force_arm_ != 0;
    power_good_ = force_brown_out_ == 0;
    fluid_low_ = force_fluid_low_ != 0;
    faults();
    coder_lines_.configure(p_.clock_hz);
    flash_.configure(p_.clock_hz);
    silent_ = force_converter_silent_ != 0;
    stuck_ = static_cast<unsigned>(force_gate_stuck_);
    wires_cut_ = static_cast<unsigned>(force_comparator_cut_) & COMPARATORS;
    wires_dead_ = static_cast<unsigned>(force_comparator_dead_) & COMPARATORS;
    fin_stuck_ = force_fin_ != 0;
    between();
    limits();
    contact_ = gap_->contact();
    configured_ = true;
    lines_ = ~0u;
    look_at_gates();
}

// Sets the range in which an axis presses no switch, with a micrometre to spare.
void Plant::between() {
    const double margin_mm = (std::abs(p_.side.limit_scatter_um) / 2 + 1) / 1000;
    lowest_pulses_ = (p_.side.limit_low_mm + margin_mm) * p_.pulses_per_mm;
    highest_pulses_ = (p_.side.limit_high_mm - margin_mm) * p_.pulses_per_mm;
}

double Plant::electrode_um() const {
    return p_.initial_gap_um + axes_[Z].position() / p_.pulses_per_mm * 1000;
}

// While no coder changes, the axes go on only when their places are wanted.
void Plant::catch_up() {
    if (still_)
        for (auto& axis : axes_)
            axis.go(phase_ - caught_up_);
    caught_up_ = phase_;
}

// ---- what a clock seldom has to do

void Plant::switches(const FromController& from) {
    add_up();
    steps(from);
    gates(from);
    switched_ = from;
}

// Adds the ones of the DACs that came under one set of signs.
void Plant::add_up() {
    for (int axis = 0; axis < AXES; ++axis) {
        const int ones = counted(ones_, axis);
        sums_[axis] += switched_.dac_negative >> axis & 1 ? -ones : ones;
    }
    ones_ = 0;
}

// Rising edges of the step pins.
void Plant::steps(const FromController& from) {
    for (int axis = 0; axis < AXES; ++axis)
        if ((from.step & ~switched_.step) >> axis & 1)
            axes_[axis].step(from.dir >> axis & 1);
}

// The gates as the sources have them. A stuck gate stays on, at its last level. A shorted
// transistor has no level. The main contactor switches the main source.
void Plant::gates(const FromController& from) {
    if (from.gap_level != 0)
        level_ = from.gap_level;
    if (stuck_ == NONE)
        gap_->clock(from.gap_on && powered_, from.gap_sense, from.gap_level, from.gap_supply);
    else if (stuck_ == SENSING)
        gap_->clock(from.gap_on && powered_, true, from.gap_level, from.gap_supply);
    else
        gap_->clock(powered_, from.gap_sense, stuck_ == MAIN ? level_ : Gap::BARE, from.gap_supply);
}

bool Plant::moves(ToController& to) {
    bool turned = !coder_lines_.sound() || configured_;
    if (!still_)
        for (auto& axis : axes_)
            turned |= axis.clock();
    if (turned)
        coders(to);
    if (configured_)
        sides(to);
    configured_ = false;
    quiet_ = still_ && coder_lines_.sound();
    return turned;
}

void Plant::coders(ToController& to) {
    unsigned a = 0, b = 0, index = 0;
    for (int axis = 0; axis < AXES; ++axis) {
        a |= static_cast<unsigned>(axes_[axis].phase_a()) << axis;
        b |= static_cast<unsigned>(axes_[axis].phase_b()) << axis;
        index |= static_cast<unsigned>(axes_[axis].index()) << axis;
    }
    coder_lines_.clock(a, b, to.enc_a, to.enc_b);
    to.enc_index = coder_lines_.index(index);
}

void Plant::sides(ToController& to) const {
    to.estop = estop_;
    to.drive_fault = drive_fault_;
    to.limit_low = limit_low_;
    to.limit_high = limit_high_;
    to.fluid_low = fluid_low_;
    to.fin = fin_ | fin_stuck_;
    to.arm = arm_;
    to.power_good = power_good_;
}

void Plant::compares(ToController& to) {
    lines_ = gap_->lines();
    const unsigned lines = (lines_ | wires_cut_) & ~wires_dead_;
    to.gap_short = lines & Gap::SHORT ? 1 : 0;
    to.gap_current = lines & Gap::CURRENT ? 1 : 0;
    to.gap_arc = lines & Gap::ARC ? 1 : 0;
    to.gap_high = lines & Gap::HIGH ? 1 : 0;
    to.gap_noise = lines & Gap::NOISE ? 1 : 0;
}

// ---- ticks

void Plant::tick(const FromController& from) {
    catch_up();
    phase_ = caught_up_ = 0;
    const double dt = clocks_per_tick_ / p_.clock_hz;
    still_ = true;
    add_up();
    for (int axis = 0; axis < AXES; ++axis) {
        axes_[axis].dac(sums_[axis]);
        sums_[axis] = 0;
        axes_[axis].tick(from.drive_enable >> axis & 1);
        still_ = still_ && axes_[axis].stays();
    }
    quiet_ = still_ && coder_lines_.sound();
    gap_->tick({axes_[0].position() / p_.pulses_per_mm * 1000,
                axes_[1].position() / p_.pulses_per_mm * 1000, electrode_um()},
               dt);
    contact_ = gap_->contact();
    faults();
    levels();
    limits();
    side(from);
    contactor(from.contactor);
}

// The filters behind the three streams of the references, one step for the ones of a tick.
void Plant::levels() {
    auto cut = static_cast<unsigned>(force_reference_cut_);
    for (int i = 0; i < 3; ++i, cut >>= 1)
        filters_[i].step((cut & 1) != 0 ? 0 : counted(references_, i) * reference_one_v_);
    references_ = 0;
    // Open, arc and short level: none exchanged, the first two, first and last, or the last two.
    static constexpr std::array<std::array<unsigned, 3>, 4> AT{
        {{0, 1, 2}, {1, 0, 2}, {2, 1, 0}, {0, 2, 1}}};
    const auto& at = AT.at(static_cast<size_t>(force_reference_swap_) % AT.size());
    if (p_.comparator.fixed == 0)
        gap_->put_levels(reference_v(at[0]), reference_v(at[1]), reference_v(at[2]));
}

// Present code of one of the converter's channels.
unsigned Plant::sample(unsigned channel) const {
    if (channel == 0)
        return code(gap_->voltage() / p_.comparator.reference_full_v);
    if (channel == 1)
        return cell_code(p_.fluid, gap_->fluid_ohm_cm(), static_cast<int>(force_fluid_sensor_));
    return 0;
}

// The third drive of a wire machine moves the wire: it reports a fault when the wire breaks.
void Plant::faults() {
    const bool broken = gap_ == &wire_ && wire_.wire().broken();
    drive_fault_ = static_cast<uint8_t>(static_cast<unsigned>(force_drive_fault_) |
                                        static_cast<unsigned>(broken) << Z);
}

// Is a switch pressed, so far beyond its own place?
bool Plant::presses(Switch& one, double beyond_um) {
    const double at_um = one.share * p_.side.limit_scatter_um;
    if (!one.pressed) {
        one.pressed = beyond_um > at_um;
    } else if (beyond_um < at_um - p_.side.limit_hysteresis_um) {
        one.pressed = false;
        one.share = presses_.uniform() - 0.5;
    }
    return one.pressed;
}

void Plant::limits() {
    unsigned low = static_cast<unsigned>(force_limit_low_);
    unsigned high = static_cast<unsigned>(force_limit_high_);
    for (int axis = 0; axis < AXES; ++axis) {
        const double pulses = axes_[axis].position();
        auto& [lower, upper] = switches_[axis];
        if (!lower.pressed && !upper.pressed && pulses > lowest_pulses_ && pulses < highest_pulses_)
            continue;
        const double place = pulses / p_.pulses_per_mm;
        const double below_um = (p_.side.limit_low_mm - place) * 1000;
        const double above_um = (place - p_.side.limit_high_mm) * 1000;
        low |= static_cast<unsigned>(presses(lower, below_um)) << axis;
        high |= static_cast<unsigned>(presses(upper, above_um)) << axis;
    }
    limit_low_ = static_cast<uint8_t>(low);
    limit_high_ = static_cast<uint8_t>(high);
}

// The main contactor follows its coil after a while, both ways.
void Plant::contactor(bool coil) {
    if (coil == powered_) {
        contactor_wait_ms_ = 0;
        return;
    }
    contactor_wait_ms_ += p_.tick_us / 1000;
    if (contactor_wait_ms_ >= p_.side.contactor_ms) {
        powered_ = coil;
        look_at_gates();
    }
}

// The machine side answers a strobe with FIN after a while, and its end with the end of FIN.
void Plant::side(const FromController& from) {
    const bool strobe = from.auxiliary_strobe != 0;
    if (strobe == static_cast<bool>(fin_)) {
        fin_wait_us_ = 0;
        return;
    }
    if (strobe && fin_wait_us_ == 0)
        auxiliaries_.push_back({now_, from.auxiliary_strobe, from.auxiliary_code});
    fin_wait_us_ += p_.tick_us;
    if (fin_wait_us_ >= p_.side.fin_delay_us && p_.side.fin_answers != 0) {
        fin_ = strobe;
        fin_wait_us_ = 0;
    }
}

}  // namespace plant
