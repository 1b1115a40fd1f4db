"""Made-up truths and answers, of which every score is known beforehand."""

from __future__ import annotations

from typing import Any

from tests.proof.key import Truth, truth_of
from tests.proof.said import Said
from tests.proof.scoring import Scored

PLACES = {
    "contact_aging": [{"phase": "onset", "covariate": "dwell"}],
    "viscous": [{"phase": "slide", "covariate": "speed"}, {"phase": "stop", "covariate": "speed"}],
}


def concealed(name: str, *, strength: float = 4.0, also: tuple[str, ...] = (), **parameters: float) -> dict[str, Any]:
    return {
        "id": name, "value": 1.0, "unit": "1", "detection_limit": 1.0 / strength, "strength": strength,
        "parameters": parameters, "also": also,
    }  # fmt: skip


def truth(
    tier: str, *effects: dict[str, Any], answer: str = "effects", runs: int = 20, name: str = "a1", **more: Any
) -> Truth:
    places = [
        {
            "effect": effect["id"],
            "where": PLACES.get(effect["id"], [{"phase": "onset", "covariate": "run"}]),
            "detectability": 2.0,
            "runs": list(range(1, runs + 1)),
            "onset_sigmas": [2.0 if run % 2 else 0.0 for run in range(1, runs + 1)],
            "path_sigmas": [0.0] * runs,
        }
        for effect in effects
    ]
    entry = {
        "tier": tier, "answer": answer, "effects": list(effects), "places": places,
        "design": {"runs": runs, "masses": [1.0]},
    }  # fmt: skip
    return truth_of(name, entry | more)


def claim(
    name: str, *, probability: float = 0.95, verdict: str = "supported", near: tuple[str, ...] = (), **values: Any
) -> dict[str, Any]:
    return {
        "id": name, "class": [name, *near], "probability": probability, "verdict": verdict,
        "parameters": {
            key: {"value": value, "sd": sd, "unit": "1", "interval90": [value - 1.645 * sd, value + 1.645 * sd]}
            for key, (value, sd) in values.items()
        },
    }  # fmt: skip


def place(phase: str, covariate: str, *, p: float = 1e-4, runs: tuple[int, ...] = ()) -> dict[str, Any]:
    return {"phase": phase, "covariate": covariate, "p": p, "runs": list(runs), "windows": []}


def said(*claims: dict[str, Any], located: tuple[dict[str, Any], ...] = (), **more: Any) -> Said:
    answer = {
        "effects": list(claims), "located": list(located), "runs": {"used": 100}, "global_p": 0.001 if claims else 0.5,
        "fit": {"log_score_gain": 0.2 if claims else 0.0}, "next_experiment": None, "untestable": [],
    }  # fmt: skip
    return Said(answer=answer | more, wall_s=20.0)


def scored(of: Truth, answer: Said, **refit: Any) -> Scored:
    return Scored(truth=of, said=answer, refit=refit)
