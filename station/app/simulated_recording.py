"""A simulated session as a recording: the recorded messages, with those in their place that the simulation changes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from shared import frames
from shared.foxglove import FrameTransform, FrameTransforms
from shared.messages import AngleReading, BlockPose, MarkerCorners, Message, Sample
from shared.rig import RigConfig
from shared.topics import ANGLE_PREFIX
from station.app.simulated_picture import IMAGE, SimulatedPicture, TopicMessage
from station.recording.provenance import Attachment, Provenance, whole_number
from station.recording.reader import Recorded, RecordingReader
from station.recording.writer import Recording
from station.signals.session import Signals
from station.signals.tracks import CornerTrack, Track
from station.simulators.recorded_runs import Poses, poses_of

Rows = dict[int, int]
_OWN = {"rig_id", "started_ns", "mode", "seed"}
_FILES = {"rig.toml", "plan.toml", "calibration.toml"}


def write_simulated(
    reader: RecordingReader,
    simulated: Signals,
    out: Path,
    *,
    rig: RigConfig,
    said: Mapping[str, str],
    model_toml: str,
    on_message: Callable[[int], None] = lambda _: None,
) -> int:
    """Writes the recording; gives the number of its messages, without those that the recorder adds for viewers.

    Pictures that show anything, log lines and the truth are left out.

    Args:
        reader: the recorded session.
        simulated: the same session in simulation.
        out: the recording to write.
        rig: for the block's height.
        said: further metadata: what simulated it.
        model_toml: the model, attached as model.toml; empty: nothing says by which model it was simulated.
        on_message: is called with the number of recorded messages that are done, after each.

    Raises:
        UserError: if `out` exists or cannot be written.
    """
    writer = _SimulatedMessages(simulated, height_m=rig.block.size_m[2])
    with Recording(out, provenance=_provenance(reader, rig, said, model_toml)) as recording:
        count = 0
        for done, item in enumerate(reader.messages(), 1):
            for topic, message in writer.of(item):
                recording.write_message(topic, message, receive_ns=item.log_ns)
                count += 1
            on_message(done)
    return count


def _provenance(reader: RecordingReader, rig: RigConfig, said: Mapping[str, str], model_toml: str) -> Provenance:
    session = reader.metadata.get("session", {})
    texts = {name: reader.attachments.get(name, b"").decode("utf-8", errors="replace") for name in _FILES}
    others = tuple(Attachment(name=name, data=data) for name, data in reader.attachments.items() if name not in _FILES)
    started_ns, seed = whole_number(session.get("started_ns", "")), whole_number(session.get("seed", ""))
    return Provenance(
        rig_id=session.get("rig_id", rig.id),
        started_ns=reader.start_ns if started_ns is None else started_ns,
        mode="lockstep",
        seed=seed,
        rig_toml=texts["rig.toml"] or rig.text,
        plan_toml=texts["plan.toml"],
        calibration=texts["calibration.toml"],
        extra={**{key: value for key, value in session.items() if key not in _OWN}, **said},
        attachments=(
            *(file for file in others if file.name != "model.toml"),
            *([Attachment(name="model.toml", data=model_toml.encode())] if model_toml else []),
        ),
    )


class _SimulatedMessages:
    """Says of every recorded message what the simulated session has instead."""

    def __init__(self, simulated: Signals, *, height_m: float) -> None:
        self._simulated, self._height_m = simulated, height_m
        self._corners = _rows(simulated.corners)
        self._fiducials = {number: _rows(track) for number, track in simulated.fiducials.items()}
        self._block = _rows(simulated.block)
        self._angles = {source: _rows(track) for source, track in simulated.angles.items()}
        self._samples = {sample.run: sample for sample in simulated.samples}
        self._poses = poses_of(simulated)
        self._picture = SimulatedPicture()

    def of(self, item: Recorded) -> Iterator[TopicMessage]:
        """Yields the messages in its place, with their topics.

        There are none, one, or one more with corners that are drawn over the picture.
        """
        yield from self._picture.take(item)
        for message in self._messages(item):
            yield item.topic, message
            if isinstance(message, MarkerCorners) and item.topic == "camera/corners":
                yield from self._picture.overlay(message)

    def _messages(self, item: Recorded) -> Iterator[Message]:
        if item.topic.startswith(IMAGE) or item.topic == "log":
            return
        message = item.message
        if isinstance(message, MarkerCorners) and item.topic in ("camera/corners", "camera/plate"):
            yield self._mark(item, message)
        elif isinstance(message, BlockPose) and item.topic == "block/pose":
            yield self._tracked(message, self._block[item.publish_ns])
        elif isinstance(message, AngleReading) and item.topic.startswith(ANGLE_PREFIX):
            yield self._angle(item, message)
        elif isinstance(message, Sample):
            yield self._samples.get(message.run, message)
        elif isinstance(message, FrameTransforms):
            yield replace(message, transforms=tuple(self._transforms(message, item.publish_ns)))
        else:
            yield message

    def _mark(self, item: Recorded, message: MarkerCorners) -> MarkerCorners:
        block = item.topic == "camera/corners"
        track = self._simulated.corners if block else self._simulated.fiducials[message.marker_id]
        rows = self._corners if block else self._fiducials[message.marker_id]
        return _seen(message, track, rows[item.publish_ns])

    def _tracked(self, message: BlockPose, row: int) -> BlockPose:
        if not message.found:
            return message
        x, y, z = self._simulated.block.position_m[row].tolist()
        qw, qx, qy, qz = self._simulated.block.quaternion[row].tolist()
        return replace(message, x=x, y=y, z=z, qw=qw, qx=qx, qy=qy, qz=qz)

    def _angle(self, item: Recorded, message: AngleReading) -> AngleReading:
        source = item.topic.removeprefix(ANGLE_PREFIX)
        track, row = self._simulated.angles[source], self._angles[source][item.publish_ns]
        x, y, z = track.gravity[row].tolist()
        return replace(message, angle_rad=float(track.angle_rad[row]), gravity_x=x, gravity_y=y, gravity_z=z)

    def _transforms(self, message: FrameTransforms, publish_ns: int) -> Iterator[FrameTransform]:
        for transform in message.transforms:
            if transform.child_frame_id != frames.BLOCK:
                yield transform
            elif len(self._simulated.corners):
                pose = _last(self._poses, publish_ns)
                if pose is not None:
                    yield frames.block_transform(
                        x_m=pose[0],
                        y_m=pose[1],
                        yaw_rad=pose[2],
                        height_m=self._height_m,
                        stamp_ns=transform.timestamp.ns,
                    )
            elif publish_ns in self._block:
                tracked = self._tracked(BlockPose(stamp_ns=publish_ns, found=True), self._block[publish_ns])
                yield frames.block_pose_transform(tracked)


def _rows(track: Track) -> Rows:
    return {time_ns: row for row, time_ns in enumerate(track.time_ns.tolist())}


def _last(poses: Poses, time_ns: int) -> NDArray[np.float64] | None:
    row = int(np.searchsorted(poses.time_ns, time_ns, side="right")) - 1
    return poses.pose[row] if row >= 0 else None


def _seen(message: MarkerCorners, track: CornerTrack, row: int) -> MarkerCorners:
    if not track.found[row]:
        reason = message.reason or "the simulated mark is out of the picture"
        return replace(message, corners_px=(), found=False, reason=reason)
    return replace(message, corners_px=tuple(track.corner_px[row].ravel().tolist()))
