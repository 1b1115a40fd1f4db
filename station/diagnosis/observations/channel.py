"""The interface of a channel: rows of one kind of evidence, which a model predicts up to noise."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields

import numpy as np

from station.diagnosis.observations.plate import Times
from station.physics.contact import Array, Bools, Contact
from station.physics.effect import Effect
from station.physics.model import Model


@dataclass(frozen=True, eq=False, kw_only=True)
class Rows:
    """The columns that every channel has, (n,) each.

    Attributes:
        run: index of the run in the evidence.
        from_ns, to_ns: the stretch of the recording that the row stands for.
        sigma: standard deviation of the measurement, in the residual's unit.
        astray: standard deviation of what else may shift the row, from reasons that nobody tells, in the same unit.
        limit: True where the residual is only a lower limit (a run that ended without a slide).
        covariates: the quantities that could explain a residual, by name; angles are those in `covariates.ANGLES`.
    """

    run: Times
    from_ns: Times
    to_ns: Times
    sigma: Array
    astray: Array
    limit: Bools
    covariates: Mapping[str, Array]

    def __len__(self) -> int:
        return len(self.run)

    @property
    def strayed(self) -> Bools:
        """The rows (n,), as a mask, that something else may shift by more than the measurement errs."""
        return self.astray > self.sigma

    def chosen(self, rows: Times | Bools) -> Rows:
        """Returns the rows with these indices or under this mask."""
        columns = {one.name: getattr(self, one.name) for one in fields(self)}
        covariates = columns.pop("covariates")
        picked = {name: values[rows] for name, values in columns.items()}
        return Rows(**picked, covariates={name: values[rows] for name, values in covariates.items()})


class Channel(ABC):
    """One kind of evidence.

    Attributes:
        name: the channel's name in tables.
        title: what it compares, in words.
        phase: the phase of a run in which it is seen, one of `PHASES`.
        unit: the residual's unit.
        shares_friction: True if the run's random effect on friction shifts its rows (by 1 per unit of ln mu).
        frictional: True if every law of friction changes its rows.
        level_tells: True if the rows' common level says something: it is neither mu's nor subtracted nor a mean of 0.
        trusted: the systematic floor in `unit`: an effect that changes its rows by less is not claimed on any evidence.
        undone_by: the methods of `Effect` that change how friction undoes a row's own motion, see `decay`.
        travelled_m: (n,) the way along the block's path, for rows that lie along one, else None. Only differences
            within a run have a meaning.
    """

    name: str
    title: str
    phase: str
    unit: str
    shares_friction: bool = False
    frictional: bool = False
    level_tells: bool = False
    trusted: float = 0.0
    undone_by: frozenset[str] = frozenset()
    travelled_m: Array | None = None

    def __init__(self, rows: Rows) -> None:
        self.rows = rows

    def __len__(self) -> int:
        return len(self.rows)

    def decay(self, model: Model) -> Array:
        """Returns how often (n,) friction undoes, within each row, a change of the very motion that calls it up.

        It is 0 where the motion is given, and negative where friction falls with the speed; see `likelihood.feedback`.
        """
        del model
        return np.zeros(len(self))

    def undone(self, covariate: str, columns_of: Callable[[Array], Array]) -> Array | float:
        """Returns the change (n, k) of `decay` by residuals of which columns (n, k) of a covariate (n,) are part."""
        del covariate, columns_of
        return 0.0

    def decays_by(self, effect: Effect) -> bool:
        """Returns true if an effect changes what `decay` returns."""
        return bool(self.undone_by & effect.acts_through())

    @abstractmethod
    def residual(self, model: Model) -> Array:
        """Returns recorded minus predicted (n,), in `unit`."""

    def off(self, model: Model) -> Array:
        """Returns the residual (n,) less what its run's other channels share of it.

        Its common level is the channel's own.
        """
        return self.residual(model)

    def near(self, model: Model | None) -> None:  # noqa: B027  # most channels have nothing to keep
        """Takes all models from now on for nearly this one, until None is given.

        A channel may then keep what is costly and does not change to first order.
        """

    @property
    def contact(self) -> Contact | None:
        """The recorded contacts; None for a channel that sees none."""
        return None

    @property
    def hooks(self) -> frozenset[str]:
        """The methods of `Effect` that can change the channel."""
        return ACTING[self.name.partition(":")[0]]

    def changed_by(self, effect: Effect) -> bool:
        """Returns true if an effect changes the channel at all, even if it changes another channel far more."""
        return bool(self.hooks & effect.acts_through())


PHASES = ("camera at rest", "pre-slip", "onset", "slide", "stop")
"""The phases of a run in which channels are seen, in their order."""

ONSET, ALONG, ACROSS, REST = "onset", "along", "across", "rest"
"""Names of channels: static friction, sliding friction, and the block's place at rest."""

CONTACT_HOOKS = frozenset({"friction", "push", "attitude", "delay_s"})
ACTING = {
    ONSET: CONTACT_HOOKS | {"shaking"},
    ALONG: CONTACT_HOOKS,
    ACROSS: CONTACT_HOOKS | {"lead"},
    "turn": frozenset({"spin", "lever", "lead"}),
    REST: frozenset({"seen", "creep"}),
    "plate": frozenset({"seen"}),
    "mount": frozenset(),
    "shape": frozenset({"seen"}),
    "sensor": frozenset({"attitude", "delay_s"}),
}
"""The methods of an effect that change each channel; the others need no evaluation."""


def rows_of(columns: Mapping[str, Array | Times | Bools], covariates: Mapping[str, Array]) -> Rows:
    """Builds rows from columns that are named as their fields; `limit` is False, and `astray` 0, unless it is given."""
    count = len(columns["run"])
    limit, astray = columns.get("limit", np.zeros(count, dtype=np.bool_)), columns.get("astray", np.zeros(count))
    return Rows(
        run=np.asarray(columns["run"], dtype=np.int64),
        from_ns=np.asarray(columns["from_ns"], dtype=np.int64),
        to_ns=np.asarray(columns["to_ns"], dtype=np.int64),
        sigma=np.asarray(columns["sigma"], dtype=np.float64),
        astray=np.asarray(astray, dtype=np.float64),
        limit=np.asarray(limit, dtype=np.bool_),
        covariates=covariates,
    )
