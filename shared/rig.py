"""The rig file, rig.toml: both sides read it; each plug-in's own table is read by the plug-in."""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

from shared.config import Table, load_table, parse
from shared.errors import UserError
from shared.likely import sides_meant
from shared.likely_lengths import unlikely_lengths
from shared.likely_picture import unlikely_picture
from shared.likely_sizes import MarkSize, unlikely, unlikely_view
from shared.notify import NAME as NOTIFY
from shared.notify import NotifyConfig, without_notify
from shared.possible import LARGEST, LEAST, require_measurable

_ID = re.compile(r"[\w-]+")
"""A rig's id names its keys on the bus, its file of a kept stop and its datasets. Recordings may have any other."""
ID_WORDS = "letters, digits, '-' and '_'"
"""The alphabet of `is_id`, in words."""
PROCESSES = ("camera", "arm", "twin", "station")


@dataclass(frozen=True, kw_only=True)
class BusConfig:
    """`[bus]`: the endpoint that each process listens on; the others connect to it. An empty one does not exist.

    `insecure = true` allows endpoints beyond this machine without keys: whoever reaches them takes part.
    """

    insecure: bool = False
    camera: str = "tcp/127.0.0.1:7447"
    arm: str = "tcp/127.0.0.1:7448"
    twin: str = ""
    station: str = "tcp/127.0.0.1:7450"

    def __post_init__(self) -> None:
        taken: dict[str, str] = {}
        for process in PROCESSES:
            for endpoint in self.endpoint(process):
                if endpoint in taken:
                    raise ValueError(
                        f"expected an endpoint of its own for each process, got {endpoint} for {taken[endpoint]} and "
                        f"for {process}; give one of them another port"
                    )
                taken[endpoint] = process

    def endpoint(self, process: str) -> tuple[str, ...]:
        """Returns the endpoint on which `process` listens: one or none."""
        value = getattr(self, process, "")
        return (value,) if value else ()

    def open_to_network(self) -> tuple[str, ...]:
        """Returns the endpoints that others than this machine's programs reach without keys."""
        all_of_them = (endpoint for process in PROCESSES for endpoint in self.endpoint(process))
        return tuple(one for one in all_of_them if not one.startswith(("tls/", "quic/")) and not _on_loopback(one))

    def peers(self, process: str) -> tuple[str, ...]:
        """Returns the endpoints to which `process` connects.

        These are those of the processes before it, so that every pair has one link.
        """
        before = PROCESSES[: PROCESSES.index(process)] if process in PROCESSES else PROCESSES
        return tuple(endpoint for name in before for endpoint in self.endpoint(name))


@dataclass(frozen=True, kw_only=True)
class CameraConfig:
    """`[camera]`: `driver` is a file in pi_agent/cameras; its own settings are the table `[camera.options]`.

    `px_per_mm` and `height_mm` (pinhole above the plate) are the nominal view, which a calibration replaces.
    `plate_rate_hz`: how often the plate's fiducial is reported. `status_hz`, `preview_hz`: as they say.
    """

    driver: str = "synthetic"
    width_px: int = 600
    height_px: int = 600
    rate_hz: float = 90.0
    exposure_ms: float = 2.0
    gain: float = 1.0
    preview_hz: float = 12.0
    jpeg_quality: int = 80
    plate_rate_hz: float = 15.0
    px_per_mm: float = 6.0
    height_mm: float = 300.0
    calibration: str = ""
    options: Table = field(default_factory=lambda: Table({}))

    def __post_init__(self) -> None:
        require_measurable(self)
        _positive(self, "width_px", "height_px", "rate_hz", "exposure_ms", "px_per_mm", "height_mm")


@dataclass(frozen=True, kw_only=True)
class MarkConfig:
    """`[mark]`: the mark on the block. `aspect` is its second side over the first, `margin` the white rim in sides."""

    side_mm: float = 10.0
    aspect: float = 1.0
    margin: float = 0.0
    feature: Literal["none", "dot", "notch", "tag"] = "none"
    tag_dictionary: str = "APRILTAG_16h5"
    tag_id: int = 0

    def __post_init__(self) -> None:
        require_measurable(self)
        _positive(self, "side_mm", "aspect")


def _on_loopback(endpoint: str) -> bool:
    host = endpoint.partition("/")[2].rpartition(":")[0].strip("[]")
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost" or endpoint.startswith("unix")


_LEAST_CORNERS = 3
"""The smallest number of corners of an outline."""


@dataclass(frozen=True, kw_only=True)
class PlateConfig:
    """`[plate]`: the plate under test. `mount_deg` is how it is turned in its mount; fiducials sit in its corners.

    The foam's opening has the diameter `opening_m`, or the corners `opening_outline_m` ([[x, y], …], metres in the
    plate) where it is not round.
    """

    material: str = "steel"
    side_m: float = 0.1
    opening_m: float = 0.09
    opening_outline_m: tuple[tuple[float, float], ...] = ()
    mount_deg: float = 0.0
    fiducial_side_mm: float = 4.0
    fiducial_place_mm: float = 42.0

    def __post_init__(self) -> None:
        require_measurable(self)
        _positive(self, "side_m", "opening_m")
        if 0 < len(self.opening_outline_m) < _LEAST_CORNERS:
            raise ValueError(
                f"expected at least {_LEAST_CORNERS} corners for opening_outline_m, got {len(self.opening_outline_m)}"
            )


@dataclass(frozen=True, kw_only=True)
class BlockConfig:
    """`[block]`: the object under test, a box of length × width × height with its mark on top."""

    name: str = "block"
    material: str = "steel"
    size_m: tuple[float, float, float] = (0.01, 0.01, 0.01)
    mass_kg: float = 0.008

    def __post_init__(self) -> None:
        if not all(LEAST <= value <= LARGEST for value in (*self.size_m, self.mass_kg)):
            raise ValueError(
                f"expected size_m and mass_kg of {LEAST:g} to {LARGEST:g}, got {self.size_m} and {self.mass_kg}"
            )


@dataclass(frozen=True, kw_only=True)
class RigConfig:
    """A rig file. `id` names the rig on the bus and has no default; `arm` and `twin` are read by the station."""

    id: str
    planted: str = ""
    """The effect that a simulated rig conceals on purpose, in a sentence that diagnoses of its recordings repeat."""
    bus: BusConfig = field(default_factory=BusConfig)
    camera: CameraConfig = field(default_factory=CameraConfig)
    mark: MarkConfig = field(default_factory=MarkConfig)
    plate: PlateConfig = field(default_factory=PlateConfig)
    block: BlockConfig = field(default_factory=BlockConfig)
    arm: Table = field(default_factory=lambda: Table({}))
    twin: Table = field(default_factory=lambda: Table({}))
    angles: Table = field(default_factory=lambda: Table({}))
    """`[angles.<name>]`: one table for each angle source, read by the station."""
    physics: Table = field(default_factory=lambda: Table({}))
    """`[physics]`: the folders of the user's own effects, read by the station."""
    plugins: Table = field(default_factory=lambda: Table({}))
    """`[plugins]`: the folders of the user's own importers and simulators, read by the station."""
    simulator: Table = field(default_factory=lambda: Table({}))
    """`[simulator.mujoco]`: the settings of the user's own simulation, read by the station."""
    notify: NotifyConfig = field(default_factory=NotifyConfig)
    """`[notify]`: who is told of a session that needs somebody; only a file of the user's own names anybody."""
    text: str = ""
    """The file itself, word for word but without `[notify]`, which every recording carries."""


def _slips(rig: RigConfig) -> Iterator[str]:
    """Yields sentences on what was probably meant in another unit."""
    mark = MarkSize((rig.mark.side_mm, rig.mark.side_mm * rig.mark.aspect), rig.mark.margin)
    yield from unlikely(
        block_m=rig.block.size_m,
        mass_kg=rig.block.mass_kg,
        plate_m=rig.plate.side_m,
        opening_m=rig.plate.opening_m,
        mark=mark,
        is_round=not rig.plate.opening_outline_m,
    )
    yield from unlikely_view(
        px_per_mm=rig.camera.px_per_mm,
        height_mm=rig.camera.height_mm,
        fiducial_mm=rig.plate.fiducial_side_mm,
        plate_m=rig.plate.side_m,
    )
    yield from unlikely_picture(
        px_per_mm=rig.camera.px_per_mm,
        height_mm=rig.camera.height_mm,
        block_m=rig.block.size_m[2],
        mark=mark,
        picture_px=(rig.camera.width_px, rig.camera.height_px),
    )


def is_id(name: str) -> bool:
    """Returns true if a name can be a part of a key on the bus and of a file's name, and holds no markup."""
    return _ID.fullmatch(name) is not None


def load_rig(path: Path) -> RigConfig:
    """Reads a rig file of the user's own.

    Raises:
        UserError: naming file, line and key of what is wrong, or of what was probably meant in another unit.
    """
    table = load_table(path)
    _require_three_sides(table.child("block"))
    notify = parse(NotifyConfig, table.child(NOTIFY))
    rig = replace(rig_of_table(table), notify=notify, text=without_notify(table))
    if not is_id(rig.id):
        raise table.error("id", ID_WORDS, repr(rig.id))
    for sentence in (*_slips(rig), *unlikely_lengths(table.values)):
        raise UserError(f"{path}: {sentence}")
    if not rig.bus.insecure and (reached := rig.bus.open_to_network()):
        raise UserError(
            f"{path}: expected keys for {', '.join(reached)}, which others on the network can reach: write tls/ and "
            "make keys with `station keys new`, or take the risk with insecure = true in [bus]"
        )
    return rig


def rig_of_table(table: Table) -> RigConfig:
    """Gives the rig of a table that was read already, such as the one inside a recording, whose sizes are not doubted.

    Its `[notify]` is passed over: a stranger's recording has nobody told of anything.

    Raises:
        UserError: naming file, line and key of what is wrong.
    """
    values = {key: value for key, value in table.values.items() if key != NOTIFY}
    return parse(RigConfig, Table({**values, "text": table.text}, table.file, table.text, own=table.own))


def _require_three_sides(block: Table) -> None:
    side = block.values.get("size_m")
    if isinstance(side, int | float) and not isinstance(side, bool):
        raise block.error("size_m", "a list of length, width and height (m)", f"{side!r}{sides_meant(side)}")


def _positive(config: object, *names: str) -> None:
    for name in names:
        value = getattr(config, name)
        if not LEAST <= value <= LARGEST:
            raise ValueError(f"expected a number of {LEAST:g} to {LARGEST:g} for '{name}', got {value}")
