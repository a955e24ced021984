# SPDX-License-Identifier: Apache-2.0
"""Machine files: their values, and the refusals."""

import re
import tomllib
from fractions import Fraction

import pytest

from host.errors import UsageError
from host.machines.machine import BUILT_IN, load
from host.machines.machine_file import MACHINES, WORDS, bounds, entries
from softcore.tables.settings import named
from testbench.native.station import parameters

SINKER = (BUILT_IN / "sinker.toml").read_text(encoding="utf-8")
WIRE = (BUILT_IN / "wire.toml").read_text(encoding="utf-8")
BASES = "base must be one of sinker, wire, cavity"
CONTROLLERS = {"settings", *(f"{axis}.pitch_error_um" for axis in "xyz")}
NO_NUMBERS = {*WORDS, "stock.steps", *CONTROLLERS}

# Unit by the end of a number's name, the longest that fits.
UNITS = {
    "nf": "nF", "nh": "nH",
    "hz": "Hz", "um": "µm", "mm": "mm", "mm2": "mm²", "us": "µs", "ms": "ms", "s": "s", "v": "V",
    "a": "A", "ohm": "Ω", "ohm_cm": "Ω cm", "mm_s": "mm/s", "mm_s2": "mm/s²", "mm3_s": "mm³/s",
    "mm3_min_a": "mm³/(min A)", "um_a": "µm/A", "um_m": "µm/m",
    "per_s": "1/s", "per_us": "1/µs", "per_um": "1/µm", "per_cm": "1/cm", "per_mm": "1/mm",
    "mm_min": "mm/min",
    "delay_square_us": "µs/µm²", "delay_linear_us": "µs/µm",    # of a formula's part
}


def plain(names):
    """Names of numbers, without those of the steps of a stock."""
    return {name for name in names if not re.match(r"stock\.(at_mm|width_um)_\d+$", name)}


@pytest.mark.parametrize("kind", MACHINES)
def test_the_model_of_a_file_has_what_the_plant_has(kind):
    """Every number has the plant's name, bounds, a meaning, and the unit that its name says."""
    found = dict(entries(MACHINES[kind]))
    assert found.keys() - CONTROLLERS == plain(name for name, _ in parameters(load(kind).tables))
    for name, field in found.items():
        assert re.fullmatch(r"[A-Z0-9`].*\.", field.description or ""), name
        if name in NO_NUMBERS:
            continue
        lowest, highest = bounds(field)
        assert lowest <= highest, name
        ends = [end for end in UNITS if re.search(rf"(^|[._]){end}$", name)]
        unit = UNITS[max(ends, key=len)] if ends else ""
        assert field.json_schema_extra == {"unit": unit}, name


def test_what_cannot_be_is_told_before_what_is_missing_and_that_before_what_is_strange(workdir):
    path = workdir / "odd.toml"
    wrong = SINKER.replace("tick_us = 8.0", "tick_us = 0").replace("filter_ms", "colour")
    for text, said in ((wrong, "tick_us must be 1 to 100, not 0."),
                       (wrong.replace("tick_us = 0", "tick_us = 8"), "axis.filter_ms is missing; "),
                       (wrong.replace("tick_us = 0", "tick_us = 8").replace(
                           "colour", "filter_ms = 1\ncolour"), "axis.colour is no number of ")):
        path.write_text(text)
        with pytest.raises(UsageError, match=f"^machine odd: {re.escape(said)}"):
            load(str(path))


@pytest.mark.parametrize("value", ["true", "'8'", "[8]", "{ a = 8 }", "1979-05-27"])
def test_what_is_no_number_is_refused_as_such(workdir, value):
    path = workdir / "odd.toml"
    for text, name in ((SINKER.replace("tick_us = 8.0", f"tick_us = {value}"), "tick_us"),
                       (SINKER.replace("filter_ms = 0.5", f"filter_ms = {value}"),
                        "axis.filter_ms"),
                       (f"{SINKER}\n408 = {value}\n", "settings.408")):
        path.write_text(text)
        with pytest.raises(UsageError, match=rf"^machine odd: {re.escape(name)} is no number\.$"):
            load(str(path))


@pytest.mark.parametrize(("line", "said"), [
    ("99 = 1", r"settings\.99 is no setting of the controller; docs/reference/settings\.md lists "
               r"them\."),
    ("562 = 3", r"settings\.562 \(pitch_points_x\) belongs to the table of a screw's error; a "
                r"machine's file gives it as pitch_error_um of the axis\."),
    ("520 = 100", r"settings\.520 and settings\.523 give x 100 steps or edges for 10000 pulses; "
                  r"there are at most as many, and with a coder at least one for 20\."),
    ("522 = 20000", r"settings\.522 and settings\.525 give z 20000 steps or edges for .*"),
    *((f"533 = {order}", r"settings\.533 \(home_order\) must have digits 1 \(X\), 2 \(Y\) and 3 "
       rf"\(Z\), each at most once, not {order}\.") for order in (11, 128, 4, 10)),
    ("400 = 33", r"settings\.400 \(short_needed\) must be 1 to 32, not 33\."),
])
def test_a_setting_that_the_controller_would_refuse_is_refused_at_once(workdir, line, said):
    path = workdir / "odd.toml"
    path.write_text(f"{SINKER}\n{line}\n")
    with pytest.raises(UsageError, match=f"^machine odd: {said}$"):
        load(str(path))


@pytest.mark.parametrize("table", ["axis", "gap", "settings"])
def test_what_is_no_table_is_refused(workdir, table):
    tables = tomllib.loads(SINKER)
    path = workdir / "odd.toml"
    for value in ("3", "[{}]"):
        path.write_text(f"{table} = {value}\n" + re.sub(
            rf"^\[{table}\].*?(?=^\[|\Z)", "", SINKER, flags=re.M | re.S))
        assert table in tables
        with pytest.raises(UsageError, match=f"^machine odd: {table} is no number of a machine"):
            load(str(path))


@pytest.mark.parametrize("key", WORDS)
def test_a_word_that_the_plant_does_not_know_is_refused(workdir, key):
    path = workdir / "odd.toml"
    table, _, name = key.rpartition(".")
    whole = WIRE if key != "work.shape" else SINKER     # no wire touches that work
    head = rf"(^\[{table}\].*?" if table else "("
    for odd in ('"odd"', "3", "[]"):
        path.write_text(re.sub(rf'{head}^{name}) = "{WORDS[key][key == "kind"]}"',
                               rf"\1 = {odd}", whole, count=1, flags=re.M | re.S))
        with pytest.raises(UsageError,
                           match=rf"^machine odd: {key} must be one of {WORDS[key][0]}, .*, not "):
            load(str(path))


def test_a_file_with_a_base_gives_what_differs(workdir):
    path = workdir / "mine.toml"
    path.write_text('base = "wire"\ntick_us = 4\n[stock]\nkind = "wall"\n[settings]\n408 = 3\n')
    mine, wire = load(str(path)).tables, load("wire").tables
    assert mine == wire | {"tick_us": 4, "stock": wire["stock"] | {"kind": "wall"},
                           "settings": wire["settings"] | {"408": 3}}
    assert "base" not in mine
    path.write_text('base = "cavity"\n[cavity]\nslope_um = 5.0\n')  # which has a base itself
    mine, cavity = load(str(path)).tables, load("cavity").tables
    assert mine == cavity | {"cavity": cavity["cavity"] | {"slope_um": 5.0}}
    assert "base" not in mine
    assert cavity["gap"] == load("sinker").tables["gap"]
    for text, said in (('base = "wire"\ngap = 3\n', "gap is no number of a machine."),
                       ('base = "wire"\n[gap]\narea_mm2 = 3\n', "gap.area_mm2 is no number of"),
                       ('base = "wire"\nkind = "sinker"\n', "initial_gap_um is missing; "),
                       ('base = "cavity"\nkind = "odd"\n', "kind must be one of sinker, wire, "),
                       ('base = "small"\n', f"{BASES}, not 'small'."),
                       ('base = ["wire"]\n', f"{BASES}, not ['wire'].")):
        path.write_text(text)
        with pytest.raises(UsageError, match=f"^machine mine: {re.escape(said)}"):
            load(str(path))


@pytest.mark.parametrize(("text", "said"), [
    ("current_max_a = 1.0", "current_max_a, 1 A, is less than one step of the supply, "
                            "source.step_a, 1.5 A."),
    ("[source]\nstep_a = 0.5", "source.step_a is 0.5 A, and the controller counts a step as 1500 "
                               "mA (settings.455)."),
])
def test_a_supply_that_cannot_be_or_is_counted_wrongly_is_refused(workdir, text, said):
    path = workdir / "mine.toml"
    path.write_text(f'base = "sinker"\n{text}\n')
    with pytest.raises(UsageError, match=f"^machine mine: {re.escape(said)}$"):
        load(str(path))


def test_a_file_without_a_kind_is_a_sinker(workdir):
    path = workdir / "plain.toml"
    path.write_text(SINKER.replace('kind = "sinker"\n', ""))
    assert load(str(path)).kind == "sinker"
    assert load("wire").kind == "wire"


@pytest.mark.parametrize("steps", [
    "3", "[]", "[3]", "[[0.0]]", '[[0.0, "a"]]', "[[0.0, -1.0]]", "[[1.0, 3.0], [1.0, 4.0]]",
    "[" + ", ".join(f"[{n}, 1]" for n in range(17)) + "]"])
def test_stock_that_is_none_is_refused(workdir, steps):
    path = workdir / "odd.toml"
    path.write_text(WIRE.replace("steps = [[0.0, 30.0]]", f"steps = {steps}"))
    with pytest.raises(UsageError, match=r"^machine odd: stock\.steps must be 1 to 16 pairs"):
        load(str(path))


def test_the_program_begins_where_the_machine_stands(workdir):
    path = workdir / "aside.toml"
    path.write_text(WIRE.replace("start_y_mm = 0.0", "start_y_mm = -0.25"))
    assert load(str(path)).start_mm == {"x": 0.0, "y": -0.25, "z": 0.0}
    assert load("sinker").start_mm == {"x": 0.0, "y": 0.0, "z": 0.1}


STEPPING = ('base = "sinker"\n[{axis}]\noutput = "step"\nsteps_per_turn = {steps}\n'
            'pitch_mm = {pitch}')


@pytest.mark.parametrize(("steps", "pitch", "gear"), [
    (3200, 5, (640, 10_000)),           # steps per mm
    (50_000, 5, None),                  # a step for each pulse: the default
    (3200, 3, (8, 75)),                 # 1066.67 steps per mm
    (1600, 2.54, (16, 254)),            # 1/10 inch, as written
    (200, 0.5, (400, 10_000)),
])
def test_the_gear_of_an_axis_is_exact(workdir, steps, pitch, gear):
    path = workdir / "mine.toml"
    path.write_text(STEPPING.format(axis="y", steps=steps, pitch=pitch))
    settings = load(str(path)).settings
    found = (settings.get("521", 10_000), settings.get("524", 10_000))
    assert Fraction(*found) == Fraction(str(steps)) / Fraction(str(pitch)) / 10_000
    assert settings["416"] == 2
    assert found[0] <= found[1] <= 1 << 16
    if gear and gear[1] == 10_000:
        assert found == gear, "in steps per mm where it can be"


@pytest.mark.parametrize(("steps", "pitch", "said"), [
    (50_001, 5, "z has 10000.2 steps per mm (z.steps_per_turn, z.pitch_mm); the most are 10000, "
                "one for each pulse of the path."),
    (3199, 7.003, "the gear of z, 3199 steps for 70030 pulses (z.steps_per_turn, z.pitch_mm), "
                  "needs more than 65536 pulses; give a rounder number."),
])
def test_a_gear_that_there_is_not_is_refused(workdir, steps, pitch, said):
    path = workdir / "mine.toml"
    path.write_text(STEPPING.format(axis="z", steps=steps, pitch=pitch))
    with pytest.raises(UsageError, match=f"^machine mine: {re.escape(said)}$"):
        load(str(path))


def test_a_coder_has_its_gear(workdir):
    path = workdir / "mine.toml"
    coder = 'base = "sinker"\n[y]\nsteps_per_turn = {edges}\npitch_mm = 5.0\n'
    for edges, gear in ((50_000, (None, None)), (20_000, (4000, None)), (2500, (500, None)),
                        (4096, (256, 3125))):
        path.write_text(coder.format(edges=edges))
        settings = load(str(path)).settings
        assert (settings.get("521"), settings.get("524")) == gear
        assert "416" not in settings
    for edges, said in (
            (50_001, "y has 10000.2 edges per mm"),
            (2499, "the coder of y has 499.8 edges per mm (y.steps_per_turn, y.pitch_mm); the "
                   "least are 500.")):
        path.write_text(coder.format(edges=edges))
        with pytest.raises(UsageError, match=re.escape(f"machine mine: {said}")):
            load(str(path))


def test_the_pitch_error_of_an_axis_is_a_table_of_the_controller(workdir):
    path = workdir / "mine.toml"
    path.write_text('base = "sinker"\n[y]\npitch_error_um = [0, 1.23, -2.0, 0.0]\n'
                    'pitch_from_mm = -60.5\npitch_step_mm = 25\n')
    assert load(str(path)).settings == load("sinker").settings | {
        str(named(name).number): value for name, value in (
            ("pitch_points_y", 4), ("pitch_first_y", 605_000), ("pitch_step_y", 250_000),
            ("pitch_y_2", 5012), ("pitch_y_3", 4980))}


TABLE_BOUND = "z.pitch_error_um must be a list of 2 to 16 errors of -409.5 to 409.5 um."


@pytest.mark.parametrize(("errors", "said"), [
    ([0] * 17, TABLE_BOUND), ([0, 409.6], TABLE_BOUND), ([0, "1"], TABLE_BOUND),
    ([0, True], TABLE_BOUND), (1.5, TABLE_BOUND),
    ([3.0], "z.pitch_error_um has one point; a table has two or more."),
    ([0, 100, -100.1], "z.pitch_error_um changes by 200.1 um up to point 3; the most are 200 um, a "
                       "hundredth of z.pitch_step_mm."),
    ([0, 200, 209.5, 9.5, -190.5, -200.1],
     "errors of z.pitch_error_um lie 409.6 um apart; the most are 409.5 um.")])
def test_a_table_of_a_screw_that_there_is_not_is_refused(workdir, errors, said):
    path = workdir / "mine.toml"
    path.write_text(f'base = "sinker"\n[z]\npitch_error_um = {str(errors).replace("True", "true")}')
    with pytest.raises(UsageError, match=f"^machine mine: {re.escape(said)}$"):
        load(str(path))


@pytest.mark.parametrize(("axis", "points"), [
    ("pitch_from_mm = -19000", "-19000 to -18980"), ("low_mm = -20\nhigh_mm = 0", "0 to 20")])
def test_a_table_beyond_the_travel_is_refused(workdir, axis, points):
    path = workdir / "mine.toml"
    path.write_text(f'base = "sinker"\n[x]\npitch_error_um = [0, 1]\n{axis}')
    said = (f"the points of x.pitch_error_um, {points} mm, lie beyond the travel, x.low_mm to "
            "x.high_mm.")
    with pytest.raises(UsageError, match=f"^machine mine: {re.escape(said)}$"):
        load(str(path))


def test_the_tables_of_the_axes_are_settings_of_the_controller(workdir):
    path = workdir / "mine.toml"
    path.write_text('base = "sinker"\n[x]\nbacklash_um = 12.34\nreversed = 1\n[z]\nlow_mm = -40\n'
                    'high_mm = 80.5\nhighest_mm_min = 900\n[settings]\n460 = 41000\n')
    assert load(str(path)).settings == load("sinker").settings | {
        "526": 123, "529": 1, "532": 900, "460": 41_000, "463": 80_500}, "[settings] wins"
    assert load("sinker").settings == load("sinker").tables["settings"]
    assert load("wire").settings == load("wire").tables["settings"]


# ---- what must not be accepted silently, nor end in Python's own words

def refusal(path, text):
    """What is said of a file, without the name of the machine before it."""
    path.write_text(text)
    with pytest.raises(UsageError) as error:
        load(str(path))
    said = str(error.value)
    assert len(said) < 300
    assert "\n" not in said
    return said.removeprefix(f"machine {path.stem}: ")


@pytest.mark.parametrize("line", ['"0520" = 5', '"0458" = 1000\n"458" = 2000', "00 = 1"])
def test_a_setting_has_one_number(workdir, line):
    number = line.split()[0].strip('"')
    assert refusal(workdir / "odd.toml", f'base = "sinker"\n[settings]\n{line}\n') == (
        f"settings.{number} begins with 0; the number of a setting has no zeros before it.")


@pytest.mark.parametrize(("name", "least", "highest"), [
    ("highest_mm_min", "1", "60000"), ("backlash_um", "0.1", "819.1"),
    ("index_mm", "0.0001", "1000")])
def test_what_would_be_rounded_to_none_is_refused(workdir, name, least, highest):
    path = workdir / "odd.toml"
    head = f'base = "sinker"\n[x]\n{name} = '
    small = float(least) * 0.4
    assert refusal(path, f"{head}{small}") == (
        f"x.{name} must be 0, or {least} to {highest}, not {small}.")
    for value in ("0", least, highest):
        path.write_text(head + value)
        assert load(str(path)).number("x", name) == float(value)


@pytest.mark.parametrize("name", ["x.reversed", "comparator.fixed", "side.fin_answers",
                                  "gap.ignition_law"])
def test_a_flag_is_0_or_1(workdir, name):
    path = workdir / "odd.toml"
    table, key = name.split(".")
    head = f'base = "sinker"\n[{table}]\n{key} = '
    for value in ("0.5", "1e-12", "0.9999999999", "2", "-1"):
        assert refusal(path, head + value) == f"{name} must be 0 or 1, not {value}."
    for value in ("0", "1", "1.0"):
        path.write_text(head + value)
        assert load(str(path)).number(table, key) == float(value)


@pytest.mark.parametrize(("name", "range_", "value"), [
    ("step_a", "0.05 to 10000", "0.0"), ("step_a", "0.05 to 10000", "1e-320"),
    ("source_ohm", "0.001 to 1000000000", "0.0")])
def test_a_supply_that_the_formulas_divide_by_is_not_0(workdir, name, range_, value):
    assert refusal(workdir / "odd.toml", f'base = "sinker"\n[source]\n{name} = {value}\n') == (
        f"source.{name} must be {range_}, not {float(value)}.")


KINDS = "kind must be one of sinker, wire, cavity"
NESTED = "its tables or lists are nested too deep."
HEX = f"0x{'f' * 6000}"


@pytest.mark.parametrize(("text", "said"), [
    (f"x = {'[' * 5000}{']' * 5000}", NESTED),
    (f"kind = {'[' * 300}{']' * 300}", f"{KINDS}, not {'[' * 60}…."),
    # Python decides how deep a table it shows.
    (f"kind{'.a' * 5000} = 1", f"{KINDS}, not "), (f"base{'.a' * 5000} = 1", f"{BASES}, not "),
    (f'base = "sinker"\ntick_us = {HEX}', "tick_us must be 1 to 100, not a value so long."),
    (f'base = "sinker"\ntick_us = {"9" * 4000}', f"tick_us must be 1 to 100, not {'9' * 60}…."),
    (f'base = "sinker"\ntick_us = {"9" * 5000}', "one of its numbers has too many digits."),
    (f'base = "sinker"\n[settings]\n408 = {HEX}', "settings.408 = a value so long is no setting; "
     "one reads number = value, both whole, not negative, and of at most 10 digits."),
    ("\N{LATIN SMALL LETTER E WITH ACUTE}", "Invalid statement (at line 1, column 1)."),
])
def test_what_is_too_deep_or_too_long_is_refused_in_a_sentence(workdir, text, said):
    path = workdir / "odd.toml"
    found = refusal(path, text).removeprefix(f"{path} is no machine description: ")
    assert found == said or (said.endswith("not ") and found.startswith(said))


@pytest.mark.parametrize("end", ["", ".toml"])
def test_a_name_that_no_file_can_have_is_refused(end):
    with pytest.raises(UsageError) as error:
        load("a" * 5000 + end)
    assert str(error.value) == (f'the machine "{"a" * 60}…" cannot be read: File name too long.')
