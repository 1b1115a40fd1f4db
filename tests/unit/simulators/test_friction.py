"""Pairs, their draws, and what a rig file may say of them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from shared.config import load_table, parse
from shared.errors import UserError
from station.simulators.mujoco.pairs import load_pair, pair_names
from station.simulators.mujoco.settings import TwinSettings
from station.simulators.mujoco.specimen import Block, Friction, Plate


def test_the_papers_four_pairs_are_there() -> None:
    assert pair_names() == ("steel_on_steel", "steel_on_wood", "wood_on_steel", "wood_on_wood")
    steel, mixed, wood = load_pair("steel_on_steel"), load_pair("wood_on_steel"), load_pair("wood_on_wood")
    assert (steel.mean_angle_rad, steel.scatter, steel.isotropic) == (0.35, 0.20, True)
    assert (mixed.mean_angle_rad, mixed.scatter) == (0.20, 0.10)
    assert wood.mean_angle_rad > steel.mean_angle_rad
    assert wood.fixed_in == "object"
    draw = wood.at(wood.mean_angle_rad)
    assert draw.mu_along < draw.mu < draw.mu_across


def test_draws_scatter_the_angle() -> None:
    friction = Friction(mean_angle_rad=0.35, scatter=0.2)
    rng = np.random.default_rng(7)
    angles = np.array([friction.draw(rng).angle_rad for _ in range(4000)])
    assert angles.mean() == pytest.approx(0.35, abs=4 * 0.07 / math.sqrt(4000))
    assert angles.std() == pytest.approx(0.07, rel=0.05)
    assert friction.draw(rng).mu == pytest.approx(math.tan(friction.draw(rng).angle_rad), rel=1.0)


def test_the_ellipse_keeps_its_geometric_mean() -> None:
    draw = Friction(mean_angle_rad=0.4, ratio=0.6).at(0.4)
    assert math.sqrt(draw.mu_along * draw.mu_across) == pytest.approx(math.tan(0.4))
    assert draw.mu_along / draw.mu_across == pytest.approx(0.6)


def test_a_rig_file_changes_a_pair(tmp_path: Path) -> None:
    file = tmp_path / "rig.toml"
    file.write_text('pair = "wood_on_wood"\nmean_mu = 0.5\nratio = 1.0\n[block]\nmass_kg = 0.0005\n')
    settings = parse(TwinSettings, load_table(file))
    friction = settings.friction()
    assert friction.mean_angle_rad == pytest.approx(math.atan(0.5))
    assert (friction.isotropic, friction.scatter, settings.block.mass_kg) == (True, 0.10, 0.0005)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('pair = "ice_on_ice"', "steel_on_steel"),
        ("scatter = 1.5", "scatter"),
        ("mean_mu = 0.5\nmean_angle_rad = 0.3", "not both"),
        ("colour = 3", "line 1"),
        ('fixed_in = "world"', "line 1"),
        ("[plate]\ncutout_radius_m = 0.2", "wider than the plate"),
    ],
)
def test_a_mistake_in_a_rig_file_is_named(tmp_path: Path, text: str, said: str) -> None:
    file = tmp_path / "rig.toml"
    file.write_text(text)
    with pytest.raises(UserError, match=said):
        parse(TwinSettings, load_table(file))


@pytest.mark.parametrize(
    "make",
    [
        lambda: Friction(mean_angle_rad=0.0),
        lambda: Friction(mean_angle_rad=0.3, ratio=-1.0),
        lambda: Block(mass_kg=math.nan),
        lambda: Plate(foam_mu=0.0),
    ],
)
def test_what_cannot_be_is_refused(make: object) -> None:
    with pytest.raises(ValueError, match="must"):
        make()  # type: ignore[operator]


def test_a_pair_that_is_not_there_is_named_with_its_key_and_the_others() -> None:
    with pytest.raises(UserError, match=r"'pair' in \[twin\].*wood_on_wood.*got 'glass_on_ice'"):
        load_pair("glass_on_ice")
