"""Every number that decides a claim stands in one table; another one is refused here."""

from __future__ import annotations

import ast
import pickle
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from station.diagnosis import thresholds
from tests.patience import PATIENCE_S

DIAGNOSIS = Path(thresholds.__file__).parent
DECIDING = ("search", "inference", "predict", "likelihood", "observations")
MOST = 60
ROUNDING = 1e-6
"""A comparison with less only asks whether something is zero but for rounding."""

SETTINGS: dict[str, str] = {
    "how many candidates are fitted in full, by rank: a budget of time": """
        search.full_fits:FULL_FITS search.full_fits:LEADING search.full_fits:PARTNERS search.comparison:ROUNDS
        search.comparison:NAMED_FITS search.comparison:SMOOTH_FITS inference.columns:MOST_VARIANTS
        inference.calibration:DRAWS search.smooth:MOST_POWERS search.smooth:SWINGS""",
    "steps, tolerances, starts and grids of a search for a maximum, which is the same with others": """
        inference.fit:MOST_STEPS inference.fit:NOISE_ROUNDS inference.climb:CONVERGED inference.climb:WORTH_RENEWING
        inference.climb:FARTHEST inference.climb:FARTHEST_SHAPE inference.climb:SHRUNK inference.climb:ENOUGH
        inference.climb:LITTLE inference.climb:DAMPED inference.climb:AGAIN inference.climb:NEARBY
        inference.climb:LEAST_STEP inference.quadratic:BENT inference.quadratic:RIDGE inference.quadratic:FLAT
        likelihood.student:SETTLED inference.noise_of:LEAST_FACTOR inference.gain:SINGULAR inference.columns:HOPELESS
        inference.columns:ABSORBED inference.determined:STEP likelihood.slopes:STEP likelihood.wander:STEPS
        likelihood.grouped:STEPS
        likelihood.mixture:ROUNDS likelihood.mixture:SETTLED likelihood.mixture:SPLITS likelihood.mixture:PEAKS
        likelihood.one_peak:FARTHEST likelihood.one_peak:BEGINNINGS
        likelihood.noise:CENSORED_ROUNDS likelihood.noise:TAILS search.candidates:OFF_NULL search.candidates:PROMISED
        search.candidates:HARDLY search.toppled:SHIFTED search.places:CONSTANT
        search.smooth:SAME search.places:DEPENDENT inference.columns:ROUGH
        search.toppled:SCATTER search.toppled:MISTAKES inference.tempered:DRAWS inference.tempered:EVEN_SHARE
        inference.tempered:MOVES inference.tempered:WIDTH inference.tempered:HALVINGS predict.resimulated:KNOT_NS
        predict.resimulated:BEGIN""",
    "units and constants of mathematics": """
        predict.resimulated:NANO predict.held_out:UPPER inference.errors:UNIFORM likelihood.robust:GAUSSIAN_MAD
        inference.level:HALF inference.level:OF_MEDIAN""",
    "what a result shows, and how; no claim depends on it": """
        inference.best_known:INFLATED search.locate:MOST_PLACES search.locate:MOST_WINDOWS search.locate:MOST_RUNS
        search.locate:STANDS_OUT search.locate:BINS search.locate:NINE_TENTHS search.locate:READ_RESIDUALS_IN
        search.unnamed:UNIT likelihood.mapping:TOLD_RAD answer:_ROWS
        search.kinds:NAMED""",
    "how many rows are worked on at a time: the memory that this takes": "likelihood.whitening:PART_ROWS",
    "guards of a division near zero": """
        likelihood.systematic:TILTED likelihood.systematic:LEAST_SLOPE likelihood.grouped:LEAST
        likelihood.mixture:LEAST_SPREAD likelihood.feedback:LINEAR
        likelihood.feedback:STEEPEST""",
    "so large a standard deviation that a level says nothing, as any larger one": """
        likelihood.grouped:ANY""",
}
"""Numbers that decide no claim, by the reason, as `module:NAME`. Those of `observations` are all about reading."""


def deciding() -> Iterator[tuple[str, ast.Module]]:
    """The modules whose numbers may decide a claim, by their names within `station.diagnosis`."""
    files = [DIAGNOSIS / "diagnose.py", DIAGNOSIS / "answer.py"]
    for folder in DECIDING:
        files.extend(sorted((DIAGNOSIS / folder).glob("*.py")))
    for path in files:
        yield ".".join(path.relative_to(DIAGNOSIS).with_suffix("").parts), ast.parse(path.read_text("utf-8"))


def constants(module: ast.Module) -> Iterator[str]:
    """The names of a module's own that a number is written beside."""
    for line in module.body:
        if isinstance(line, ast.Assign | ast.AnnAssign) and line.value is not None:
            targets = line.targets if isinstance(line, ast.Assign) else [line.target]
            if any(_is_number(part) for part in ast.walk(line.value)):
                yield from (name.id for target in targets for name in ast.walk(target) if isinstance(name, ast.Name))


def literals(module: ast.Module) -> Iterator[str]:
    """The comparisons in which a number is written that is neither whole, nor a half of something, nor rounding."""
    for part in ast.walk(module):
        if isinstance(part, ast.Compare):
            sides = [inner for side in (part.left, *part.comparators) for inner in ast.walk(side)]
            products = [inner for inner in sides if isinstance(inner, ast.BinOp)]
            halves = {id(one.left) for one in products if ast.unparse(one.left) == "0.5"}
            numbers = [float(ast.unparse(inner)) for inner in sides if _is_number(inner) and id(inner) not in halves]
            if any(number != int(number) and abs(number) > ROUNDING for number in numbers):
                yield f"line {part.lineno}: {ast.unparse(part)}"


def _is_number(part: ast.AST) -> bool:
    return isinstance(part, ast.Constant) and type(part.value) in (int, float)


def declared() -> set[str]:
    return {name for names in SETTINGS.values() for name in names.split()}


def test_a_number_that_decides_is_in_the_table() -> None:
    named = {f"{module}:{name}" for module, tree in deciding() for name in constants(tree)}
    own = {name for name in named if not name.startswith("observations.")}
    assert sorted(own - declared()) == [], (
        "move it to station/diagnosis/thresholds.py, or say here why it decides nothing"
    )


def test_no_comparison_hides_a_number() -> None:
    hidden = {module: found for module, tree in deciding() if (found := list(literals(tree)))}
    assert hidden == {}, "give it a name in station/diagnosis/thresholds.py"


def test_what_is_declared_to_decide_nothing_exists() -> None:
    named = {f"{module}:{name}" for module, tree in deciding() for name in constants(tree)}
    assert sorted(declared() - named) == []


def test_the_table_is_short_and_says_everything() -> None:
    table = thresholds.table()
    assert 0 < len(table) <= MOST
    for name, one in table.items():
        assert one.meaning.endswith("."), name
        assert one.how, name
        assert one.unit, name
        assert one.shown, name


def test_every_number_of_the_table_is_used() -> None:
    used = {
        part.attr
        for path in DIAGNOSIS.rglob("*.py")
        for part in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(part, ast.Attribute) and isinstance(part.value, ast.Name) and part.value.id == "thresholds"
    }
    assert sorted(thresholds.table().keys() - used) == []


def test_the_benchmark_can_change_what_says_so() -> None:
    """It replaces a number once the modules are loaded and the evidence is read."""
    early = {name for path in DIAGNOSIS.rglob("*.py") for name in _read_early(path)}
    asked = {name for name, one in thresholds.table().items() if one.shown == thresholds.BENCHMARK}
    assert sorted(early & asked) == [], "say EDITED"


def _read_early(path: Path) -> Iterator[str]:
    tree = ast.parse(path.read_text("utf-8"))
    late: set[int] = set()
    for part in ast.walk(tree):
        if isinstance(part, ast.FunctionDef) and "observations" not in path.parts:
            late |= {id(inner) for line in part.body for inner in ast.walk(line)}
    for part in ast.walk(tree):
        if isinstance(part, ast.Attribute) and ast.unparse(part.value) == "thresholds" and id(part) not in late:
            yield part.attr


def test_the_command_prints_the_table() -> None:
    command = [sys.executable, "-m", "station.diagnosis.thresholds"]
    printed = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=True).stdout
    assert all(f"{name} = " in printed for name in thresholds.table())


def test_another_process_gets_the_number() -> None:
    assert pickle.loads(pickle.dumps(thresholds.ALARM)) == thresholds.ALARM


def test_a_number_in_a_comparison_is_found() -> None:
    tree = ast.parse("ALARM = 0.05\nif p < 0.05: pass\nif p < 1e-9: pass\nif p < 3: pass")
    assert list(constants(tree)) == ["ALARM"]
    assert list(literals(tree)) == ["line 2: p < 0.05"]
