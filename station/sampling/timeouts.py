"""Time limits of what could take for ever: motions, missing corners, and the block's coming to rest."""

from __future__ import annotations

from collections.abc import Sequence

from station.sampling.state import FROZEN, LATE, UNTIMED, State

_LOOKING = ("REFERENCE", "TILT")
"""The phases that must see every frame; the dwell can wait for corners, after the slip a run ends without them."""


def overdue(state: State) -> str:
    """Returns the reason why the run must be given up now, in one sentence; empty while nothing is overdue."""
    plan = state.plan
    if state.awaited and state.since(state.asked_ns) > plan.timeout_s + state.takes_s:
        return (
            f"expected the arm to finish its motion within {plan.timeout_s:g} s beyond the {state.takes_s:.1f} s that "
            "it takes, it did not"
        )
    if state.phase in _LOOKING and (unseen := _unseen(state)):
        return unseen
    # A camera agent that was started again needs some seconds, in which the block rests as well as it ever did.
    if state.phase == "DWELL" and state.since(state.found_ns) > plan.timeout_s:
        return _blind(state, plan.timeout_s)
    if state.phase == "SLIP" and state.waited(plan.timeout_s):
        return (
            f"expected the plate's attitude after the slip, the arm agent reported none for {plan.timeout_s:g} s; "
            "is `station arm` running?"
        )
    if state.phase == "DWELL" and state.waited(plan.timeout_s + state.run.dwell_wanted_s):
        return "expected the block to come to rest on the level plate, it still moves"
    return ""


def _unseen(state: State) -> str:
    silent = state.plan.silence_s
    if state.since(state.found_ns) > silent:
        return _blind(state, silent)
    if state.since(state.attitude_ns) <= silent:
        return ""
    return (
        f"expected the plate's attitude, got none for {silent:g} s; is the link to the arm agent cut, or `station arm` "
        "not running?"
    )


def _blind(state: State, seconds: float) -> str:
    if state.blind == FROZEN:
        return (
            f"expected new frames of the camera, got the same one again for {seconds:g} s: the camera is frozen; start "
            "`pi-agent run` again"
        )
    if state.blind == LATE:
        return (
            f"expected frames of this moment, got none for {seconds:g} s that was less than {state.plan.silence_s:g} s "
            "old; is the link to the camera cut or slow?"
        )
    if state.blind == UNTIMED:
        return (
            "expected to know the camera agent's clock, got no answer to the station's pings in time: is the link to "
            "the camera cut or slow?"
        )
    return (
        f"expected corners of the marker, got none for {seconds:g} s; is the mark in view, and `pi-agent run` running?"
    )


def in_force(stop: str) -> str:
    """Returns why a session ends while the arm is stopped, in one sentence; `stop` is the reason of the stop."""
    return f"the arm is stopped ({stop}): look at the rig, then start a session to go on"


def not_begun(state: State, *, geometry: bool, attitude: bool, untimed: Sequence[str]) -> str:
    """Returns the reason why the session cannot begin, in one sentence; empty while it is too early to say.

    `untimed` are the agents whose clocks are not known: nothing that they stamp is heard.
    """
    if not state.waited(state.plan.timeout_s):
        return ""
    if state.stopped:
        return in_force(state.stopped)
    if untimed:
        names = " and ".join(f"{agent}/clock" for agent in untimed)
        return (
            f"expected answers from {names} to the station's pings within {state.plan.timeout_s:g} s, got none that "
            "came back in half a second; do `pi-agent run` and `station arm` run, and is a link slow?"
        )
    missing = {
        "the camera's geometry (camera/geometry)": geometry,
        "the plate's attitude (arm/platform)": attitude,
        "corners of the marker (camera/corners)": bool(state.found_ns),
    }
    names = " and ".join(name for name, there in missing.items() if not there)
    return (
        f"expected {names} within {state.plan.timeout_s:g} s, got none; is the mark in view, and do `pi-agent run` and "
        "`station arm` report no fault?"
    )
