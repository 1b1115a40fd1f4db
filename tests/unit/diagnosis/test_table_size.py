"""Tables whose diagnosis would not fit into memory are refused before it begins."""

from __future__ import annotations

import numpy as np
import pytest

from shared.errors import UserError
from shared.messages import Sample
from station.diagnosis.observations import table_size
from station.diagnosis.observations.setting import Setting
from station.diagnosis.observations.table import table_evidence
from station.diagnosis.observations.table_size import Index, require_room
from station.recording.measured import MOST_ROWS
from station.signals.measured import Measured


def test_as_many_rows_as_are_read_have_room_without_groups() -> None:
    require_room(None, MOST_ROWS)


def test_rows_of_few_groups_have_less_room_than_those_of_many() -> None:
    rows: Index = np.arange(20_000, dtype=np.int64)
    require_room(rows % 200, len(rows))
    with pytest.raises(UserError, match="got 20000 rows in 7 groups, the largest of 2858: rows of one group share"):
        require_room(rows % 7, len(rows))


def test_a_table_of_large_groups_is_refused_before_its_diagnosis(monkeypatch: pytest.MonkeyPatch) -> None:
    count = 30
    monkeypatch.setattr(table_size, "MOST_BYTES", table_size.ROW_BYTES * count + table_size.PAIR_BYTES * 200)
    rng = np.random.default_rng(1)
    columns = {"friction_coefficient": rng.uniform(0.2, 0.4, count), "time_s": np.arange(count, dtype=np.float64)}

    def made(groups: int) -> Measured:
        named = tuple(str(number % groups) for number in range(count))
        return Measured(samples=(Sample(),) * count, more=columns, group=named)

    assert table_evidence(made(10), Setting()).runs == count
    with pytest.raises(UserError, match="30 rows in 2 groups, the largest of 15"):
        table_evidence(made(2), Setting())
