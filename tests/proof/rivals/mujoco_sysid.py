"""MuJoCo's own system identification: the sliding coefficient and a damping, from simulated and recorded slides."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields
from typing import ClassVar

import numpy as np

from station.diagnosis.inference.fit import fit
from station.diagnosis.observations.plate import PlateMotion, Times
from station.diagnosis.observations.tracks import RunTrack, run_tracks
from station.diagnosis.predict.held_out import HeldOut
from station.physics.contact import GRAVITY_M_S2, Array, Bools
from station.physics.model import Term
from tests.proof.identify import Identified, Slide, identify, sysid
from tests.proof.judged import judged
from tests.proof.rivals import Answer, Rival, Table

MOST_SLIDES, MOST_FRAMES = 8, 30
"""Slides of the training runs that a fit rests on, drawn at random, and frames of each: a third of a second."""

FEWEST_FRAMES, FIRST_FRAMES = 15, 15
"""The fewest frames of a slide; and those that its first place and velocity are read from."""

SEED = 3


class MujocoSysid(Rival):
    """Fits what MuJoCo has of friction on slides; it names nothing.

    What it finds is a damping, beside a coefficient for each slide. As a law it is judged as the tool judges the same
    one, a drag held at that number: with mu, its scatter and the readings' own errors fitted anew, without each fold.
    """

    name: ClassVar[str] = "mujoco_sysid"
    title: ClassVar[str] = "mujoco.sysid: sliding friction and damping"
    says_names: ClassVar[bool] = False
    says_places: ClassVar[bool] = False

    def why_not(self) -> str | None:
        """Its package is there wherever MuJoCo is, but not what that needs."""
        return None if sysid() is not None else "what mujoco.sysid needs is not installed: pip install --group proof"

    def answer(self, table: Table) -> Answer:
        """Held-out scores of what it identifies."""
        slides = slides_of(table)
        if len(slides) < 2 * MOST_SLIDES:
            return Answer()
        side_m = math.sqrt(float(np.median(table.evidence.facts.area_m2)))
        parts: list[tuple[Bools, HeldOut]] = []
        for number in np.unique(table.fold).tolist():
            known = [run for run in slides if table.fold[run] != number]
            chosen = np.random.default_rng(SEED).choice(known, min(MOST_SLIDES, len(known)), replace=False)
            found = identify([slides[run] for run in chosen.tolist()], side_m=side_m)
            parts.append((table.fold == number, _judged(table, found)))
        return Answer(held=_together(parts))


def _together(parts: Sequence[tuple[Bools, HeldOut]]) -> HeldOut:
    """Returns the predictions of each part for its own runs."""
    mine = [mine for mine, _ in parts]

    def of(name: str) -> Array:
        return np.select(mine, [getattr(held, name) for _, held in parts], np.nan)

    return HeldOut(*(of(one.name) for one in fields(HeldOut)))


def _judged(table: Table, found: Identified) -> HeldOut:
    """Predictions by a drag that does not depend on the load, held at what was identified."""
    viscous = table.catalogue["viscous"]
    drag = viscous.parameters[0].clipped(found.drag_n_s_m)
    law = table.plain.model.with_term(Term(viscous, {"drag_n_s_m": drag, "by_load": 0.0}))
    fitted = fit(table.evidence, law, (), noise=table.plain.noise) if drag > 0.0 else table.plain
    return judged(table.evidence, fitted, (), table.fold)


def slides_of(table: Table) -> dict[int, Slide]:
    """The slides by the place of their run in the evidence, where the tool's windows say that the block slid freely."""
    along = table.evidence.channel("along")
    if along is None:
        return {}
    plate = PlateMotion(table.signals.attitude, table.signals.motions)
    tracks = {track.sample.run: track for track in run_tracks(table.signals)}
    found = dict[int, Slide]()
    for place in np.unique(along.rows.run).tolist():
        track = tracks.get(round(float(table.evidence.run_number[place])))
        mine = along.rows.run == place
        if track is None:
            continue
        slide = _slide(track, plate, along.rows.from_ns[mine], along.rows.to_ns[mine], _mass(table, place))
        if slide is not None:
            found[place] = slide
    return found


def _mass(table: Table, place: int) -> float:
    return float(table.evidence.facts.mass_kg[place])


def _slide(track: RunTrack, plate: PlateMotion, from_ns: Times, to_ns: Times, mass_kg: float) -> Slide | None:
    """The frames of a run's windows; None where there are too few."""
    frames = track.frames(int(from_ns.min()), int(to_ns.max()) + 1)
    time_ns, place = track.time_ns[frames][:MOST_FRAMES], track.pose[frames, :2][:MOST_FRAMES]
    if len(time_ns) < FEWEST_FRAMES:
        return None
    time_s = (time_ns - time_ns[0]) * 1e-9
    # A cubic through the first frames: one frame's place, and two frames' velocity, would be their noise.
    first = np.polyfit(time_s[:FIRST_FRAMES], place[:FIRST_FRAMES], 3)
    return Slide(
        time_s=time_s,
        place_m=np.concatenate([first[3:4], place[1:]]) - first[3],
        velocity_m_s=first[2],
        gravity_m_s2=GRAVITY_M_S2 * plate.gravity_at(time_ns),
        mass_kg=mass_kg,
    )
