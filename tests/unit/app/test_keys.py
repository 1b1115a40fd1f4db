"""`station keys`: what is made, for whom it is readable, and what is refused in words."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

import pytest
from cryptography import x509

from shared.bus_keys import members_in, tls_settings
from shared.bus_rights import ROLES
from shared.errors import UserError
from station.__main__ import main

RIG = """\
id = "lab"
[bus]
camera = "tls/192.168.7.2:7447"
arm = "tls/arm.local:7448"
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("rig.toml").write_text(RIG, encoding="utf-8")
    assert main(["keys", "new", "--rig", "rig.toml"]) == 0
    return tmp_path / "keys"


def certificate(path: Path) -> x509.Certificate:
    return x509.load_pem_x509_certificate((path / "cert.pem").read_bytes())


def test_each_process_gets_a_certificate_for_its_address(folder: Path) -> None:
    for role in ROLES:
        made = certificate(folder / role)
        assert made.subject.rfc4514_string() == f"CN={role}.1"
        made.verify_directly_issued_by(x509.load_pem_x509_certificate((folder / "authority" / "ca.pem").read_bytes()))
    hosts = {
        role: str(certificate(folder / role).extensions.get_extension_for_class(x509.SubjectAlternativeName).value)
        for role in ROLES
    }
    assert "192.168.7.2" in hosts["camera"]
    assert "arm.local" in hosts["arm"]
    assert all("127.0.0.1" in names for names in hosts.values())


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no modes")
def test_secrets_are_their_owners_alone_and_loose_ones_are_refused(folder: Path) -> None:
    secrets = [*folder.rglob("key.pem"), *folder.rglob("ca.key")]
    assert len(secrets) == len(ROLES) + 1
    assert {path.stat().st_mode & 0o777 for path in secrets} == {0o600}
    (folder / "arm" / "key.pem").chmod(0o640)
    with pytest.raises(UserError, match=r"its owner alone can read, got .*key\.pem: chmod 600 it"):
        tls_settings(["tls/a:1"], rig_id="lab", process="arm", environment={"REPOSE_KEYS": str(folder)})


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no modes")
@pytest.mark.parametrize("mode", [0o644, 0o620])
def test_an_authority_that_others_reach_gives_no_keys_and_takes_none(
    folder: Path, mode: int, capsys: pytest.CaptureFixture[str]
) -> None:
    before = (folder / "twin" / "key.pem").read_bytes()
    (folder / "authority" / "ca.key").chmod(mode)
    assert main(["keys", "revoke", "twin", "--rig", "rig.toml"]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert re.search(r"Expected a private key that its owner alone can read, got .*ca\.key: chmod 600 it", said)
    assert (folder / "twin" / "key.pem").read_bytes() == before


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no modes")
@pytest.mark.parametrize("mode", [0o666, 0o620, 0o602])
@pytest.mark.parametrize("name", ["rights.toml", "ca.pem", "cert.pem"])
def test_keys_that_others_may_write_to_are_refused(folder: Path, name: str, mode: int) -> None:
    """A writer of rights.toml has any role, and one of ca.pem says whose certificates count."""
    (folder / "arm" / name).chmod(mode)
    with pytest.raises(UserError, match=f"owner alone can write to, got .*{re.escape(name)}: chmod go-w it"):
        tls_settings(["tls/a:1"], rig_id="lab", process="arm", environment={"REPOSE_KEYS": str(folder)})


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no modes")
@pytest.mark.parametrize("mode", [0o777, 0o730, 0o703])
@pytest.mark.parametrize("name", [".", "arm"])
def test_a_folder_of_keys_that_others_may_write_to_is_refused(folder: Path, name: str, mode: int) -> None:
    """A writer of a folder puts other files there, and other folders."""
    (folder / name).chmod(mode)
    with pytest.raises(UserError, match=r"owner alone can write to, got .*: chmod go-w it"):
        tls_settings(["tls/a:1"], rig_id="lab", process="arm", environment={"REPOSE_KEYS": str(folder)})


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no modes")
def test_keys_are_their_owners_to_write_whatever_the_umask(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("rig.toml").write_text(RIG, encoding="utf-8")
    before = os.umask(0)
    try:
        assert main(["keys", "new", "--rig", "rig.toml"]) == 0
        assert main(["keys", "revoke", "arm", "--rig", "rig.toml"]) == 0
    finally:
        os.umask(before)
    assert {path.stat().st_mode & 0o022 for path in [Path("keys"), *Path("keys").rglob("*")]} == {0}
    assert tls_settings(["tls/a:1"], rig_id="lab", process="arm", environment={"REPOSE_KEYS": "keys"})


def test_the_rights_go_with_the_keys(folder: Path) -> None:
    settings = tls_settings(["tls/a:1"], rig_id="lab", process="arm", environment={"REPOSE_KEYS": str(folder)})
    assert settings["transport/link/tls"]["listen_private_key"] == str(folder / "arm" / "key.pem")
    assert settings["access_control"]["default_permission"] == "deny"
    own = {"REPOSE_KEYS": str(folder / "camera")}
    assert tls_settings(["tls/a:1"], rig_id="lab", process="camera", environment=own)["access_control"]["enabled"]
    with pytest.raises(UserError, match=r"keys of rig 'other', but .* is of rig 'lab'"):
        tls_settings(["tls/a:1"], rig_id="other", process="arm", environment={"REPOSE_KEYS": str(folder)})


def test_what_is_revoked_counts_nowhere(folder: Path) -> None:
    before = (folder / "camera" / "key.pem").read_bytes()
    assert main(["keys", "revoke", "camera", "--rig", "rig.toml"]) == 0
    assert (folder / "camera" / "key.pem").read_bytes() != before
    for role in ROLES:
        assert members_in(folder / role / "rights.toml", "lab")["camera"] == ["camera.2"]
    assert main(["keys", "revoke", "camera", "--rig", "rig.toml"]) == 0
    assert members_in(folder / "arm" / "rights.toml", "lab")["camera"] == ["camera.3"]
    assert members_in(folder / "arm" / "rights.toml", "lab")["arm"] == ["arm.1"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["keys", "new", "--rig", "rig.toml"], "Expected a new folder for the keys, but keys exists"),
        (
            ["keys", "revoke", "arm", "--rig", "rig.toml", "--keys", "none"],
            "Expected the folder that `station keys new`",
        ),
    ],
)
@pytest.mark.usefixtures("folder")
def test_mistakes_are_one_sentence(words: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize(
    ("bus", "refused"),
    [
        ('camera = "tcp/192.168.7.2:7447"', True),
        ('camera = "tcp/0.0.0.0:7447"', True),
        ('camera = "tcp/[2001:db8::1]:7447"', True),
        ('camera = "udp/pi.local:7447"', True),
        ('insecure = true\ncamera = "tcp/192.168.7.2:7447"', False),
        ('camera = "tls/192.168.7.2:7447"', False),
        ('camera = "tcp/127.0.0.2:7447"', False),
        ('camera = "tcp/[::1]:7447"', False),
        ('camera = "tcp/localhost:7447"', False),
    ],
)
def test_the_network_needs_keys_or_the_users_word(
    bus: str, refused: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "rig.toml").write_text(f'id = "lab"\n[bus]\n{bus}\n', encoding="utf-8")
    status = main(["effects", "wear", "--rig", str(tmp_path / "rig.toml")])
    assert status == (2 if refused else 0)
    assert ("insecure = true" in capsys.readouterr().err) == refused
