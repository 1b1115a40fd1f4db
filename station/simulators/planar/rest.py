"""The block at rest: when it starts to slide, in which direction, and how it creeps before that.

What it lacks to slide, E = max over φ of T·e(φ) − h(φ) N, is looked at on a grid of times, and where E has become
positive the crossing is closed in on. On straight ramps the grid divides the stretches; of a finely sampled recording
it takes the steepest moment of every tenth of a second, and each knot only where a crossing was seen.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from station.physics.contact import Array, Contact
from station.simulators.planar.asked import Asked
from station.simulators.planar.friction import LimitCurve, Support, setting_off
from station.simulators.planar.load import Blocks, Motion, World
from station.simulators.planar.plate import Column, Index
from station.simulators.planar.root import root

FINE_S = 0.05
"""Knots nearer to each other than this belong to a recording."""
_APART_S = 0.25
_APART_CREEPING_S = 0.125
_WINDOW_S = 0.1
_BLOCK = 2048
_ROUNDS_MOST, _SETTLED_RAD = 20, 1e-3
_FARTHEST_RAD, _LEAST_BEND = 1.5, 1e-3
_LEAST_MARGIN_M_S2, _MOST_MARGIN_M_S2 = 1e-3, 0.1


class Grid(NamedTuple):
    """Times (n, c) at which the runs are looked at, and the stretch that each is on."""

    time_s: Array
    number: Index


class Lying(NamedTuple):
    """Blocks at rest (a,): run, stretch, from when on an onset is looked for, since when they lie, and pose (a, 3)."""

    row: Index
    number: Index
    from_s: Array
    rest_from_s: Array
    pose: Array

    def select(self, chosen: Index) -> Lying:
        """Returns the blocks with the indices `chosen` (b,)."""
        since = self.from_s[chosen], self.rest_from_s[chosen]
        return Lying(self.row[chosen], self.number[chosen], *since, self.pose[chosen])


class Crossing(NamedTuple):
    """The end of a rest (a,): the onset (inf: none), its stretch and direction, and the pose (a, 3) by then."""

    time_s: Array
    number: Index
    way: Array
    pose: Array


@dataclass(frozen=True, eq=False)
class Creep:
    """Nodes (a, c) of the creep of blocks at rest."""

    time_s: Array
    position: Array

    def at(self, chosen: Index, time_s: Array) -> Creep:
        """Returns the creep at other times `time_s` (b, w), s, of the blocks with the indices `chosen` (b,)."""
        positions = [self.position_at(chosen, time_s[:, column]) for column in range(time_s.shape[1])]
        return Creep(time_s, np.stack(positions, axis=1))

    def position_at(self, chosen: Index, time_s: Array) -> Array:
        """Returns positions (b, 2), m in P, of blocks `chosen` (b,) at times `time_s` (b,), s, linear between nodes."""
        nodes = self.time_s[chosen]
        left = np.clip((nodes <= time_s[:, None]).sum(axis=1) - 1, 0, nodes.shape[1] - 2)
        row = np.arange(len(chosen))
        begin, end = nodes[row, left], nodes[row, left + 1]
        share = np.clip((time_s - begin) / np.maximum(end - begin, 1e-12), 0.0, 1.0)[:, None]
        positions = self.position[chosen]
        return positions[row, left] * (1.0 - share) + positions[row, left + 1] * share


class Rest:
    """Finds onsets in the runs of a world."""

    def __init__(self, world: World, curve: LimitCurve) -> None:
        self._world, self._curve = world, curve
        self._creeps, self._shakes = bool(world.model.acting("creep")), bool(world.model.acting("shaking"))
        self._grid, self._fine = self._grid_of()
        self._wary = np.zeros(len(world.commands), dtype=bool)
        self._margin = np.zeros(len(world.commands))

    # --- the grid -----------------------------------------------------------------------------------------------------

    def _grid_of(self) -> tuple[Grid, bool]:
        times = self._world.commands.time_s
        lengths = np.diff(times, axis=1)
        usual = float(np.median(lengths[lengths > 0]))
        if usual > FINE_S:
            return self._divided(lengths), False
        return self._steepest(max(1, round(_WINDOW_S / usual))), True

    def _divided(self, lengths: Array) -> Grid:
        apart = _APART_CREEPING_S if self._creeps else _APART_S
        parts = max(1, int(np.ceil(float(lengths.max()) / apart)))
        share = np.arange(1, parts + 1) / parts
        begin, n = self._world.commands.time_s[:, :-1], len(lengths)
        times = (begin[:, :, None] + lengths[:, :, None] * share).reshape(n, -1)
        number = np.repeat(np.arange(lengths.shape[1]), parts)
        return Grid(times, np.broadcast_to(number, times.shape))

    def _steepest(self, window: int) -> Grid:
        """Returns the knot with the steepest load in each window of knots, and with pushes the most abrupt one too."""
        plate = self._world.plate
        n = len(self._world.commands)
        table = plate.table.reshape(Column.COUNT, n, -1)
        count = table.shape[2]
        before = np.maximum(np.arange(count) - 1, 0)  # the grid looks at a knot from the stretch that ends there
        x, y, z = table[Column.GRAVITY : Column.GRAVITY + 3] - table[Column.PIVOT : Column.PIVOT + 3][:, :, before]
        steepness = np.hypot(x, y) / np.maximum(-z, 1e-6)
        scores = [steepness]
        if self._world.pushed:
            scores.append(np.abs(table[Column.ACCELERATION : Column.ACCELERATION + 3]).sum(axis=0))
        starts = np.arange(0, count, window)
        found = [np.full((n, 1), count)]
        for score in scores:
            padded = np.pad(score, ((0, 0), (0, len(starts) * window - count)), constant_values=-np.inf)
            found.append(padded.reshape(n, len(starts), window).argmax(axis=2) + starts)
        knot = np.sort(np.concatenate(found, axis=1), axis=1)
        times = np.take_along_axis(self._world.commands.time_s, knot, axis=1)
        return Grid(times, np.maximum(knot - 1, 0))

    # --- what it lacks to slide ---------------------------------------------------------------------------------------

    def excess(self, blocks: Blocks, time_s: Array, pose: Array, *, way: Array | None = None) -> tuple[Array, Array]:
        """Returns E (a,), m/s², and the direction (a,), rad in P, of the slide that begins.

        Args:
            blocks: the blocks.
            time_s: (a,) the times, s.
            pose: (a, 3) x and y (m) and yaw (rad) of the blocks in P.
            way: (a,) a first guess at the direction, rad in P.
        """
        zero = np.zeros(len(time_s))
        at = Motion(pose[:, 0], pose[:, 1], pose[:, 2], zero, zero if way is None else way)
        x, y, normal, contact = self._world.pull(blocks, time_s, at)
        if contact is not None and self._shakes:
            push = blocks.shake * self._world.model.shaking(contact)
            x, y = x + push * np.cos(contact.down_rad), y + push * np.sin(contact.down_rad)
        if way is None or self._curve.is_round:
            way = np.arctan2(y, x)
        if contact is None or self._curve.is_round:
            facing = None if contact is None else contact.facing(way)
            return np.hypot(x, y) - self._hold(facing, blocks) * normal - self._margin[blocks.row], way
        way = self._weakest(contact, blocks, (x, y), way)
        value = self._hold(contact.facing(way), blocks)
        return x * np.cos(way) + y * np.sin(way) - value * normal - self._margin[blocks.row], way

    def _weakest(self, contact: Contact, blocks: Blocks, load: tuple[Array, Array], way: Array) -> Array:
        """Returns the direction (a,) in which h / cos is least, cos being that of its angle to the load.

        The search begins at a guess at it.

        By Newton's method within a bracket: in the tangent of that angle the function is convex for any limit curve, so
        that its slope tells the side, also at a corner of the curve or on a straight part of it, where Newton's step is
        worthless. Where E vanishes this is the direction of its maximum.
        """
        downward = np.arctan2(load[1], load[0])
        off = np.clip(np.remainder(way - downward + np.pi, 2.0 * np.pi) - np.pi, -_FARTHEST_RAD, _FARTHEST_RAD)
        low, high = np.full(len(off), -_FARTHEST_RAD), np.full(len(off), _FARTHEST_RAD)
        for _ in range(_ROUNDS_MOST):
            curve = self._curve.at(contact.facing(downward + off), blocks.friction)
            wanted, low, high = _toward_weakest(curve, off, (low, high))
            turned = float(np.abs(wanted - off).max(initial=0.0))
            off = wanted
            if turned < _SETTLED_RAD:
                break
        return downward + off

    def _hold(self, contact: Contact | None, blocks: Blocks) -> Array:
        """Returns the friction (a,) that holds.

        It is the static limit, or the larger kinetic one in runs of which to `beware`.
        """
        limit = self._curve.value(contact, blocks.friction)
        wary = self._wary[blocks.row]
        if contact is None or not wary.any():
            return limit
        return np.where(wary, np.maximum(limit, self._curve.value(setting_off(contact), blocks.friction)), limit)

    def beware(self, row: Index) -> None:
        """Runs `row` (a,) in which a slip ended where it began: kinetic friction is above the static, or it stutters.

        From the second time on, the next slip must lack ever more, up to 1 % of gravity, so that time goes on.
        """
        more = np.clip(2.0 * self._margin[row], _LEAST_MARGIN_M_S2, _MOST_MARGIN_M_S2)
        self._margin[row] = np.where(self._wary[row], more, 0.0)
        self._wary[row] = True

    # --- the search ---------------------------------------------------------------------------------------------------

    def crossing(self, lying: Lying) -> tuple[Crossing, Creep | None]:
        """Returns the next onsets, and the way crept until then (or until the end) if the model lets blocks creep."""
        grid = self._from_now(lying)
        creep = self._creeping(lying, grid) if self._creeps else None
        first = self._first(lying, grid, creep)
        a = len(lying.row)
        onset = Crossing(np.full(a, np.inf), lying.number.copy(), np.zeros(a), lying.pose.copy())
        found = np.flatnonzero(first >= 0)
        if len(found):
            self._close_in(onset, found, first[found], lying, (grid, creep))
        if creep is not None:
            ends = np.minimum(onset.time_s, grid.time_s[:, -1])
            onset.pose[:, :2] = creep.position_at(np.arange(a), ends)
        return onset, creep

    def _from_now(self, lying: Lying) -> Grid:
        """Returns the grid with the blocks' present moment before it, and in place of what is past."""
        times, number = self._grid.time_s[lying.row], self._grid.number[lying.row]
        now = lying.from_s[:, None]
        past = times <= now
        number = np.where(past, lying.number[:, None], number)
        return Grid(np.column_stack([now, np.where(past, now, times)]), np.column_stack([lying.number, number]))

    def _first(self, lying: Lying, grid: Grid, creep: Creep | None) -> Index:
        """Returns the first column (a,) of the grid with E ≥ 0; −1 without one."""
        first, way = np.full(len(lying.row), -1), np.zeros(len(lying.row))
        left, column, count = np.arange(len(first)), 0, grid.time_s.shape[1]
        while len(left) and column < count:
            columns = slice(column, min(column + max(1, _BLOCK // len(left)), count))
            excess, way[left] = self._over(columns, left, (lying, grid, creep), way)
            slips = excess >= 0
            hit = slips.any(axis=1)
            first[left[hit]] = column + slips[hit].argmax(axis=1)
            left, column = left[~hit], columns.stop
        return first

    def _over(
        self, columns: slice, left: Index, seen: tuple[Lying, Grid, Creep | None], way: Array
    ) -> tuple[Array, Array]:
        """Returns E (b, w), m/s², of the blocks `left` (b,) in some columns of the grid, and the last's direction (b,).

        `way` (a,) are those of the columns before, by which all but the first begin.
        """
        lying, grid, creep = seen
        width = columns.stop - columns.start
        many = lying.select(np.repeat(left, width))
        blocks = self._world.blocks(many.row, grid.number[left, columns].ravel(), rest_from_s=many.rest_from_s)
        pose = many.pose
        if creep is not None:
            pose = np.column_stack([creep.position[left, columns].reshape(-1, 2), pose[:, 2]])
        guess = None if columns.start == 0 else np.repeat(way[left], width)
        excess, found = self.excess(blocks, grid.time_s[left, columns].ravel(), pose, way=guess)
        return excess.reshape(len(left), width), found.reshape(len(left), width)[:, -1]

    def _close_in(
        self, onset: Crossing, found: Index, column: Index, lying: Lying, seen: tuple[Grid, Creep | None]
    ) -> None:  # fmt: skip
        """Fills in the crossings of the blocks `found` (b,), which lie before the grid's `column` (b,)."""
        (grid, creep), own = seen, lying.select(found)
        if self._fine:
            number, low, high = self._knots_around(found, column, lying, grid, creep)
        else:
            number, high = grid.number[found, column], grid.time_s[found, column]
            low = grid.time_s[found, np.maximum(column - 1, 0)]
        blocks = self._world.blocks(own.row, number, rest_from_s=own.rest_from_s)

        def at(time_s: Array, way: Array | None) -> tuple[Array, Array]:
            pose = own.pose
            if creep is not None:
                pose = np.column_stack([creep.position_at(found, time_s), pose[:, 2]])
            return self.excess(blocks, time_s, pose, way=way)

        onset.time_s[found], onset.way[found] = root(at, low, high)
        onset.number[found] = number

    def _knots_around(
        self, found: Index, column: Index, lying: Lying, grid: Grid, creep: Creep | None
    ) -> tuple[Index, Array, Array]:  # fmt: skip
        """Looks at every knot between two columns of the grid: the stretch of the crossing, and its two ends."""
        own, times = lying.select(found), self._world.commands.time_s
        last = grid.number[found, column]
        before = grid.number[found, np.maximum(column - 1, 0)]
        width = int((last - before).max()) + 1
        numbers = np.minimum(before[:, None] + np.arange(width), last[:, None])
        ends = np.minimum(times[own.row[:, None], numbers + 1], grid.time_s[found, column][:, None])
        ends = np.maximum(ends, own.from_s[:, None])
        first = self._first(own, Grid(ends, numbers), None if creep is None else creep.at(found, ends))
        chosen = np.arange(len(found)), np.where(first < 0, width - 1, first)
        number, high = numbers[chosen], ends[chosen]
        return number, np.clip(times[own.row, number], own.from_s, high), high

    # --- creeping -----------------------------------------------------------------------------------------------------

    def _creeping(self, lying: Lying, grid: Grid) -> Creep:
        """Returns the way crept at the grid's times, by the trapezium rule."""
        a, c = grid.time_s.shape
        velocity, width = np.empty((a, c, 2)), max(1, _BLOCK // a)
        for column in range(0, c, width):
            columns = slice(column, min(column + width, c))
            many = lying.select(np.repeat(np.arange(a), columns.stop - column))
            blocks = self._world.blocks(many.row, grid.number[:, columns].ravel(), rest_from_s=many.rest_from_s)
            zero = np.zeros(len(many.row))
            at = Motion(many.pose[:, 0], many.pose[:, 1], many.pose[:, 2], zero, zero)
            times = grid.time_s[:, columns].ravel()
            contact = self._world.pull(blocks, times, at).contact
            assert contact is not None
            lacking, _ = self.excess(blocks, times, many.pose)
            resting = Asked.like(contact, way_rad=contact.down_rad, spare_m_s2=-lacking)
            crept = self._world.model.creep(resting)
            held = contact.border_m[:, None] < 0.0  # the foam carries what would drive the creep
            velocity[:, columns] = np.where(held, 0.0, crept).reshape(a, -1, 2)
        lengths = np.diff(grid.time_s, axis=1)[..., None]
        steps = 0.5 * lengths * (velocity[:, 1:] + velocity[:, :-1])
        moved = np.concatenate([np.zeros((a, 1, 2)), np.cumsum(steps, axis=1)], axis=1)
        return Creep(grid.time_s, lying.pose[:, None, :2] + moved)


def _toward_weakest(curve: Support, off: Array, within: tuple[Array, Array]) -> tuple[Array, Array, Array]:
    """Returns the next guess (a,) after `off`, by Newton's step or halving, and the narrower bracket of the minimum."""
    tangent = np.tan(off)
    slope = curve.slope + curve.value * tangent
    low, high = np.where(slope < 0, off, within[0]), np.where(slope < 0, within[1], off)
    bend = curve.bend + curve.slope * tangent + curve.value * (1.0 + tangent * tangent)
    wanted = off - slope / np.where(bend > _LEAST_BEND * curve.value, bend, np.nan)
    return np.where((wanted >= low) & (wanted <= high), wanted, 0.5 * (low + high)), low, high
