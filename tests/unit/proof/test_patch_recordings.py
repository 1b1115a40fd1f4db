"""The patch world's recordings: accepted by the rig's own commands, the same for the same seed, and made apart."""

import ast
import hashlib
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import tests.proof.patch_world
from station.__main__ import main as station
from tests.proof.families.patch_world import MARK_MM
from tests.proof.patch_world import pilot
from tests.proof.patch_world.__main__ import main
from tests.proof.patch_world.cases import draw_ids
from tests.proof.patch_world.effects import KNOWN
from tests.proof.patch_world.making import Order, seal

FORBIDDEN = (
    "station.diagnosis", "station.physics", "station.simulators", "tests.proof", "tests.concealed", "tests.recovery",
)  # fmt: skip


def order(out: Path, tier: str = "single", *more: str) -> list[str]:
    return ["--out", str(out), "--tier", tier, "--cases", "1", "--seed", "5", "--runs", "2", *more]


@pytest.fixture(scope="module", autouse=True)
def few_pilots() -> Iterator[None]:
    """Two pilot runs and three steps of the bisection find a strength as well as many, for what is tested here."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pilot, "RUNS", 2)
        patch.setattr(pilot, "TRIES", 3)
        yield


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("patch")
    assert main(order(out, "single", "--only", "leaning_base")) == 0
    return out


@pytest.mark.parametrize("command", ["check", "doctor", "samples"])
def test_the_rigs_own_commands_accept_a_recording(made: Path, command: str) -> None:
    assert station([command, str(made / "001" / "session.mcap")]) == 0


def test_the_rig_file_is_the_one_inside(made: Path) -> None:
    text = (made / "001" / "rig.toml").read_bytes()
    assert text in (made / "001" / "session.mcap").read_bytes()


def test_the_truth_says_where_and_by_how_much(made: Path) -> None:
    truth = json.loads((made / "truth" / "001.json").read_text())
    runs = truth["acted"]["leaning_base"]
    assert [one["run"] for one in runs] == [1, 2]
    assert all(one["onset_deg"] for one in runs)
    assert all(set(one["phases"]) == {"rest", "slide", "return"} for one in runs)


@pytest.mark.parametrize(("name", "begins", "moves"), [("bending_mast", False, True), ("barrel_lens", True, False)])
def test_the_fiducial_tells_what_tilts_from_what_rests(tmp_path: Path, name: str, begins: bool, moves: bool) -> None:
    assert main(order(tmp_path, "single", "--only", name)) == 0
    runs = json.loads((tmp_path / "truth" / "001.json").read_text())["acted"][name]
    rests = [one["phases"]["rest"] for one in runs]
    assert all((rest["fiducial_begin_mm"] > MARK_MM) == begins for rest in rests)
    assert all((rest["fiducial_moved_mm"] > MARK_MM) == moves for rest in rests)


def test_a_call_that_broke_off_goes_on_with_the_same_bytes(made: Path, tmp_path: Path) -> None:
    (tmp_path / "001").mkdir()
    (tmp_path / "001" / "session.mcap.partial").write_bytes(b"half")
    (tmp_path / "key.json").write_bytes((made / "key.json").read_bytes())
    assert main(order(tmp_path, "single", "--only", "leaning_base")) == 0
    for name in ("001/session.mcap", "001/rig.toml", "truth/001.json"):
        assert (tmp_path / name).read_bytes() == (made / name).read_bytes()


def test_the_same_arguments_seal_the_same_key(made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    same = Order(out=tmp_path, tier="single", cases=1, seed=5, runs=2, only=("leaning_base",))
    sealed = seal(same, jobs=1)
    assert (tmp_path / "key.json").read_bytes() == (made / "key.json").read_bytes()
    assert main(order(made, "single", "--only", "leaning_base")) == 0
    assert capsys.readouterr().out.split()[1] == sealed == hashlib.sha256((made / "key.json").read_bytes()).hexdigest()


def test_a_folder_of_another_order_is_refused(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(order(made, "null")) == 2
    assert "another --out" in capsys.readouterr().err


def test_an_unknown_effect_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(order(tmp_path, "single", "--only", "gremlins")) == 2
    assert "gremlins" in capsys.readouterr().err


def test_every_effect_comes_before_one_comes_again() -> None:
    ids = draw_ids("single", len(KNOWN), seed=3, only=())
    assert sorted(one for (one,) in ids) == sorted(KNOWN)


def test_it_imports_nothing_of_what_it_is_to_prove() -> None:
    folder = Path(tests.proof.patch_world.__file__).parent
    named = {name for path in folder.rglob("*.py") for name in _imports(path)}
    assert not [name for name in named if _forbidden(name)]
    program = "import sys, tests.proof.patch_world.__main__; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout.split()
    assert "station.sampling.machine" in loaded
    assert not [name for name in loaded if _forbidden(name)]


def _forbidden(name: str) -> bool:
    """The proof's own package has a docstring only; what it holds beside the patch world is the scorer's."""
    return name.startswith(FORBIDDEN) and name != "tests.proof" and not name.startswith("tests.proof.patch_world")


def _imports(path: Path) -> list[str]:
    names: list[str] = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names.append(node.module)
    return names
