"""Rerun's page in a real browser: it draws, and no request of it leaves this computer."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from shared.rig import RigConfig
from station.view.rrd import write_rrd
from station.view.setup import setup_of
from station.view.web import serve_file
from tests.patience import PATIENCE_S
from tests.system import chromium
from tests.system.elsewhere import elsewhere
from tests.unit.view import session

pytestmark = [
    pytest.mark.system,
    pytest.mark.skipif(not chromium.binary(), reason=chromium.WHY_NOT),
]
DRAWS = chromium.DRAWS_WITHOUT_A_CARD
DRAWN = "document.getElementById('the_canvas_id').className === 'visible'"
SETTLES_S = 5.0
"""The viewer's news, fonts and figures are asked for within a second of its start."""


def test_no_request_of_the_viewer_leaves_this_computer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rerun's page asks fonts.googleapis.com, api.github.com, app.rerun.io and tel.rerun.io; its program the last."""
    drawn = tmp_path / "session.rrd"
    items = list(session.session_messages())
    write_rrd(items, drawn, topics={topic for topic, _, _ in items}, setup=setup_of(RigConfig(id="test")), name="test")
    with elsewhere() as internet, chromium.browser(tmp_path / "profile", internet.word, *DRAWS) as page:
        page.of("fetch('http://example.org/').catch(() => null)")
        assert [line for line in internet.asked if "example.org" in line], "a request that leaves is not heard"
        internet.asked.clear()
        monkeypatch.setenv("HTTPS_PROXY", internet.url)
        served = serve_file(drawn)
        try:
            page.size(900, 700)
            page.open(served.url)
            page.wait(DRAWN)
            time.sleep(SETTLES_S)
            page.picture(Path(os.environ.get("REPOSE_PICTURES", tmp_path)) / "viewer.png")
        finally:
            served.end()
            served.process.wait(PATIENCE_S)
        assert internet.asked == []
    refused = [error for error in page.errors if "Content Security Policy" in error]
    assert [error for error in page.errors if error not in refused and "example.org" not in error] == []
    assert [error for error in refused if "tel.rerun.io" in error], "nothing was refused: was it drawn at all?"
