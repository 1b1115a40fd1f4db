"""Recordings elsewhere: listed, fetched whole and once, and one sentence for whatever goes wrong."""

from __future__ import annotations

import functools
import threading
from collections.abc import Generator
from http.server import HTTPServer, SimpleHTTPRequestHandler
from pathlib import Path
from typing import Any

import pytest

from shared.errors import UserError
from station.__main__ import main
from station.app.many import remote
from station.app.many.named import chosen
from station.recording.parts import files_of
from station.recording.reader import digest, open_recording
from tests.unit.diagnosis.recorded import GOLDEN
from tests.unit.recording.test_parts import split

fsspec: Any = pytest.importorskip("fsspec")


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(remote.CACHE_NAMED_BY, str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def store() -> Generator[Any]:
    system = fsspec.filesystem("memory")
    for name in ("/lab/one.mcap", "/lab/deep/two.mcap", "/lab/three.csv", "/lab/note.txt"):
        system.pipe(name, name.encode())
    yield system
    system.rm("/lab", recursive=True)


@pytest.fixture
def server(tmp_path: Path) -> Generator[str]:
    """A folder with a recording on a web server of this machine."""
    pytest.importorskip("aiohttp")
    folder = tmp_path / "served" / "lab"
    folder.mkdir(parents=True)
    (folder / "one.mcap").write_bytes(GOLDEN.read_bytes())

    class Quiet(SimpleHTTPRequestHandler):
        def log_message(self, format: str, *args: Any) -> None:
            pass

    with HTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=str(folder.parent))) as http:
        thread = threading.Thread(target=http.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{http.server_port}/lab"
        http.shutdown()
        thread.join()


@pytest.mark.parametrize(
    ("word", "names", "one"),
    [
        ("memory://lab/one.mcap", ["one.mcap"], True),
        ("memory://lab/*.*", ["one.mcap", "three.csv"], False),
        ("memory://lab", ["deep/two.mcap", "one.mcap"], False),
        ("memory://lab/**/*.mcap", ["deep/two.mcap", "one.mcap"], False),
    ],
)
@pytest.mark.usefixtures("store")
def test_addresses_name_recordings(word: str, names: list[str], one: bool) -> None:
    found = chosen([word])
    assert [name.replace("memory:///", "memory://") for name in found.names] == [f"memory://lab/{it}" for it in names]
    assert found.one == one


def test_a_copy_is_made_once_and_anew_when_the_recording_changes(store: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    fetched = list[str]()
    fetch = store.get_file

    def counted(_self: Any, path: str, local: str) -> None:
        fetched.append(path)
        fetch(path, local)

    monkeypatch.setattr(type(store), "get_file", counted)
    first = remote.local("memory://lab/one.mcap")
    assert (first.name, first.read_bytes()) == ("one.mcap", b"/lab/one.mcap")
    assert remote.local("memory://lab/one.mcap") == first
    assert len(fetched) == 1
    store.pipe("/lab/one.mcap", b"/LAB/ONE.MCAP")
    assert remote.local("memory://lab/one.mcap").read_bytes() == b"/LAB/ONE.MCAP"


@pytest.mark.usefixtures("store")
def test_a_transfer_that_breaks_off_leaves_nothing(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def half(_self: Any, _path: str, local: str) -> None:
        Path(local).write_bytes(b"/lab")

    monkeypatch.setattr(fsspec.get_filesystem_class("memory"), "get_file", half)
    with pytest.raises(UserError, match="4 of 13 bytes came"):
        remote.local("memory://lab/one.mcap")
    assert [path for path in cache.rglob("*") if path.is_file()] == []


@pytest.mark.parametrize(
    ("word", "said"),
    [
        ("memory://lab/none.mcap", "there is none"),
        ("memory://lab/*.bag", "found none"),
        ("odd://lab/a.mcap", "Protocol not known"),
        ("http://127.0.0.1:9/a.mcap", "Expected"),
    ],
)
@pytest.mark.usefixtures("store")
def test_what_names_nothing_is_said_at_once(word: str, said: str) -> None:
    with pytest.raises(UserError, match=said):
        chosen([word])


def test_a_store_whose_package_is_missing_is_named_with_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(_address: str) -> None:
        raise ImportError("Install s3fs to access S3")

    monkeypatch.setattr(fsspec.core, "url_to_fs", missing)
    with pytest.raises(UserError, match=r"Install s3fs to access S3\); run: .*\[remote\]"):
        chosen(["s3://bucket/a.mcap"])


def test_commands_read_a_recording_on_a_web_server(
    server: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert main(["doctor", f"{server}/one.mcap"]) == 1
    there = capsys.readouterr().out
    assert main(["doctor", str(GOLDEN)]) == 1
    assert there.replace(f"{server}/one.mcap", str(GOLDEN)) == capsys.readouterr().out
    assert main(["samples", f"{server}/", str(GOLDEN), "--out", str(tmp_path / "set")]) == 0
    assert "2 recordings: 2 done" in capsys.readouterr().out


def test_the_parts_of_a_recording_are_fetched_with_it(store: Any, tmp_path: Path) -> None:
    first = split(tmp_path / "long.mcap")
    for path in files_of(first):
        store.pipe(f"/lab/deep/{path.name}", path.read_bytes())
    found = chosen(["memory://lab/deep"])
    assert [name.rpartition("/")[2] for name in found.names] == ["long.mcap", "two.mcap"]
    copy = remote.local(found.names[0])
    assert [path.name for path in files_of(copy)] == [path.name for path in files_of(first)]
    assert digest(open_recording(copy)) == digest(open_recording(first))
