// SPDX-License-Identifier: Apache-2.0
// Generated from host/machines/machine_file.py by `python -m testbench.plant.generate`; do not edit.
#pragma once

#include <cstddef>
#include <map>
#include <string>

namespace plant {

enum class MachineKind { sinker, wire, cavity };  // `kind`
enum class AxisDac { sigma_delta, pwm };  // `axis.dac`
enum class XOutput { velocity, step };  // `x.output`
enum class YOutput { velocity, step };  // `y.output`
enum class ZOutput { velocity, step };  // `z.output`
enum class StockKind { solid, wall, circle, rectangle };  // `stock.kind`
enum class WorkShape { plane, block, hole, boss };  // `work.shape`

struct AxisParameters {
    // Velocity command, as pulses on a pin: `sigma_delta`, whose ripple lies at high frequencies,
    // or `pwm`, with a period of 1024 clocks, for amplifiers that want one. The gateware is built
    // for it.
    double dac = 0;
    // Speed at full scale of the converter, which is reached at 32 768 pulses of following error
    // Er. [mm/s]
    double full_speed_mm_s = 163.84;
    // Highest speed of the motor. [mm/s]
    double max_speed_mm_s = 60.0;
    // Highest acceleration, by the current limit of the amplifier. [mm/s²]
    double max_acceleration_mm_s2 = 5000.0;
    // Time constant of the speed loop. [ms]
    double speed_loop_ms = 3.0;
    // Time constant of the current loop. [ms]
    double current_loop_ms = 0.5;
    // Time constant of the low pass behind the converter. [ms]
    double filter_ms = 0.5;
    // Deceleration with the drive disabled. [mm/s²]
    double brake_mm_s2 = 8000.0;
    // Gain of the position loop of a stepping drive, if the axis is driven by step pulses. [1/s]
    double step_gain_per_s = 300.0;
    // Dead time of the amplifier. [ms]
    double dead_time_ms = 0.0;
    // Speed at which the drive moves with a command of zero. [mm/s]
    double offset_mm_s = 0.0;
    // Coulomb friction, as the speed by which the speed loop falls short of its command. [mm/s]
    double friction_mm_s = 0.0;
};

struct XParameters {
    // What drives the axis: `velocity`, a velocity command with a coder on the motor; or `step`,
    // steps and direction, without a coder.
    double output = 0;
    // Steps of a turn of the screw: full steps of the motor, times microsteps of its amplifier,
    // times the reduction. With a coder its edges of a turn, four for each line. At most 10 000 per
    // mm, and at least 500 of a coder.
    double steps_per_turn = 10000.0;
    // Travel of a turn of the screw. [mm]
    double pitch_mm = 1.0;
    // 1: the drive turns the other way, so its direction is inverted.
    double reversed = 0.0;
    // Travel between two indices of the coder, each as wide as a count; 0: it has none. [mm]
    double index_mm = 1.0;
    // Place of an index, from where the axis started. [mm]
    double index_at_mm = 0.4;
    // Play between drive and axis. The controller makes up for it. [µm]
    double backlash_um = 0.0;
    // Error of the simulated screw: how much too far up it takes the axis for each metre up from
    // where the axis started. [µm/m]
    double screw_um_m = 0.0;
    // Periodic error of that screw, its amplitude: a sine of the place, 0 at the start. [µm]
    double screw_wave_um = 0.0;
    // Wavelength of the periodic error. [mm]
    double screw_wave_mm = 5.0;
    // Place of its first point, in the machine frame. [mm]
    double pitch_from_mm = 0.0;
    // Distance of its points. [mm]
    double pitch_step_mm = 20.0;
    // Highest speed that the controller lets the axis have; 0: no own bound. [mm/min]
    double highest_mm_min = 0.0;
    // Lower soft limit, in the machine frame. [mm]
    double low_mm = -299.0;
    // Upper soft limit. [mm]
    double high_mm = 299.0;
};

struct YParameters {
    // What drives the axis: `velocity`, a velocity command with a coder on the motor; or `step`,
    // steps and direction, without a coder.
    double output = 0;
    // Steps of a turn of the screw: full steps of the motor, times microsteps of its amplifier,
    // times the reduction. With a coder its edges of a turn, four for each line. At most 10 000 per
    // mm, and at least 500 of a coder.
    double steps_per_turn = 10000.0;
    // Travel of a turn of the screw. [mm]
    double pitch_mm = 1.0;
    // 1: the drive turns the other way, so its direction is inverted.
    double reversed = 0.0;
    // Travel between two indices of the coder, each as wide as a count; 0: it has none. [mm]
    double index_mm = 1.0;
    // Place of an index, from where the axis started. [mm]
    double index_at_mm = 0.4;
    // Play between drive and axis. The controller makes up for it. [µm]
    double backlash_um = 0.0;
    // Error of the simulated screw: how much too far up it takes the axis for each metre up from
    // where the axis started. [µm/m]
    double screw_um_m = 0.0;
    // Periodic error of that screw, its amplitude: a sine of the place, 0 at the start. [µm]
    double screw_wave_um = 0.0;
    // Wavelength of the periodic error. [mm]
    double screw_wave_mm = 5.0;
    // Place of its first point, in the machine frame. [mm]
    double pitch_from_mm = 0.0;
    // Distance of its points. [mm]
    double pitch_step_mm = 20.0;
    // Highest speed that the controller lets the axis have; 0: no own bound. [mm/min]
    double highest_mm_min = 0.0;
    // Lower soft limit, in the machine frame. [mm]
    double low_mm = -299.0;
    // Upper soft limit. [mm]
    double high_mm = 299.0;
};

struct ZParameters {
    // What drives the axis: `velocity`, a velocity command with a coder on the motor; or `step`,
    // steps and direction, without a coder.
    double output = 0;
    // Steps of a turn of the screw: full steps of the motor, times microsteps of its amplifier,
    // times the reduction. With a coder its edges of a turn, four for each line. At most 10 000 per
    // mm, and at least 500 of a coder.
    double steps_per_turn = 10000.0;
    // Travel of a turn of the screw. [mm]
    double pitch_mm = 1.0;
    // 1: the drive turns the other way, so its direction is inverted.
    double reversed = 0.0;
    // Travel between two indices of the coder, each as wide as a count; 0: it has none. [mm]
    double index_mm = 1.0;
    // Place of an index, from where the axis started. [mm]
    double index_at_mm = 0.4;
    // Play between drive and axis. The controller makes up for it. [µm]
    double backlash_um = 0.0;
    // Error of the simulated screw: how much too far up it takes the axis for each metre up from
    // where the axis started. [µm/m]
    double screw_um_m = 0.0;
    // Periodic error of that screw, its amplitude: a sine of the place, 0 at the start. [µm]
    double screw_wave_um = 0.0;
    // Wavelength of the periodic error. [mm]
    double screw_wave_mm = 5.0;
    // Place of its first point, in the machine frame. [mm]
    double pitch_from_mm = 0.0;
    // Distance of its points. [mm]
    double pitch_step_mm = 20.0;
    // Highest speed that the controller lets the axis have; 0: no own bound. [mm/min]
    double highest_mm_min = 0.0;
    // Lower soft limit, in the machine frame. [mm]
    double low_mm = -299.0;
    // Upper soft limit. [mm]
    double high_mm = 299.0;
};

struct FluidParameters {
    // Resistivity to which the fluid goes, from `gap.fluid_ohm_cm`, by equal ratios in equal times.
    // [Ω cm]
    double drift_end_ohm_cm = 1000000000.0;
    // Time that it takes, of the machine's; 0: the fluid stays. [s]
    double drift_s = 0.0;
    // Constant of the conductivity cell. [1/cm]
    double cell_per_cm = 1.0;
    // Resistor parallel to the cell, so that a broken wire can be told from oil. [Ω]
    double cell_parallel_ohm = 1000000.0;
    // Resistor between the cell and the converter's supply. [Ω]
    double cell_series_ohm = 30000.0;
};

struct SourceParameters {
    // Open voltage with the supply's code at 0. [V]
    double open_v = 80.0;
    // Open voltage for each step of that code. [V]
    double supply_step_v = 20.0;
    // Removal with the electrode negative, as a share of that with it positive.
    double negative_removal = 0.5;
    // Time constant with which the open voltage rises. [µs]
    double rise_us = 0.2;
    // Time constant with which it falls after a pulse. [µs]
    double fall_us = 0.2;
    // Resistance of the source before ignition. [Ω]
    double source_ohm = 10.0;
    // Discharge current for each step of the current level. [A]
    double step_a = 1.5;
    // Burning voltage of a good discharge. [V]
    double burning_v = 25.0;
    // Its standard deviation. [V]
    double burning_spread_v = 1.5;
    // Burning voltage of an arc. [V]
    double arc_v = 17.0;
    // Its standard deviation. [V]
    double arc_spread_v = 0.7;
    // Contact drop of a short. [V]
    double short_v = 2.0;
    // Resistance of a short. [Ω]
    double short_ohm = 0.2;
    // Voltage of the sensing source, below the 60 V DC that may be touched. [V]
    double sensing_v = 24.0;
    // Highest current of the sensing source, by its resistor alone. [A]
    double sensing_a = 1.0;
};

struct RelaxationParameters {
    // Capacitor for each step of the current level, which chooses it here. 0: there is none, and
    // the discharges have `source.step_a`. [nF]
    double step_nf = 0.0;
    // Resistor through which it is charged. [Ω]
    double charging_ohm = 20.0;
    // Resistor through which a transistor empties it while the gate is off. [Ω]
    double emptying_ohm = 2.0;
    // Stray inductance of the leads from it to the gap: with the capacitor it gives the time of the
    // discharge, half a period. [nH]
    double inductance_nh = 500.0;
};

struct ComparatorParameters {
    // 1: the comparators have the levels below; 0: those that the controller's reference pins give,
    // filtered.
    double fixed = 0.0;
    // Level of an open gap. [V]
    double high_level_v = 60.0;
    // Level below which a discharge is an arc. [V]
    double arc_level_v = 20.0;
    // Level below which the gap is shorted. [V]
    double short_level_v = 12.0;
    // Level of the current, which sees what leaks through the fluid as well. [A]
    double current_level_a = 0.5;
    // The same while the gate of the sensing source is on: that gate lowers the level. [A]
    double sensing_level_a = 0.5;
    // Gap voltage that a reference pin stands for if it is always high, and full scale of the
    // converter. [V]
    double reference_full_v = 100.0;
    // Time constant of the filter behind each reference pin. After a change of a reference the
    // controller waits 4.6 times as long before the first discharge pulse, unless levels are fixed.
    // [µs]
    double reference_rc_us = 200.0;
    // Share of the sparks whose noise the detector misses.
    double noise_miss = 0.01;
};

struct SideParameters {
    // Time from the strobe of an auxiliary function to its FIN. [µs]
    double fin_delay_us = 2000.0;
    // 1: the machine side answers with FIN; 0: never.
    double fin_answers = 1.0;
    // Time that the main contactor takes to close, and to open. [ms]
    double contactor_ms = 20.0;
    // Place of every axis's lower limit switch, from where the axis started. [mm]
    double limit_low_mm = -300.0;
    // Place of the upper limit switch. [mm]
    double limit_high_mm = 300.0;
    // Each time, a limit switch is pressed at another place: anywhere, equally likely, in a width
    // of this about its own. [µm]
    double limit_scatter_um = 10.0;
    // It is released so much further back than it was pressed. [µm]
    double limit_hysteresis_um = 50.0;
};

struct GapParameters {
    // What an arc removes, as a share of a good discharge.
    double arc_removal = 0.2;
    // Debris helps ignition: the mean delay is divided by 1 + this times the debris.
    double ignition_debris = 4.0;
    // Voltage helps ignition: the mean delay is divided by the gap's voltage over `source.open_v`,
    // to this power.
    double ignition_power = 4.0;
    // A conducting fluid helps ignition: the mean delay is divided by 10⁶ Ω cm over the fluid's
    // resistivity, to this power; never by less than 1.
    double ignition_conductivity = 0.3;
    // Distribution of the delay: 0 exponential, 1 a mixture of two Weibull distributions.
    double ignition_law = 0.0;
    // Gap in the middle between the two Weibull distributions. [µm]
    double weibull_gap_um = 30.0;
    // Width of gap over which one distribution changes into the other. [µm]
    double weibull_width_um = 4.0;
    // Weibull shape of a narrow gap.
    double weibull_narrow_shape = 0.8;
    // Weibull shape of a wide gap.
    double weibull_wide_shape = 1.6;
    // Time from the start of a pulse in which nothing ignites, except arcs. [µs]
    double formative_us = 0.5;
    // Gap below which electrode and workpiece touch. [µm]
    double contact_um = 2.0;
    // Resistivity of the fluid when the program starts. [Ω cm]
    double fluid_ohm_cm = 1000000000.0;
    // Area of the electrode. [mm²]
    double area_mm2 = 100.0;
    // Removal for each ampere of mean current. [mm³/(min A)]
    double removal_mm3_min_a = 5.0;
    // Spread of the craters: standard deviation over mean.
    double removal_spread = 0.25;
    // Gap at which the mean delay is `ignition_delay_us`. [µm]
    double ignition_gap_um = 40.0;
    // Mean delay of ignition at that gap. [µs]
    double ignition_delay_us = 60.0;
    // Width of gap for which the mean delay grows e-fold. [µm]
    double ignition_slope_um = 12.0;
    // Mean delay of ignition is (this g² + `delay_linear_us` g + `delay_constant_us`) / ln 2 at a
    // gap g in µm that faces half of the wire's surface. [µs/µm²]
    double delay_square_us = 0.48;
    // Linear coefficient of that delay. [µs/µm]
    double delay_linear_us = -3.69;
    // Constant term of that delay. [µs]
    double delay_constant_us = 14.05;
    // Gap below which the mean delay stays the same. [µm]
    double delay_least_um = 3.84;
    // Gap across which nothing ignites any more. [µm]
    double reach_um = 80.0;
    // Discharges are e times rarer for each such increase of the gap over its narrowest place; 0:
    // they occur at the narrowest place only. [µm]
    double engagement_um = 4.0;
};

struct DebrisParameters {
    // Time constant with which the channel of a discharge deionises. [µs]
    double deionisation_us = 15.0;
    // It is longer by this part for each decade of the fluid's resistivity below 10⁶ Ω cm.
    double deionisation_conductivity = 0.3;
    // Share of the ignitions without a pause that become arcs, for each unit of debris.
    double arc_share = 1.0;
    // Share of the pulses that are shorted singly, for each unit of debris.
    double single_short = 0.02;
    // Width of gap for which shorts by debris become e times rarer. [µm]
    double bridge_gap_um = 25.0;
    // Mean way back that ends such a short; of a sinker, at the surface. [µm]
    double stretch_um = 60.0;
    // Time constant of the flushing at the surface, before it is speeded up. [s]
    double time_s = 3.0;
    // Depth at which the flushing takes twice as long. [mm]
    double depth_mm = 1.0;
    // Of the fluid that a lift draws in, gap / (gap + depth / this) is fresh. [mm]
    double exchange_depth_mm = 1.0;
    // Rate of bridges in a closed gap, for each square of debris, before it is speeded up. [1/s]
    double bridge_rate_per_s = 2.0;
    // Depth at which breaking a bridge takes twice the lift. [mm]
    double stretch_depth_mm = 1.0;
    // Breaking a bridge takes 1 + this times the debris as much lift.
    double stretch_debris = 1.0;
    // Fluid through a gap of `flow_gap_um` or more. [mm³/s]
    double flow_mm3_s = 3.0;
    // Gap below which the flow goes with the cube of the width. [µm]
    double flow_gap_um = 25.0;
    // The flow is e times less for debris of 1 over this number.
    double flow_debris = 3.0;
    // The flow drifts: standard deviation of its logarithm.
    double flow_spread = 0.0;
    // Time for which the flow is much the same, before it is speeded up. [s]
    double flow_time_s = 5.0;
    // Debris beyond which a gap of width 0 is shorted.
    double clog_least = 0.3;
    // Increase of that debris for each µm of gap. [1/µm]
    double clog_per_um = 0.02;
    // Debris beyond which a gap of any width is shorted.
    double clog_most = 0.95;
    // Rate of other shorts in a gap of width 0. [1/µs]
    double random_short_per_us = 0.001;
    // Gap from which on there are no such shorts. [µm]
    double random_short_um = 40.0;
    // How long such a short lasts. [µs]
    double random_short_us = 100.0;
};

struct WorkParameters {
    // `plane`: endless, as far as the axes go. `block`: square, its sides along X and Y. `hole`: a
    // round hole in an endless work. `boss`: round, on an endless base.
    double shape = 0;
    // X of the middle of a block, hole or boss, from where the electrode starts. [mm]
    double centre_x_mm = 8.0;
    // Y of it. [mm]
    double centre_y_mm = -5.0;
    // Side of a block; diameter of a hole or boss. [mm]
    double size_mm = 20.0;
    // Depth of a hole; height of a block or boss above what it stands on. [mm]
    double depth_mm = 10.0;
    // Diameter of the electrode, as it touches. [mm]
    double electrode_mm = 11.284;
};

struct WireParameters {
    // Diameter. [mm]
    double diameter_mm = 0.2;
    // Discharge duration for which the table of craters holds; others are scaled by energy. [µs]
    double crater_us = 3.0;
    // Bending of the wire, away from the discharges, for each ampere of mean current. [µm/A]
    double deflection_um_a = 0.5;
    // Time constant of the bending. [ms]
    double deflection_ms = 5.0;
    // Mean current of good discharges and arcs at which the wire breaks (0: never); the third drive
    // then reports a fault. [A]
    double break_a = 5.0;
    // Time over which that mean is taken. [ms]
    double break_ms = 20.0;
};

struct WorkpieceParameters {
    // Thickness. [mm]
    double thickness_mm = 10.0;
    // Side of the cells of the plan view in which its material is counted. [µm]
    double cell_um = 2.0;
    // X of the wire when the program starts, from the workpiece's zero, which is the program's.
    // [mm]
    double start_x_mm = 0.0;
    // Y of the wire when the program starts. [mm]
    double start_y_mm = 0.0;
};

struct StockParameters {
    // `solid`: a plate from X = `edge_mm` on. `wall`: along X, its finished surface at Y 0 and the
    // workpiece at Y above. `circle`: a punch about zero, of diameter `size_x_mm`; its contour
    // begins at +X. `rectangle`: one of `size_x_mm` by `size_y_mm`; its contour begins at the lower
    // left corner. Contours go counter-clockwise.
    double kind = 0;
    // X of a solid plate's edge. [mm]
    double edge_mm = 0.13;
    // Diameter of a hole about the wire's start; 0: none. [mm]
    double hole_mm = 0.0;
    // Size of a punch along X. [mm]
    double size_x_mm = 5.0;
    // Size of a rectangle along Y. [mm]
    double size_y_mm = 5.0;
    static constexpr std::size_t STEPS = 16;
    // What a first cut has left on the surface of a wall or a punch: pairs of a place along the
    // contour (mm) and the width from there on (µm). Before the first place it is the first width.
    double steps = 0;
    double at_mm[STEPS] = {}, width_um[STEPS] = {};
};

struct CavityParameters {
    // Perimeter of the electrode, which is convex. [mm]
    double perimeter_mm = 40.0;
    // Thickness of the layers in which the walls are counted. [µm]
    double layer_um = 100.0;
    // Overcut on each side of discharges of `reference_a` that burn for `reference_us`. [µm]
    double overcut_um = 40.0;
    // Current that this overcut is for. [A]
    double reference_a = 10.0;
    // Duration of a discharge that it is for. [µs]
    double reference_us = 100.0;
    // The overcut goes with the current to this power.
    double current_power = 0.29;
    // And with the duration to this power.
    double time_power = 0.38;
    // Share of a discharge that a wall gets for each unit of debris, area for area with the front,
    // where the wall is as far off as the overcut.
    double wall_debris = 0.05;
    // It is e times less for each such distance that the wall is further off. [µm]
    double slope_um = 12.0;
};

// All that a machine's file says of it.
struct MachineParameters {
    // Clock of the simulated controller. A board runs at 25 MHz or more; a slow clock simulates
    // faster. [Hz]
    double clock_hz = 2000000.0;
    // Pulses of a millimetre of the path, for which the gateware is built. A pulse is an edge of
    // the coder, too; a step has its own size, see `[x]`. [1/mm]
    double pulses_per_mm = 10000.0;
    // Step of the slow physics: motors, debris, shorts. [µs]
    double tick_us = 8.0;
    // Number of real discharges for which each simulated one stands. Flushing goes as much faster;
    // axes do not.
    double removal_scale = 60.0;
    // Highest discharge current: as many whole steps of `source.step_a` as are in it, 63 at most,
    // are what the gateware is built for, and no register exceeds them. [A]
    double current_max_a = 30.0;
    // What moves: the electrode of a sinker, without or with side walls (`cavity`), or a wire;
    // `sinker` if not given.
    double kind = 0;
    // Height of the electrode above the top of the workpiece when the program starts. [µm]
    double initial_gap_um = 100.0;
    AxisParameters axis;
    XParameters x;
    YParameters y;
    ZParameters z;
    FluidParameters fluid;
    SourceParameters source;
    RelaxationParameters relaxation;
    ComparatorParameters comparator;
    SideParameters side;
    GapParameters gap;
    DebrisParameters debris;
    WorkParameters work;
    WireParameters wire;
    WorkpieceParameters workpiece;
    StockParameters stock;
    CavityParameters cavity;
};

// Every number by its name.
inline std::map<std::string, double*> by_name(MachineParameters& p) {
    std::map<std::string, double*> names = {
        {"clock_hz", &p.clock_hz},
        {"pulses_per_mm", &p.pulses_per_mm},
        {"tick_us", &p.tick_us},
        {"removal_scale", &p.removal_scale},
        {"current_max_a", &p.current_max_a},
        {"kind", &p.kind},
        {"initial_gap_um", &p.initial_gap_um},
        {"axis.dac", &p.axis.dac},
        {"axis.full_speed_mm_s", &p.axis.full_speed_mm_s},
        {"axis.max_speed_mm_s", &p.axis.max_speed_mm_s},
        {"axis.max_acceleration_mm_s2", &p.axis.max_acceleration_mm_s2},
        {"axis.speed_loop_ms", &p.axis.speed_loop_ms},
        {"axis.current_loop_ms", &p.axis.current_loop_ms},
        {"axis.filter_ms", &p.axis.filter_ms},
        {"axis.brake_mm_s2", &p.axis.brake_mm_s2},
        {"axis.step_gain_per_s", &p.axis.step_gain_per_s},
        {"axis.dead_time_ms", &p.axis.dead_time_ms},
        {"axis.offset_mm_s", &p.axis.offset_mm_s},
        {"axis.friction_mm_s", &p.axis.friction_mm_s},
        {"x.output", &p.x.output},
        {"x.steps_per_turn", &p.x.steps_per_turn},
        {"x.pitch_mm", &p.x.pitch_mm},
        {"x.reversed", &p.x.reversed},
        {"x.index_mm", &p.x.index_mm},
        {"x.index_at_mm", &p.x.index_at_mm},
        {"x.backlash_um", &p.x.backlash_um},
        {"x.screw_um_m", &p.x.screw_um_m},
        {"x.screw_wave_um", &p.x.screw_wave_um},
        {"x.screw_wave_mm", &p.x.screw_wave_mm},
        {"x.pitch_from_mm", &p.x.pitch_from_mm},
        {"x.pitch_step_mm", &p.x.pitch_step_mm},
        {"x.highest_mm_min", &p.x.highest_mm_min},
        {"x.low_mm", &p.x.low_mm},
        {"x.high_mm", &p.x.high_mm},
        {"y.output", &p.y.output},
        {"y.steps_per_turn", &p.y.steps_per_turn},
        {"y.pitch_mm", &p.y.pitch_mm},
        {"y.reversed", &p.y.reversed},
        {"y.index_mm", &p.y.index_mm},
        {"y.index_at_mm", &p.y.index_at_mm},
        {"y.backlash_um", &p.y.backlash_um},
        {"y.screw_um_m", &p.y.screw_um_m},
        {"y.screw_wave_um", &p.y.screw_wave_um},
        {"y.screw_wave_mm", &p.y.screw_wave_mm},
        {"y.pitch_from_mm", &p.y.pitch_from_mm},
        {"y.pitch_step_mm", &p.y.pitch_step_mm},
        {"y.highest_mm_min", &p.y.highest_mm_min},
        {"y.low_mm", &p.y.low_mm},
        {"y.high_mm", &p.y.high_mm},
        {"z.output", &p.z.output},
        {"z.steps_per_turn", &p.z.steps_per_turn},
        {"z.pitch_mm", &p.z.pitch_mm},
        {"z.reversed", &p.z.reversed},
        {"z.index_mm", &p.z.index_mm},
        {"z.index_at_mm", &p.z.index_at_mm},
        {"z.backlash_um", &p.z.backlash_um},
        {"z.screw_um_m", &p.z.screw_um_m},
        {"z.screw_wave_um", &p.z.screw_wave_um},
        {"z.screw_wave_mm", &p.z.screw_wave_mm},
        {"z.pitch_from_mm", &p.z.pitch_from_mm},
        {"z.pitch_step_mm", &p.z.pitch_step_mm},
        {"z.highest_mm_min", &p.z.highest_mm_min},
        {"z.low_mm", &p.z.low_mm},
        {"z.high_mm", &p.z.high_mm},
        {"fluid.drift_end_ohm_cm", &p.fluid.drift_end_ohm_cm},
        {"fluid.drift_s", &p.fluid.drift_s},
        {"fluid.cell_per_cm", &p.fluid.cell_per_cm},
        {"fluid.cell_parallel_ohm", &p.fluid.cell_parallel_ohm},
        {"fluid.cell_series_ohm", &p.fluid.cell_series_ohm},
        {"source.open_v", &p.source.open_v},
        {"source.supply_step_v", &p.source.supply_step_v},
        {"source.negative_removal", &p.source.negative_removal},
        {"source.rise_us", &p.source.rise_us},
        {"source.fall_us", &p.source.fall_us},
        {"source.source_ohm", &p.source.source_ohm},
        {"source.step_a", &p.source.step_a},
        {"source.burning_v", &p.source.burning_v},
        {"source.burning_spread_v", &p.source.burning_spread_v},
        {"source.arc_v", &p.source.arc_v},
        {"source.arc_spread_v", &p.source.arc_spread_v},
        {"source.short_v", &p.source.short_v},
        {"source.short_ohm", &p.source.short_ohm},
        {"source.sensing_v", &p.source.sensing_v},
        {"source.sensing_a", &p.source.sensing_a},
        {"relaxation.step_nf", &p.relaxation.step_nf},
        {"relaxation.charging_ohm", &p.relaxation.charging_ohm},
        {"relaxation.emptying_ohm", &p.relaxation.emptying_ohm},
        {"relaxation.inductance_nh", &p.relaxation.inductance_nh},
        {"comparator.fixed", &p.comparator.fixed},
        {"comparator.high_level_v", &p.comparator.high_level_v},
        {"comparator.arc_level_v", &p.comparator.arc_level_v},
        {"comparator.short_level_v", &p.comparator.short_level_v},
        {"comparator.current_level_a", &p.comparator.current_level_a},
        {"comparator.sensing_level_a", &p.comparator.sensing_level_a},
        {"comparator.reference_full_v", &p.comparator.reference_full_v},
        {"comparator.reference_rc_us", &p.comparator.reference_rc_us},
        {"comparator.noise_miss", &p.comparator.noise_miss},
        {"side.fin_delay_us", &p.side.fin_delay_us},
        {"side.fin_answers", &p.side.fin_answers},
        {"side.contactor_ms", &p.side.contactor_ms},
        {"side.limit_low_mm", &p.side.limit_low_mm},
        {"side.limit_high_mm", &p.side.limit_high_mm},
        {"side.limit_scatter_um", &p.side.limit_scatter_um},
        {"side.limit_hysteresis_um", &p.side.limit_hysteresis_um},
        {"gap.arc_removal", &p.gap.arc_removal},
        {"gap.ignition_debris", &p.gap.ignition_debris},
        {"gap.ignition_power", &p.gap.ignition_power},
        {"gap.ignition_conductivity", &p.gap.ignition_conductivity},
        {"gap.ignition_law", &p.gap.ignition_law},
        {"gap.weibull_gap_um", &p.gap.weibull_gap_um},
        {"gap.weibull_width_um", &p.gap.weibull_width_um},
        {"gap.weibull_narrow_shape", &p.gap.weibull_narrow_shape},
        {"gap.weibull_wide_shape", &p.gap.weibull_wide_shape},
        {"gap.formative_us", &p.gap.formative_us},
        {"gap.contact_um", &p.gap.contact_um},
        {"gap.fluid_ohm_cm", &p.gap.fluid_ohm_cm},
        {"gap.area_mm2", &p.gap.area_mm2},
        {"gap.removal_mm3_min_a", &p.gap.removal_mm3_min_a},
        {"gap.removal_spread", &p.gap.removal_spread},
        {"gap.ignition_gap_um", &p.gap.ignition_gap_um},
        {"gap.ignition_delay_us", &p.gap.ignition_delay_us},
        {"gap.ignition_slope_um", &p.gap.ignition_slope_um},
        {"gap.delay_square_us", &p.gap.delay_square_us},
        {"gap.delay_linear_us", &p.gap.delay_linear_us},
        {"gap.delay_constant_us", &p.gap.delay_constant_us},
        {"gap.delay_least_um", &p.gap.delay_least_um},
        {"gap.reach_um", &p.gap.reach_um},
        {"gap.engagement_um", &p.gap.engagement_um},
        {"debris.deionisation_us", &p.debris.deionisation_us},
        {"debris.deionisation_conductivity", &p.debris.deionisation_conductivity},
        {"debris.arc_share", &p.debris.arc_share},
        {"debris.single_short", &p.debris.single_short},
        {"debris.bridge_gap_um", &p.debris.bridge_gap_um},
        {"debris.stretch_um", &p.debris.stretch_um},
        {"debris.time_s", &p.debris.time_s},
        {"debris.depth_mm", &p.debris.depth_mm},
        {"debris.exchange_depth_mm", &p.debris.exchange_depth_mm},
        {"debris.bridge_rate_per_s", &p.debris.bridge_rate_per_s},
        {"debris.stretch_depth_mm", &p.debris.stretch_depth_mm},
        {"debris.stretch_debris", &p.debris.stretch_debris},
        {"debris.flow_mm3_s", &p.debris.flow_mm3_s},
        {"debris.flow_gap_um", &p.debris.flow_gap_um},
        {"debris.flow_debris", &p.debris.flow_debris},
        {"debris.flow_spread", &p.debris.flow_spread},
        {"debris.flow_time_s", &p.debris.flow_time_s},
        {"debris.clog_least", &p.debris.clog_least},
        {"debris.clog_per_um", &p.debris.clog_per_um},
        {"debris.clog_most", &p.debris.clog_most},
        {"debris.random_short_per_us", &p.debris.random_short_per_us},
        {"debris.random_short_um", &p.debris.random_short_um},
        {"debris.random_short_us", &p.debris.random_short_us},
        {"work.shape", &p.work.shape},
        {"work.centre_x_mm", &p.work.centre_x_mm},
        {"work.centre_y_mm", &p.work.centre_y_mm},
        {"work.size_mm", &p.work.size_mm},
        {"work.depth_mm", &p.work.depth_mm},
        {"work.electrode_mm", &p.work.electrode_mm},
        {"wire.diameter_mm", &p.wire.diameter_mm},
        {"wire.crater_us", &p.wire.crater_us},
        {"wire.deflection_um_a", &p.wire.deflection_um_a},
        {"wire.deflection_ms", &p.wire.deflection_ms},
        {"wire.break_a", &p.wire.break_a},
        {"wire.break_ms", &p.wire.break_ms},
        {"workpiece.thickness_mm", &p.workpiece.thickness_mm},
        {"workpiece.cell_um", &p.workpiece.cell_um},
        {"workpiece.start_x_mm", &p.workpiece.start_x_mm},
        {"workpiece.start_y_mm", &p.workpiece.start_y_mm},
        {"stock.kind", &p.stock.kind},
        {"stock.edge_mm", &p.stock.edge_mm},
        {"stock.hole_mm", &p.stock.hole_mm},
        {"stock.size_x_mm", &p.stock.size_x_mm},
        {"stock.size_y_mm", &p.stock.size_y_mm},
        {"stock.steps", &p.stock.steps},
        {"cavity.perimeter_mm", &p.cavity.perimeter_mm},
        {"cavity.layer_um", &p.cavity.layer_um},
        {"cavity.overcut_um", &p.cavity.overcut_um},
        {"cavity.reference_a", &p.cavity.reference_a},
        {"cavity.reference_us", &p.cavity.reference_us},
        {"cavity.current_power", &p.cavity.current_power},
        {"cavity.time_power", &p.cavity.time_power},
        {"cavity.wall_debris", &p.cavity.wall_debris},
        {"cavity.slope_um", &p.cavity.slope_um},
    };
    for (std::size_t i = 0; i < StockParameters::STEPS; ++i) {
        names["stock.at_mm_" + std::to_string(i)] = &p.stock.at_mm[i];
        names["stock.width_um_" + std::to_string(i)] = &p.stock.width_um[i];
    }
    return names;
}

}  // namespace plant
