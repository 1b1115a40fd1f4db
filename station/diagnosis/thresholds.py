"""Every number that decides a claim, with its value, unit, meaning and reason; no other number decides one.

    python -m station.diagnosis.thresholds

prints the table. Most numbers are read from here when they are needed, so that another value can be tried from outside:
`KNOCK_OUT=NAME=VALUE pytest -m benchmark -s tests/benchmarks/test_knock_out.py` diagnoses the same cases with it and
without. `tests/unit/diagnosis/test_thresholds.py` refuses a deciding number that is not here.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Self

BENCHMARK = "KNOCK_OUT={name}=VALUE pytest -m benchmark -s tests/benchmarks/test_knock_out.py"
EDITED = "pytest -m benchmark -s tests/benchmarks/test_knock_out.py before and after {name} is changed here"
"""The command for a number that is read when a module is loaded, or while a recording is read."""


class Threshold(float):
    """A number with its unit (1: none), its meaning, how it was set, and the command that shows its effect."""

    unit: str
    meaning: str
    how: str
    shown: str

    def __new__(cls, value: float, *, unit: str = "1", meaning: str, how: str, shown: str = BENCHMARK) -> Self:
        """Returns the number itself; `shown` is a command in which `{name}` stands for the threshold's name."""
        made = super().__new__(cls, value)
        made.unit, made.meaning, made.how, made.shown = unit, meaning, how, shown
        return made

    def __reduce__(self) -> tuple[type[float], tuple[float]]:
        """Pickles as a plain float: another process gets the number alone."""
        return float, (float(self),)


# These decide whether anything is tested at all.
LEAST_RUNS = Threshold(
    20,
    unit="runs",
    meaning="With fewer runs nothing is said.",
    how="Convention: the standard deviation of 20 draws is known to a sixth.",
)
LEAST_SLID = Threshold(
    10,
    unit="runs",
    meaning="With fewer runs in which the block slid, or fewer stretches of a record on their own, nothing is said.",
    how="Convention, as above.",
)
ALARM = Threshold(
    0.04,
    meaning="The search looks for names below this global p.",
    how="By hand, below the gate of 5 % false alarms.",
)
NEXT = Threshold(
    0.005,
    meaning="The search looks for a further name below this global p of what is left.",
    how="By hand: each further name adds to what is claimed.",
)
MOST_STAGES = Threshold(
    4,
    unit="names",
    meaning="The stages of a search are at most so many.",
    how="Convention: no case conceals more than two.",
)
LEAST_P = Threshold(
    1e-6, meaning="No smaller p is reported or compared.", how="No tail of a null of 1000 draws is known better."
)
PROMISING = Threshold(
    2.0,
    unit="2 ln L",
    meaning="A candidate whose score promises less is not fitted in full.",
    how="A gain that no penalty of one number can leave positive (Akaike's).",
)
DETECTABLE = Threshold(
    2.8,
    unit="standard errors",
    meaning="An effect is untestable if its largest plausible size is less.",
    how="80 of 100 are seen at a level of 5 %: 1.96 + 0.84.",
)
PLAUSIBLE = Threshold(
    3.0,
    unit="typical sizes",
    meaning="No effect is plausibly larger; it is also the prior's standard deviation of one that mu takes up.",
    how="Convention: three times what the effect's own source calls typical.",
)

# These weigh the candidates.
NONE = Threshold(
    0.5,
    meaning="Prior probability that nothing is left to find.",
    how="A prior by hand: each answer is as likely as the other.",
)
SINGLE = Threshold(
    0.365,
    meaning="Prior probability of one effect with a name, shared out evenly.",
    how="A prior by hand; the four add up to 1.",
)
PAIR = Threshold(
    0.12, meaning="Prior probability of two effects, shared out evenly.", how="A prior by hand: a third of SINGLE."
)
OTHER = Threshold(
    0.015,
    meaning="Prior probability of something without a name, shared out evenly.",
    how="A prior by hand: a 24th of SINGLE.",
)
LEAST_COST = Threshold(
    2.0,
    unit="2 ln L",
    meaning="A shape that nothing identifies, or that is at its bound, costs so much.",
    how="Akaike's penalty of a number: of two laws that agree the simpler one is named.",
)
SWAP = Threshold(
    2.0,
    unit="2 ln odds",
    meaning="A candidate takes a term's place if it is likelier by more.",
    how="Convention: a difference not worth more than a bare mention (Kass & Raftery 1995).",
)
CREDIBLE = Threshold(0.95, meaning="A class of names has this posterior together.", how="Convention: 95 %.")
EVEN = Threshold(0.5, meaning="A name is claimed above this probability.", how="Convention: likelier than not.")
NOMINAL = Threshold(
    0.1,
    meaning="At this global p a session's own null speaks neither for nor against nothing.",
    how="By hand on development cases; it changes `none_probability` and no name.",
    shown="pytest tests/unit/diagnosis/test_posterior.py",
)
OVERDISPERSED = Threshold(
    1.5,
    unit="standard errors",
    meaning="Runs' scores scatter more than the likelihood says if they do so by more.",
    how="Convention: one in fifteen sessions exceeds it by chance.",
)
TRUSTED_AFTER_RUNS = Threshold(
    30.0,
    unit="runs",
    meaning="With so many runs their own scatter counts for half in the standard errors.",
    how="Convention: the sandwich's own error is a quarter there.",
)
MOST_WIDER = Threshold(
    6.0, meaning="Standard errors are widened by at most this factor.", how="By hand on development cases."
)
FOLDS = Threshold(
    5,
    unit="folds",
    meaning="Runs are held out in so many folds, and no name is claimed that does not improve their prediction.",
    how="Convention (Kohavi 1995).",
    shown=EDITED,
)

# These decide whether a gain is only a law's misspecification.
KNOWN_TO = Threshold(
    30.0,
    unit="2 ln L",
    meaning="A law's misfit weighs as much as chance where the law gains so much; it grows with the gain.",
    how="By hand on development cases; the knock-out benchmark shows what another value does.",
)
BELIEVED = Threshold(
    2.0,
    unit="standard deviations",
    meaning="A nuisance may stand in for an effect as far as this.",
    how="Convention: 95 %.",
)

# These are the systematic floors of the measurements.
FRICTION_TRUSTED = Threshold(
    0.003,
    meaning="No effect is identified by less friction, however many runs show it.",
    how="0.06° at a tilt of 20°: what attitude, clock and the corners of a tilt's course leave open.",
    shown=EDITED,
)
PLACE_TRUSTED_M = Threshold(
    2e-6,
    unit="m",
    meaning="The same of a mean place.",
    how="A fiftieth of a pixel: tests/benchmarks/test_tracking_accuracy.py.",
    shown=EDITED,
)
CREPT_SHARE = Threshold(
    0.015,
    unit="of its limit",
    meaning="A resting block's creep that nobody tells falls by an e-fold for each further share that it is below it.",
    how="A soft sole and a rate law of tests/proof/patch_world (seed 20261527): .04 mm at 96 %, .2 mm at 98.5 %.",
    shown=EDITED,
)
STRAIN_TRUSTED = Threshold(
    1e-4,
    meaning="The same of a mark's shape.",
    how="A fiftieth of a pixel over a mark.",
    shown=EDITED,
)
ANGLE_TRUSTED_RAD = Threshold(
    2e-4,
    unit="rad",
    meaning="The same of an attitude.",
    how="By hand: 0.01°.",
    shown=EDITED,
)
TURN_TRUSTED_RAD_S2 = Threshold(
    0.5,
    unit="rad/s²",
    meaning="The same of a sliding block's turning.",
    how="Friction that acts 3 µm beside the mass.",
    shown=EDITED,
)
ONSET_SHIFT = Threshold(
    0.003,
    meaning="Prior standard deviation of what all onsets are read early or late by.",
    how="0.06° at a tilt of 20°, as FRICTION_TRUSTED.",
    shown=EDITED,
)
ONSET_BLUR_S2 = Threshold(
    2e-4,
    unit="s²",
    meaning="The same of the variance of an onset's time.",
    how="(14 ms)²: one frame and a reading of the attitude.",
    shown=EDITED,
)

# These concern the noise.
GAUSSIAN = Threshold(
    200.0,
    unit="degrees of freedom",
    meaning="A tail this thin is a Gaussian.",
    how="No session tells it from one.",
    shown=EDITED,
)
LEAST_KNOWN = Threshold(
    8,
    unit="runs",
    meaning="With fewer runs onset and slide share no friction, no wander is estimated, and runs are no kind.",
    how="Convention: a robust standard deviation of eight is known to a quarter.",
    shown="pytest tests/unit/diagnosis/test_wander.py",
)
LEAST_SCALED = Threshold(
    20,
    unit="rows",
    meaning="With fewer rows a channel's noise keeps its nominal scale, and the likeliest tail is the Gaussian's.",
    how="Convention: the scale of twenty is known to a sixth.",
    shown="pytest tests/unit/diagnosis/test_unseen.py",
)
MOST_CENSORED = Threshold(
    2.0,
    meaning="Runs without a slide widen the onsets' scatter by at most this factor.",
    how="By hand; no reason is on record.",
)
CLIP = Threshold(
    3.0,
    unit="robust sd",
    meaning="What is farther off counts as if it were there in estimates of the noise.",
    how="Convention: 0.3 % of a Gaussian is cut, and its sd by 0.7 %, which is given back.",
)
WANDER_CLIP = Threshold(
    4.0,
    unit="robust sd",
    meaning="The same before the wander is estimated.",
    how="Convention: an outlier would read as wander, and a wander's own tail is not to be cut.",
    shown="pytest tests/unit/diagnosis/test_wander.py",
)
SHORTEST_REACH_M = Threshold(
    5e-4,
    unit="m",
    meaning="Friction wanders over no shorter way.",
    how="A shorter reach is the frames' own noise.",
    shown="pytest tests/unit/diagnosis/test_wander.py",
)
LONGEST_REACH_M = Threshold(
    2e-2,
    unit="m",
    meaning="Friction wanders over no longer way.",
    how="A longer reach is the run's own level of friction.",
    shown="pytest tests/unit/diagnosis/test_wander.py",
)

# These weigh the evidence of the blocks' first paths, for laws of sliding alone.
PATHS_SLACK = Threshold(
    20.0, unit="2 ln L", meaning="A fit of the paths may fall so short of its best.", how="Seen on development cases."
)
PATHS_SHARE = Threshold(
    0.25,
    meaning="This share of what the paths say counts.",
    how="By hand: the windows' evidence holds a part of the same data.",
)
PATHS_MOST = Threshold(
    12.0,
    unit="2 ln odds",
    meaning="The paths say no more than this.",
    how="By hand on development cases: enough to tell neighbours apart.",
)

# These decide which parts of a recording are used.
LEAST_TILT_RAD = Threshold(
    0.02,
    unit="rad",
    meaning="Nothing is read from a plate more level than this.",
    how="By hand: 1.1°.",
    shown=EDITED,
)
FREE_M = Threshold(
    1e-3,
    unit="m",
    meaning="Windows of a slide nearer to the foam are left out.",
    how="By hand: nearer ones show the foam.",
    shown=EDITED,
)
SLOWEST_M_S = Threshold(
    8e-3,
    unit="m/s",
    meaning="Windows of slower slides are left out.",
    how="By hand; no reason is on record.",
    shown=EDITED,
)
SLOWEST_SIGMAS = Threshold(
    6.0,
    unit="standard errors",
    meaning="Windows whose speed is less sure are left out.",
    how="By hand: the direction is then known to 10°.",
    shown=EDITED,
)
SHORTEST_M = Threshold(
    1e-3,
    unit="m",
    meaning="A shorter slide has no direction and is left out.",
    how="A tenth of the block's side.",
    shown=EDITED,
)
CROOKED = Threshold(
    2.0,
    meaning="The direction of a path that misses a smooth course by more than this times its noise is not used.",
    how="By hand: a knocked block.",
    shown=EDITED,
)
PLAIN_SIGMAS = Threshold(
    4.0,
    unit="standard errors",
    meaning="The rig's own readings of the onsets stay where slides differ from plain ones by less.",
    how="By hand on development cases.",
    shown="pytest tests/unit/diagnosis/test_slips.py",
)

# These decide which covariates may explain a residual.
LEAST_ROWS = Threshold(12, unit="rows", meaning="A covariate known of fewer rows explains nothing.", how="Convention.")
LEAST_KNOWN_SHARE = Threshold(
    0.5, meaning="A covariate known of a smaller share of the rows explains nothing.", how="Convention: most of them."
)
LEAST_SPREAD_RAD = Threshold(0.1, unit="rad", meaning="An angle that varies less explains nothing.", how="By hand: 6°.")
LEAST_WAVE = Threshold(
    0.1,
    meaning="A harmonic that varies less over the angles that occur explains nothing: it would act by its slope alone.",
    how="By hand: of four directions every second sine.",
)
LEAST_DWELL_S = Threshold(
    0.2,
    unit="s",
    meaning="A dwell that varies less was not chosen: a block that holds longer also rests longer.",
    how="By hand: only a protocol makes it vary by more.",
)
LEAST_PLACES_M = Threshold(
    1e-3, unit="m", meaning="Places that lie nearer to each other explain nothing.", how="A tenth of the block's side."
)

# These decide whether the block topples.
MOST_MISTAKEN = Threshold(
    3e-2,
    meaning="A run is called tipped by mistake at most so often (three smaller chances beside it).",
    how="A prior by hand; no reason is on record.",
    shown="pytest tests/recovery/test_tipping.py",
)
WIDEST_TIP = Threshold(
    0.08,
    meaning="A block's own tipping angle scatters by at most so much (three smaller ones beside it), relative.",
    how="A prior by hand: a side of 10 mm that stands on 9.2 mm.",
    shown="pytest tests/recovery/test_tipping.py",
)

# This decides whether another experiment is proposed; no name depends on it.
PRECISE = Threshold(
    0.02,
    meaning="No experiment is proposed that narrows a size whose standard error is at most this share of it.",
    how="Convention: friction scatters by more from run to run.",
    shown="station plan",
)

# This decides which places are listed; no name depends on it.
LEVEL = Threshold(
    0.05, meaning="A place is listed below this corrected p.", how="Convention: 5 %.", shown="station diagnose FILE"
)


def table() -> dict[str, Threshold]:
    """Returns all thresholds by name, in the order of this file."""
    return {name: value for name, value in globals().items() if isinstance(value, Threshold)}


def lines() -> Iterator[str]:
    """Yields the table as text, three lines to a number."""
    for name, one in table().items():
        yield f"{name} = {float(one):g}" + ("" if one.unit == "1" else f" {one.unit}")
        yield f"    {one.meaning} {one.how}"
        yield f"    {one.shown.format(name=name)}"


if __name__ == "__main__":
    print("\n".join(lines()))
