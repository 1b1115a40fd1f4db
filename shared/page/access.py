"""Access to the page: a secret token, and only for requests that a page of ours makes.

| what somebody could try | what stands against it |
|---|---|
| reach it from another machine | the server listens on the loopback address only |
| another program or user of this machine guesses | 256 random bits, compared in constant time |
| one of them opens connections and says nothing | few at a time, each for seconds (`strangers.py`) |
| a foreign page in the same browser posts a form (CSRF) | a POST needs the token in a header, which no form can set |
| a foreign page reads an answer | no answer allows another origin; the cookie is SameSite=Strict and HttpOnly |
| a foreign name that resolves to 127.0.0.1 (DNS rebinding) | `Host` must be a loopback name |
"""

from __future__ import annotations

import hmac
import os
import secrets
from collections.abc import Mapping
from http.cookies import CookieError, SimpleCookie
from pathlib import Path

from shared.errors import UserError
from shared.own_files import require_own, require_secret

HEADER = "X-Repose-Token"
_HOSTS = frozenset({"127.0.0.1", "localhost", "[::1]"})
_LEAST_LETTERS = 32


class Access:
    """The token of one server, and what a request must show of it."""

    def __init__(self, token: str, *, port: int) -> None:
        self.token = token
        self.cookie = f"repose-{port}"
        """The name of the cookie: browsers do not keep the ports of one host apart."""

    def knows(self, token: str) -> bool:
        """Returns true if it is the token."""
        return hmac.compare_digest(token.encode(), self.token.encode())

    def may_read(self, headers: Mapping[str, str]) -> bool:
        """Returns true if the request carries the cookie."""
        try:
            found = SimpleCookie(headers.get("Cookie", "")).get(self.cookie)
        except CookieError:
            return False
        return found is not None and self.knows(found.value)

    def may_act(self, headers: Mapping[str, str]) -> bool:
        """Returns true if the request also comes from our own page: only that can set the header."""
        origin, own = headers.get("Origin"), f"http://{headers.get('Host', '')}"
        return self.may_read(headers) and self.knows(headers.get(HEADER, "")) and origin in (None, own)

    def set_cookie(self) -> str:
        """Returns the value of `Set-Cookie` that lets a browser in."""
        return f"{self.cookie}={self.token}; Path=/; HttpOnly; SameSite=Strict"


def is_local(host: str) -> bool:
    """Returns true if a request's `Host` is a name of this machine; any port, as a tunnel may lead from another one."""
    name, _, port = host.rpartition(":")
    return (name in _HOSTS and port.isdigit()) or host in _HOSTS


def token_of(file: Path | None) -> str:
    """Returns a new token, or the one of a file, which is made where there is none; only its owner can read it.

    Raises:
        UserError: if the file cannot be used, or others than its owner may read it, write to it or put another one in
            its place.
    """
    if file is None:
        return secrets.token_urlsafe(32)
    try:
        require_own(file.parent, what="keys of a page")
        if not file.exists():
            with os.fdopen(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as made:
                made.write(secrets.token_urlsafe(32) + "\n")
        kept = file.resolve()  # a link leads to a file in another folder
        require_own(kept.parent, what="keys of a page")
        require_secret(kept, what="the key of a page")
        token = kept.read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise UserError(f"Expected to keep the token in {file}, but that failed: {error}") from error
    if len(token) < _LEAST_LETTERS or not token.isascii() or not token.replace("-", "").replace("_", "").isalnum():
        raise UserError(
            f"Expected a token of {_LEAST_LETTERS} or more letters and digits in {file}, found another text; delete "
            "the file, and a new one is made"
        )
    return token
