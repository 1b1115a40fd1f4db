"""The data of the report's figures: residuals with their places and covariates, and held-out predictions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from station.diagnosis.observations.channel import Channel
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.predict.held_out import HeldOut
from station.diagnosis.search.locate import smooth_part
from station.diagnosis.search.search import Search, Stage
from station.physics.contact import Array, Bools
from station.physics.model import Model


@dataclass(frozen=True, eq=False, kw_only=True)
class ChannelPicture:
    """One channel's residuals (n,), recorded minus predicted, by the plain model and by the one that was found.

    Attributes:
        name, phase, unit: the channel's.
        run: (n,) the recording's own run numbers.
        x_m, y_m: (n,) the block's place on the plate (P); nan where the channel has none.
        before, after: (n,) residuals in `unit`.
        sigma: (n,) the measurements' standard deviations.
        limit: (n,) True where a residual is only a lower limit: a run without a slide.
        covariates: (n,) each, by name, SI and radians.
    """

    name: str
    phase: str
    unit: str
    run: Array
    x_m: Array
    y_m: Array
    before: Array
    after: Array
    sigma: Array
    limit: Bools
    covariates: Mapping[str, Array] = field(default_factory=dict[str, Array])


@dataclass(frozen=True, kw_only=True)
class Spot:
    """A channel against a covariate: the smooth part's effect size, and its p corrected for the whole search."""

    phase: str
    channel: str
    covariate: str
    effect_size: float
    p: float


@dataclass(frozen=True, eq=False, kw_only=True)
class HeldOutPicture:
    """Predictions of every run (r,) by a fit that has not seen it; nan where a run has no such figure.

    `rank` is the share of the predicted distribution below the recorded onset, `log_score` a run's log density.
    """

    onset_error_deg: Array
    path_error_mm: Array
    rank: Array
    log_score: Array


@dataclass(frozen=True, eq=False, kw_only=True)
class PictureData:
    """The data of a diagnosis's figures, which is no part of its JSON; empty where nothing could be tested.

    `spots_before` are of the plain model's residuals, `spots_after` of those that the last stage tested.
    """

    channels: tuple[ChannelPicture, ...] = ()
    spots_before: tuple[Spot, ...] = ()
    spots_after: tuple[Spot, ...] = ()
    held_before: HeldOutPicture | None = None
    held_after: HeldOutPicture | None = None
    opening_radius_m: float = np.inf

    def channel(self, name: str) -> ChannelPicture | None:
        """The channel of that name, or None."""
        return next((channel for channel in self.channels if channel.name == name), None)


def picture_data(
    evidence: Evidence, found: Search, both: tuple[HeldOut, HeldOut], *, opening_radius_m: float = np.inf
) -> PictureData:
    """Gathers the data; it evaluates each channel's residuals twice, and once more with a small fit for each spot."""
    before, after = found.null.model, found.model.model
    return PictureData(
        channels=tuple(_channel(evidence, channel, before, after) for channel in evidence.channels),
        spots_before=_spots(found.stages[0]),
        spots_after=_spots(found.stages[-1]),
        held_before=_held(both[0]),
        held_after=_held(both[1]),
        opening_radius_m=opening_radius_m,
    )


def _channel(evidence: Evidence, channel: Channel, before: Model, after: Model) -> ChannelPicture:
    rows = channel.rows
    unknown = np.full(len(rows), np.nan)
    return ChannelPicture(
        name=channel.name,
        phase=channel.phase,
        unit=channel.unit,
        run=evidence.run_number[rows.run],
        x_m=rows.covariates.get("x", unknown),
        y_m=rows.covariates.get("y", unknown),
        before=channel.residual(before),
        after=channel.residual(after),
        sigma=rows.sigma,
        limit=rows.limit,
        covariates=rows.covariates,
    )


def _spots(stage: Stage) -> tuple[Spot, ...]:
    spots = list[Spot]()
    for candidate in stage.places:
        place = candidate.place
        if place is None:
            continue
        spots.append(
            Spot(
                phase=place.phase,
                channel=place.channel.name,
                covariate=place.covariate,
                effect_size=smooth_part(stage.before, place)[2],
                p=float(stage.calibration.corrected(candidate.p)),
            )
        )
    return tuple(spots)


def _held(held: HeldOut) -> HeldOutPicture:
    return HeldOutPicture(
        onset_error_deg=np.degrees(held.onset_rad),
        path_error_mm=1e3 * held.path_m,
        rank=held.rank,
        log_score=held.log_run,
    )
