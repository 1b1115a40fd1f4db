"""Objections to a target are said in one sentence, and what can be forced is known."""

from __future__ import annotations

import dataclasses
import subprocess
from pathlib import Path

import pytest

from shared.errors import UserError
from shared.rig import CameraConfig, RigConfig
from station.app.deploy import facts
from station.app.deploy.facts import Facts, findings_of, parse_facts, require_supported
from station.app.deploy.systems import SYSTEMS, apt_packages, system_of

PROBE = Path(facts.__file__).parent / "probe.sh"
TRIXIE = Facts(
    system="Debian GNU/Linux 13 (trixie)",
    codename="trixie",
    machine="aarch64",
    bits="64",
    userland="arm64",
    model="Raspberry Pi 5 Model B Rev 1.0",
    python="3.13",
    python_bits="64",
    numpy="2.2.4",
    picamera2="yes",
    cameras="0 : imx708",
    cameras_asked="yes",
    disk_free_kb="9000000",
    memory_kb="2000000",
    systemd="yes",
    chrony="yes",
    uid="1000",
    sudo="free",
    client="192.168.7.1",
)
PI_RIG = RigConfig(id="lab", camera=CameraConfig(driver="pi_camera"))


def findings(changes: dict[str, str], *, forced: bool = False, rig: RigConfig = PI_RIG) -> list[str]:
    about = dataclasses.replace(TRIXIE, **changes)
    found = findings_of(about, rig, system=system_of(about.codename), ahead_s=0.0, forced=forced)
    return [item.sentence for item in found if item.stops]


def test_a_pi_with_trixie_is_accepted_without_a_word():
    require_supported(TRIXIE, foreign=False)
    assert findings_of(TRIXIE, PI_RIG, system=SYSTEMS["trixie"], ahead_s=0.01, forced=False) == []


@pytest.mark.parametrize(
    "changes",
    [
        {"bits": "32", "userland": "armhf", "python_bits": "32", "machine": "armv7l"},
        {"userland": "armhf", "python_bits": "32"},  # a 64-bit kernel under a 32-bit system: Pi OS did that by default
    ],
)
def test_a_32_bit_system_is_refused_in_one_sentence(changes: dict[str, str]):
    with pytest.raises(UserError, match=r"^Expected a 64-bit system, got a 32-bit one .*write Raspberry Pi OS Trixie"):
        require_supported(dataclasses.replace(TRIXIE, **changes), foreign=True)


def test_another_processor_needs_a_lock_of_its_own():
    laptop = dataclasses.replace(TRIXIE, machine="x86_64", userland="amd64")
    with pytest.raises(UserError, match="Expected a Raspberry Pi"):
        require_supported(laptop, foreign=False)
    require_supported(laptop, foreign=True)


def test_a_system_without_a_lock_is_named():
    with pytest.raises(UserError, match=r"Expected one of trixie, bookworm .* got 'bullseye'"):
        system_of("bullseye")


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"python": "3.12"}, "Python 3.13, got 3.12"),
        ({"numpy": "2.4.6"}, "own NumPy 2.2.4, got 2.4.6"),
        ({"disk_free_kb": "100000"}, "400 MB of free disk, got 100 MB"),
        ({"memory_kb": "200000"}, "memory, got 200 MB"),
        ({"cameras": ""}, "libcamera lists none"),
    ],
)
def test_what_stops(changes: dict[str, str], expected: str):
    found = findings(changes)
    assert len(found) == 1
    assert expected in found[0]


def test_force_goes_on_without_a_camera_but_not_without_disk():
    assert findings({"cameras": ""}, forced=True) == []
    assert findings({"disk_free_kb": "100000"}, forced=True) != []


def test_other_cameras_need_no_ribbon_cable():
    assert findings({"cameras": ""}, rig=RigConfig(id="lab")) == []


def test_a_wrong_clock_is_told_and_does_not_stop():
    found = findings_of(TRIXIE, PI_RIG, system=SYSTEMS["trixie"], ahead_s=-86400.0, forced=False)
    assert ["-86400.0 s" in item.sentence for item in found] == [True]
    assert not found[0].stops


def test_picamera2_is_debians_own_and_only_for_its_driver():
    assert "python3-picamera2" in apt_packages(driver="pi_camera")
    assert "python3-picamera2" not in apt_packages(driver="usb_camera")


def test_the_probe_runs_in_a_plain_shell_and_says_what_this_machine_is():
    words = ["sh", str(PROBE), "/opt/a folder/that is not there", "python3"]
    said = subprocess.run(words, capture_output=True, text=True, check=True, env={"PATH": "/usr/bin:/bin"}).stdout
    about = parse_facts("Welcome to this machine!\nhint=none\n" + said)
    assert about.bits == "64"
    assert about.machine
    assert int(about.disk_free_kb) > 0
    assert about.uid.isdigit()
