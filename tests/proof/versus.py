"""The tool beside its rivals, on the same cases and folds."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tests.proof.gates import Gate, figure, share
from tests.proof.places import cell, truly
from tests.proof.rivals import NOT_HERE, rivals
from tests.proof.said import number
from tests.proof.scoring import Scored, of_kind

TOOL, ORACLE = "station diagnose", "oracle (knows the effects)"


@dataclass(frozen=True, kw_only=True)
class Line:
    """A row: what a method says, and how it predicts unseen runs.

    Name right and place right are of strong singles, the name on nulls of these; errors of onsets (deg) and paths (mm,
    root mean squares, medians over the cases), the gain and the gap closed are of singles and pairs. A cell without
    cases is one that this rival has nothing to say in.
    """

    title: str
    name: Gate
    null_named: Gate
    place: Gate
    onset: Gate
    path: Gate
    gain: Gate
    gap: Gate
    note: str = ""

    @property
    def cells(self) -> tuple[Gate, ...]:
        """The gates in the order of the table."""
        return self.name, self.null_named, self.place, self.onset, self.path, self.gain, self.gap


def versus(cases: Sequence[Scored], reasons: Mapping[str, str]) -> list[Line]:
    """The tool, the rivals that ran, those that could not with the reason, and the oracle."""
    refitted = [one for one in cases if one.refit.get("rivals")]
    if not refitted:
        return []
    lines = [_tool(refitted)]
    for name, rival in rivals().items():
        ran = [(one, one.refit["rivals"][name]) for one in refitted if name in one.refit.get("rivals", {})]
        why = reasons.get(name, "")
        lines.append(_rival(rival.title, ran, names=rival.says_names, places=rival.says_places, why=why))
    lines += [_rival(name, (), names=False, places=False, why=why) for name, why in NOT_HERE.items()]
    return [*lines, _oracle(refitted)]


def _tool(cases: Sequence[Scored]) -> Line:
    strong, effects = _strong(cases), of_kind(cases, "single", "pair")
    return Line(
        title=TOOL,
        name=share("name", "", (one.right_first for one in strong)),
        null_named=share("null", "", (bool(one.said.names) for one in of_kind(cases, "null"))),
        place=share("place", "", (_tool_place(one) for one in strong)),
        onset=figure("onset", "", (one.error("onset_rmse_deg", "after") for one in effects), _median),
        path=figure("path", "", (one.error("path_rmse_mm", "after") for one in effects), _median),
        gain=figure("gain", "", (one.gain for one in effects), _mean),
        gap=figure("gap", "", (one.gap_closed for one in effects), _median),
    )


def _tool_place(case: Scored) -> bool:
    """True if its first located place is right, taken alone, as the rivals have one."""
    located = case.said.answer.get("located", ())
    first = cell(located[0]["phase"], located[0]["covariate"]) if located else None
    return any(first in truly(effect) for effect in case.truth.effects)


def _rival(title: str, ran: Sequence[tuple[Scored, Mapping[str, Any]]], *, names: bool, places: bool, why: str) -> Line:
    good = [(case, answer) for case, answer in ran if "fault" not in answer]
    faults = len(ran) - len(good)
    strong = [(case, answer) for case, answer in good if case.truth.kind == "single" and case.strong]
    effects = [(case, answer) for case, answer in good if case.truth.kind in ("single", "pair")]
    plain = [answer for case, answer in good if case.truth.kind == "null"]
    note = why or (f"failed on {faults} of {len(ran)} cases: {_fault(ran)}" if faults else "")
    return Line(
        title=title,
        name=share("name", "", (_first_right(case, answer) for case, answer in strong if names)),
        null_named=share("null", "", (bool(answer["names"]) for answer in plain if names)),
        place=share("place", "", (_place(case, answer) for case, answer in strong if places)),
        onset=figure("onset", "", (number(answer.get("onset_deg")) for _, answer in effects), _median),
        path=figure("path", "", (number(answer.get("path_mm")) for _, answer in effects), _median),
        gain=figure("gain", "", (number(answer.get("gain")) for _, answer in effects), _mean),
        gap=figure(
            "gap", "", (min(case.share_of(number(answer.get("gain"))), 1.0) for case, answer in effects), _median
        ),
        note=note,
    )


def _first_right(case: Scored, answer: Mapping[str, Any]) -> bool:
    return bool(answer["names"]) and answer["names"][0] in case.truth.right


def _place(case: Scored, answer: Mapping[str, Any]) -> bool:
    place = answer.get("place")
    return place is not None and any(cell(place[0], place[1]) in truly(effect) for effect in case.truth.effects)


def _fault(ran: Sequence[tuple[Scored, Mapping[str, Any]]]) -> str:
    return next((str(answer["fault"]) for _, answer in ran if "fault" in answer), "")


def _oracle(cases: Sequence[Scored]) -> Line:
    nothing = share("", "", ())
    effects = [one for one in of_kind(cases, "single", "pair") if "oracle" in one.refit]
    return Line(
        title=ORACLE, name=nothing, null_named=nothing, place=nothing,
        onset=figure("onset", "", (number(one.refit["oracle"].get("onset_deg")) for one in effects), _median),
        path=figure("path", "", (number(one.refit["oracle"].get("path_mm")) for one in effects), _median),
        gain=figure("gain", "", (number(one.refit["oracle"]["gain"]) for one in effects), _mean),
        gap=figure("gap", "", (), _median),
    )  # fmt: skip


def _strong(cases: Sequence[Scored]) -> list[Scored]:
    return [one for one in of_kind(cases, "single") if one.strong]


def _mean(values: np.ndarray) -> float:
    return float(np.mean(values)) if len(values) else math.nan


def _median(values: np.ndarray) -> float:
    return float(np.median(values)) if len(values) else math.nan
