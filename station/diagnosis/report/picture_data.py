"""The data of the report's figures: residuals with their places and covariates, and held-out predictions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from station.diagnosis.observations.channel import Channel
from station.diagnosis.observations.evidence import Evidence
from station.diagnosis.predict.held_out import HeldOut
from station.diagnosis.search.locate import smooth_part, tested_places
from station.diagnosis.search.search import Search, Stage
from station.physics.contact import Array, Bools
from station.physics.model import Model


@dataclass(frozen=True, eq=False, kw_only=True)
class ChannelPicture:
    """One channel's residuals (n,), recorded minus predicted, by the plain model and by the one that was found.

    Attributes:
        name, unit: the channel's.
        x_m, y_m: (n,) the block's place on the plate (P); nan where the channel has none.
        before, after: (n,) residuals in `unit`.
        limit: (n,) True where a residual is only a lower limit: a run without a slide.
    """

    name: str
    unit: str
    x_m: Array
    y_m: Array
    before: Array
    after: Array
    limit: Bools


@dataclass(frozen=True, kw_only=True)
class Spot:
    """A channel against a covariate: the smooth part's effect size, and the p by which `located` ranks it."""

    phase: str
    channel: str
    covariate: str
    effect_size: float
    p: float


@dataclass(frozen=True, eq=False, kw_only=True)
class PictureData:
    """The data of a diagnosis's figures, which is no part of its JSON; empty where nothing could be tested.

    `spots_before` are of the plain model's residuals, `spots_after` of those that the last stage tested.
    """

    channels: tuple[ChannelPicture, ...] = ()
    spots_before: tuple[Spot, ...] = ()
    spots_after: tuple[Spot, ...] = ()
    held_before: HeldOut | None = None
    held_after: HeldOut | None = None
    opening_radius_m: float = np.inf

    def channel(self, name: str) -> ChannelPicture | None:
        """Returns the channel of that name, or None."""
        return next((channel for channel in self.channels if channel.name == name), None)


def picture_data(
    evidence: Evidence, found: Search, both: tuple[HeldOut, HeldOut], *, opening_radius_m: float = np.inf
) -> PictureData:
    """Gathers the data; it evaluates each channel's residuals twice, and once more with a small fit for each spot."""
    before, after = found.null.model, found.model.model
    return PictureData(
        channels=tuple(_channel(channel, before, after) for channel in evidence.channels),
        spots_before=_spots(found.stages[0]),
        spots_after=_spots(found.stages[-1]),
        held_before=both[0],
        held_after=both[1],
        opening_radius_m=opening_radius_m,
    )


def _channel(channel: Channel, before: Model, after: Model) -> ChannelPicture:
    rows, unknown = channel.rows, np.full(len(channel), np.nan)
    return ChannelPicture(
        name=channel.name,
        unit=channel.unit,
        x_m=rows.covariates.get("x", unknown),
        y_m=rows.covariates.get("y", unknown),
        before=channel.residual(before),
        after=channel.residual(after),
        limit=rows.limit,
    )


def _spots(stage: Stage) -> tuple[Spot, ...]:
    return tuple(
        Spot(
            phase=place.phase,
            channel=place.channel.name,
            covariate=place.covariate,
            effect_size=smooth_part(stage.before.model, place)[2],
            p=p,
        )
        for place, p, _ in tested_places(stage)
    )
