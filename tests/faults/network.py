"""A cable for each process: network namespaces with one link each on a common bridge. It needs root.

A cut takes the link down, as a pulled plug does; a silent link stays up and carries nothing. Loss and delay are made
by a process that takes every frame of a cable and hands it on (`cable.py`), since not every kernel has netem.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass, field

from tests.system.processes import ROOT

SUBNET, PHYSICS = "10.177.0", "10.178.0"
TWIN = "twin"
"""It stands for the arm's joints and for the light that reaches the camera: what connects them is no cable of the
rig's, and no row cuts it. It is on a bridge of its own."""


def possible() -> bool:
    """True if namespaces, links and bridges can be made here."""
    if os.name != "posix" or not hasattr(os, "geteuid") or os.geteuid() or shutil.which("ip") is None:
        return False
    name = f"rp{os.getpid() % 10000}try"
    made = not _run("ip", "link", "add", name, "type", "bridge", check=False)
    _run("ip", "link", "del", name, check=False)
    return made


@dataclass
class Network:
    """The namespaces of some processes, each with an address."""

    names: tuple[str, ...]
    tag: str = field(default_factory=lambda: f"rp{os.getpid() % 10000}")
    _cables: dict[str, subprocess.Popen[bytes]] = field(default_factory=dict[str, subprocess.Popen[bytes]])

    def make(self) -> None:
        """Makes bridge, namespaces and links."""
        for bridge in (self.bridge, f"{self.tag}ph"):
            self._ip("link", "add", bridge, "type", "bridge")
            self._ip("link", "set", bridge, "up")
        for number, name in enumerate(self.names, start=1):
            self._ip("netns", "add", self.space(name))
            self._ip("-n", self.space(name), "link", "set", "lo", "up")
            if name != TWIN:
                self._plug(name, self._link(name), "eth0", f"{SUBNET}.{number}", self.bridge)
            self._plug(name, f"{self._link(name)}p", "eth1", f"{PHYSICS}.{number}", f"{self.tag}ph")
        for number, name in enumerate(self.names, start=1):
            if name != TWIN:  # the twin reaches the others where they listen, by its own way
                way = (f"{self.address(name)}/32", "via", f"{PHYSICS}.{number}")
                self._ip("-n", self.space(TWIN), "route", "add", *way)

    def _plug(self, name: str, here: str, there: str, address: str, bridge: str) -> None:
        """A link from a process's namespace to a bridge."""
        space = self.space(name)
        self._ip("link", "add", here, "type", "veth", "peer", "name", there, "netns", space)
        self._ip("-n", space, "addr", "add", f"{address}/24", "dev", there)
        self._ip("-n", space, "link", "set", there, "up")
        self._ip("link", "set", here, "master", bridge, "up")

    def remove(self) -> None:
        """Removes everything; what is already gone is no fault."""
        for name in [*self._cables]:
            self.plain(name)
        for name in self.names:
            _run("ip", "link", "del", self._link(name), check=False)
            _run("ip", "link", "del", f"{self._link(name)}p", check=False)
            _run("ip", "netns", "del", self.space(name), check=False)
        _run("ip", "link", "del", self.bridge, check=False)
        _run("ip", "link", "del", f"{self.tag}ph", check=False)

    @property
    def bridge(self) -> str:
        """The bridge's name."""
        return f"{self.tag}br"

    def space(self, name: str) -> str:
        """A process's namespace."""
        return f"{self.tag}{name}"

    def address(self, name: str) -> str:
        """A process's address."""
        return f"{PHYSICS if name == TWIN else SUBNET}.{self.names.index(name) + 1}"

    def inside(self, name: str) -> list[str]:
        """The words before a command that runs in a process's namespace."""
        return ["ip", "netns", "exec", self.space(name)]

    def cut(self, name: str) -> None:
        """Pulls the plug."""
        self._ip("link", "set", self._link(name), "down")

    def mend(self, name: str) -> None:
        """Puts it in again."""
        self._ip("link", "set", self._link(name), "up")

    def silence(self, name: str) -> None:
        """The link stays up and carries nothing."""
        self._ip("link", "set", self._link(name), "nomaster")

    def speak(self, name: str) -> None:
        """It carries again."""
        self._ip("link", "set", self._link(name), "master", self.bridge)

    def bad(self, name: str, *, loss: float = 0.0, delay_s: float = 0.0) -> None:
        """Frames of a cable are lost or late, in both directions."""
        near, far = f"{self._link(name)}x", f"{self._link(name)}y"
        self._ip("link", "set", self._link(name), "nomaster")
        self._ip("link", "add", near, "type", "veth", "peer", "name", far)
        self._ip("link", "set", near, "up")
        self._ip("link", "set", far, "master", self.bridge, "up")
        words = [sys.executable, "-m", "tests.faults.cable", self._link(name), near, str(loss), str(delay_s)]
        self._cables[name] = subprocess.Popen(words, cwd=ROOT)

    def plain(self, name: str) -> None:
        """The cable is as before."""
        process = self._cables.pop(name)
        process.terminate()
        process.wait()
        _run("ip", "link", "del", f"{self._link(name)}x", check=False)
        self.speak(name)

    def _link(self, name: str) -> str:
        return f"{self.tag}{name[:4]}"

    def _ip(self, *words: str) -> None:
        _run("ip", *words)


def _run(*words: str, check: bool = True) -> int:
    return subprocess.run(words, check=check, capture_output=not check).returncode
