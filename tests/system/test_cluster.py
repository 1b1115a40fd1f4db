"""A Dask scheduler and two workers, each a process of its own, do the work on many recordings."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Generator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from station.__main__ import main
from station.app.many.each import Result, each
from station.cluster import cluster
from tests.patience import PATIENCE_S
from tests.system.ports import free_port
from tests.unit.diagnosis.recorded import GOLDEN

pytestmark = pytest.mark.system
distributed: Any = pytest.importorskip("distributed")
ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory: pytest.TempPathFactory) -> Generator[str]:
    """The address of a scheduler whose two workers have another working folder."""
    folder, address = tmp_path_factory.mktemp("dask"), f"127.0.0.1:{free_port()}"
    host, _, port = address.partition(":")
    worker = ["dask_worker", f"tcp://{address}", "--nthreads", "1", "--no-nanny", "--no-dashboard"]
    started = [
        _started(["dask_scheduler", "--host", host, "--port", port, "--no-dashboard"], folder),
        *(_started([*worker, "--local-directory", str(folder / name)], folder) for name in ("one", "two")),
    ]
    try:
        with distributed.Client(f"tcp://{address}", timeout=PATIENCE_S) as client:
            client.wait_for_workers(2, timeout=PATIENCE_S)
        yield f"tcp://{address}"
    finally:
        for process in reversed(started):
            process.kill()
            process.wait()


def _started(words: list[str], folder: Path) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", f"distributed.cli.{words[0]}", *words[1:]]
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.Popen(command, cwd=folder, env=env, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


@pytest.fixture(autouse=True)
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("recs").mkdir()
    for name in "abcd":
        shutil.copy(GOLDEN, f"recs/{name}.mcap")
    Path("recs/torn.mcap").write_bytes(GOLDEN.read_bytes()[:30_000])
    return tmp_path


def told(path: Path, name: str, *, parent: int) -> Result:
    """Returns who works on it, and where."""
    assert os.getpid() != parent
    return {"recording": name, "size": path.stat().st_size, "cwd": str(Path.cwd())}


def test_workers_of_the_cluster_do_the_work(scheduler: str, lab: Path) -> None:
    with cluster(f"dask={scheduler}"):
        rows = each([f"recs/{name}.mcap" for name in "abcd"], partial(told, parent=os.getpid()))
    assert [row.reason for row in rows] == [""] * 4
    assert {row.result["size"] for row in rows} == {GOLDEN.stat().st_size}
    assert str(lab) not in {row.result["cwd"] for row in rows}


def test_a_command_says_the_same_as_without_a_cluster(scheduler: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", "recs", "--json"]) == 1
    here = capsys.readouterr().out
    assert main(["doctor", "recs", "--json", "--out", "kept", "--backend", f"dask={scheduler}"]) == 1
    assert capsys.readouterr().out == here
    assert len(list(Path("kept/_results").iterdir())) == 1, "they are copies of one"


def test_no_scheduler_is_a_mistake_that_is_said(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("station.cluster.TIMEOUT_S", 0.2)
    assert main(["doctor", "recs", "--backend", f"dask=tcp://127.0.0.1:{free_port()}"]) == 2
    assert "Expected a Dask scheduler at tcp://127.0.0.1:" in capsys.readouterr().err
