"""A Python file that carries a model and the code to run it in an engine, with nothing of this package."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any

from station.export.carried import corrections, tilt_test
from station.export.carried.law import law_of_run
from station.export.carried.states import contact
from station.export.carry import Carried, carry, commented
from station.export.exported import ExportedFile, unsupported_lines
from station.export.from_model import NamedModel
from station.export.unsupported_of_model import unsupported_of_model
from station.physics.effect import HOOKS
from station.physics.model import Model, Term

_OFFERED = (
    contact,
    law_of_run,
    corrections.true_gravity,
    corrections.seen_corners,
    corrections.stamp_s,
    tilt_test.tilt_test,
    tilt_test.Ramp,
    tilt_test.show,
)
"""The names that every file offers beside its engine."""

_HEAD = (
    "MODEL.friction(contact(rest_s=[1, 10, 100])) is the coefficient, MODEL.push(…) the force per mass (m/s², in the "
    "plate's frame P) and MODEL.attitude(…) the turn of the plate at any states; seen_corners(MODEL, …) and "
    "stamp_s(MODEL, …) are what a camera makes of the block. P has its origin in the middle of the plate and z along "
    "its normal.",
    "",
    "Each part below is cut out of the module of Repose that its line names: the equations are those that the station "
    "itself runs.",
)


SAID = frozenset(HOOKS) - {"motion"}
"""The methods of `Effect` that Python code can say in any engine: each turns the plate itself."""

_CORNERS = (
    "it turns as the engine's contact lets it, and the four corners of a box resist turning 2.4 times as much as an "
    "even sole: it starts at another tilt (by up to 0.8 degrees where that was tried), and turns otherwise"
)
CORNERS: Mapping[str, str] = MappingProxyType({"spin": _CORNERS, "lever": _CORNERS})
"""The engines' model of a turning block that touches its plate by four corners (ρ = L / √2, not L / √12)."""

_MET_CORNERS = (
    "it starts as it should, but the four corners of a box resist turning 2.6 times as much as an even sole: it turns "
    "by a third less where that was tried"
)
MET_CORNERS: Mapping[str, str] = MappingProxyType({"spin": _MET_CORNERS, "lever": _MET_CORNERS})
"""The same where the moment is made as much larger as corners hold more of it (`carried/corners.py`)."""

_NO_CAVEATS: Mapping[str, str] = MappingProxyType({})


def python_file(
    named: NamedModel,
    *,
    engine: str,
    supported: frozenset[str],
    how: Sequence[str],
    bench: Callable[..., Any],
    caveats: Mapping[str, str] = _NO_CAVEATS,
    scene: str = "",
) -> ExportedFile:
    """Returns the file for one engine.

    Args:
        named: the model.
        engine: the engine's name, which also ends the file's.
        supported: the methods of `Effect` that the engine's code can express.
        caveats: sentences on what the engine makes of some of these methods, by their names.
        how: sentences that say how the file is used.
        bench: the function that makes the engine's `Bench` from the model, and from the scene if there is one.
        scene: the text of a scene that the file holds.
    """
    model = named.model
    parts = (Model, Term, *(kind for term in model.terms for kind in _kinds(term)))
    carried = carry(*parts, *_OFFERED, bench)
    unsupported = unsupported_of_model(model, engine=engine, supported=supported, caveats=caveats)
    about = [*how, "", *_HEAD, "", *_summary(model), *unsupported_lines(unsupported)]
    lines = (commented(about), "", "from __future__ import annotations", "", *carried.imports, "")
    text = "\n".join((*lines, carried.text, "", *_tail(named, carried, bench=bench, scene=scene), ""))
    return ExportedFile(f"{named.stem}_{engine.lower()}.py", text, f"{named.stem} ({engine})", tuple(unsupported))


def _kinds(term: Term) -> Iterator[type]:
    """Yields the classes of an effect and of the objects that it holds."""
    yield type(term.effect)
    for held in vars(term.effect).values():
        if type(held).__module__.partition(".")[0] == "station":
            yield type(held)


def _summary(model: Model) -> Iterator[str]:
    yield f"mu_s {model.mu_s:.6g}, scatter from run to run {model.scatter:.3g} (law_of_run draws it for one run), and"
    for term in model.terms:
        numbers = ", ".join(f"{name} {value:.6g}" for name, value in term.values.items())
        yield f"{term.effect.id} ({numbers}): {term.effect.law}"


def _tail(named: NamedModel, carried: Carried, *, bench: Callable[..., Any], scene: str) -> Iterator[str]:
    """Yields the model itself, the scene, and an example."""
    model, name = named.model, carried.name_of
    yield f"\nMODEL = {name(Model)}("
    yield f"    mu_s={float(model.mu_s)!r},\n    scatter={float(model.scatter)!r},\n    terms=("
    for term in model.terms:
        kind = type(term.effect)
        made = name(kind) + repr(term.effect).removeprefix(kind.__name__)
        values = {key: float(value) for key, value in term.values.items()}
        yield f"        {name(Term)}({made}, {values!r}),"
    yield "    ),\n)"
    if scene:
        yield f"SCENE = {_quoted(scene)}"
    yield "\n\ndef example():"
    yield '    """A block on a plate, to be tilted by tilt_test."""'
    yield f"    return {name(bench)}(MODEL{', SCENE' if scene else ''})"
    yield '\n\nif __name__ == "__main__":'
    yield f"    {name(tilt_test.show)}(example, about_rad=np.arctan(MODEL.mu_s))"


def _quoted(text: str) -> str:
    return '"""' + text.replace("\\", "\\\\").replace('"""', '\\"""') + '"""'
