// SPDX-License-Identifier: Apache-2.0
#include "plant.hpp"

#include <cmath>

namespace plant {

Plant::Plant(uint64_t seed) : lines_(seed), gap_(seed), wire_(seed) {
    auto& p = parameters_;
    p["kind"] = &kind_;
    p["clock_hz"] = &clock_hz_;
    p["pulses_per_mm"] = &pulses_per_mm_;
    p["tick_us"] = &tick_us_;
    p["removal_scale"] = &process_.removal_scale;
    p["initial_gap_um"] = &process_.initial_gap_um;
    p["side.fin_delay_us"] = &fin_delay_us_;
    p["side.fin_answers"] = &fin_answers_;
    p["side.contactor_ms"] = &contactor_ms_;
    p["side.limit_low_mm"] = &limit_low_mm_;
    p["side.limit_high_mm"] = &limit_high_mm_;

    p["axis.full_speed_mm_s"] = &motor_.full_speed_mm_s;
    p["axis.max_speed_mm_s"] = &motor_.max_speed_mm_s;
    p["axis.max_acceleration_mm_s2"] = &motor_.max_acceleration_mm_s2;
    p["axis.speed_loop_ms"] = &motor_.speed_loop_ms;
    p["axis.current_loop_ms"] = &motor_.current_loop_ms;
    p["axis.filter_ms"] = &motor_.filter_ms;
    p["axis.brake_mm_s2"] = &motor_.brake_mm_s2;
    p["axis.step_gain_per_s"] = &motor_.step_gain_per_s;

    p["gap.area_mm2"] = &process_.area_mm2;
    p["gap.removal_mm3_min_a"] = &process_.removal_mm3_min_a;
    p["gap.removal_spread"] = &process_.removal_spread;
    p["gap.arc_removal"] = &process_.arc_removal;
    p["gap.ignition_gap_um"] = &process_.ignition_gap_um;
    p["gap.ignition_delay_us"] = &process_.ignition_delay_us;
    p["gap.ignition_slope_um"] = &process_.ignition_slope_um;
    p["gap.ignition_debris"] = &process_.ignition_debris;
    p["gap.ignition_power"] = &process_.ignition_power;
    p["gap.ignition_conductivity"] = &process_.ignition_conductivity;
    p["gap.ignition_law"] = &process_.ignition_law;
    p["gap.weibull_gap_um"] = &process_.weibull_gap_um;
    p["gap.weibull_width_um"] = &process_.weibull_width_um;
    p["gap.weibull_narrow_shape"] = &process_.weibull_narrow_shape;
    p["gap.weibull_wide_shape"] = &process_.weibull_wide_shape;
    p["gap.formative_us"] = &process_.formative_us;
    p["gap.contact_um"] = &process_.contact_um;
    p["gap.fluid_ohm_cm"] = &process_.fluid_ohm_cm;

    p["fluid.drift_end_ohm_cm"] = &process_.drift_end_ohm_cm;
    p["fluid.drift_s"] = &process_.drift_s;
    p["fluid.cell_per_cm"] = &cell_.cell_per_cm;
    p["fluid.cell_parallel_ohm"] = &cell_.cell_parallel_ohm;
    p["fluid.cell_series_ohm"] = &cell_.cell_series_ohm;

    p["source.open_v"] = &process_.open_v;
    p["source.supply_step_v"] = &process_.supply_step_v;
    p["source.negative_removal"] = &process_.negative_removal;
    p["source.rise_us"] = &process_.rise_us;
    p["source.fall_us"] = &process_.fall_us;
    p["source.source_ohm"] = &process_.source_ohm;
    p["source.step_a"] = &process_.step_a;
    p["source.burning_v"] = &process_.burning_v;
    p["source.burning_spread_v"] = &process_.burning_spread_v;
    p["source.arc_v"] = &process_.arc_v;
    p["source.arc_spread_v"] = &process_.arc_spread_v;
    p["source.short_v"] = &process_.short_v;
    p["source.short_ohm"] = &process_.short_ohm;
    p["source.sensing_v"] = &process_.sensing_v;
    p["source.sensing_a"] = &process_.sensing_a;
    p["comparator.fixed"] = &reference_fixed_;
    p["comparator.high_level_v"] = &high_level_v_;
    p["comparator.arc_level_v"] = &arc_level_v_;
    p["comparator.short_level_v"] = &short_level_v_;
    p["comparator.reference_full_v"] = &reference_full_v_;
    p["comparator.reference_rc_us"] = &reference_rc_us_;
    p["comparator.current_level_a"] = &process_.current_level_a;
    p["comparator.noise_miss"] = &process_.noise_miss;

    p["debris.time_s"] = &process_.debris_time_s;
    p["debris.depth_mm"] = &process_.debris_depth_mm;
    p["debris.exchange_depth_mm"] = &process_.exchange_depth_mm;
    p["debris.deionisation_us"] = &process_.deionisation_us;
    p["debris.deionisation_conductivity"] = &process_.deionisation_conductivity;
    p["debris.arc_share"] = &process_.arc_share;
    p["debris.single_short"] = &process_.single_short;
    p["debris.bridge_rate_per_s"] = &process_.bridge_rate_per_s;
    p["debris.bridge_gap_um"] = &process_.bridge_gap_um;
    p["debris.stretch_um"] = &process_.stretch_um;
    p["debris.stretch_depth_mm"] = &process_.stretch_depth_mm;
    p["debris.stretch_debris"] = &process_.stretch_debris;

    p["wire.diameter_mm"] = &cutting_.diameter_mm;
    p["wire.crater_us"] = &cutting_.crater_us;
    p["wire.deflection_um_a"] = &cutting_.deflection_um_a;
    p["wire.deflection_ms"] = &cutting_.deflection_ms;
    p["wire.break_a"] = &cutting_.break_a;
    p["wire.break_ms"] = &cutting_.break_ms;
    p["workpiece.thickness_mm"] = &cutting_.thickness_mm;
    p["workpiece.cell_um"] = &cutting_.cell_um;
    p["workpiece.start_x_mm"] = &cutting_.start_x_mm;
    p["workpiece.start_y_mm"] = &cutting_.start_y_mm;
    p["stock.kind"] = &stock_.kind;
    p["stock.edge_mm"] = &stock_.edge_mm;
    p["stock.hole_mm"] = &stock_.hole_mm;
    p["stock.size_x_mm"] = &stock_.size_x_mm;
    p["stock.size_y_mm"] = &stock_.size_y_mm;
    p["stock.steps"] = &stock_.steps;
    for (size_t i = 0; i < Stock::STEPS; ++i) {
        p["stock.at_mm_" + std::to_string(i)] = &stock_.at_mm[i];
        p["stock.width_um_" + std::to_string(i)] = &stock_.width_um[i];
    }
    p["gap.delay_square_us"] = &cutting_.delay_square_us;
    p["gap.delay_linear_us"] = &cutting_.delay_linear_us;
    p["gap.delay_constant_us"] = &cutting_.delay_constant_us;
    p["gap.delay_least_um"] = &cutting_.delay_least_um;
    p["gap.reach_um"] = &cutting_.reach_um;
    p["gap.engagement_um"] = &cutting_.engagement_um;
    p["debris.flow_mm3_s"] = &cutting_.flow_mm3_s;
    p["debris.flow_gap_um"] = &cutting_.flow_gap_um;
    p["debris.flow_debris"] = &cutting_.flow_debris;
    p["debris.flow_spread"] = &cutting_.flow_spread;
    p["debris.flow_time_s"] = &cutting_.flow_time_s;
    p["debris.clog_least"] = &cutting_.clog_least;
    p["debris.clog_per_um"] = &cutting_.clog_per_um;
    p["debris.clog_most"] = &cutting_.clog_most;
    p["debris.random_short_per_us"] = &cutting_.random_short_per_us;
    p["debris.random_short_um"] = &cutting_.random_short_um;
    p["debris.random_short_us"] = &cutting_.random_short_us;

    p["force.short"] = &gap_.force.short_;
    p["force.gap_um"] = &gap_.force.gap_um;
    p["force.debris"] = &gap_.force.debris;
    p["force.fluid_ohm_cm"] = &gap_.force.fluid_ohm_cm;
    p["force.fluid_sensor"] = &force_fluid_sensor_;
    p["force.converter_silent"] = &force_converter_silent_;
    p["force.estop"] = &force_estop_;
    p["force.drive_fault"] = &force_drive_fault_;
    p["force.fluid_low"] = &force_fluid_low_;
    p["force.limit_low"] = &force_limit_low_;
    p["force.limit_high"] = &force_limit_high_;
    p["force.arm"] = &force_arm_;
    p["force.brown_out"] = &force_brown_out_;
    p["force.encoder_cut"] = &lines_.force.cut;
    p["force.encoder_jump"] = &lines_.force.jump;
    p["force.encoder_a_low"] = &lines_.force.a_low;
    p["force.encoder_a_high"] = &lines_.force.a_high;
    p["force.encoder_b_low"] = &lines_.force.b_low;
    p["force.encoder_b_high"] = &lines_.force.b_high;
    p["force.encoder_swap"] = &lines_.force.swap;
    p["force.encoder_open"] = &lines_.force.open;
    p["force.encoder_a_noise"] = &lines_.force.a_noise;
    p["force.encoder_noise_hz"] = &lines_.force.noise_hz;
    p["force.gate_stuck"] = &force_gate_stuck_;
    p["force.comparator_cut"] = &force_comparator_cut_;
    p["force.comparator_dead"] = &force_comparator_dead_;
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
    const std::map<std::string, double> readings = {
        {"read.gap_um", gap_.gap_um()},
        {"read.depth_um", gap_.depth_um()},
        {"read.debris", gap_.debris()},
        {"read.gap_v", gap_.voltage()},
        {"read.gap_a", gap_.current()},
        {"read.fluid_ohm_cm", gap_.fluid_ohm_cm()},
        {"read.open_reference_v", reference_v_[0]},
        {"read.arc_reference_v", reference_v_[1]},
        {"read.short_reference_v", reference_v_[2]},
        {"read.hazard_per_us", gap_.hazard_per_us()},
        {"read.bridged", gap_.bridged()},
        {"read.removed_mm3", gap_.removed_mm3()},
        {"read.sparks", static_cast<double>(gap_.sparks())},
        {"read.arcs", static_cast<double>(gap_.arcs())},
        {"read.bridges", static_cast<double>(gap_.bridges())},
        {"read.engagement", wire_.engagement()},
        {"read.wire_a", wire_.mean_a()},
        {"read.wire_broken", wire_.broken()},
        {"read.wire_x_um", wire_.x_um()},
        {"read.wire_y_um", wire_.y_um()},
        {"read.taken_mm3", wire_.workpiece().taken_um3() * 1e-9},
        {"read.missing_mm3", name == "read.missing_mm3" ? wire_.workpiece().missing_um3() * 1e-9 : 0},
        {"read.state", static_cast<double>(gap_.state())},
        {"read.electrode_um", electrode_um()},
        {"read.x_speed_mm_s", axes_[0].speed()},
        {"read.y_speed_mm_s", axes_[1].speed()},
        {"read.z_speed_mm_s", axes_[Z].speed()},
        {"read.x_pulses", axes_[0].position()},
        {"read.y_pulses", axes_[1].position()},
        {"read.z_pulses", axes_[Z].position()},
    };
    const auto reading = readings.find(name);
    if (reading == readings.end())
        return false;
    value = reading->second;
    return true;
}

std::vector<std::string> Plant::names() const {
    std::vector<std::string> result;
    for (const auto& [name, _] : parameters_)
        result.push_back(name);
    return result;
}

void Plant::configure() {
    clocks_per_tick_ = std::max(1u, static_cast<unsigned>(std::lround(tick_us_ * clock_hz_ / 1e6)));
    for (auto& axis : axes_)
        axis.configure(motor_, pulses_per_mm_, clock_hz_, clocks_per_tick_);
    gap_.configure(process_, clock_hz_);
    cutting_.removal_scale = process_.removal_scale;
    wire_.configure(cutting_);
    if (now_ == 0)
        wire_.reset(stock_);
    gap_.put_wire(kind_ == 0 ? nullptr : &wire_);
    reference_one_v_ = reference_full_v_ / clocks_per_tick_;
    reference_step_ = 1 - std::exp(-tick_us_ / reference_rc_us_);
    if (reference_fixed_ != 0)
        gap_.put_levels(high_level_v_, arc_level_v_, short_level_v_);
    if (now_ == 0)
        gap_.put_electrode(process_.initial_gap_um);
    estop_ = force_estop_ != 0;
    arm_ = force_arm_ != 0;
    power_good_ = force_brown_out_ == 0;
    fluid_low_ = force_fluid_low_ != 0;
    faults();
    lines_.configure(clock_hz_);
    stuck_ = static_cast<unsigned>(force_gate_stuck_);
    wires_cut_ = static_cast<unsigned>(force_comparator_cut_);
    wires_dead_ = static_cast<unsigned>(force_comparator_dead_);
    limits();
}

double Plant::electrode_um() const {
    return process_.initial_gap_um + axes_[Z].position() / pulses_per_mm_ * 1000;
}

void Plant::tick(const FromController& from) {
    phase_ = 0;
    const double dt = clocks_per_tick_ / clock_hz_;
    moving_ = 0;
    for (int axis = 0; axis < AXES; ++axis) {
        axes_[axis].tick(from.drive_enable >> axis & 1);
        moving_ |= static_cast<unsigned>(!axes_[axis].resting()) << axis;
    }
    if (kind_ != 0)
        wire_.tick(axes_[0].position() / pulses_per_mm_ * 1000,
                   axes_[1].position() / pulses_per_mm_ * 1000, dt);
    gap_.tick(electrode_um(), dt);
    faults();
    levels();
    limits();
    side(from);
    contactor(from.contactor);
}

// The filters behind the three streams of the references, one step for the ones of a tick.
void Plant::levels() {
    for (auto& volts : reference_v_) {
        const auto ones = static_cast<double>(references_ & ((1u << COUNTER) - 1));
        volts += (ones * reference_one_v_ - volts) * reference_step_;
        references_ >>= COUNTER;
    }
    references_ = 0;
    if (reference_fixed_ == 0)
        gap_.put_levels(reference_v_[0], reference_v_[1], reference_v_[2]);
}

// Code of one of the converter's channels, as it is now.
unsigned Plant::sample(unsigned channel) const {
    if (channel == 0)
        return code(gap_.voltage() / reference_full_v_);
    if (channel == 1)
        return cell_code(cell_, gap_.fluid_ohm_cm(), static_cast<int>(force_fluid_sensor_));
    return 0;
}

// A wire machine's third drive is that of the wire: it reports a fault when the wire is broken.
void Plant::faults() {
    const bool broken = kind_ != 0 && wire_.broken();
    drive_fault_ = static_cast<uint8_t>(static_cast<unsigned>(force_drive_fault_) |
                                        static_cast<unsigned>(broken) << Z);
}

void Plant::limits() {
    unsigned low = static_cast<unsigned>(force_limit_low_);
    unsigned high = static_cast<unsigned>(force_limit_high_);
    for (int axis = 0; axis < AXES; ++axis) {
        const double place = axes_[axis].position() / pulses_per_mm_;
        low |= static_cast<unsigned>(place < limit_low_mm_) << axis;
        high |= static_cast<unsigned>(place > limit_high_mm_) << axis;
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
    contactor_wait_ms_ += tick_us_ / 1000;
    if (contactor_wait_ms_ >= contactor_ms_)
        powered_ = coil;
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
    fin_wait_us_ += tick_us_;
    if (fin_wait_us_ >= fin_delay_us_ && fin_answers_ != 0) {
        fin_ = strobe;
        fin_wait_us_ = 0;
    }
}

}  // namespace plant
