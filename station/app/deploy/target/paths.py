"""Names the paths of everything on the target."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

SERVICE = "pi-agent"
ACCOUNT = "repose"


class Refused(Exception):
    """The target cannot do what was asked; its text is one sentence for the user."""


@dataclass(frozen=True)
class TargetPaths:
    """All paths, below `root` ("/" on a Pi; a folder for an installation without privileges)."""

    root: Path

    @property
    def home(self) -> Path:
        """Everything that is installed."""
        return self.root / "opt/repose"

    @property
    def releases(self) -> Path:
        """One folder for each release: code, rig file, keys."""
        return self.home / "releases"

    @property
    def venvs(self) -> Path:
        """One folder for each set of dependencies."""
        return self.home / "venvs"

    @property
    def incoming(self) -> Path:
        """The folder in which uploads land."""
        return self.home / "incoming"

    @property
    def current(self) -> Path:
        """The link to the release that runs."""
        return self.home / "current"

    @property
    def previous(self) -> Path:
        """The link to the release that ran before it."""
        return self.home / "previous"

    @property
    def state(self) -> Path:
        """The agent's own files: calibrations made on the Pi."""
        return self.root / "var/lib/repose"

    @property
    def unit(self) -> Path:
        """The systemd unit."""
        return self.root / f"etc/systemd/system/{SERVICE}.service"

    @property
    def clock_source(self) -> Path:
        """The station as a source of chrony's."""
        return self.root / "etc/chrony/sources.d/repose.sources"

    def release_of(self, link: Path) -> str:
        """Returns the release's id that a link points to, or empty."""
        return link.readlink().name if link.is_symlink() else ""


def point(link: Path, target: Path) -> None:
    """Points a link at a folder beside it in one step: there is no moment without it."""
    fresh = link.with_name(link.name + ".new")
    fresh.unlink(missing_ok=True)
    fresh.symlink_to(target.relative_to(link.parent))
    fresh.replace(link)
