"""Encrypted endpoints: who has no certificate of the rig's takes no part."""

from __future__ import annotations

import shutil
import socket
import subprocess
import time
from collections.abc import Sequence
from pathlib import Path

import pytest

from shared.bus_keys import tls_settings
from shared.errors import UserError
from shared.messages import Heartbeat
from shared.zenoh_bus import ZenohBus
from tests.patience import PATIENCE_S


def openssl(*words: str) -> None:
    subprocess.run(["openssl", *words], capture_output=True, check=True)


def authority(folder: Path) -> Path:
    folder.mkdir()
    key, certificate = str(folder / "ca.key"), str(folder / "ca.pem")
    openssl("req", "-x509", "-newkey", "ed25519", "-nodes", "-subj", "/CN=rig", "-keyout", key, "-out", certificate)
    return folder


def member(folder: Path, signer: Path, *, trusts: Path) -> Path:
    """A folder of keys for 127.0.0.1, signed by one authority and trusting another."""
    folder.mkdir()
    request, names = str(folder / "request"), folder / "names"
    names.write_text("subjectAltName=IP:127.0.0.1")
    openssl(
        "req", "-newkey", "ed25519", "-nodes", "-subj", "/CN=me", "-keyout", str(folder / "key.pem"), "-out", request
    )
    signing = ["-CA", str(signer / "ca.pem"), "-CAkey", str(signer / "ca.key"), "-CAcreateserial"]
    openssl("x509", "-req", "-in", request, *signing, "-extfile", str(names), "-out", str(folder / "cert.pem"))
    shutil.copy(trusts / "ca.pem", folder)
    return folder


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def test_plain_endpoints_need_no_keys():
    assert tls_settings(["tcp/127.0.0.1:7447"], environment={}) == {}


def test_missing_keys_are_one_sentence(tmp_path: Path):
    with pytest.raises(UserError, match=r"ca\.pem for the encrypted endpoints .* set REPOSE_KEYS"):
        tls_settings(["tls/127.0.0.1:7447"], environment={"REPOSE_KEYS": str(tmp_path)})


@pytest.mark.skipif(shutil.which("openssl") is None, reason="no openssl here: apt-get install openssl")
def test_only_members_of_the_rig_take_part(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    ours, theirs = authority(tmp_path / "ours"), authority(tmp_path / "theirs")
    folders = {
        "agent": member(tmp_path / "agent", ours, trusts=ours),
        "stranger": member(tmp_path / "stranger", theirs, trusts=ours),
        "station": member(tmp_path / "station", ours, trusts=ours),
    }
    endpoint = [f"tls/127.0.0.1:{free_port()}"]
    heard: dict[str, int] = {"stranger": 0, "station": 0}

    def opened(who: str, *, listen: Sequence[str] = (), connect: Sequence[str] = ()) -> ZenohBus:
        monkeypatch.setenv("REPOSE_KEYS", str(folders[who]))
        return ZenohBus("keys", listen=listen, connect=connect)

    with (
        opened("agent", listen=endpoint) as agent,
        opened("stranger", connect=endpoint) as stranger,
        opened("station", connect=endpoint) as station,
    ):
        for name, bus in (("stranger", stranger), ("station", station)):
            bus.subscribe("session/heartbeat", lambda _, name=name: heard.update({name: heard[name] + 1}))
        give_up = time.monotonic() + PATIENCE_S
        while heard["station"] < 20:
            assert time.monotonic() < give_up, "a member does not hear the agent"
            agent.publish("session/heartbeat", Heartbeat(armed=True))
            station.poll(0.02)
            stranger.poll(0.02)
    assert heard["stranger"] == 0
