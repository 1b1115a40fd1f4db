"""Measures one topic's messages in time, in one pass and bounded memory."""

from __future__ import annotations

import math
from dataclasses import dataclass

from shared.messages import REPEATED, BlockPose, MarkerCorners
from shared.topics import TOPICS
from station.recording.checkup.quantiles import Quantiles
from station.recording.reader import Recorded

LATE_NS = 1_000_000_000
"""Nanoseconds after which a message is late: the plan's `silence_s`, unless a plan says otherwise."""
GAP_PERIODS = 3.5
"""An interval of more than this many nominal periods is a gap: three messages in a row are missing."""


@dataclass(frozen=True, kw_only=True)
class StreamHealth:
    """One topic. Intervals are between capture times; latency is receipt minus capture, on the station's clock.

    `history` counts messages captured before the recording began, which a recovery sent later: they are left out of
    the latencies. NaN stands for what cannot be said.
    """

    topic: str
    count: int
    rate_hz: float
    nominal_hz: float
    interval_p50_ms: float
    jitter_p99_ms: float
    gaps: int
    gap_max_s: float
    gap_max_at_s: float
    latency_p50_ms: float
    latency_p99_ms: float
    latency_min_ms: float
    latency_max_ms: float
    missing: int
    not_found: int
    history: int
    late: int = 0
    """Messages that were older than `LATE_NS` when they arrived: too old to decide anything by."""
    repeated: int = 0
    """Frames that were there before: the camera was frozen."""


class StreamWatch:
    """Collects what `StreamHealth` says."""

    def __init__(self, topic: str, *, start_ns: int, nominal_hz: float | None = None) -> None:
        self._topic = topic
        self._start_ns = start_ns
        table_hz = TOPICS[topic].rate_hz if topic in TOPICS else 0.0
        self._nominal_hz = table_hz if nominal_hz is None else nominal_hz
        self._gap_ns = GAP_PERIODS * 1e9 / self._nominal_hz if self._nominal_hz else math.inf
        self._count = 0
        self._first_ns = self._last_ns = 0
        self._intervals, self._latencies = Quantiles(), Quantiles()
        self._gaps = 0
        self._gap_max_ns = 0
        self._gap_max_at_ns = start_ns
        self._history = 0
        self._sequences: dict[tuple[int, int], _Sequence] = {}
        self._not_found = 0
        self._late = self._repeated = 0
        self._last_frame = MarkerCorners()

    def add(self, item: Recorded) -> None:
        """Takes the next message in the order of receipt."""
        if self._count:
            self._add_interval(item.publish_ns - self._last_ns)
        else:
            self._first_ns = item.publish_ns
        self._count += 1
        self._last_ns = max(self._last_ns, item.publish_ns)
        if item.publish_ns < self._start_ns:
            self._history += 1
        else:
            self._latencies.add(item.log_ns - item.publish_ns)
            self._late += item.log_ns - item.publish_ns > LATE_NS
        if self._topic in ("camera/corners", "camera/plate", "block/pose"):
            self._add_numbered(item)

    def _add_interval(self, interval_ns: int) -> None:
        self._intervals.add(interval_ns)
        if interval_ns > self._gap_ns:
            self._gaps += 1
        if interval_ns > self._gap_max_ns:
            self._gap_max_ns = interval_ns
            self._gap_max_at_ns = self._last_ns

    def _add_numbered(self, item: Recorded) -> None:
        message = item.message
        if isinstance(message, MarkerCorners):
            key = (message.boot_id, message.marker_id)
            self._repeated += self._topic == "camera/corners" and _repeats(message, self._last_frame)
            self._last_frame = message
        elif isinstance(message, BlockPose):
            key = (0, 0)
        else:
            return
        self._not_found += not message.found
        if self._topic == "camera/plate":  # its numbers are those of the frames, of which only some report it
            return
        self._sequences.setdefault(key, _Sequence(message.seq)).add(message.seq)

    def health(self) -> StreamHealth:
        """Returns the findings of the messages so far."""
        span_s = (self._last_ns - self._first_ns) * 1e-9
        median_ns = self._intervals.at(0.5)
        return StreamHealth(
            topic=self._topic,
            count=self._count,
            rate_hz=(self._count - 1) / span_s if span_s > 0 else math.nan,
            nominal_hz=self._nominal_hz,
            interval_p50_ms=median_ns * 1e-6,
            jitter_p99_ms=(self._intervals.at(0.99) - median_ns) * 1e-6,
            gaps=self._gaps,
            gap_max_s=self._gap_max_ns * 1e-9,
            gap_max_at_s=(self._gap_max_at_ns - self._start_ns) * 1e-9,
            latency_p50_ms=self._latencies.at(0.5) * 1e-6,
            latency_p99_ms=self._latencies.at(0.99) * 1e-6,
            latency_min_ms=self._latencies.smallest_ns * 1e-6 if self._latencies.count else math.nan,
            latency_max_ms=self._latencies.largest_ns * 1e-6 if self._latencies.count else math.nan,
            missing=sum(sequence.missing for sequence in self._sequences.values()),
            not_found=self._not_found,
            history=self._history,
            late=self._late,
            repeated=self._repeated,
        )


def _repeats(frame: MarkerCorners, before: MarkerCorners) -> bool:
    """Returns true if noise would have to have come out the same twice, or if the agent says so itself."""
    noisy = frame.sigma_px > 0 and not frame.noiseless
    same = noisy and bool(frame.corners_px) and frame.corners_px == before.corners_px
    return frame.reason == REPEATED or same


class _Sequence:
    """The numbers of one life of one sender: what lies between the first and the last and never came."""

    def __init__(self, first: int) -> None:
        self._first = self._last = first
        self._seen = 0

    def add(self, number: int) -> None:
        self._first, self._last = min(self._first, number), max(self._last, number)
        self._seen += 1

    @property
    def missing(self) -> int:
        return max(0, self._last - self._first + 1 - self._seen)
