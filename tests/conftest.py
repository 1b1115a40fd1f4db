"""For all tests: how long an example takes says something of the machine, and nothing of the program.

A suite that a script has started in the background is told to ignore Ctrl-C, and whatever it starts would ignore it,
too. What arm agents keep of their stops goes to a folder that ends with the tests, and so do answers that several
processes of the tests ask for.
"""

import os
import signal

import pytest
from hypothesis import settings

from tests.answers import FOLDER

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile("repose", deadline=None)
settings.load_profile("repose")


@pytest.fixture(scope="session", autouse=True)
def _states(tmp_path_factory: pytest.TempPathFactory) -> None:  # pyright: ignore[reportUnusedFunction]
    os.environ["XDG_STATE_HOME"] = str(tmp_path_factory.mktemp("state"))


@pytest.fixture(scope="session", autouse=True)
def _answers(  # pyright: ignore[reportUnusedFunction]
    pytestconfig: pytest.Config, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """The workers of one run have folders of their own beside each other.

    A run that a worker's test starts inherits the worker's environment, and is none: its folder is its own.
    """
    own = tmp_path_factory.getbasetemp()
    folder = (own.parent if hasattr(pytestconfig, "workerinput") else own) / "answers"
    folder.mkdir(exist_ok=True)
    os.environ[FOLDER] = str(folder)
