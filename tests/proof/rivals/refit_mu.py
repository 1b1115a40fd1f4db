"""Identification of a model of fixed structure fits mu and its scatter here, and nothing is missed."""

from __future__ import annotations

from typing import ClassVar

from tests.proof.judged import judged
from tests.proof.rivals import Answer, Rival, Table


class RefitMu(Rival):
    """Fits mu alone; it never names anything, and is therefore right on nulls."""

    name: ClassVar[str] = "refit_mu"
    title: ClassVar[str] = "refit mu only"
    says_names: ClassVar[bool] = False
    says_places: ClassVar[bool] = False

    def answer(self, table: Table) -> Answer:
        """Held-out scores of the plain fit."""
        return Answer(held=judged(table.evidence, table.plain, (), table.fold))
