import io
import json
from collections import Counter
from pathlib import Path

from rich.console import Console

from tests.proof.gates import gates
from tests.proof.pictures import confusion_counts, detected, draw_all
from tests.proof.report import About, as_json, markdown, printed
from tests.unit.proof.made_up import claim, concealed, said, scored, truth

CASES = [
    scored(truth("single", concealed("viscous", strength=4.0), name="a1"), said(claim("viscous"))),
    scored(truth("single", concealed("viscous", strength=0.5), name="a2"), said()),
    scored(truth("null", answer="none", name="a3"), said(claim("wear"))),
]
ABOUT = About(
    date="2026-11-21", command="python -m tests.proof --seed 1", versions={"numpy": "2"}, seed=1,
    tiers={"single": 2, "null": 1},
    seals={"single": "ab" * 32}, tool="1234", not_made={"artefact": "the generator made no cases: none yet"},
)  # fmt: skip


def test_confusion_and_detection_are_counted():
    assert confusion_counts(CASES) == Counter({("viscous", "viscous"): 1, ("none", "wear"): 1})
    assert detected(CASES) == {"viscous": {4.0: [(True, True)], 0.5: [(False, False)]}}


def test_pictures_are_drawn_where_there_is_something(tmp_path: Path):
    assert [path.name for path in draw_all(CASES, tmp_path)] == ["confusion.png", "reliability.png", "detection.png"]
    assert draw_all([], tmp_path) == []
    assert all((tmp_path / name).stat().st_size > 2000 for name in ("confusion.png", "detection.png"))


def test_the_readme_table_says_where_it_is_from_and_what_is_missed():
    text = markdown(ABOUT, gates(CASES), [], {"stribeck": Counter({"another law": 2})}, ["confusion"])
    assert (
        "Measured 2026-11-21 with `python -m tests.proof --seed 1` (seed 1; single 2, null 1; tool 1234; numpy 2)."
        in text
    )
    (alarms,) = [line for line in text.splitlines() if "false alarms on nulls:" in line]
    assert "100.0 %" in alarms
    assert "| 1 | ≤ 14 of 300 | NO" in alarms
    assert "artefact" in text
    assert "Parameters of stribeck left out 2 times: another law" in text
    assert "ab" * 32 in text


def test_the_terminal_has_every_gate():
    console = Console(width=160, record=True, file=io.StringIO())
    console.print(printed(gates(CASES)))
    text = console.export_text()
    assert all(gate.title in text for gate in gates(CASES))


def test_the_json_has_no_number_that_json_lacks():
    text = json.dumps(as_json(ABOUT, gates(CASES), [], CASES), allow_nan=False)
    assert json.loads(text)["cases"][0]["first"] == "viscous"
