"""A law that sets in beyond a size has no slope at its null, and is looked at with a size."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from station.diagnosis.inference.columns import scores
from station.diagnosis.inference.fit import Fit, fit
from station.diagnosis.inference.gain import gain
from station.diagnosis.inference.level import levelled
from station.diagnosis.observations.channel import REST, Channel, rows_of
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.table import table_evidence
from station.diagnosis.search.candidates import single_candidates
from station.physics.catalogue import catalogue
from station.physics.contact import Array
from station.physics.model import Model
from tests.contracts.effect_states import contacts
from tests.unit.diagnosis.tables import MU, samples
from tests.unit.physics.test_shaken_block import crept_m_s

SHAKEN_M_S2, HZ, NEAR_M_S2, FAR_M_S2, LASTED_S, NOISE_M = 0.12, 8.0, 0.1, 2.0, 0.3, 5e-6
RUNS, NEAR = 60, 4
"""Every so many blocks are seen near to their limit."""


class _Crept(Channel):
    """The ways that blocks have come before their slips, after LASTED_S at one distance to the limit."""

    name, title, phase, unit = REST, "the block's place before the slip", "pre-slip", "m"

    def __init__(self, crept_m: Array, spare_m_s2: Array) -> None:
        count = len(crept_m)
        none = np.zeros(count, dtype=np.int64)
        columns = {"run": np.arange(count), "from_ns": none, "to_ns": none, "sigma": np.full(count, NOISE_M)}
        super().__init__(rows_of(columns, {}))
        self._crept = crept_m
        self._resting = contacts(count, moving=False, down_rad=0.0, spare_m_s2=spare_m_s2)

    def residual(self, model: Model) -> Array:
        """Recorded minus predicted (n,), m."""
        return self._crept - LASTED_S * model.creep(self._resting)[:, 0]


def _evidence(shaken_m_s2: float) -> tuple[Evidence, Fit]:
    spare = np.where(np.arange(RUNS) % NEAR == 0, NEAR_M_S2, FAR_M_S2)
    crept = LASTED_S * crept_m_s(shaken_m_s2, HZ, NEAR_M_S2, cycles=20) if shaken_m_s2 else 0.0
    noise = np.random.default_rng(20261459).normal(0.0, NOISE_M, RUNS)
    plain = table_evidence(samples(runs=RUNS), Setting())
    rest = _Crept(np.where(spare == NEAR_M_S2, crept, 0.0) + noise, spare)
    evidence = replace(plain, channels=(*plain.channels, rest))
    return evidence, fit(evidence, levelled(evidence, Model(mu_s=MU)), ())


def test_blocks_that_creep_near_their_limit_show_that_the_arm_shakes() -> None:
    """They have come as far as Newton's steps say; to slopes at the null they are nothing but outliers."""
    evidence, null = _evidence(SHAKEN_M_S2)
    arm = catalogue()["arm_vibration"]
    scored = scores(evidence, null, [arm])
    slopes = [gain(scored, one.columns)[0][0] for one in scored.variants if one.start.values["sd_m_s2"] == 0.0]
    (candidate,) = single_candidates(evidence, null, [arm])
    assert max(slopes) < 10.0
    assert candidate.twice_gain > 30.0
    assert candidate.starts[0].values["sd_m_s2"] in (0.05, 0.1)


def test_blocks_that_lie_still_do_not() -> None:
    """A size that is not there gains nothing."""
    evidence, null = _evidence(0.0)
    (candidate,) = single_candidates(evidence, null, [catalogue()["arm_vibration"]])
    assert candidate.twice_gain < 10.0
