# SPDX-License-Identifier: Apache-2.0
"""Basic data of the roughing planner: the shipped files, and files that are refused."""

import re
from itertools import pairwise

import pytest

from host.errors import UserError
from host.roughing import synthetic
from host.roughing.basic import FOLDER, file_name, read_all, read_file

GOOD = """\
electrode = "copper"
workpiece = "steel"
area_mm2 = 50
source = "a test"
depth_mm = [0, 1, 10]

[finish]
rmax_um = [1, 5]
side_um = [0, -4]

[[current]]
ip = 4
bottom_um = 24
side_um = 20
undersize_um = [66, 67.5, 78]

[[current]]
ip = 6
bottom_um = 30
side_um = 25
undersize_um = [84, 86, 99.5]
"""


def written(folder, text=GOOD, name="copper_steel_50mm2.toml"):
    path = folder / name
    path.write_text(text)
    return path


def test_the_files_are_what_the_generator_makes():
    made = dict(synthetic.files())
    assert made == {path.name: path.read_text() for path in FOLDER.glob("*.toml")}
    assert all("SYNTHETIC" in text.splitlines()[1] for text in made.values())


def test_the_files_hold_the_formula_to_the_last_digit():
    for one in read_all("copper", "steel"):
        for ip, row in zip(one.ip, one.undersize_um, strict=True):
            for depth, value in zip(one.depth_mm, row, strict=True):
                exact = synthetic.undersize_um(one.area_mm2, ip, depth)
                assert abs(value - exact) <= 0.05 + 1e-9


def test_the_files_are_in_order_of_area():
    data = read_all("copper", "steel")
    assert all(one.area_mm2 < two.area_mm2 for one, two in pairwise(data))
    assert {one.source for one in data} == {"synthetic"}


def test_a_file_is_read(tmp_path):
    one = read_file(written(tmp_path))
    assert one.column(2) == (78.0, 99.5)
    assert one.finish_um == ((1.0, 0.0), (5.0, -4.0))


def test_finishes_may_be_left_out(tmp_path):
    text = re.sub(r"\[finish\](.|\n)*?\n\n", "", GOOD)
    assert read_file(written(tmp_path, text)).finish_um == ((1.0, 0.0),)


@pytest.mark.parametrize(("old", "new", "line", "why"), [
    ('source = "a test"\n', "", 1, "source is missing"),
    ('"copper"', "3", 1, "electrode must be a name"),
    ("area_mm2 = 50\n", "", 1, "area_mm2 is missing"),
    ("area_mm2 = 50", "area_mm2 = 0", 3, "area_mm2 must not be 0"),
    ("area_mm2 = 50", "area_mm2 = 50.125", 3,
     "area_mm2 has at most 2 digits behind the point, unlike 50.125"),
    ("area_mm2 = 50", "area_mm2 = 51", 1,
     "a file with these materials and this area is called copper_steel_51mm2.toml"),
    ("depth_mm = [0, 1, 10]", "", 1, "depth_mm is missing"),
    ("[0, 1, 10]", "[0, 10, 1]", 5, "depth_mm must rise, but 1 follows 10"),
    ("[0, 1, 10]", "[0, 1, true]", 5, "depth_mm must be a number, not True"),
    ("[0, 1, 10]", "[0, 1, 2000]", 5, "depth_mm must be 0 to 1000, not 2000"),
    ("[1, 5]", "[5, 1]", 8, "rmax_um must rise, but 1 follows 5"),
    ("[1, 5]", "[2, 5]", 9,
     "side_um must be 0 where rmax_um is 1: it is the difference from the stock for 1 um"),
    ("[1, 5]", "[1, 2, 3, 4, 5, 6, 7]", 8, "more than 6 roughnesses"),
    ("side_um = [0, -4]\n", "", 7, "side_um is missing"),
    ("[0, -4]", "[0]", 9, "side_um has 1 values for 2 roughnesses"),
    ("bottom_um = 30\n", "", 17, "bottom_um is missing"),
    ("bottom_um = 30", "bottom_um = 20", 19,
     "bottom_um must not fall from current to current, but 20 follows 24"),
    ("[0, -4]", "[0, 4]", 9, "side_um must not rise with the roughness, but 4 follows 0"),
    ("[0, -4]", "[0, -9000]", 9, "side_um must be -3000 to 3000, not -9000"),
    ("[0, -4]", "[0, true]", 9, "side_um must be a number, not True"),
    ("84, 86, 99.5", "84, 86, 6000.0001", 21,
     "undersize_um must be 0 to 6000, not 6000.0001"),
    ("area_mm2 = 50", "area_mm2 = 1000000.25", 3, "area_mm2 must be 0 to 100000, not 1000000.25"),
    ("ip = 6", "ip = 6\nbotom_um = 30", 19, "botom_um is not known in [[current]]"),
    ("ip = 6", 'ip = 6\n"" = 30', 19, '"" is not known in [[current]]'),
    ("99.5]", "99.5]\n[current.more]", 22, "more is not known in [[current]]"),
    ("[0, -4]", "[0, -4]\nbottom_um = 0", 10, "bottom_um is not known in [finish]"),
    ('source = "a test"', 'source = "a test"\nelectrod = 1', 5, "electrod is not known"),
    ("ip = 6", "ip = 4", 18, "ip must rise from current to current, but 4 follows 4"),
    ("ip = 4", "ip = 0", 12, "ip must not be 0"),
    ("undersize_um = [84, 86, 99.5]", "", 17, "undersize_um is missing"),
    ("84, 86, 99.5", "84, 86", 21, "undersize_um has 2 values for 3 depths"),
    ("84, 86, 99.5", "84, 99.5, 86", 21,
     "undersize_um must rise with the depth, but 86 follows 99.5"),
    ("84, 86, 99.5", "66, 86, 99.5", 21,
     "undersize_um must rise with the current (at 0 mm), but 66 follows 66"),
    ("84, 86, 99.5", "-1, 86, 99.5", 21, "undersize_um must be 0 to 6000, not -1"),
    ("[finish]", "[finsh]", 7, "finsh is not known"),
    ('source = "a test"', '"a (b" = 1', 4, "a (b is not known"),
    ("area_mm2 = 50", "area_mm2 = 5" + 400 * "0", 3,
     "area_mm2 must be 0 to 100000, not a number of more than 300 digits"),
])
def test_bad_data_are_refused_by_name_and_line(tmp_path, old, new, line, why):
    assert old in GOOD
    path = written(tmp_path, GOOD.replace(old, new))
    with pytest.raises(UserError) as told:
        read_file(path)
    assert str(told.value) == f"{path}, line {line}: {why}."


def test_a_single_current_is_refused(tmp_path):
    path = written(tmp_path, GOOD[:GOOD.rindex("[[current]]")])
    with pytest.raises(UserError, match=r"line 11: at least two tables \[\[current\]\] are needed"):
        read_file(path)


def test_currents_that_are_no_tables_are_refused(tmp_path):
    path = written(tmp_path, GOOD[:GOOD.index("[finish]")] + "current = [4, 6]\n")
    with pytest.raises(UserError, match=r"line 7: current must be tables \[\[current\]\], not 4"):
        read_file(path)


def test_what_is_no_toml_is_refused(tmp_path):
    with pytest.raises(UserError, match=r"copper_steel_50mm2\.toml is no TOML: .*line 3"):
        read_file(written(tmp_path, GOOD.replace("= 50", "=")))


def test_materials_without_data_are_refused(tmp_path):
    with pytest.raises(UserError, match=r"^there are no basic data of graphite on steel in .*, "
                                        r"only of copper on steel\.$"):
        read_all("graphite", "steel")
    with pytest.raises(UserError, match=r"only of nothing\.$"):
        read_all("copper", "steel", tmp_path)


def test_a_longer_name_is_another_material(tmp_path):
    written(tmp_path)
    hard = GOOD.replace('"steel"', '"steel_hard"').replace("area_mm2 = 50", "area_mm2 = 60")
    written(tmp_path, hard, "copper_steel_hard_60mm2.toml")
    assert [one.area_mm2 for one in read_all("copper", "steel", tmp_path)] == [50]
    assert [one.area_mm2 for one in read_all("copper", "steel_hard", tmp_path)] == [60]
    with pytest.raises(UserError, match=r"^there are no basic data of copper_steel on hard in .*, "
                                        r"only of copper on steel, copper on steel_hard\.$"):
        read_all("copper_steel", "hard", tmp_path)


def test_a_name_with_two_lines_is_told_by_what_the_file_says(tmp_path):
    """Electrodes of copper-tungsten, beside a workpiece of tungsten steel."""
    alloy = GOOD.replace('"copper"', '"copper_tungsten"')
    hard = GOOD.replace('"steel"', '"tungsten_steel"').replace("area_mm2 = 50", "area_mm2 = 60")
    written(tmp_path, alloy, "copper_tungsten_steel_50mm2.toml")
    written(tmp_path, hard, "copper_tungsten_steel_60mm2.toml")
    for pair, area in ((("copper_tungsten", "steel"), 50), (("copper", "tungsten_steel"), 60)):
        assert [one.area_mm2 for one in read_all(*pair, tmp_path)] == [area]
    with pytest.raises(UserError, match=r", only of copper on tungsten_steel, copper_tungsten on "
                                        r"steel\.$"):
        read_all("copper", "steel", tmp_path)


def test_a_table_within_a_line_is_found(tmp_path):
    text = re.sub(r"\[finish\](.|\n)*?\n\n", "", GOOD).replace(
        "depth_mm", "finish = {rmax_um = [1], side_um = [0], x = 1}\ndepth_mm")
    with pytest.raises(UserError, match=r"line 5: x is not known in \[finish\]\.$"):
        read_file(written(tmp_path, text))
    text = text.replace("finish = {rmax_um = [1], side_um = [0], x = 1}", "finish.x = 1")
    with pytest.raises(UserError, match=r"line 5: x is not known in \[finish\]\.$"):
        read_file(written(tmp_path, text))


def test_a_broken_file_of_another_pair_is_no_harm(tmp_path):
    written(tmp_path)
    written(tmp_path, "nothing", "copper_tungsten_steel_50mm2.toml")
    assert len(read_all("copper", "steel", tmp_path)) == 1


def test_a_large_area_is_named_to_its_last_digit():
    assert file_name("copper", "steel", 100_000.0) == "copper_steel_100000mm2.toml"
    assert file_name("copper", "steel", 12345.67) == "copper_steel_12345.67mm2.toml"


def test_a_name_is_no_pattern(tmp_path):
    written(tmp_path, GOOD.replace('"steel"', '"st[1]*"'), "copper_st[1]*_50mm2.toml")
    assert len(read_all("copper", "st[1]*", tmp_path)) == 1


@pytest.mark.parametrize(("old", "new", "what"), [("[0, 1, 10]", "[0, 1, 11]", "depths"),
                                                  ("[0, -4]", "[0, -3]", "table of finishes")])
def test_files_that_do_not_fit_each_other_are_refused(tmp_path, old, new, what):
    written(tmp_path)
    other = GOOD.replace(old, new).replace("area_mm2 = 50", "area_mm2 = 90")
    written(tmp_path, other, "copper_steel_90mm2.toml")
    with pytest.raises(UserError, match=rf"^{re.escape(str(tmp_path))}/copper_steel_90mm2\.toml "
                                        rf"has (an)?other {what}"):
        read_all("copper", "steel", tmp_path)
