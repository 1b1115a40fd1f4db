"""Delivers one notification: JSON to a URL by POST, or to a program's standard input. No shell has a part in it.

A failure is said in words of our own: those of a library may hold the URL, which is a secret.
"""

from __future__ import annotations

import base64
import http.client
import subprocess
import urllib.error
import urllib.request
from collections.abc import Sequence
from typing import Any
from urllib.parse import unquote, urlsplit, urlunsplit

from shared.system.processes import kill_apart, start_apart

TEXT = "{text}"
"""The argument of a command in whose place the sentence is put."""


class UndeliveredError(Exception):
    """The reason in words why a notification did not arrive."""


class _NoRedirect(urllib.request.HTTPRedirectHandler):
    """Follows nobody elsewhere: a POST that is redirected arrives as an empty GET, and perhaps at a stranger's."""

    def redirect_request(self, *_: Any, **__: Any) -> None:
        return None


def post(url: str, body: bytes, *, timeout_s: float) -> None:
    """Sends the body as JSON.

    Raises:
        UndeliveredError: if nobody answers within `timeout_s`, or the answer is no success.
    """
    address, headers = _without_user(url)
    headers |= {"Content-Type": "application/json", "User-Agent": "repose"}
    try:
        request = urllib.request.Request(address, data=body, headers=headers, method="POST")
        with urllib.request.build_opener(_NoRedirect).open(request, timeout=timeout_s):
            return
    except urllib.error.HTTPError as error:
        error.close()
        raise UndeliveredError(f"its url answered with status {error.code}") from None
    except TimeoutError:
        raise UndeliveredError(f"its url did not answer within {timeout_s:g} s") from None
    except (OSError, http.client.HTTPException, ValueError) as error:
        raise UndeliveredError(f"its url cannot be reached: {_reason(error)}") from None


def _without_user(url: str) -> tuple[str, dict[str, str]]:
    """Returns the URL without the user and password in it, and the header that says them instead."""
    parts = urlsplit(url)
    user, at, host = parts.netloc.rpartition("@")
    if not at:
        return url, {}
    word = base64.b64encode(unquote(user).encode()).decode()
    return urlunsplit(parts._replace(netloc=host)), {"Authorization": f"Basic {word}"}


def _reason(error: Exception) -> str:
    """Returns the system's words for an error, or its kind; never a library's words, which may hold the URL."""
    cause = error.reason if isinstance(error, urllib.error.URLError) else error
    if isinstance(cause, OSError) and cause.strerror:
        return cause.strerror
    return type(cause).__name__


def call(command: Sequence[str], text: str, body: bytes, *, timeout_s: float) -> None:
    """Starts a program with the body on its standard input, and `text` for an argument that is `{text}`.

    Raises:
        UndeliveredError: if it cannot be started, does not end within `timeout_s` (it is killed), or ends with a fault.
    """
    words = [text if word == TEXT else word for word in command]
    try:
        process = start_apart(words)
    except (OSError, ValueError) as error:
        raise UndeliveredError(f"its command cannot be started: {_reason(error)}") from None
    try:
        process.communicate(body, timeout=timeout_s)
    except subprocess.TimeoutExpired:
        kill_apart(process)
        raise UndeliveredError(f"its command did not end within {timeout_s:g} s") from None
    if process.returncode:
        raise UndeliveredError(f"its command ended with status {process.returncode}")
