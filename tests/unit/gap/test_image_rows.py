"""The evidence of the mark's picture: its shape while the block turns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from station.gap.evidence.build import evidence_of
from station.gap.evidence.evidence import Setting
from station.gap.evidence.image_rows import _mean_shape  # pyright: ignore[reportPrivateUsage]: its one user is the evidence
from station.physics.catalogue import catalogue
from station.physics.model import Model, Term
from station.simulators.simulator import simulator
from tests.unit.gap.recorded import OPENING_RADIUS_M, golden, joined

SQUARE_M = 0.005 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def test_the_mean_of_a_square_that_turns_is_that_square() -> None:
    turned = np.linspace(-0.6, 0.6, 25)
    at = np.exp(1j * turned)[:, None] * (SQUARE_M @ [1.0, 1j]) + (0.01 + 0.02j)
    seen = np.stack([at.real, at.imag], axis=-1)
    np.testing.assert_allclose(_mean_shape(seen, turned), SQUARE_M, atol=1e-12)
    shrunk = _mean_shape(seen, np.zeros_like(turned))
    assert np.abs(shrunk).max() < 0.97 * SQUARE_M.max(), "turned by 70° the plain mean is several per cent smaller"


def test_a_block_that_turns_does_not_seem_to_shrink() -> None:
    """Windows of a slide in which friction acts 0.5 mm beside the mass: no strain beyond its noise."""
    recorded, rig = golden()
    rig = replace(rig, plate=replace(rig.plate, opening_m=2 * OPENING_RADIUS_M))
    model = Model(mu_s=0.35).with_term(Term(catalogue()["uneven_contact"], {"x_m": 5e-4, "y_m": 3e-4}))
    rng = np.random.default_rng(3)
    signals = joined([simulator("planar").repeat(recorded, model, rig=rig, rng=rng) for _ in range(4)])
    setting = Setting(
        opening_radius_m=OPENING_RADIUS_M, block_side_m=rig.block.size_m[0], block_mass_kg=rig.block.mass_kg
    )
    shape = evidence_of(signals, setting).channel("shape")
    assert shape is not None
    strain = shape.residual(Model(mu_s=0.35)).reshape(-1, 3)
    sliding = shape.rows.covariates["speed"][::3] > 0.02
    assert sliding.sum() > 20
    area = 0.5 * strain[sliding, :2].sum(axis=1)
    error = np.std(area) / np.sqrt(len(area))
    assert abs(area.mean()) < 3.3 * error
