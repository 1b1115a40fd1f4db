"""Everything that a page can see and ask for, behind the server and without a word of HTTP."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from shared.bus import Bus
from shared.clock import Clock
from shared.notes import note_line
from shared.page.asked import text, unknown, whole_number
from shared.rig import RigConfig
from station.app.attached import planted_in
from station.app.serve.curve import LiveCurve
from station.app.serve.follower import Follower
from station.app.serve.jobs import Jobs
from station.app.serve.sessions import Files, Sessions
from station.app.serve.shelf import Shelf
from station.app.serve.viewers import Viewers


class Backend:
    """The session on the bus, the recordings of a folder, and the actions on both. Close it."""

    def __init__(self, bus: Bus, rig: RigConfig, *, files: Files, clock: Clock) -> None:
        self._rig = rig
        self.shelf = Shelf(files.folder)
        self.follower = Follower(
            bus, self.shelf.new_ones, elsewhere=(self.shelf.folder,), nominal_hz=rig.camera.rate_hz
        )
        self.curve = LiveCurve(self.follower.samples)
        self.jobs = Jobs(self.shelf)
        self.viewers = Viewers(rig_file=files.rig)
        self.sessions = Sessions(bus, rig, files=files, clock=clock)
        self._actions: dict[str, Callable[[Mapping[str, Any]], None]] = {
            "session": self._session,
            "arm-stop": lambda _: self.sessions.stop_arm(),
            "job": lambda asked: self.jobs.begin(text(asked, "kind"), text(asked, "recording")),
            "job-end": lambda _: self.jobs.end(),
            "view": self._view,
        }

    def state(self) -> dict[str, Any]:
        """Returns everything that changes all the time."""
        own = {"job": self.jobs.state(), "own": self.sessions.state(), "view": self.viewers.state}
        notes = planted_in(self._rig)
        told = {"notes": notes, "note_lines": [note_line(note) for note in notes]}
        return {"rig": self._rig.id, **told, **self.follower.state(), **own}

    def act(self, name: str, asked: Mapping[str, Any]) -> None:
        """Does what a page asks for.

        Raises:
            UserError: saying in a sentence why not.
        """
        if name not in self._actions:
            raise unknown(name, self._actions)
        self._actions[name](asked)

    def _session(self, asked: Mapping[str, Any]) -> None:
        if (action := text(asked, "action")) == "start":
            self.sessions.begin(samples=whole_number(asked, "samples"), seed=whole_number(asked, "seed"))
            self.follower.expect()
        else:
            self.sessions.control(action)

    def _view(self, asked: Mapping[str, Any]) -> None:
        name = text(asked, "recording")
        self.viewers.show(name, self.shelf.path(name) if name else None)

    def close(self) -> None:
        """Ends what was started here; a session brings the plate back to level first."""
        self.curve.close()
        self.viewers.end()
        self.jobs.end()
        self.sessions.end()
