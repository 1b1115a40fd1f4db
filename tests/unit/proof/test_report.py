import io
import json
from collections import Counter
from pathlib import Path

from rich.console import Console

from station.pages.caption import made_by
from tests.proof.families import families
from tests.proof.page import html_page
from tests.proof.pictures import Shown, confusion_counts, detected, draw_all
from tests.proof.report import MISSED, NO_CASES, About, Column, as_json, column_of, markdown, printed, rows
from tests.proof.run import Proof
from tests.proof.scoring import Scored
from tests.unit.diagnosis.page import Page
from tests.unit.proof.made_up import claim, concealed, said, scored, truth

CASES = [
    scored(truth("single", concealed("viscous", strength=4.0), name="a1"), said(claim("viscous"))),
    scored(truth("single", concealed("viscous", strength=0.5), name="a2"), said()),
    scored(truth("null", answer="none", name="a3"), said(claim("wear"))),
]
QUIET = [scored(truth("null", answer="none", name=f"b{n}"), said()) for n in range(9)]
ABOUT = About(date="2026-11-21", command="python -m tests.proof --seed 1", versions={"numpy": "2"}, seed=1, tool="1234")


def column(family: str, cases: list[Scored], **more: dict[str, str]) -> Column:
    told = {"seals": {"single": "ab" * 32}, "not_made": {}, "absent": {}} | more
    return column_of(
        Proof(family=families()[family], cases=tuple(cases), digest="1234", **told),
        pictures=[Shown(name=f"{family}-confusion", told="What was named. n = 3 cases.", html="<figure></figure>")],
    )


COLUMNS = [
    column("own", CASES, not_made={"artefact": "the generator made no cases: none yet"}), column("patch_world", QUIET)
]  # fmt: skip


def test_confusion_and_detection_are_counted():
    assert confusion_counts(CASES) == Counter({("viscous", "viscous"): 1, ("none", "wear"): 1})
    assert detected(CASES) == {"viscous": {4.0: [(True, True)], 0.5: [(False, False)]}}


def test_pictures_are_drawn_where_there_is_something(tmp_path: Path):
    with made_by(ABOUT.command):
        drawn = draw_all(CASES, tmp_path, "own")
        assert draw_all([], tmp_path, "own") == []
    assert [shown.name for shown in drawn] == ["own-confusion", "own-reliability", "own-detection"]
    for shown in drawn:
        assert (tmp_path / f"{shown.name}.svg").stat().st_size > 2000
        assert (tmp_path / f"{shown.name}.pdf").read_bytes().startswith(b"%PDF")
        assert "n = 3 c" in shown.told or "n = 2 " in shown.told


def test_a_missed_gate_is_marked_in_its_own_family_and_not_averaged_away():
    (alarms,) = [row for row in rows(COLUMNS) if row[0].startswith("false alarms on nulls:")]
    _, asked, own, patch = alarms
    assert asked == "≤ 5 %"
    assert own.startswith(MISSED)
    assert "100 % (21 % … 100 %; n 1)" in own
    assert patch == "0 % (0 % … 30 %; n 9)"


def test_a_family_without_such_cases_says_so():
    (first,) = [row for row in rows(COLUMNS) if row[0] == "strong singles: right name first"]
    assert (first[2], first[3]) == ("100 % (21 % … 100 %; n 1)", NO_CASES)


def test_the_page_says_where_it_is_from_and_what_was_left_out():
    text = markdown(ABOUT, COLUMNS)
    assert "Measured 2026-11-21 with `python -m tests.proof --seed 1` (seed 1; tool 1234; numpy 2)." in text
    assert f"**{MISSED}**" in text
    assert "own generator: single 2, null 1" in text
    assert "Tier artefact: the generator made no cases" in text
    assert "Key of own/single: sha256 " + "ab" * 32 in text
    assert "![own-confusion](own-confusion.svg)" in text
    assert "What was named. n = 3 cases." in text


def test_the_page_has_every_row_marks_what_is_missed_and_fetches_nothing():
    text = html_page(ABOUT, COLUMNS)
    page = Page(text)
    assert [place for place in page.fetched if not place.startswith("data:")] == []
    assert len(page.ids) == len(set(page.ids))
    assert all(cell in page.text for row in rows(COLUMNS) for cell in row)
    assert text.count('class="missed"') == sum(cell.startswith(MISSED) for row in rows(COLUMNS) for cell in row) > 0
    assert "Missed: false alarms on nulls: anything claimed (own generator)" in page.text
    assert "Key of own/single: sha256 " + "ab" * 32 in page.text
    assert ABOUT.command in page.text


def test_the_terminal_has_every_row():
    console = Console(width=240, record=True, file=io.StringIO())
    console.print(printed(COLUMNS))
    text = console.export_text()
    assert all(row[0] in text for row in rows(COLUMNS))


def test_the_json_has_no_number_that_json_lacks():
    text = json.dumps(as_json(ABOUT, COLUMNS), allow_nan=False)
    assert json.loads(text)["families"]["own"]["cases"][0]["first"] == "viscous"
