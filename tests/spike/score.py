"""Puts keys and answers side by side: `python -m tests.spike.score KEYS SPIKE PRESENT`, folders of one JSON a case."""

from __future__ import annotations

import json
import math
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np


def wilson(k: int, n: int) -> str:
    """k of n with the 95 % interval."""
    if n == 0:
        return "-"
    p, z = k / n, 1.96
    middle, half = (
        (p + z * z / 2 / n) / (1 + z * z / n),
        z * math.sqrt(p * (1 - p) / n + z * z / 4 / n / n) / (1 + z * z / n),
    )
    return f"{k}/{n} ({100 * (middle - half):.0f}-{100 * (middle + half):.0f} %)"


def said_by_present(answer: dict) -> list[str]:
    """What the present method claims, the most probable first."""
    if answer["verdict"] != "supported":
        return []
    return [e["id"] for e in answer["effects"] if e["probability"] >= 0.9]


TRUTH = {
    "kinetic_drop": (("drop", "DROP"),), "viscous": (("drag_per_s", "DRAG"),),
    "rate_strengthening": (("rate_gain", "RATE"),),
    "stribeck": (("fall", "SF"),), "contact_aging": (("ageing", "AGE"),), "wear": (("wear", "WEAR"),),
    "clock_offset": (("late_s", "TAU"),), "platform_level": (("level_x", "EX"), ("level_y", "EY")),
}  # fmt: skip


def main() -> None:
    """Prints a row a case, and the sums."""
    keys, spike, present = (Path(each) for each in sys.argv[1:4])
    sums, z, seconds, slow = defaultdict(lambda: [0, 0]), [], [], []
    for key in sorted(keys.glob("*.json")):
        (entry,) = json.loads(key.read_text()).values()
        kind, truth = key.stem.split("_")[0], {e["id"]: e for e in entry["effects"]}
        row = f"{key.stem:22s} {'+'.join(truth):36s}"
        for who, folder in (("spike", spike), ("present", present)):
            path = folder / key.name
            if not path.exists() or path.stat().st_size == 0:
                row += f" | {who} -"
                continue
            answer = json.loads(path.read_text())
            said = answer["claimed"] if who == "spike" else said_by_present(answer)
            right = set(said) == set(truth) if truth else not said
            both = set(truth) <= set(said)
            sums[who, kind, "exactly"][0] += right
            sums[who, kind, "exactly"][1] += 1
            sums[who, kind, "truth claimed"][0] += both and bool(truth)
            sums[who, kind, "truth claimed"][1] += 1
            sums[who, kind, "a wrong name"][0] += bool(set(said) - set(truth))
            sums[who, kind, "a wrong name"][1] += 1
            row += f" | {who} {'+'.join(said) or 'none'}"
            if who == "spike":
                seconds.append((answer["seconds"], answer["runs"]))
                row += f" chi2 {answer['chi2']:.2f} n {answer['runs']} {answer['seconds']:.0f} s"
                row += "" if answer["all_converged"] else " NOT CONVERGED"
                sums[who, kind, "every fit converged"][0] += answer["all_converged"]
                sums[who, kind, "every fit converged"][1] += 1
                for name, pairs in TRUTH.items():
                    for mine, theirs in pairs if name in truth and name in answer["top"] else ():
                        value, sd = answer["parameters"][theirs]
                        true = truth[name]["parameters"].get(mine, math.nan)
                        z.append((name, (value - true) / sd))
            elif "seconds" in answer:
                slow.append(answer["seconds"])
        print(row)
    for (who, kind, what), (k, n) in sorted(sums.items()):
        print(f"{who:8s} {kind:7s} {what:20s} {wilson(k, n)}")
    print("z", [(name, round(value, 2)) for name, value in z], "sd", np.std([v for _, v in z]) if z else None)
    if seconds:
        print("spike s a run", np.median([s / n for s, n in seconds]), "median s", np.median([s for s, _ in seconds]))
    print("present median s", np.median(slow) if slow else None)


if __name__ == "__main__":
    main()
