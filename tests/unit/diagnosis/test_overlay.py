"""The overlay: recorded and simulated blocks in one file, with what was located marked."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared.config import Table
from shared.errors import UserError
from station.app.overlaid import overlay_of, write_overlay
from station.diagnosis.result import Diagnosis, EffectFound, Located, Stretch, Value
from station.physics.catalogue import catalogue
from station.physics.model import Model, Term, table_of_model
from station.recording.reader import open_recording
from station.view.overlay import joined
from tests.unit.diagnosis.recorded import GOLDEN, golden
from tests.unit.diagnosis.tables import grained
from tests.unit.view.rrd_file import has_blueprint, rerun, rows_by_entity

GHOSTS = "/world/platform/simulated/"


def diagnosis(*, claimed: bool = True) -> Diagnosis:
    """Returns the golden session's diagnosis, as if friction had a direction and one onset stood out twice."""
    recorded, _ = golden()
    sample = recorded.samples[1]
    effect = catalogue()["plate_anisotropy"]
    term = Term(effect, {**effect.neutral(), "cos2": 0.2})
    window = Stretch(run=sample.run, from_ns=sample.slip_ns - 500_000_000, to_ns=sample.detect_ns)
    place = Located(
        phase="onset", covariate="direction", channel="onset", effect_size=0.5, p=0.001, runs=(sample.run,),
        windows=(window,), summary="onset: the friction changes with the direction",
    )  # fmt: skip
    found = EffectFound(
        id=effect.id, title=effect.title, class_ids=(effect.id,), probability=0.9, verdict="supported", parameters={}
    )
    return replace(
        grained().diagnosis,
        verdict="supported" if claimed else "not supported",
        mu_s=Value(value=0.35, sd=0.01, unit="1"),
        located=(place, replace(place, covariate="tilt", summary="onset: the friction changes with the tilt")),
        effects=(found,) if claimed else (),
        model=table_of_model(Model(mu_s=0.35, terms=(term,))),
    )


def written(path: Path, found: Diagnosis) -> dict[str, int]:
    """Returns how many rows each entity of the file has."""
    _, rig = golden()
    assert write_overlay(open_recording(GOLDEN), found, path, rig=rig, known=catalogue(), rig_path=None) > 1000
    rerun("rrd", "verify", path)
    assert has_blueprint(path)
    return rows_by_entity(path)


def test_recorded_and_simulated_blocks_stand_in_one_file(tmp_path: Path) -> None:
    rows = written(tmp_path / "over.rrd", diagnosis())
    for name in ("before", "after"):
        assert rows[f"{GHOSTS}{name}/block"] > 100
        assert rows[f"{GHOSTS}{name}/way"] == 3  # one for each run
        assert rows[f"/plots/block/simulated/{name}"] > 100
    assert rows["/world/platform/block"] > 100
    assert [name for name in rows if name.startswith("/state/located/")] == ["/state/located/onset"]
    assert rows["/state/located/onset"] == 3  # its meaning, and where it begins and ends
    assert rows["/log/diagnosis"] == 2
    assert rows["/world/platform/located"] == 2
    assert rows["/diagnosis"] == 1


def test_the_ghosts_are_those_of_the_simulator_that_was_asked_for() -> None:
    """A block in MuJoCo with the user's own soft contact has crept down by the time it slides."""
    recorded, rig = golden()
    soft = replace(rig, simulator=Table({"mujoco": {"cone": "elliptic"}}))
    planar, mujoco = (
        overlay_of(recorded, diagnosis(claimed=False), rig=soft, known=catalogue(), simulate=name)
        for name in ("planar", "mujoco")
    )
    assert "simulated before (mujoco)" in mujoco.words
    apart = planar.ghosts[0].path.pose[:, :2] - mujoco.ghosts[0].path.pose[:, :2]
    assert np.linalg.norm(apart, axis=1).max() > 1e-3
    for ghost in (planar.ghosts[0], mujoco.ghosts[0]):
        assert np.array_equal(ghost.path.time_ns, planar.ghosts[0].path.time_ns)


def test_without_a_claim_there_is_no_after(tmp_path: Path) -> None:
    rows = written(tmp_path / "over.rrd", diagnosis(claimed=False))
    assert f"{GHOSTS}before/block" in rows
    assert f"{GHOSTS}after/block" not in rows


def test_ghosts_start_where_the_block_lay_and_differ_by_what_was_found() -> None:
    recorded, rig = golden()
    overlay = overlay_of(recorded, diagnosis(), rig=rig, known=catalogue())
    before, after = (ghost.path for ghost in overlay.ghosts)
    for from_ns, _ in overlay.runs:
        own, seen = (path.between(from_ns, from_ns + 200_000_000).mean(axis=0) for path in (before, overlay.recorded))
        assert own == pytest.approx(seen, abs=1e-3)
    assert np.abs(before.pose - after.pose).max() > 1e-3


def test_stretches_that_overlap_are_marked_once() -> None:
    assert joined([(5, 8), (1, 3), (2, 4), (8, 9)]) == [(1, 4), (5, 9)]
    assert joined([]) == []


def test_what_cannot_be_tested_cannot_be_overlaid(tmp_path: Path) -> None:
    _, rig = golden()
    nothing = replace(diagnosis(), verdict="untestable", notes=("expected runs, found none",))
    with pytest.raises(UserError, match="expected runs, found none"):
        write_overlay(open_recording(GOLDEN), nothing, tmp_path / "o.rrd", rig=rig, known=catalogue(), rig_path=None)
