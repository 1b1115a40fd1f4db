"""A cluster that the user has does the pool's work: `dask=ADDRESS` of a scheduler, or `ray` (`ray=ADDRESS`).

Its workers have this program installed and see the same folders under the same paths.
"""

from __future__ import annotations

import importlib
import socket
from collections.abc import Callable, Generator
from contextlib import AbstractContextManager, contextmanager, nullcontext

from shared.errors import UserError
from station.pool import on_backend

TIMEOUT_S = 10.0
"""The time in which a scheduler answers."""


def cluster(named: str) -> AbstractContextManager[None]:
    """Makes `spread` use that cluster within the block, or this machine with an empty text.

    Raises:
        UserError: for another name, or if the cluster does not answer.
    """
    if not named:
        return nullcontext()
    kind, _, address = named.partition("=")
    if kind not in _KINDS or (kind == "dask" and not address):
        raise UserError(f"Expected --backend dask=ADDRESS or ray, got {named}; the scheduler prints its address")
    return _KINDS[kind](address)


@contextmanager
def _dask(address: str) -> Generator[None]:
    from distributed import Client  # noqa: PLC0415  # an extra, and slow to load

    try:
        client = Client(address, timeout=TIMEOUT_S)
    except (OSError, ValueError) as error:
        raise UserError(f"Expected a Dask scheduler at {address}, but none answers: {error}") from error
    with client:
        if not client.ncores():
            raise UserError(f"Expected workers at the Dask scheduler {address}, but it has none; start some")
        with on_backend("dask", client=client):
            yield


@contextmanager
def _ray(address: str) -> Generator[None]:
    """Connects to Ray, which is the user's own: it has no wheels for every system, and no extra brings it."""
    try:
        ray, of_joblib = importlib.import_module("ray"), importlib.import_module("ray.util.joblib")
    except ModuleNotFoundError as error:
        raise UserError(f"Expected the package ray, which is not installed ({error}); run: pip install ray") from error
    of_joblib.register_ray()
    try:
        _require_answer(address)
        ray.init(address=address or None, log_to_driver=False, logging_level="ERROR")
    except OSError as error:
        raise UserError(f"Expected a Ray cluster at {address}, but none answers: {error}") from error
    try:
        with on_backend("ray"):
            yield
    finally:
        ray.shutdown()


def _require_answer(address: str) -> None:
    """Asks whether anything listens there, as Ray itself asks for minutes.

    Raises:
        OSError: if nothing does.
    """
    host, _, port = address.rpartition("://")[2].rpartition(":")
    if host and port.isdecimal():
        socket.create_connection((host.strip("[]"), int(port)), timeout=TIMEOUT_S).close()


_KINDS: dict[str, Callable[[str], AbstractContextManager[None]]] = {"dask": _dask, "ray": _ray}
