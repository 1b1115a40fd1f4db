"""The operating systems that the agent is put onto, and what is pinned for each."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from shared.errors import UserError

DEPLOY = Path(__file__).resolve().parents[3] / "deploy"
"""The folder of unit, locks and example; a checkout has it, an installed wheel does not."""
PICAMERA = "python3-picamera2"


@dataclass(frozen=True, kw_only=True)
class System:
    """One release of Raspberry Pi OS or Debian, 64 bit.

    `numpy` is the release's own: picamera2 and simplejpeg are compiled against it, so the agent uses that very one and
    the lock holds only wheels that go with it. `glibc` bounds which manylinux wheels run.
    """

    codename: str
    title: str
    python: tuple[int, int]
    numpy: str
    glibc: tuple[int, int]

    @property
    def lock(self) -> Path:
        """The pinned wheels."""
        return DEPLOY / f"requirements-{self.codename}.lock"

    @property
    def abi(self) -> str:
        """The tag of its Python, such as cp313."""
        return f"cp{self.python[0]}{self.python[1]}"

    @property
    def platforms(self) -> tuple[str, ...]:
        """The wheel tags that its C library runs, newest first (pip does not widen a tag by itself)."""
        tags = [f"manylinux_2_{minor}_aarch64" for minor in range(self.glibc[1], 16, -1)]
        return (*tags, "manylinux2014_aarch64")


SYSTEMS = {
    system.codename: system
    for system in (
        System(codename="trixie", title="Debian 13", python=(3, 13), numpy="2.2.4", glibc=(2, 41)),
        System(codename="bookworm", title="Debian 12", python=(3, 11), numpy="1.24.2", glibc=(2, 36)),
    )
}


def system_of(codename: str) -> System:
    """Returns the system with this codename.

    Raises:
        UserError: if there is no lock for it.
    """
    if codename not in SYSTEMS:
        raise UserError(
            f"Expected one of {', '.join(SYSTEMS)} (Raspberry Pi OS or Debian, 64 bit), got "
            f"'{codename or 'an unknown system'}': install Raspberry Pi OS Trixie 64-bit, or pass a lock with --lock"
        )
    return SYSTEMS[codename]


def apt_packages(*, driver: str) -> tuple[str, ...]:
    """Returns the Debian packages that the agent needs with this camera driver."""
    return ("python3-numpy", *((PICAMERA,) if driver == "pi_camera" else ()))
