"""An engine leaves parts of a model out, and says so in words, whichever method of an effect it is."""

from __future__ import annotations

from station.export.python_file import SAID
from station.export.unsupported_of_model import LEFT_OUT, unsupported_of_model
from station.physics.catalogue import catalogue
from station.physics.effect import HOOKS
from station.physics.model import Model, Term


def test_every_method_of_an_effect_has_words() -> None:
    assert set(LEFT_OUT) == set(HOOKS)


def test_an_engine_that_turns_the_plate_itself_leaves_its_play_out_of_the_motion() -> None:
    play = Model(mu_s=0.36, terms=(Term(catalogue()["backlash"], {"half_width_rad": 0.004}),))
    (said,) = unsupported_of_model(play, engine="numpy", supported=SAID, caveats={})
    assert "backlash" in said
    assert "motion of the plate" in said
