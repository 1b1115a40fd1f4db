"""Estimators of where an edge lies: steps, blurred by lens and motion, that are fitted to profiles across it.

Along a profile the light is `dark + contrast × f(s − e)`: s is the distance outwards, e the edge's place, f the step
from 0 to 1 as lens and motion blur it. All lengths are in deviations of the lens's blur. Linearised about e = 0 a fit
is one matrix product for all profiles; what the estimator answers to a step that lies elsewhere is known, and turned
back by a table.

The fit is by generalised least squares: the pixels' noise, and for a bare tape the texture of the plate beside it, seen
through the blur. Texture disturbs the bright side only, so the dark foot of the edge counts more; how far the foot
reaches depends on the blur, so beside texture the blur must be known, from all four edges and from earlier frames, and
the motion blur from the mark's speed. Under a mark that moves the plate lies still: what a place shows of it goes with
the share of the exposure for which it is uncovered.
"""

from collections.abc import Callable
from functools import lru_cache, partial
from math import sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pi_agent.tracking import normal

Floats = NDArray[np.float64]
Matrix = NDArray[np.float32]

STEPS = np.linspace(-3.0, 3.0, 13)  # places along a profile, in blur deviations
STEPS_ON_TEXTURE = np.linspace(-4.5, 3.0, 15)  # the same beside a textured plate: the dark must be known well
NOISE = 0.009  # noise of the pixels, in contrasts, that is left in the mean of neighbouring profiles
DIM_NOISE = 0.02, 0.04, 0.07  # the same in dim light, and in still dimmer
SHADED_BLUR = 0.03  # relative error of the blur where the light changes across the edge
KNOWN_BLUR = 0.007  # relative error of a blur that is taken as known
REACH = np.linspace(-1.6, 1.6, 65)  # places of an edge for which the answer is known, in deviations of all blur
LOOSE_BLUR = 0.1  # relative error of a blur that is read beside a slope in the light
TEXTURE = 0.15  # relative deviation of a plate's reflectance
TEXTURE_LENGTH = 3.0  # its correlation length, in blur deviations
LEAST_GAIN = 0.4  # smallest useful change of the estimator's answer per change of the place
FAR = 0.4  # distance, in blur deviations, at which it is found how much wider a step seems
SOLVED = 7  # number of columns of `StepModel.solve`
APART = 1e5  # distance between the tables of two edges: no answer is as large
EDGES_APART = APART * np.arange(4.0)[:, None]
SHARPER = 0.86  # blur at the pixels over that of light read between them, at an ordinary blur
MOTION_BLUR_STEP = 0.25  # distance between the motion blurs for which estimators are made, in blur deviations
BETWEEN = 4  # parts into which that is cut by going evenly between two estimators
MOST_MOTION_BLUR = 10.0  # a longer path across an edge looks like a still longer one


class Table(NamedTuple):
    """The answer of an estimator to a step away from where it is expected (k,).

    `answers`: e as the estimator gives it, increasing; `reach`: where the step lies, in blur deviations. The tables of
    four edges lie one behind the other: `apart` (4, 1) is what is added to the answers of each.
    """

    answers: Floats
    reach: Floats
    apart: Floats | None = None

    def place(self, answer: Matrix | Floats) -> Floats:
        """Returns the places of the steps (4, n), in blur deviations."""
        return np.interp(answer if self.apart is None else answer + self.apart, self.answers, self.reach)

    def fenced(self) -> "Table":
        """Returns the table with ends so far away that no answer gets beyond, among the next edge's."""
        answers = np.concatenate([[-0.499 * APART], self.answers, [0.499 * APART]])
        return Table(answers, np.concatenate([self.reach[:1], self.reach, self.reach[-1:]]))


class Sloped(NamedTuple):
    """The estimator for profiles with a slope in the light: `misfit` (m, m), and the table of their estimator."""

    misfit: Matrix
    table: Table


class StepModel(NamedTuple):
    """Evenly spaced places along a profile, and matrices for `light @ matrix`.

    `solve_and_misfit`: `solve` (m, 7) beside `misfit` (m, m). `solve`: contrast, contrast × e, contrast × dσ; contrast
    and contrast × e once more, by another estimator: beside texture one that leans on neither side of the edge and is
    pulled further by it, beside a margin one that is not pulled by a shadow; and by one that allows for a slope in the
    light that a highlight adds (`sloped` gives the rest that is needed where one lies). `motion_blur_gain`,
    `other_gain`: how much further out a step seems to each of the two for each deviation by which its motion blur is
    longer than expected.
    `widening`: how much wider a step seems, in shares of the lens's blur, by the square of how far it lies away. Each
    is one for all edges, or (4, …), one for each.
    """

    steps: Floats
    solve_and_misfit: Matrix
    table: Table
    other_table: Table
    sloped: Callable[[], Sloped]
    motion_blur_gain: Floats
    other_gain: Floats
    widening: Floats
    uneven: Matrix | None

    @property
    def solve(self) -> Matrix:
        """The matrix (m, SOLVED), or (4, m, SOLVED), of what is asked of a profile, without the misfit."""
        return self.solve_and_misfit[..., :SOLVED]


@lru_cache(maxsize=8)
def step_model(*, textured: bool, known_blur: bool = False, noise: float = NOISE) -> StepModel:
    """Returns the estimator for a mark beside a textured plate, or beside its own white margin.

    `known_blur`: e is estimated with the blur as given; its error is estimated all the same, as if it were not.
    `noise`: of the pixels, in contrasts.
    """
    return _model(textured=textured, known_blur=known_blur, noise=noise, motion_blur=0.0)


class MovingModels:
    """The estimators for any path of the mark across an edge within the exposure; see `step_model`."""

    def __init__(self, *, textured: bool) -> None:
        motion_blurs = np.arange(0.0, MOST_MOTION_BLUR + MOTION_BLUR_STEP, MOTION_BLUR_STEP)
        models = [
            _model(textured=textured, known_blur=textured, noise=NOISE, motion_blur=float(motion_blur))
            for motion_blur in motion_blurs
        ]
        slopes = [model.sloped() for model in models]
        self._solve = _between(np.stack([model.solve_and_misfit for model in models])).astype(np.float32)
        self._sloped = _between(np.stack([slope.misfit for slope in slopes])).astype(np.float32)
        # Beside a margin, where an error of the blur moves no edge, motion blur leaves nothing of it to undo.
        uneven = [model.uneven for model in models if model.uneven is not None]
        self._uneven = _between(np.stack(uneven)).astype(np.float32) if textured else None
        self._tables = _tables_between([[model.table, model.other_table] for model in models])
        self._sloped_tables = _tables_between([[slope.table] for slope in slopes])
        gains = np.array(
            [(model.motion_blur_gain, model.other_gain, model.widening) for model in models], dtype=np.float64
        )
        self._small = _between(np.concatenate([gains, np.stack([model.steps for model in models])], axis=1))

    def at(self, motion_blur: Floats) -> tuple[StepModel, Floats]:
        """Returns estimators of four edges with about the blurs `motion_blur` (4,), and theirs (4,), in deviations."""
        last = len(self._small) - 1
        indices = np.array([min(round(each * (BETWEEN / MOTION_BLUR_STEP)), last) for each in motion_blur.tolist()])
        small = self._small.take(indices, axis=0)
        table, other_table = _tables_at(self._tables, indices)
        model = StepModel(
            small[:, 3:],
            self._solve.take(indices, axis=0),
            table,
            other_table,
            partial(self._sloped_at, indices),
            small[:, 0],
            small[:, 1],
            small[:, 2],
            None if self._uneven is None else self._uneven.take(indices, axis=0),
        )
        return model, indices * (MOTION_BLUR_STEP / BETWEEN)

    def _sloped_at(self, indices: NDArray[np.intp]) -> Sloped:
        """Returns the estimators that allow for a slope in the light, which few frames need."""
        (table,) = _tables_at(self._sloped_tables, indices)
        return Sloped(self._sloped.take(indices, axis=0), table)


@lru_cache(maxsize=2)
def moving_models(*, textured: bool) -> MovingModels:
    """Returns the estimators for a moving mark, made once: they take some tens of milliseconds."""
    return MovingModels(textured=textured)


def _between(rows: NDArray[Any]) -> Floats:
    """Returns the rows, and others evenly between them."""
    share = np.arange(0.0, len(rows) - 1 + 0.5 / BETWEEN, 1.0 / BETWEEN)
    first = np.minimum(share.astype(np.intp), len(rows) - 2)
    part = (share - first).reshape(-1, *[1] * (rows.ndim - 1))
    return rows[first] + part * (rows[first + 1] - rows[first])


def _tables_between(tables: list[list[Table]]) -> Floats:
    """Answers and reach (2, tables, motion blurs, k) by table and motion blur, and of those evenly between them."""
    fenced = [[table.fenced() for table in row] for row in tables]
    answers = _between(np.array([[table.answers for table in row] for row in fenced])).swapaxes(0, 1)
    reach = _between(np.array([[table.reach for table in row] for row in fenced])).swapaxes(0, 1)
    return np.ascontiguousarray(np.stack([answers, reach]))  # otherwise `take` copies all of them


def _tables_at(tables: Floats, indices: NDArray[np.intp]) -> list[Table]:
    """Returns the tables of four edges, one behind the other."""
    chosen = tables.take(indices, axis=2)
    chosen[0] += EDGES_APART
    answers, reach = chosen.reshape(2, len(chosen[0]), -1)
    return [Table(each, there, EDGES_APART) for each, there in zip(answers, reach, strict=True)]


def _model(*, textured: bool, known_blur: bool, noise: float, motion_blur: float) -> StepModel:
    places = STEPS_ON_TEXTURE if textured else STEPS
    steps = np.linspace(places[0] - 0.5 * motion_blur, places[-1] + 0.5 * motion_blur, len(places))
    model = _derivatives(steps, motion_blur)
    covariance = _covariance(steps, noise=noise, texture=TEXTURE if textured else 0.0, motion_blur=motion_blur)
    free = _solution(model, covariance, blur_error=np.inf)
    solve = _solution(model, covariance, blur_error=KNOWN_BLUR) if known_blur else free
    seen = _step(steps - _reach(motion_blur)[:, None], motion_blur)
    other = _other(steps, textured=textured, noise=noise, motion_blur=motion_blur)
    slope = np.column_stack([model, steps])
    sloped = _solution(slope, covariance, blur_error=KNOWN_BLUR if known_blur else LOOSE_BLUR)
    beside_slope = Sloped(_misfit(slope), _table(seen, sloped, _reach(motion_blur)))
    wanted = np.column_stack([solve[:, 1:3], free[:, 3], other[:, 1:3], sloped[:, 1:3]])
    return StepModel(
        steps,
        np.concatenate([wanted, _misfit(model)], axis=1).astype(np.float32),
        _table(seen, solve, _reach(motion_blur)),
        _table(seen, other, _reach(motion_blur)),
        lambda: beside_slope,
        np.array(_by_motion_blur(steps, motion_blur) @ solve[:, 2]),
        np.array(_by_motion_blur(steps, motion_blur) @ other[:, 2]),
        np.array(_widening(steps, solve[:, 1], free[:, 3], motion_blur)),
        (_bow(steps, motion_blur)[:, None] * wanted).astype(np.float32),
    )


def _misfit(model: Floats) -> Matrix:
    """Gives the residue (m, m) of least squares in a profile, scaled so that its root sum of squares is a deviation."""
    size, parameters = model.shape
    left_over = np.eye(size) - np.linalg.pinv(model).T @ model.T
    return (left_over / np.sqrt(size - parameters)).astype(np.float32)


def _other(steps: Floats, *, textured: bool, noise: float, motion_blur: float) -> Floats:
    """Returns an estimator that minds texture beside the edge more than the one in use.

    Where there is none, one that does not mind if the light changes across the edge, at twice the noise.
    """
    model = _derivatives(steps, motion_blur)
    covariance = _covariance(steps, noise=noise, texture=0.0, motion_blur=motion_blur)
    if textured:
        return _solution(model, covariance, blur_error=KNOWN_BLUR)
    changing = steps * model[:, 1]
    return _solution(np.column_stack([model, changing]), covariance, blur_error=SHADED_BLUR)


def _reach(motion_blur: float) -> Floats:
    """Returns the places of a step for which the answer is known."""
    return sqrt(1.0 + motion_blur * motion_blur / 12.0) * REACH


def _table(seen: Floats, solve: Floats, reach: Floats) -> Table:
    """Returns the answer of the estimator to steps `seen` (k, m) away from where it expects them, where they differ."""
    answers = (seen @ solve[:, 2]) / (seen @ solve[:, 1])
    flat = np.gradient(answers, reach) < LEAST_GAIN
    left = int(np.flatnonzero(flat & (reach < 0)).max(initial=0))
    right = int(np.flatnonzero(flat & (reach > 0)).min(initial=len(reach) - 1))
    kept = np.clip(np.arange(len(reach)), left, right)
    rising = 1e-9 * np.arange(len(reach))  # a table of steps that are not told apart must rise all the same
    return Table(answers[kept] + rising, reach[kept])


def _widening(steps: Floats, contrast: Floats, blur: Floats, motion_blur: float) -> float:
    """Returns the share by which a step seems wider to the estimator of the blur, by the square of its distance."""
    seen = [_step(steps - place, motion_blur) for place in (-FAR, FAR)]
    return float(np.mean([(step @ blur) / (step @ contrast) for step in seen])) / FAR**2


def _bow(u: Floats, motion_blur: float) -> Floats:
    """Returns the second derivative of a step at the pixels themselves, which are sharper than light between them."""
    if motion_blur > 0.0:
        late, early = (u + 0.5 * motion_blur) / SHARPER, (u - 0.5 * motion_blur) / SHARPER
        return (normal.density(late) - normal.density(early)) / (SHARPER * motion_blur)
    sharp = u / SHARPER
    return -sharp * normal.density(sharp) / SHARPER**2


def _derivatives(u: Floats, motion_blur: float) -> Floats:
    """Returns derivatives (len(u), 4) of the blurred step by dark level, contrast, place and blur, at contrast 1."""
    if motion_blur == 0.0:
        return np.stack([np.ones_like(u), _step(u, motion_blur), -normal.density(u), -u * normal.density(u)], axis=1)
    late, early = u + 0.5 * motion_blur, u - 0.5 * motion_blur
    place = (normal.cumulative(early) - normal.cumulative(late)) / motion_blur
    blur = (normal.density(late) - normal.density(early)) / motion_blur
    return np.stack([np.ones_like(u), _step(u, motion_blur), place, blur], axis=1)


def _step(u: Floats, motion_blur: float) -> Floats:
    """Returns the blurred step from 0 to 1 at distances u outwards."""
    if motion_blur == 0.0:
        return normal.cumulative(u)
    return (normal.area(u + 0.5 * motion_blur) - normal.area(u - 0.5 * motion_blur)) / motion_blur


def _by_motion_blur(u: Floats, motion_blur: float) -> Floats:
    """Returns the derivative (len(u),) of the blurred step by its motion blur."""
    if motion_blur == 0.0:
        return np.zeros_like(u)
    ends = 0.5 * (normal.cumulative(u + 0.5 * motion_blur) + normal.cumulative(u - 0.5 * motion_blur))
    return (ends - _step(u, motion_blur)) / motion_blur


def _solution(model: Floats, covariance: Floats, *, blur_error: float) -> Floats:
    """Solves generalised least squares: a column for each of the model's. `blur_error`: relative error of the blur."""
    weight = np.linalg.inv(covariance)
    information = model.T @ weight @ model
    information[3, 3] += blur_error**-2
    return np.asarray(np.linalg.solve(information, model.T @ weight).T, dtype=np.float64)


def _covariance(u: Floats, *, noise: float, texture: float, motion_blur: float) -> Floats:
    """Returns the covariance (m, m) of a profile's samples.

    It is that of pixel noise shared by interpolation, and of texture beyond the edge.

    The texture of a place counts by the share of the exposure for which the moving mark leaves it uncovered.
    """
    shared = noise**2 * np.exp(-np.abs(u[:, None] - u) / 0.5)
    if texture == 0.0:
        return shared
    outside = np.arange(0.05 - 0.5 * motion_blur, 8.0 + 0.5 * motion_blur, 0.1)
    uncovered = np.clip(0.5 + outside / max(motion_blur, 1e-9), 0.0, 1.0)
    spread = 0.1 * normal.density(u[:, None] - outside) * uncovered
    correlation = np.exp(-np.abs(outside[:, None] - outside) / TEXTURE_LENGTH)
    return shared + texture**2 * (spread @ correlation @ spread.T)
