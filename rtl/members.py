# SPDX-License-Identifier: Apache-2.0
"""Members of the machine: those that lead to pads, and those that lead to registers."""

from amaranth import *
from amaranth.lib.wiring import In, Out

from rtl.motion.supervision import GAIN_BITS
from rtl.pads import INPUTS, OUTPUTS
from rtl.safety.interlock import Cause

__all__ = ["AXES", "CAUSES", "pins", "registers"]

AXES = "xyz"
CAUSES = len(Cause)


def pins():
    """Members of a machine that lead to pads, as plain active-high signals.

    Vectors have one bit per axis. ``gap_high`` to ``gap_current`` are the comparators of the gap:
    voltage above the open level, below the arc level, below the short level, current flowing;
    ``gap_reference`` are the streams that set the first three levels, and ``gap_noise`` says that a
    discharge has high frequencies. ``adc_select`` to ``adc_data`` lead to the converter that
    ``rtl.gap.sampler`` asks. ``gap_supply`` is the power supply's open voltage and, in bit 4, its
    polarity.
    ``gap_on`` and ``gap_sense`` gate the discharge and the current-limited sensing source.
    ``dac`` has a density of ones proportional to the speed command, ``dac_negative`` its sign.
    ``safe`` says that the interlock holds the outputs in their safe state.
    """
    serial = ("rx", "tx")
    members = {name: In(width) for name, (width, _) in INPUTS.items() if name not in serial}
    return members | {name: Out(width, init=init) for name, (width, init) in OUTPUTS.items()
                      if name not in serial}


def registers():
    """Members that lead to registers: ``softcore/regmap.py`` has their meaning and units."""
    coordinate = signed(32)
    members = {
        "path_slot_select": In(8), "path_slot_select_strobe": In(1),
        "path_slot_data": In(32), "path_slot_data_strobe": In(1),
        "path_ahead": In(coordinate), "path_behind": In(coordinate), "path_floor": In(coordinate),
        "path_fast_ahead": In(coordinate), "path_fast_behind": In(coordinate),
        "path_fast_slot": In(8), "path_fast_slot_strobe": In(1),
        "path_origin": In(8), "path_origin_strobe": In(1),
        "path_command": Out(coordinate), "path_position": Out(coordinate),
        "path_front": Out(coordinate), "path_slot": Out(8),
        "path_status_moving": Out(1), "path_status_reverse": Out(1),
        "path_status_in_position": Out(1), "path_status_state": Out(4),
        "path_status_crowded": Out(1),

        "ramp_start_rate": In(30), "ramp_acceleration": In(30),

        "retraction_rate": In(30), "retraction_limit": In(31), "retraction_high_rate": In(30),
        "retraction_low_rate": In(30), "retraction_changeover": In(31),
        "retraction_low_lead": In(24), "retraction_jump_distance": In(31),
        "retraction_jump_rate": In(30), "retraction_jump_high_rate": In(30),
        "retraction_commit": In(1), "retraction_commit_strobe": In(1),
        "retraction_jump_period": In(32), "retraction_gain": In(16), "retraction_repeats": In(8),
        "retraction_settle": In(24), "retraction_control_run": In(1),
        "retraction_control_hold": In(1), "retraction_command_retract": In(1),
        "retraction_command_release": In(1), "retraction_command_strobe": In(1),
        "retraction_start": Out(coordinate), "retraction_first": Out(coordinate),
        "retraction_series": Out(8),

        "event_head_kind": Out(8), "event_head_detail": Out(8), "event_head_slot": Out(8),
        "event_head_valid": Out(1), "event_cycle": Out(32), "event_path": Out(coordinate),
        "event_first": Out(32), "event_second": Out(32), "event_pop": In(1),
        "event_pop_strobe": In(1), "event_status": Out(1),

        "gap_short_ratio_needed": In(6), "gap_short_ratio_window": In(6),
        "gap_short_duration": In(24), "gap_clear_needed": In(8), "gap_blanking": In(16),
        "gap_settle": In(8), "gap_confirm": In(8), "gap_delay_least": In(16),
        "gap_criteria_current": In(1), "gap_criteria_delay": In(1), "gap_criteria_noise": In(1),
        "gap_reference_open": In(10), "gap_reference_arc": In(10), "gap_reference_short": In(10),
        "gap_open_count": Out(32), "gap_ok_count": Out(32), "gap_dame_count": Out(32),
        "gap_short_count": Out(32), "gap_status_shorted": Out(1), "gap_status_last": Out(2),
        "gap_lag_time": In(28),

        "power_on_time": In(20), "power_off_time": In(20), "power_level": In(6),
        "power_sense_on": In(16), "power_sense_off": In(16), "power_control_machining": In(1),
        "power_control_cut": In(1), "power_limits_level": Out(6), "power_limits_off": Out(20),
        "power_off_extra": In(20), "power_supply_voltage": In(4), "power_supply_negative": In(1),

        "servo_control_on": In(1), "servo_control_mode": In(2), "servo_presets_dame": In(8),
        "servo_presets_open": In(8), "servo_presets_ok": In(8), "servo_counting_window": In(8),
        "servo_counting_weight": In(4), "servo_period": In(24), "servo_step": In(16),
        "servo_ups": Out(32), "servo_downs": Out(32), "servo_status_dame": Out(1),
        "servo_status_open": Out(1), "servo_status_held": Out(1),

        "fluid_control_convert": In(1), "fluid_control_manual": In(1),
        "fluid_control_manual_class": In(2), "fluid_threshold_0": In(12),
        "fluid_threshold_1": In(12), "fluid_threshold_2": In(12), "fluid_hysteresis": In(8),
        "fluid_bounds_lowest": In(12), "fluid_bounds_highest": In(12), "fluid_level": Out(12),
        "fluid_voltage": Out(12), "fluid_status_class": Out(2), "fluid_status_measured": Out(2),
        "fluid_status_known": Out(1), "fluid_status_broken_low": Out(1),
        "fluid_status_broken_high": Out(1), "fluid_status_disordered": Out(1),
        "fluid_status_fault": Out(1),

        "law_control_law": In(2), "law_control_measure": In(1), "law_unit": In(16),
        "law_window": In(32), "law_no_load": In(16), "law_reference_voltage": In(16),
        "law_reference_drop": In(16), "law_least": In(16), "law_bounds_lowest": In(16),
        "law_bounds_highest": In(16), "law_gain": In(30), "law_highest": In(30),
        "law_voltage_mean": Out(16), "law_voltage_drop": Out(16), "law_status_ratio": Out(16),
        "law_status_windows": Out(8), "law_status_known": Out(1), "law_feed": Out(30),

        "condition_order_commit": In(1), "condition_order_disarm": In(1),
        "condition_order_restart": In(1), "condition_order_strobe": In(1),
        "condition_depth": In(coordinate), "condition_depth_strobe": In(1),
        "condition_status_armed": Out(1), "condition_status_pending": Out(1),
        "condition_status_count": Out(8),

        "safety_live": Out(CAUSES), "safety_latched": Out(CAUSES), "safety_status_safe": Out(1),
        "safety_status_first": Out(5), "safety_status_simultaneous": Out(CAUSES),
        "safety_status_blamed": Out(len(AXES)), "safety_leave": In(8), "safety_leave_strobe": In(1),
        "safety_limits_low": Out(len(AXES)), "safety_limits_high": Out(len(AXES)),
        "safety_limits_leaving": Out(1), "safety_damage_axes": Out(len(AXES)),
        "safety_damage_word": Out(1), "safety_damage_segment": Out(1),
        "safety_damage_place": Out(1), "safety_damage_pulses": Out(1),
        "safety_pet": In(8), "safety_pet_strobe": In(1), "safety_clear": In(8),
        "safety_clear_strobe": In(1), "safety_stop": In(1), "safety_stop_strobe": In(1),
        "safety_fluid": In(1), "safety_period": Out(32),
        "safety_watch_asked": Out(1), "safety_watch_open": Out(1),
        "safety_arming_contactor": Out(1), "safety_arming_armed": Out(1), "safety_disarm": In(1),
        "safety_disarm_strobe": In(1),

        "auxiliary_send_code": In(16), "auxiliary_send_letter": In(2),
        "auxiliary_send_strobe": In(1), "auxiliary_timeout": In(32),
        "auxiliary_status_busy": Out(1), "auxiliary_status_timed_out": Out(1),
    }
    for letter in AXES:
        members |= {
            f"event_{letter}": Out(coordinate),
            f"axis_{letter}_command": Out(coordinate), f"axis_{letter}_position": Out(coordinate),
            f"axis_{letter}_error": Out(coordinate), f"axis_{letter}_overshoot": Out(32),
            f"axis_{letter}_follow_stopped": In(18), f"axis_{letter}_follow_moving": In(18),
            f"axis_{letter}_window": In(12),
            f"axis_{letter}_mode_step": In(1), f"axis_{letter}_mode_reverse": In(1),
            f"axis_{letter}_step_time_width": In(8), f"axis_{letter}_step_time_space": In(8),
            f"axis_{letter}_step_time_setup": In(8), f"axis_{letter}_adopt": In(1),
            f"axis_{letter}_adopt_strobe": In(1), f"axis_{letter}_status_saturated": Out(1),
            f"axis_{letter}_status_illegal": Out(1), f"axis_{letter}_status_check": Out(3),
            f"axis_{letter}_status_beyond_low": Out(1),
            f"axis_{letter}_status_beyond_high": Out(1),
            f"axis_{letter}_low": In(coordinate), f"axis_{letter}_high": In(coordinate),
            f"axis_{letter}_gain": In(GAIN_BITS),
        }
    return members
