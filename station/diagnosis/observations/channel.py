"""The interface of a channel: rows of one kind of evidence, which a model predicts up to noise."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from station.diagnosis.observations.plate import Times
from station.physics.contact import Array, Bools
from station.physics.effect import Effect
from station.physics.model import Model


@dataclass(frozen=True, eq=False, kw_only=True)
class Rows:
    """What every channel has, (n,) each.

    Attributes:
        run: index of the run in the evidence.
        from_ns, to_ns: the stretch of the recording that the row stands for.
        sigma: standard deviation of the measurement, in the residual's unit.
        limit: True where the residual is only a lower limit (a run that ended without a slide).
        covariates: what could explain a residual, by name; an angle's name ends in `_rad`.
    """

    run: Times
    from_ns: Times
    to_ns: Times
    sigma: Array
    limit: Bools
    covariates: Mapping[str, Array]

    def __len__(self) -> int:
        return len(self.run)


class Channel(ABC):
    """One kind of evidence.

    Attributes:
        name: a word for tables.
        phase: when in a run it is seen: camera at rest, pre-slip, onset, slide or stop.
        unit: of the residual.
        shares_friction: whether the run's own draw of friction shifts its rows (by 1 per unit of ln mu).
        trusted: what all rows together are trusted to, in `unit`: by less no effect is told, however many runs say so.
        travelled_m: (n,) how far along its path the block is, of rows that lie along one; None of others. Only
            differences within a run mean anything.
    """

    name: str
    phase: str
    unit: str
    shares_friction: bool = False
    trusted: float = 0.0
    travelled_m: Array | None = None

    def __init__(self, rows: Rows) -> None:
        self.rows = rows

    def __len__(self) -> int:
        return len(self.rows)

    @abstractmethod
    def residual(self, model: Model) -> Array:
        """Recorded less predicted (n,), in `unit`."""

    def near(self, model: Model | None) -> None:  # noqa: B027  # most channels have nothing to keep
        """From now on takes all models for nearly this one, until None is given.

        What costs much and does not change to first order need not be looked for anew.
        """

    @property
    def hooks(self) -> frozenset[str]:
        """The methods of `Effect` through which one shows in it."""
        return ACTING[self.name.partition(":")[0]]

    def changed_by(self, effect: Effect) -> bool:
        """Whether an effect changes it at all: also where it shows far more in another channel."""
        return bool(self.hooks & effect.acts_through())


CONTACT_HOOKS = frozenset({"friction", "push", "attitude", "delay_s"})
ACTING = {
    "onset": CONTACT_HOOKS | {"shaking"},
    "along": CONTACT_HOOKS,
    "across": CONTACT_HOOKS,
    "turn": frozenset({"spin", "lever"}),
    "rest": frozenset({"seen", "creep"}),
    "plate": frozenset({"seen"}),
    "shape": frozenset({"seen"}),
    "sensor": frozenset({"attitude"}),
}
"""Which methods of an effect change which channel; saves the evaluations that would change nothing."""


def rows_of(columns: Mapping[str, Array | Times | Bools], covariates: Mapping[str, Array]) -> Rows:
    """Rows from columns that are named as their fields."""
    count = len(columns["run"])
    limit = columns.get("limit", np.zeros(count, dtype=np.bool_))
    return Rows(
        run=np.asarray(columns["run"], dtype=np.int64),
        from_ns=np.asarray(columns["from_ns"], dtype=np.int64),
        to_ns=np.asarray(columns["to_ns"], dtype=np.int64),
        sigma=np.asarray(columns["sigma"], dtype=np.float64),
        limit=np.asarray(limit, dtype=np.bool_),
        covariates=covariates,
    )


class Part(Channel):
    """Some rows of a channel: what the noise of some runs is estimated from."""

    def __init__(self, whole: Channel, chosen: Bools) -> None:
        rows = whole.rows
        super().__init__(
            Rows(
                run=rows.run[chosen],
                from_ns=rows.from_ns[chosen],
                to_ns=rows.to_ns[chosen],
                sigma=rows.sigma[chosen],
                limit=rows.limit[chosen],
                covariates={name: values[chosen] for name, values in rows.covariates.items()},
            )
        )
        self.name, self.phase, self.unit = whole.name, whole.phase, whole.unit
        self.shares_friction = whole.shares_friction
        self._whole, self._chosen = whole, chosen
        self.travelled_m = None if whole.travelled_m is None else whole.travelled_m[chosen]

    def changed_by(self, effect: Effect) -> bool:
        """As the whole is."""
        return self._whole.changed_by(effect)

    def residual(self, model: Model) -> Array:
        """Of the chosen rows."""
        return self._whole.residual(model)[self._chosen]
