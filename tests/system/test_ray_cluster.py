"""Ray does the work on many recordings: a cluster of its own processes on this machine, and the address of one."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Generator
from functools import partial
from pathlib import Path

import pytest

from station.__main__ import main
from station.app.many.each import Result, each
from station.cluster import cluster
from tests.patience import PATIENCE_S
from tests.system.ports import free_port
from tests.unit.diagnosis.recorded import GOLDEN

pytestmark = [
    pytest.mark.system,
    pytest.mark.filterwarnings("default"),  # those of Ray's own code
]
pytest.importorskip("ray", reason="ray is not installed (the dependency group tools)")
ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module", autouse=True)
def head(tmp_path_factory: pytest.TempPathFactory) -> Generator[str]:
    """The address of a Ray head with two workers, whose working folder is another."""
    folder, port = tmp_path_factory.mktemp("ray"), free_port()
    words = ["start", "--head", "--block", "--node-ip-address=127.0.0.1", f"--port={port}", "--num-cpus=2"]
    more = ["--include-dashboard=false", "--object-store-memory=100000000", "--disable-usage-stats"]
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "ray.scripts.scripts", *words, *more]
    with (folder / "log").open("wb") as log:
        process = subprocess.Popen(command, cwd=folder, env=env, stdout=log, stderr=log)
    try:
        _wait_for(port)
        yield f"127.0.0.1:{port}"
    finally:
        process.terminate()
        process.wait(timeout=PATIENCE_S)


def _wait_for(port: int) -> None:
    last = time.monotonic() + PATIENCE_S
    while True:
        try:
            socket.create_connection(("127.0.0.1", port), timeout=1.0).close()
            return
        except OSError:
            if time.monotonic() > last:
                raise
            time.sleep(0.2)


@pytest.fixture(autouse=True)
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("recs").mkdir()
    for name in "abcd":
        shutil.copy(GOLDEN, f"recs/{name}.mcap")
    Path("recs/torn.mcap").write_bytes(GOLDEN.read_bytes()[:30_000])


def told(path: Path, name: str, *, parent: int) -> Result:
    """Returns the size of a recording; whoever works on it is another process than `parent`."""
    assert os.getpid() != parent
    return {"recording": name, "size": path.stat().st_size}


def test_workers_of_the_cluster_do_the_work(head: str) -> None:
    with cluster(f"ray={head}"):
        rows = each([f"recs/{name}.mcap" for name in "abcd"], partial(told, parent=os.getpid()))
    assert [row.reason for row in rows] == [""] * 4
    assert {row.result["size"] for row in rows} == {GOLDEN.stat().st_size}


def test_a_command_says_the_same_as_without_a_cluster(head: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", "recs", "--json", "--jobs", "1"]) == 1
    here = capsys.readouterr().out
    assert main(["doctor", "recs", "--json", "--out", "kept", "--backend", f"ray={head}"]) == 1
    assert capsys.readouterr().out == here
    assert len(list(Path("kept/_results").iterdir())) == 1, "they are copies of one"


def test_no_cluster_is_a_mistake_that_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", "recs", "--backend", f"ray=127.0.0.1:{free_port()}"]) == 2
    said = capsys.readouterr().err
    assert "Expected a Ray cluster at 127.0.0.1:" in said
    assert len(said.splitlines()) == 1
