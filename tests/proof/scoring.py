"""One case scored: what was concealed beside what was said."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from shared.rig import RigConfig
from tests.proof.advice import advice_right, reason_right
from tests.proof.key import Concealed, Truth
from tests.proof.parameters import Map, Pull, pulls_of
from tests.proof.places import acting_auc, place_auc, place_right
from tests.proof.said import Said, number

CONFIDENT = 0.9


@dataclass(frozen=True, kw_only=True)
class Scored:
    """A case with its truth, answer, rig, and the refits (empty where there are none).

    `maps` are the effects whose parameters can be compared, and `inexact` the reasons why others cannot.
    """

    truth: Truth
    said: Said
    rig: RigConfig | None = None
    refit: Mapping[str, Any] = field(default_factory=dict[str, Any])
    maps: Mapping[str, Map] = field(default_factory=dict[str, Map])
    inexact: Mapping[str, str] = field(default_factory=dict[str, str])

    @property
    def tier(self) -> str:
        """The case's tier."""
        return self.truth.tier

    @property
    def strong(self) -> bool:
        """True if every concealed effect should be found without doubt."""
        return bool(self.truth.effects) and all(effect.strong for effect in self.truth.effects)

    @property
    def alarmed(self) -> bool:
        """True if anything is claimed; a fault of the tool is no silence and counts as an alarm."""
        return self.said.fault is not None or bool(self.said.claimed)

    @property
    def significant(self) -> bool:
        """True if the global p is below 5 %."""
        return number(self.said.answer.get("global_p")) < 0.05

    @property
    def right_first(self) -> bool:
        """True if the first name is a true one."""
        return self.said.first in self.truth.right

    @property
    def right_class(self) -> bool:
        """True if every truth stands in some claimed class."""
        return all(effect.right & self.said.within for effect in self.truth.effects)

    @property
    def both(self) -> bool:
        """True if every truth is a name of its own."""
        return self.truth.each_named(self.said.names)

    @property
    def wrongly_confident(self) -> bool:
        """True if a name that is no truth is said without doubt: supported, alone in its class, at 0.9 or more."""
        sure = {effect["id"] for effect in self.said.claimed if number(effect["probability"]) >= CONFIDENT}
        return any(name not in self.truth.right and name in sure for name in self.said.confident)

    @property
    def wrongly_named(self) -> bool:
        """For effects outside the catalogue: whether the first claim is one of the catalogue."""
        return self.said.first not in ("none", "other", "fault")

    @property
    def located(self) -> bool:
        """True if a place of any concealed effect was found."""
        return any(place_right(self.said, effect) for effect in self.truth.effects)

    @property
    def advised(self) -> bool:
        """True if the next experiment would split what the design confounds."""
        return advice_right(self.truth, self.said)

    @property
    def explained(self) -> bool:
        """True if the answer says that the concealed effect cannot be tested, and what that takes."""
        return reason_right(self.truth, self.said)

    @property
    def gain(self) -> float:
        """Held-out gain of the tool per run; 0 where it claims no model, nan where that is unknown."""
        if "tool" in self.refit:
            return number(self.refit["tool"]["gain"])
        if not self.said.names and self.said.fault is None:
            return 0.0
        return number(self.said.answer.get("fit", {}).get("log_score_gain"))

    @property
    def gap_closed(self) -> float:
        """The tool's held-out gain over the oracle's; nan where the oracle gains less than two standard errors.

        A tool that claims more than the truth may gain more than the oracle, whose law is not quite the generator's:
        that counts as 1, so that it cannot make up for another case.
        """
        return min(self.share_of(self.gain), 1.0)

    def share_of(self, gain: float) -> float:
        """A held-out gain as a share of the oracle's."""
        oracle = self.refit.get("oracle")
        if not oracle or not number(oracle["gain"]) > 2 * number(oracle["se"]):
            return math.nan
        return gain / number(oracle["gain"])

    def error(self, figure: str, when: str) -> float:
        """An error of unseen runs, `before` or `after`, as the tool tells it; nan if it tells none."""
        return number(self.said.answer.get("fit", {}).get(when, {}).get(figure))

    def falls(self, figure: str) -> bool | None:
        """True if an error of unseen runs, `onset_rmse_deg` or `path_rmse_mm`, is less after than before."""
        before, after = (self.error(figure, when) for when in ("before", "after"))
        return after < before if math.isfinite(before) and math.isfinite(after) else None

    @property
    def paths_better_without(self) -> bool | None:
        """True if unseen paths get better by more than two standard errors once a right name is left out."""
        right = [one.get("held_out") for one in self.said.claimed if self.truth.right & set(one["class"])]
        gains = [(number(one["path_gain_mm"]), number(one["path_gain_se_mm"])) for one in right if one]
        known = [(gain, error) for gain, error in gains if math.isfinite(gain) and math.isfinite(error)]
        return any(gain < -2.0 * error for gain, error in known) if known else None

    def aucs(self) -> list[float]:
        """Returns the area under the ROC curve of each concealed effect's place."""
        effects = self.truth.effects
        return [place_auc(self.said, effect, others=_without(effects, effect)) for effect in effects]

    def acting_aucs(self) -> list[float]:
        """The same by what the tool says of each effect's own sizes; one that is not named has 0.5."""
        return [acting_auc(self.said, effect) for effect in self.truth.effects]

    def pulls(self) -> tuple[list[Pull], dict[str, str]]:
        """Parameters of the rightly named effects, and those left out."""
        if self.rig is None:
            return [], {}
        return pulls_of(self.truth, self.said, self.rig, maps=self.maps, inexact=self.inexact)

    def statements(self) -> list[tuple[float, bool]]:
        """Every claim's probability, and whether its class has a truth, or `other` where that is."""
        outside = self.truth.answer == "other"
        return [
            (
                number(effect["probability"]),
                bool(self.truth.right & set(effect["class"])) or (outside and "other" in effect["class"]),
            )
            for effect in self.said.claimed
        ]


def _without(effects: Sequence[Concealed], one: Concealed) -> list[Concealed]:
    return [effect for effect in effects if effect is not one]


def of_kind(cases: Sequence[Scored], *kinds: str) -> list[Scored]:
    """Returns the cases of some kinds."""
    return [case for case in cases if case.truth.kind in kinds]
