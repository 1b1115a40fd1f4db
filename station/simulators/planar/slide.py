"""The block in motion, from an onset to its stop: place, speed v, direction φ, yaw; each run at its own step.

    v′ = T·e(φ) − h(φ) N,    v φ′ = T·e⊥(φ) − h′(φ) N = G.

Of a block that turns, friction against the sliding is the less, see `turning`.

Kutta's third-order rule, with the step from its embedded second-order one. At low speed φ relaxes faster than any step,
the faster the more the limit curve bends: there it is not integrated but moved by what an exponential relaxation with
the rate λ = (T·e + h″ N) / v gives.
A step never passes a knot; one that passes a stop is taken again, up to the stop.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from station.physics.circle import cos_sin
from station.physics.contact import Array
from station.physics.sole import TURNING_RADIUS, carried_across, left_against_turning
from station.simulators.planar.friction import LimitCurve, Support
from station.simulators.planar.load import Blocks, Motion, World
from station.simulators.planar.plate import Column, Index
from station.simulators.planar.turning import (
    Decays,
    Turning,
    decays,
    rate_after,
    rate_at_full,
    rate_at_half,
    turning,
)

SLOW_M_S = 5e-3
LONGEST_S, FIRST_S, SHORTEST_S = 20e-3, 2e-3, 2e-5
TOLERANCE_M_S = 1e-5
_ACROSS = 0.2
"""Share of the error across the way, and of the turning, that counts: friction takes it back, and the rule's own error
is smaller."""
_STOPPED_M_S, _NO_TIME_S = 1e-8, 1e-9
_NONE = np.empty(0, dtype=np.intp)
_LEAST_FRICTION = 1e-9
"""A law may take all friction away."""
_CORNER = 15.0
"""Change of G per radian, in units of the friction, beyond which a limit curve has a facet (2 : 1 ellipse: 4)."""


class Nodes(NamedTuple):
    """The steps of a slide, one after another: run, time, pose (·, 3) with yaw, and velocity (·, 3) with yaw rate."""

    row: Index
    time_s: Array
    pose: Array
    velocity: Array


class Stop(NamedTuple):
    """The ends of slides (a,): run, time, stretch, and the pose (a, 3)."""

    row: Index
    time_s: Array
    number: Index
    pose: Array


@dataclass(eq=False)
class _State:
    """The blocks that move (a,)."""

    blocks: Blocks
    time_s: Array
    at: Motion
    step_s: Array
    end_s: Array

    def select(self, chosen: Index) -> _State:
        at = Motion(*(np.asarray(values)[chosen] for values in self.at))
        return _State(self.blocks.select(chosen), self.time_s[chosen], at, self.step_s[chosen], self.end_s[chosen])


class _Rates(NamedTuple):
    """Changes of x, y, v and φ, how far φ was moved at low speed, and what the yaw needs."""

    x: Array
    y: Array
    speed: Array
    way: Array
    moved: Array | float
    drag: Array
    bend: Array | float
    slow: NDArray[np.bool_]
    turning: Turning | None


_Stages = tuple[_Rates, _Rates, _Rates]


class Slide:
    """Follows blocks from their onset to their stop."""

    def __init__(self, world: World, curve: LimitCurve, *, traced: bool = True) -> None:
        """`traced` says if the nodes are wanted; else only the onsets are among them."""
        self._traced = traced
        self._world, self._curve = world, curve.in_motion
        self._shakes = bool(world.model.acting("shaking"))
        self._leads = bool(world.model.acting("lead"))
        self._spins = world.model.turns or bool(world.commands.velocity[:, 2].any())

    def run(
        self, blocks: Blocks, time_s: Array, pose: Array, *, way: Array, speed: Array | None = None,
        yaw_rate: Array | None = None,
    ) -> tuple[Nodes, Stop]:  # fmt: skip
        """Follows the blocks from their onsets on, or from where they slide already.

        Args:
            blocks: the blocks (a,).
            time_s: (a,) the time at which each is taken over, s.
            pose: (a, 3) x and y (m) and yaw (rad) in P by then.
            way: (a,) the direction of sliding, rad in P.
            speed: (a,) the speed by then, m/s; None: they start from rest.
            yaw_rate: (a,) the yaw rate by then, rad/s; None: they do not turn.
        """
        zero = np.zeros(len(time_s))
        at = Motion(
            pose[:, 0],
            pose[:, 1],
            pose[:, 2],
            zero if speed is None else speed,
            way,
            zero if yaw_rate is None else yaw_rate,
        )
        if self._spins and speed is None:
            # A moment holds its share of friction without having a way: the block sets off where the load points.
            at = at._replace(way=way + self._rates(blocks, time_s, at, since=zero + FIRST_S).moved)
        end = self._world.commands.end_s[blocks.row]
        state = _State(blocks, time_s, at, np.full(len(time_s), FIRST_S), end)
        nodes, stops = [_nodes(state)], list[Stop]()
        while len(state.time_s):
            state, gone = self._step(state)
            if self._traced:
                nodes.append(_nodes(state))
            if gone.any():
                ended = state.select(np.flatnonzero(gone))
                final = np.column_stack([ended.at.x, ended.at.y, ended.at.yaw])
                stops.append(Stop(ended.blocks.row, ended.time_s, ended.blocks.number, final))
                state = state.select(np.flatnonzero(~gone))
        return Nodes(*(np.concatenate(parts) for parts in zip(*nodes, strict=True))), Stop(
            *(np.concatenate(parts) for parts in zip(*stops, strict=True))
        )

    def _step(self, state: _State) -> tuple[_State, NDArray[np.bool_]]:
        """Tries one step of every block; those whose step was too long stay where they are. Says who has stopped."""
        blocks, at, time = state.blocks, state.at, state.time_s
        left = blocks.stretch[Column.END] - time
        step = np.minimum(state.step_s, left)
        first = self._rates(blocks, time, at)
        half = _moved(at, 0.5 * step, first)
        fading = None if first.turning is None else decays(first.turning, step)
        if first.turning is not None and fading is not None:
            half = half._replace(yaw_rate=rate_at_half(first.turning, fading))
        second = self._rates(blocks, time + 0.5 * step, half, since=0.5 * step, like=first)
        full = _moved(at, step, first, second)
        if first.turning is not None and second.turning is not None and fading is not None:
            full = full._replace(yaw_rate=rate_at_full(first.turning, second.turning, fading))
        third = self._rates(blocks, time + step, full, since=step, like=first)
        after, wrong = _kutta(at, (first, second, third), step)
        if fading is not None:
            after, wrong = self._turned(blocks, after, wrong, (first, second, third), fading)

        passed = step >= left
        # Who sets off just before a knot gets no speed until there: it has not stopped, its load grows beyond.
        stops = (after.speed <= 0.0) & ~(passed & (step <= _NO_TIME_S))
        arrived = stops & ((after.speed > -_STOPPED_M_S) | (step <= _NO_TIME_S))
        taken = np.where(stops, arrived, (wrong <= 1.0) | (step <= SHORTEST_S))
        grown = step * np.clip(0.85 / np.cbrt(np.maximum(wrong, 1e-9)), 0.25, 2.5)
        longer = np.where(taken & (step < state.step_s), np.maximum(state.step_s, grown), grown)
        following = np.minimum(longer, LONGEST_S)
        over = np.flatnonzero(stops)
        if len(over):
            following[over] = _time_to_stop(at.speed[over], first.speed[over], after.speed[over], step[over])

        stopped = taken & stops
        new = Motion(
            np.where(taken, after.x, at.x),
            np.where(taken, after.y, at.y),
            np.where(taken, after.yaw, at.yaw) if self._spins else at.yaw,
            np.where(taken, np.maximum(after.speed, 0.0), at.speed),
            np.where(taken, after.way, at.way),
            np.where(stopped, 0.0, np.where(taken, after.yaw_rate, at.yaw_rate)) if self._spins else at.yaw_rate,
        )
        now = np.where(taken, time + step, time)
        blocks, over = self._moved_on(blocks, taken & passed, now, state.end_s)
        return _State(blocks, now, new, following, state.end_s), stopped | over

    def _moved_on(
        self, blocks: Blocks, passed: NDArray[np.bool_], now: Array, end_s: Array
    ) -> tuple[Blocks, NDArray[np.bool_]]:
        """Moves blocks that have reached a knot on to the next stretch that takes any time; says whose run is over."""
        over = passed & (now >= end_s)
        going = np.flatnonzero(passed & ~over)
        if len(going):
            blocks = self._world.moved_on(blocks, going)
        return blocks, over

    def _rates(
        self, blocks: Blocks, time_s: Array, at: Motion, *, since: Array | None = None, like: _Rates | None = None
    ) -> _Rates:
        """Returns the rates of change at the beginning of a step or `since` (a,) s after it.

        Who is slow, and h″, which hardly changes in a step, its later stages take from the first (`like`).
        """
        cosine, sine = cos_sin(at.way)
        x, y, normal, contact = self._world.pull(blocks, time_s, at, (cosine, sine))
        if contact is not None and self._shakes:
            # A push that sets a block off lasts as long as the slide; else no slip before its time would get away.
            push = np.maximum(blocks.shake, 0.0) * self._world.model.shaking(contact)
            x, y = x + push * np.cos(contact.down_rad), y + push * np.sin(contact.down_rad)
        h = self._curve.at(contact, blocks.friction, bends=like is None)
        bend = np.maximum(h.bend, 0.0) / np.maximum(h.value, _LEAST_FRICTION)
        slow = like.slow if like is not None else at.speed < SLOW_M_S * (1.0 + bend)
        if like is not None:
            h = h._replace(bend=like.bend)
        ahead, aside = x * cosine + y * sine, y * cosine - x * sine
        aside = aside - h.slope * normal
        lead = self._world.model.lead(contact) if self._leads and contact is not None else None
        if lead is not None:
            side = 2.0 * self._world.half_m[blocks.row]
            across = carried_across(lead, side, yaw_rate_rad_s=np.asarray(at.yaw_rate), speed_m_s=at.speed)
            aside = aside - h.value * normal * across
        moved: Array | float = 0.0
        some = np.flatnonzero(slow) if since is not None else _NONE
        if since is not None and len(some):
            stiffness = ahead + h.bend * normal
            turn = relaxed(stiffness[some], aside[some], at.speed[some], since[some])
            cosine[some], sine[some] = _turned_by(turn, cosine[some], sine[some])
            ahead[some] = x[some] * cosine[some] + y[some] * sine[some]
            moved = np.zeros(len(slow))
            moved[some] = turn
            h = Support(h.value + moved * (h.slope + 0.5 * moved * h.bend), h.slope, h.bend)
        way = np.where(slow, 0.0, aside / np.maximum(at.speed, 0.5 * SLOW_M_S))
        drag, own = h.value * normal, None
        if self._spins:
            own = turning(
                np.zeros_like(drag) if contact is None else self._world.driven(contact, drag, h.slope * normal),
                hold=drag if lead is None else drag * left_against_turning(lead),
                speed=at.speed,
                rate=np.asarray(at.yaw_rate),
                side=2.0 * self._world.half_m[blocks.row],
                bound=None if like is None or like.turning is None else like.turning.bound,
            )
            drag = drag * own.share
        return _Rates(at.speed * cosine, at.speed * sine, ahead - drag, way, moved, drag, h.bend, slow, own)

    def _turned(
        self, blocks: Blocks, after: Motion, wrong: Array, stages: _Stages, fading: Decays
    ) -> tuple[Motion, Array]:
        """Returns the state after a step with its yaw and yaw rate, and the error against the tolerance with theirs."""
        first, second, third = (_turning_of(stage) for stage in stages)
        rate, off = rate_after(first, second, third, fading)
        yaw = after.yaw + fading.step / 6.0 * (first.rate + 4.0 * second.rate + third.rate)
        reach = TURNING_RADIUS * 2.0 * self._world.half_m[blocks.row]
        return after._replace(yaw=yaw, yaw_rate=rate), np.maximum(wrong, _ACROSS * reach * off / TOLERANCE_M_S)


def _turning_of(stage: _Rates) -> Turning:
    assert stage.turning is not None
    return stage.turning


def _nodes(state: _State) -> Nodes:
    at = state.at
    cosine, sine = cos_sin(at.way)
    velocity = np.column_stack([at.speed * cosine, at.speed * sine, at.yaw_rate])
    return Nodes(state.blocks.row, state.time_s, np.column_stack([at.x, at.y, at.yaw]), velocity)


def _moved(at: Motion, step: Array, first: _Rates, second: _Rates | None = None) -> Motion:
    """Computes a stage of the rule: a step by `first`, or by 2 `second` − `first`."""
    if second is None:
        x, y, speed, way = first.x, first.y, first.speed, first.way
    else:
        x, y = 2.0 * second.x - first.x, 2.0 * second.y - first.y
        speed, way = 2.0 * second.speed - first.speed, 2.0 * second.way - first.way
    yaw = at.yaw
    if first.turning is not None:
        turned = first.turning.rate
        if second is not None and second.turning is not None:
            turned = 2.0 * second.turning.rate - turned
        yaw = yaw + step * turned
    # A speed below zero, of a block that stops on the way, is for the stop to deal with; effects need not know it.
    return Motion(at.x + step * x, at.y + step * y, yaw, np.maximum(at.speed + step * speed, 0.0), at.way + step * way)


def _kutta(at: Motion, stages: _Stages, step: Array) -> tuple[Motion, Array]:
    """Returns the state after a step, and its error against the tolerance.

    On a corner of the support function (a facet of the limit curve) φ is held by forces from both sides, faster than
    any step follows. Where φ′ changes its sign within a step too long for it, φ is put between, where they balance.
    """
    first, second, third = stages
    sixth = step / 6.0
    way = at.way + sixth * (first.way + 4.0 * second.way + third.way)
    along = np.abs(first.speed - 2.0 * second.speed + third.speed)
    across = np.maximum(at.speed, SLOW_M_S) * np.abs(first.way - 2.0 * second.way + third.way)
    doubtful = np.flatnonzero(sixth * _ACROSS * across > TOLERANCE_M_S)
    if len(doubtful):
        held, balanced = _between(at, stages, step, doubtful)
        way[held], across[held] = balanced, 0.0
    after = Motion(
        at.x + sixth * (first.x + 4.0 * second.x + third.x),
        at.y + sixth * (first.y + 4.0 * second.y + third.y),
        at.yaw,
        at.speed + sixth * (first.speed + 4.0 * second.speed + third.speed),
        np.where(first.slow, at.way + third.moved, way),
    )
    return after, sixth * np.maximum(along, _ACROSS * across) / TOLERANCE_M_S


def _between(at: Motion, stages: _Stages, step: Array, doubtful: Index) -> tuple[Index, Array]:
    """Gives the `doubtful` (b,) that are held at a corner (c,), and the ways (c,) where the forces on them balance."""
    first, second, third = (stage.way[doubtful] for stage in stages)
    step = step[doubtful]
    early = first * second < 0
    other = np.where(early, second, third)
    reach = np.where(early, 0.5 * step * first, step * (2.0 * second - first))
    speed = np.maximum(at.speed[doubtful], SLOW_M_S)
    abrupt = speed * np.abs(first - other) > _CORNER * stages[0].drag[doubtful] * np.abs(reach)
    held = np.flatnonzero((first * other < 0) & abrupt)
    balance = first[held] / (first[held] - other[held])
    return doubtful[held], at.way[doubtful[held]] + reach[held] * balance


def _turned_by(turn: Array, cosine: Array, sine: Array) -> tuple[Array, Array]:
    """Returns cosine and sine of an angle that grows by `turn`."""
    by_cosine, by_sine = cos_sin(turn)
    return cosine * by_cosine - sine * by_sine, sine * by_cosine + cosine * by_sine


def relaxed(stiffness: Array, aside: Array, speed: Array, since: Array) -> Array:
    """Returns the change of φ (a,), rad, in some time from now, towards where G vanishes.

    Args:
        stiffness: (a,) −dG/dφ = T·e + h″ N, m/s².
        aside: (a,) G, m/s².
        speed: (a,) v, m/s.
        since: (a,) the time, s.
    """
    paced = since / np.maximum(speed, 1e-9)
    decay = np.clip(stiffness * paced, -1.0, 1e9)
    small = np.abs(decay) < 1e-6
    share = np.where(small, 1.0, -np.expm1(-decay) / np.where(small, 1.0, decay))
    return np.arctan(aside * paced * share)


def _time_to_stop(speed: Array, change: Array, after: Array, step: Array) -> Array:
    """Returns the zero of a parabola through the speed, its change and the (negative) speed after `step`."""
    bend = (after - speed - change * step) / np.maximum(step * step, 1e-18)
    root = np.sqrt(np.maximum(change * change - 4.0 * bend * speed, 0.0))
    below = -change + root
    time = np.where(below > 0, 2.0 * speed / np.where(below > 0, below, 1.0), 0.5 * step)
    return np.clip(time, 0.0, step * (1.0 - 1e-6))
