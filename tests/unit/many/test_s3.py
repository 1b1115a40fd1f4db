"""The commands over a bucket of an S3 server on this machine (moto's), a damaged object among its recordings."""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
from collections.abc import Generator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from station.__main__ import main
from station.app import analysis_files
from station.app.many import remote
from tests.patience import PATIENCE_S
from tests.recovery.test_analysis_command import recorded
from tests.unit.diagnosis.recorded import GOLDEN
from tests.unit.friction.sessions import session

pytest.importorskip("s3fs", reason="the extra remote is not installed")
moto: Any = pytest.importorskip("moto.server", reason="moto, flask and flask-cors are not installed")
ROOT = Path(__file__).parents[3]
DAY = "s3://lab/2026"


@pytest.fixture(scope="module")
def endpoint(tmp_path_factory: pytest.TempPathFactory) -> Generator[str]:
    """The address of a server with two recordings (one deeper), a torn one and a note in the bucket `lab`."""
    other = tmp_path_factory.mktemp("s3") / "other.mcap"
    recorded(session(5, rng=np.random.default_rng(1)), other)
    server = moto.ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    address = f"http://{host}:{port}"
    store = _client(address)
    store.create_bucket(Bucket="lab")
    whole = GOLDEN.read_bytes()
    for name, data in {
        "one.mcap": whole,
        "deep/two.mcap": other.read_bytes(),
        "torn.mcap": whole[:30_000],
        "note.txt": b"no recording",
    }.items():
        store.put_object(Bucket="lab", Key=f"2026/{name}", Body=data)
    yield address
    server.stop()


def _client(endpoint: str) -> Any:
    session: Any = importlib.import_module("boto3").session.Session(aws_access_key_id="a", aws_secret_access_key="b")
    return session.client("s3", endpoint_url=endpoint, region_name="us-east-1")


@pytest.fixture(autouse=True)
def settings(endpoint: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Sets what the page tells a user to; fsspec has read its own part of the environment when it was loaded."""
    for name, value in {
        "AWS_ACCESS_KEY_ID": "a",
        "AWS_SECRET_ACCESS_KEY": "b",
        "FSSPEC_S3_ENDPOINT_URL": endpoint,
        remote.CACHE_NAMED_BY: str(tmp_path / "cache"),
    }.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setitem(importlib.import_module("fsspec.config").conf, "s3", {"endpoint_url": endpoint})
    monkeypatch.setattr(analysis_files, "figure_kinds", tuple)
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("command", ["doctor", "samples", "analyze", "diagnose"])
def test_a_damaged_object_is_a_row_and_stops_no_other(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command, f"{DAY}/**/*.mcap", "--jobs", "1", "--out", "kept"]) == 1
    said = capsys.readouterr().out
    assert f"✗ {DAY}/torn.mcap: Expected a finished recording" in said
    assert "3 recordings: 2 done, 1 could not be read." in said
    assert all(f"{DAY}/{name}.mcap" in said for name in ("one", "deep/two"))
    main([command, f"{DAY}/**/*.mcap", "--jobs", "1", "--out", "kept"])
    assert "3 recordings: 2 there already, 1 could not be read." in capsys.readouterr().out


def test_an_object_says_what_its_file_says(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", f"{DAY}/one.mcap"]) == 1
    there = capsys.readouterr().out
    assert main(["doctor", str(GOLDEN)]) == 1
    assert there.replace(f"{DAY}/one.mcap", str(GOLDEN)) == capsys.readouterr().out


def test_a_folder_is_listed_from_a_terminal_by_what_the_environment_says(tmp_path: Path) -> None:
    words = [sys.executable, "-m", "station", "doctor", f"{DAY}/", "--json", "--jobs", "1"]
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    ended = subprocess.run(words, env=env, capture_output=True, text=True, check=False, timeout=PATIENCE_S)
    rows = json.loads(ended.stdout)
    assert (ended.returncode, ended.stderr) == (1, "")
    assert [row["path"] for row in rows] == [f"{DAY}/{name}.mcap" for name in ("deep/two", "one", "torn")]
    assert ["error" in row for row in rows] == [False, False, True]


@pytest.mark.parametrize(
    ("word", "said"),
    [
        (f"{DAY}/none.mcap", f"Expected a recording at {DAY}/none.mcap, but there is none"),
        ("s3://nobody/*.mcap", "s3://nobody/*.mcap"),
        (f"{DAY}/*.bag", "found none"),
    ],
)
def test_what_names_no_object_is_one_sentence(word: str, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", word]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert len(error.splitlines()) == 1


def test_an_object_that_was_written_anew_is_read_anew(endpoint: str, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["samples", "s3://lab/again/*.mcap", "--jobs", "1", "--out", "kept"]
    store = _client(endpoint)
    store.put_object(Bucket="lab", Key="again/a.mcap", Body=GOLDEN.read_bytes()[:30_000])
    assert main(words) == 2
    store.put_object(Bucket="lab", Key="again/a.mcap", Body=GOLDEN.read_bytes())
    importlib.import_module("s3fs").S3FileSystem.clear_instance_cache()  # as a new process has none
    assert main(words) == 0
    assert "1 recording: 1 done." in capsys.readouterr().out


def test_no_server_is_one_sentence(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setitem(importlib.import_module("fsspec.config").conf, "s3", {"endpoint_url": "http://127.0.0.1:9"})
    assert main(["doctor", "s3://lab/2026/"]) == 2
    error = capsys.readouterr().err
    assert "Expected to fetch s3://lab/2026/, but that failed" in error
    assert len(error.splitlines()) == 1
