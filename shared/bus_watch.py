"""Says who is refused on a bus with keys, at both ends: Zenoh itself drops what is not allowed without a word.

- Who listens sees each link with the name in its certificate: one that counts as nobody is named, with its address.
- Who is refused cannot be told why, but sees signs of it: no link comes about (an expired certificate, a foreign
  authority), or links stand and nobody on them announces himself (revoked keys). Its own certificate it reads itself.
- A handshake that fails leaves its only trace at the accepting end in Zenoh's own log, which has no callback: it goes
  to standard output where RUST_LOG asks for it (`RUST_LOG=zenoh_link_tls=warn`, as in the Pi's unit).

What a member sends beyond its rights reaches nobody, and no other process learns of it; its own end names it.
"""

from __future__ import annotations

import logging
import ssl
import threading
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from shared.bus_rights import is_rival, sent_by
from shared.topics import ANGLE_PREFIX, SERVICES

_LOG = logging.getLogger(__name__)
PATIENCE_S = 10.0
"""Zenoh tries again at least every second, and a process announces itself as soon as it runs."""


@dataclass
class BusWatch:
    """A process with keys notices who is refused, and says each thing once.

    `members` are the names that count, by role, and `process` is this one's role.
    """

    folder: Path
    process: str
    members: Mapping[str, Sequence[str]]
    connect: Sequence[str]
    own: str = ""
    begun_s: float = field(default_factory=time.monotonic)
    _links: set[str] = field(default_factory=set[str])
    _said: set[str] = field(default_factory=set[str])
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def read_own(self) -> None:
        """Reads this process's own certificate, as the others will."""
        try:
            self.own = common_name(self.folder)
        except (ssl.SSLError, OSError) as error:
            why = getattr(error, "verify_message", "") or str(error)
            self._say(f"The keys in {self.folder} will be refused by the others: {why}")

    def linked(self, name: str | None, address: str) -> None:
        """Notes a link with whoever has a certificate of that name."""
        with self._lock:
            self._links.add(name or address)
        if self.members and name not in self._counting():
            self._say(
                f"Refused: a process at {address} with the certificate '{name}', which counts as nobody here "
                f"({self.folder / 'rights.toml'}); nothing that it sends or asks arrives"
            )
        if is_rival(self._role_of(name or ""), self.process):
            self._say(
                f"Refused: another {self.process} process at {address} with the certificate '{name}'; nothing that it "
                "sends or asks arrives here, as a rig has one at a time"
            )

    def sending(self, name: str) -> None:
        """Notes that this process sends on a topic; said if its certificate does not allow it."""
        role = self._role_of(self.own)
        if role and name not in sent_by(role) and not name.startswith(ANGLE_PREFIX):
            self._beyond(role, f"send {name}")

    def asking(self, service: str) -> None:
        """Notes that this process asks a service; said if its certificate does not allow it."""
        role = self._role_of(self.own)
        if role and SERVICES[service].asker not in (role, "any"):
            self._beyond(role, f"ask {service}")

    def look(self, *, alive: bool) -> None:
        """Says so once this process has waited long for others and nothing can be heard of them."""
        if not self.connect or alive or time.monotonic() < self.begun_s + PATIENCE_S:
            return
        with self._lock:
            links = ", ".join(sorted(self._links))
        if links:
            self._say(f"Linked with {links}, but nobody there lets the keys in {self.folder} hear; were they revoked?")
        else:
            self._say(
                f"No link with {', '.join(self.connect)}: nobody listens there, or the keys in {self.folder} are "
                "refused (expired, or of another authority)"
            )

    def _counting(self) -> frozenset[str]:
        return frozenset(name for names in self.members.values() for name in names)

    def _role_of(self, name: str) -> str:
        return next((role for role, names in self.members.items() if name in names), "") if name else ""

    def _beyond(self, role: str, what: str) -> None:
        self._say(f"The keys of {role} ('{self.own}') may not {what}: the other processes leave it out")

    def _say(self, sentence: str) -> None:
        with self._lock:
            if sentence in self._said:
                return
            self._said.add(sentence)
        _LOG.warning("%s", sentence)


def common_name(folder: Path) -> str:
    """Returns the name in the certificate of a folder of keys, checked as another process would.

    The check is a handshake with itself.

    Raises:
        ssl.SSLError: if it is expired, or not signed by the authority in the folder.
        OSError: if a file cannot be read.
    """
    cert, key, authority = (str(folder / f"{name}.pem") for name in ("cert", "key", "ca"))
    server, client = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER), ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    server.verify_mode = ssl.CERT_REQUIRED
    server.load_verify_locations(authority)
    client.check_hostname, client.verify_mode = False, ssl.CERT_NONE  # the other end is this very function
    for context in (server, client):
        context.load_cert_chain(cert, key)
    there, back = ssl.MemoryBIO(), ssl.MemoryBIO()
    ends = (client.wrap_bio(back, there), server.wrap_bio(there, back, server_side=True))
    for _ in range(4):  # a handshake goes to and fro twice
        for end in ends:
            with suppress(ssl.SSLWantReadError):
                end.do_handshake()
    certificate = ends[1].getpeercert() or {}
    names = [value for pairs in certificate.get("subject", ()) for name, value in pairs if name == "commonName"]
    return str(names[0]) if names else ""
