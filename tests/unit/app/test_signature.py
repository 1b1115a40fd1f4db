"""`station keys sign` and what `station verify` says of it: who signed, and every way in which that does not hold."""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path

import pytest
from rich.console import Console

from station.__main__ import main
from station.app.commands.run import sign_session
from station.app.signature import signature_path

GOLDEN = Path(__file__).parents[2] / "golden" / "session.mcap"
RIG = 'id = "lab"\n[bus]\ncamera = "tls/192.168.7.2:7447"\n'


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("REPOSE_KEYS", raising=False)
    Path("rig.toml").write_text(RIG, encoding="utf-8")
    assert main(["keys", "new", "--rig", "rig.toml"]) == 0
    shutil.copy(GOLDEN, "session.mcap")
    assert main(["keys", "sign", "session.mcap", "--keys", "keys"]) == 0
    return tmp_path


def said(capsys: pytest.CaptureFixture[str], *words: str, status: int) -> dict[str, object]:
    capsys.readouterr()
    assert main(["verify", "session.mcap", "--json", *words]) == status
    return json.loads(capsys.readouterr().out)["signature"]


@pytest.mark.usefixtures("here")
def test_it_says_who_signed(capsys: pytest.CaptureFixture[str]) -> None:
    signature = said(capsys, "--keys", "keys", status=0)
    assert signature["signer"] == "station.1"
    assert signature["authority"] is True
    assert signature["fault"] == ""
    assert main(["verify", "session.mcap", "--keys", "keys"]) == 0
    assert "✓ signature signed by station.1" in capsys.readouterr().out


@pytest.mark.usefixtures("here")
def test_without_keys_it_says_that_only_they_tell_whose_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    assert said(capsys, status=0)["authority"] is False
    assert main(["verify", "session.mcap"]) == 0
    printed = capsys.readouterr().out
    assert "whose that is only the rig's --keys tell" in printed
    assert "– signature" in printed, "anybody has a key of his own"


@pytest.mark.usefixtures("here")
def test_every_reader_reads_a_signed_recording_as_before() -> None:
    assert Path("session.mcap").read_bytes() == GOLDEN.read_bytes()
    assert main(["check", "session.mcap"]) == 0


@pytest.mark.usefixtures("here")
def test_a_file_changed_afterwards_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    """Even by a byte that no reader looks at."""
    text = GOLDEN.read_bytes().replace(b"repose", b"Repose", 1)  # the name of the program that wrote it
    assert text != GOLDEN.read_bytes()
    Path("session.mcap").write_bytes(text)
    assert said(capsys, "--keys", "keys", status=1)["fault"] == "the file was changed after it was signed"


@pytest.mark.usefixtures("here")
def test_a_signature_made_to_fit_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    path = signature_path(Path("session.mcap"))
    told = json.loads(path.read_text(encoding="utf-8"))
    path.write_text(json.dumps({**told, "signed_ns": told["signed_ns"] + 1}), encoding="utf-8")
    assert said(capsys, "--keys", "keys", status=1)["fault"] == "the signature is not of this certificate"


@pytest.mark.usefixtures("here")
def test_the_keys_of_another_authority_do_not_count(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["keys", "new", "--rig", "rig.toml", "--out", "others"]) == 0
    assert main(["keys", "sign", "session.mcap", "--keys", "others"]) == 0
    assert "not of the authority" in str(said(capsys, "--keys", "keys", status=1)["fault"])
    assert said(capsys, status=0)["signer"] == "station.1"  # that it holds says nothing of whose it is


@pytest.mark.usefixtures("here")
def test_the_keys_of_the_pi_do_not_count(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["keys", "sign", "session.mcap", "--keys", "keys/camera"]) == 0
    assert "camera.1 is not, or no longer, the station" in str(said(capsys, "--keys", "keys", status=1)["fault"])


@pytest.mark.usefixtures("here")
def test_revoked_keys_do_not_count(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["keys", "revoke", "station", "--rig", "rig.toml"]) == 0
    assert "station.1 is not, or no longer, the station" in str(said(capsys, "--keys", "keys", status=1)["fault"])


@pytest.mark.parametrize("text", ["", "{}", "[]", "null", '{"format": 1}', "x" * 10, '"' * 99, "[" * 50_000])
@pytest.mark.usefixtures("here")
def test_what_is_no_signature_is_one_sentence(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    signature_path(Path("session.mcap")).write_text(text, encoding="utf-8")
    assert main(["verify", "session.mcap"]) == 2
    assert "expected a signature" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["keys", "sign", "session.mcap"], "give --keys FOLDER, or set REPOSE_KEYS"),
        (["keys", "sign", "none.mcap", "--keys", "keys"], "Expected a recording at none.mcap"),
        (["keys", "sign", "session.mcap", "--keys", "none"], "Expected a certificate at none/cert.pem"),
        (["verify", "session.mcap", "--keys", "none"], "Expected a certificate at none/ca.pem"),
    ],
)
@pytest.mark.usefixtures("here")
def test_mistakes_are_one_sentence(words: list[str], sentence: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words) == 2
    assert sentence in capsys.readouterr().err


@pytest.mark.usefixtures("here")
def test_a_key_that_others_can_read_signs_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    Path("keys/station/key.pem").chmod(0o644)
    assert main(["keys", "sign", "session.mcap", "--keys", "keys"]) == 2
    assert "its owner alone can read" in capsys.readouterr().err


@pytest.mark.usefixtures("here")
@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no modes")
@pytest.mark.parametrize("name", ["rights.toml", "ca.pem", "."])
def test_keys_that_others_may_write_to_tell_nothing(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    (Path("keys/station") / name).chmod(0o777)
    assert main(["verify", "session.mcap", "--keys", "keys"]) == 2
    assert "owner alone can write to" in " ".join(capsys.readouterr().err.split())


def test_a_live_session_signs_where_the_environment_names_keys(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, terminal = Path("session.mcap"), Console(record=True, width=200)
    sign_session(path, where=terminal)
    assert not signature_path(path).exists(), "that of a recording which was replaced is gone"
    monkeypatch.setenv("REPOSE_KEYS", str(here / "keys"))
    sign_session(path, where=terminal)
    assert main(["verify", str(path)]) == 0
    monkeypatch.setenv("REPOSE_KEYS", str(here / "none"))
    sign_session(path, where=terminal)
    assert "The recording is not signed: Expected a certificate at" in terminal.export_text()
