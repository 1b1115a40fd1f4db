"""A URDF that is wrong is refused in one sentence that names what is wrong with it, and nothing else is read."""

from __future__ import annotations

from pathlib import Path

import pytest

from shared.errors import UserError
from station.arm.urdf import robot as robot_module
from station.arm.urdf.chain import chain_of
from station.arm.urdf.robot import read_robot
from tests.unit.arm.urdf.written_urdf import STAGE, written

BOMB = '<!DOCTYPE r [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;">]>\n' + STAGE
OUTSIDE = '<!DOCTYPE r [<!ENTITY a SYSTEM "file:///etc/hostname">]>\n' + STAGE


def changed(old: str, new: str) -> str:
    assert old in STAGE
    return STAGE.replace(old, new, 1)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("<robot", "cannot be read"),
        ("", "cannot be read"),
        ("<sdf/>", "<sdf>; export it as URDF"),
        (BOMB, "no <!DOCTYPE>"),
        (OUTSIDE, "no <!DOCTYPE>"),
        ('<robot><xacro:macro name="a"/></robot>', "run `xacro"),
        ("<robot/>", "found 0: none"),
        ("<robot>" + "<link/>" * 5001 + "</robot>", "at most 5000 parts"),
        (changed('name="ring"', 'name="foot"'), "'foot' comes twice"),
        (changed('name="ring"', 'name="ri\u0007"').replace("\u0007", "&#9;"), "printable"),
        (changed('child link="ring"', 'child link="rung"'), "'rung', which it does not have"),
        (changed('<child link="plate"/>', '<child link="ring"/>'), "'ring' hangs on two"),
        (changed('<child link="plate"/>', ""), "<child link=\"...\"/> in the joint 'mount'"),
        (changed('type="revolute"', 'type="screw"'), "'screw'"),
        (changed('xyz="0 0 0.1"', 'xyz="0 0"'), "3 finite numbers as xyz of the joint 'tilts'"),
        (changed('xyz="0 0 0.1"', 'xyz="0 0 nan"'), "got '0 0 nan'"),
        (changed('xyz="0 0 0.1"', 'xyz="0 0 1e308"'), "none beyond 1e.09, got '0 0 1e308'"),
        (changed('axis xyz="0 0 2"', 'axis xyz="0 0 1e308"'), "got '0 0 1e308'"),
        ('<?xml version="1.0" encoding="klingon"?><robot/>', "unknown encoding: klingon"),
        (changed('upper="1.2"', 'upper="up"'), "a finite number as upper"),
        (changed('axis xyz="0 0 2"', 'axis xyz="0 0 0"'), "Expected a direction as the axis"),
    ],
)
def test_it_is_refused_in_a_sentence(tmp_path: Path, text: str, named: str) -> None:
    with pytest.raises(UserError, match=named) as refused:
        read_robot(written(tmp_path, text))
    assert "\n" not in str(refused.value)


def test_what_is_no_file_or_too_large_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(UserError, match="there is no such file"):
        read_robot(tmp_path)
    monkeypatch.setattr(robot_module, "_MOST_BYTES", 100)
    with pytest.raises(UserError, match="is larger"):
        read_robot(written(tmp_path, STAGE))


def test_prefixes_that_nobody_declared_do_no_harm(tmp_path: Path) -> None:
    found = read_robot(written(tmp_path, changed("<limit ", '<limit drake:acceleration="2" ')))
    assert found.joints["ring"].max_effort_nm == 3.0


def test_an_axis_has_the_length_of_one(tmp_path: Path) -> None:
    assert read_robot(written(tmp_path, STAGE)).joints["ring"].axis == (0.0, 0.0, 1.0)


BRANCHED = STAGE.replace(
    "</robot>",
    '<link name="finger"/><joint name="grips" type="prismatic"><parent link="plate"/><child link="finger"/></joint>'
    '<link name="lamp"/><joint name="hangs" type="fixed"><parent link="foot"/><child link="lamp"/></joint></robot>',
)


def test_it_goes_to_the_last_link_and_what_is_fixed_to_a_link_belongs_to_it(tmp_path: Path) -> None:
    chain = chain_of(read_robot(written(tmp_path, BRANCHED)), tip="plate")
    assert [joint.name for joint, _, _ in chain.steps] == ["tilts"]
    assert {link.name for link, _ in chain.foot.links} == {"foot", "lamp"}
    assert {link.name for link, _ in chain.steps[0][2].links} == {"ring", "plate"}
    assert chain.last_from_tip[:3, 3].tolist() == [0.0, 0.0, 0.01]
    assert chain_of(read_robot(written(tmp_path, STAGE))).tip == "plate"


@pytest.mark.parametrize(
    ("text", "base", "tip", "named"),
    [
        (STAGE, None, "hand", "got 'hand'; it has foot, ring, plate"),
        (STAGE, "plate", "foot", "no joints lead there"),
        (STAGE, "ring", "plate", "found none; name --base and --tip"),
        (BRANCHED, None, "finger", "'grips' is prismatic"),
        (BRANCHED.replace("prismatic", "revolute").replace('name="lamp"', 'name="a"'), None, None, "does not have"),
        (STAGE.replace("</robot>", '<link name="b"/><joint name="c" type="fixed"><parent link="ring"/><child link="b"/>'
                       "</joint></robot>"), None, None, "it may be b, plate: name --tip"),
        (changed('<parent link="foot"/>', '<parent link="plate"/>'), None, None, "found none; name --base and --tip"),
        (changed('<parent link="foot"/>', '<parent link="plate"/>'), None, "plate", "no joints lead there"),
        (STAGE.replace("<limit", '<mimic joint="x"/><limit'), None, None, "'tilts' mimics 'x'"),
    ],
)  # fmt: skip
def test_a_way_that_cannot_be_gone_is_named(
    tmp_path: Path, text: str, base: str | None, tip: str | None, named: str
) -> None:
    with pytest.raises(UserError, match=named):
        chain_of(read_robot(written(tmp_path, text)), base=base, tip=tip)
