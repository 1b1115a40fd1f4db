"""The poses of blocks at wanted times, from the nodes of their rests and slides by cubic Hermite interpolation."""

from __future__ import annotations

import numpy as np

from station.physics.contact import Array
from station.simulators.planar.plate import Index
from station.simulators.planar.rest import Creep
from station.simulators.planar.slide import Nodes, Stop


class Path:
    """`pose` (n, m, 3) at `time_s` (n, m), which begins as the start for ever and is corrected rest by rest."""

    def __init__(self, start: Array, time_s: Array) -> None:
        self._time_s = time_s
        self.pose = np.repeat(start[:, None, :], time_s.shape[1], axis=1)

    @property
    def wanted(self) -> bool:
        """True if anybody wants a pose."""
        return self._time_s.shape[1] > 0

    def creep(self, row: Index, creep: Creep, end_s: Array) -> None:
        """Fills in the way that the runs `row` (a,) crept until `end_s` (a,), where they stay."""
        for number, run in enumerate(row.tolist()):
            after = np.flatnonzero(self._time_s[run] > creep.time_s[number, 0])
            at = np.minimum(self._time_s[run, after], end_s[number])
            for axis in range(2):
                self.pose[run, after, axis] = np.interp(at, creep.time_s[number], creep.position[number, :, axis])

    def slide(self, nodes: Nodes, stop: Stop) -> None:
        """Fills in slides: their nodes in the order of time, and where the blocks lie afterwards."""
        if not self.wanted:
            return
        order = np.argsort(nodes.row, kind="stable")
        row, time_s = nodes.row[order], nodes.time_s[order]
        first = np.flatnonzero(np.diff(row, prepend=-1))
        begin_s = np.full(len(self.pose), np.inf)
        begin_s[row[first]] = time_s[first]
        self._stay(stop)
        self._move(nodes, order, begin_s, stop)

    def _stay(self, stop: Stop) -> None:
        after = self._time_s[stop.row] > stop.time_s[:, None]
        run, column = np.nonzero(after)
        self.pose[stop.row[run], column] = stop.pose[run]

    def _move(self, nodes: Nodes, order: Index, begin_s: Array, stop: Stop) -> None:
        times = self._time_s[stop.row]
        chosen, column = np.nonzero((times >= begin_s[stop.row][:, None]) & (times <= stop.time_s[:, None]))
        if not len(chosen):
            return
        run = stop.row[chosen]
        wanted = times[chosen, column]
        # One search for all runs: times of later runs are made later than those of earlier ones.
        start = min(float(nodes.time_s.min()), 0.0)
        span = float(nodes.time_s.max()) - start + 1.0
        row = nodes.row[order]
        keys = row * span + (nodes.time_s[order] - start)
        right = np.searchsorted(keys, run * span + (wanted - start), side="right")
        right = np.clip(right, 1, len(keys) - 1)
        right = np.where(row[right] != run, right - 1, right)
        left = right - 1
        a, b = order[left], order[right]
        length = nodes.time_s[b] - nodes.time_s[a]
        share = np.clip((wanted - nodes.time_s[a]) / np.where(length > 0, length, 1.0), 0.0, 1.0)[:, None]
        pose, velocity, length = nodes.pose, nodes.velocity, length[:, None]
        bend = share * share * (3.0 - 2.0 * share)
        found = pose[a] + bend * (pose[b] - pose[a])
        found += length * share * (1.0 - share) * ((1.0 - share) * velocity[a] - share * velocity[b])
        self.pose[run, column] = found
