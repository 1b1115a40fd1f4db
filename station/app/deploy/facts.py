"""Finds out what the target is, and if the agent can be put onto it."""

from __future__ import annotations

from dataclasses import dataclass, fields

from shared.errors import UserError
from shared.rig import RigConfig
from station.app.deploy.systems import PICAMERA, System

DISK_KB = 400_000
MEMORY_KB = 350_000
CLOCK_S = 1.0


@dataclass(frozen=True, kw_only=True)
class Facts:
    """The output of `probe.sh`; empty where the target did not know."""

    system: str = ""
    codename: str = ""
    machine: str = ""
    bits: str = ""
    userland: str = ""
    model: str = ""
    python: str = ""
    python_bits: str = ""
    numpy: str = ""
    picamera2: str = ""
    cameras: str = ""
    cameras_asked: str = ""
    disk_free_kb: str = ""
    writable: str = ""
    memory_kb: str = ""
    systemd: str = ""
    chrony: str = ""
    uid: str = ""
    sudo: str = ""
    client: str = ""


def parse_facts(text: str) -> Facts:
    """Returns the facts from the probe's lines; lines of others (a login's greeting) are passed over."""
    known = {spec.name for spec in fields(Facts)}
    pairs = (line.partition("=") for line in text.splitlines())
    return Facts(**{key: value.strip() for key, _, value in pairs if key in known})


@dataclass(frozen=True)
class Finding:
    """Something that is not as expected; `stops` the deployment, unless it is `forced` on."""

    sentence: str
    stops: bool = True
    forceable: bool = False


def require_supported(facts: Facts, *, foreign: bool) -> None:
    """Refuses what no lock can serve; a `foreign` system is one for which the user passes a lock.

    Raises:
        UserError: for a 32-bit system, another processor, or a missing Python.
    """
    if "32" in (facts.bits, facts.python_bits) or facts.userland in {"armhf", "armel", "i386"}:
        raise UserError(
            f"Expected a 64-bit system, got a 32-bit one ({facts.system}, {facts.userland or facts.machine}): "
            "NumPy and OpenCV have no 32-bit Arm wheels, so write Raspberry Pi OS Trixie (64-bit) to the card"
        )
    if not facts.python:
        raise UserError(f"Expected Python 3 on the target ({facts.system}), got none: sudo apt-get install python3")
    if not foreign and facts.machine not in {"aarch64", "arm64"}:
        raise UserError(
            f"Expected a Raspberry Pi (aarch64), got {facts.machine} ({facts.system}): "
            "another machine needs its own lock and wheels, given with --lock and --wheels"
        )


def findings_of(facts: Facts, rig: RigConfig, *, system: System | None, ahead_s: float, forced: bool) -> list[Finding]:
    """Finds all that is wrong with a supported target.

    `ahead_s` is its clock less this one; `system` is None when the user brings a lock.
    """
    found = [*_python(facts, system), *_room(facts), *_camera(facts, rig), *_clock(ahead_s)]
    return [Finding(item.sentence, item.stops and not (forced and item.forceable), item.forceable) for item in found]


def _python(facts: Facts, system: System | None) -> list[Finding]:
    if system is None:
        return []
    found: list[Finding] = []
    wanted = f"{system.python[0]}.{system.python[1]}"
    if facts.python != wanted:
        found.append(Finding(f"Expected {system.title}'s Python {wanted}, got {facts.python}: the wheels are for it"))
    if facts.numpy and facts.numpy != system.numpy:
        found.append(
            Finding(
                f"Expected {system.title}'s own NumPy {system.numpy}, got {facts.numpy}: picamera2 is compiled against "
                "the system's, so remove the other one (`sudo pip uninstall --break-system-packages numpy`)",
                forceable=True,
            )
        )
    return found


def _room(facts: Facts) -> list[Finding]:
    found: list[Finding] = []
    if facts.disk_free_kb.isdigit() and int(facts.disk_free_kb) < DISK_KB:
        found.append(Finding(f"Expected {DISK_KB // 1000} MB of free disk, got {int(facts.disk_free_kb) // 1000} MB"))
    if facts.memory_kb.isdigit() and int(facts.memory_kb) < MEMORY_KB:
        found.append(
            Finding(f"Expected {MEMORY_KB // 1000} MB of memory, got {int(facts.memory_kb) // 1000} MB", forceable=True)
        )
    return found


def _camera(facts: Facts, rig: RigConfig) -> list[Finding]:
    if rig.camera.driver != "pi_camera":
        return []
    if not facts.cameras_asked:
        return [
            Finding(f"The camera cannot be checked: the target has no rpicam-hello ({PICAMERA} comes with it)", False)
        ]
    if not facts.cameras:
        sentence = "Expected a camera, but libcamera lists none: check its ribbon cable and /boot/firmware/config.txt"
        return [Finding(sentence, forceable=True)]
    return []


def _clock(ahead_s: float) -> list[Finding]:
    if abs(ahead_s) < CLOCK_S:
        return []
    return [Finding(f"The target's clock is {ahead_s:+.1f} s from this one; chrony will step it", stops=False)]
