"""Writes a case: session.mcap in the format of a real recording, and the rig file that a real rig's user would have."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.random import Generator

from shared import topics, wire
from station.recording.mcap_file import McapFile
from station.recording.provenance import Provenance, versions
from tests.concealed.design import PAIRS, Setting
from tests.concealed.measure import EPOCH_NS
from tests.concealed.moments import moments_of
from tests.concealed.session import SessionRecord
from tests.concealed.streams import streams_of

RIG_ID = "bench"
_ANGLES = """
[angles.imu]
kind = "mavlink"
"""


def rig_toml(setting: Setting, *, mu_guess: float, scatter_guess: float) -> str:
    """The rig file: what the user knows of the rig, and a first guess of its friction."""
    design, world = setting.design, setting.world
    block, plate, _, cube_kg = PAIRS[design.pair]
    height = round(world.mark_height, 4)
    return f"""# A measuring rig: tilting plate, one camera above it.
id = "{RIG_ID}"

[camera]
driver = "synthetic"
rate_hz = 90.0
width_px = 600
height_px = 600
px_per_mm = {world.px_per_m * 1e-3:.4f}
height_mm = {world.camera_height * 1e3:.1f}
plate_rate_hz = 15.0

[mark]
side_mm = {world.mark_side * 1e3:.3f}
margin = 0.1667
feature = "dot"

[plate]
material = "{plate}"
opening_m = {2.0 * (world.wall_radius + 0.65 * world.side):.4f}
mount_deg = {design.mounts_deg[0]:.1f}

[block]
name = "{block} cube"
material = "{block}"
size_m = [{world.side:.4f}, {world.side:.4f}, {height:.4f}]
mass_kg = {cube_kg:.5f}

[arm]
driver = "simulated"
model = "jaco2_spherical"

[twin]
pair = "{block}_on_{plate}"
mean_mu = {mu_guess:.2f}
scatter = {scatter_guess:.2f}
ratio = 1.0
{_ANGLES if design.second_sensor else ""}"""


def write_session(
    session: SessionRecord, path: Path, *, rig: str, rng: Generator, mode: Literal["live", "lockstep"] = "live"
) -> None:
    """Writes a session under its final name, or nothing."""
    partial = path.with_name(path.name + ".partial")
    provenance = Provenance(rig_id=RIG_ID, started_ns=EPOCH_NS, mode=mode, rig_toml=rig)
    with partial.open("wb") as file:
        writer = McapFile(file, library=f"repose {versions()['repose']}", compression="zstd")
        writer.add_metadata("session", provenance.session())
        writer.add_metadata("versions", {"repose": versions()["repose"]})
        for extra in provenance.files():
            writer.add_attachment(extra.name, extra.data, media_type=extra.media_type, stamp_ns=EPOCH_NS)
        _write_messages(writer, session, rng)
        writer.finish()
    os.replace(partial, path)


def _write_messages(writer: McapFile, session: SessionRecord, rng: Generator) -> None:
    channels: dict[str, int] = {}
    schemas: dict[str, int] = {}

    def channel(topic: str) -> int:
        if topic not in channels:
            cls = topics.topic(topic).message
            name = wire.schema_name(cls)
            if name not in schemas:
                schemas[name] = writer.register_schema(name, wire.schema(cls))
            channels[topic] = writer.register_channel("/" + topic, schema_id=schemas[name])
        return channels[topic]

    log_ns, publish_ns, numbers, payloads = [], [], [], list[bytes]()
    for stream in streams_of(session, rng):
        log_ns.append(stream.log_ns)
        publish_ns.append(stream.publish_ns)
        numbers.append(np.full(len(stream.log_ns), channel(stream.topic)))
        data, size = stream.rows.tobytes(), stream.rows.shape[1]
        payloads += [data[at : at + size] for at in range(0, len(data), size)]
    moments = list(moments_of(session))
    publish_ns.append(np.array([moment[1] for moment in moments]))
    log_ns.append(np.array([moment[2] for moment in moments]))
    numbers.append(np.array([channel(moment[0]) for moment in moments]))
    payloads += [wire.encode(moment[3]) for moment in moments]
    _write_in_order(writer, np.concatenate(log_ns), np.concatenate(publish_ns), np.concatenate(numbers), payloads)


def _write_in_order(
    writer: McapFile, log_ns: np.ndarray, publish_ns: np.ndarray, numbers: np.ndarray, payloads: list[bytes]
) -> None:
    counts = [0] * (int(numbers.max()) + 1)
    order = np.argsort(log_ns, kind="stable").tolist()
    logs, publishes, channels = log_ns.tolist(), publish_ns.tolist(), numbers.tolist()
    for i in order:
        number = channels[i]
        writer.add_message(
            number, log_ns=logs[i], publish_ns=publishes[i], sequence=counts[number], payload=payloads[i]
        )
        counts[number] += 1
