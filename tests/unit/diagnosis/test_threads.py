"""A diagnosis keeps to one core for each process that it was given."""

from __future__ import annotations

from pathlib import Path

from threadpoolctl import threadpool_info, threadpool_limits

from station.app.diagnosing import diagnose_file
from station.recording.tables import write_samples
from tests.unit.diagnosis.tables import samples


def test_linear_algebra_takes_one_thread(tmp_path: Path) -> None:
    """Its matrices are small: more threads would wait for each other, at full load."""
    threads = set[int]()

    def look(_: str) -> None:
        threads.update(pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas")

    write_samples(samples(), tmp_path / "samples.csv")
    with threadpool_limits(limits=2, user_api="blas"):  # whatever the environment asks for
        diagnose_file(tmp_path / "samples.csv", status=look)
    assert threads == {1}
