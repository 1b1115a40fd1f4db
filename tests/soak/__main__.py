"""`python -m tests.soak --samples 20000`: a session as long as a week of a lab, and whether it grows.

The session runs in simulated time in a process of its own, with its recording split by size; memory, file handles and
threads of it and its children are read every few seconds and drawn. Then the parts are read as one. Exit status 1: one
of the three is more than 5 % higher in the last quarter than in the second one, or a message is not there.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Sequence
from dataclasses import astuple
from pathlib import Path

import psutil

from station.recording.parts import files_of
from station.recording.reader import TRUTH, RecordingReader, open_recording
from tests.soak.watching import QUANTITIES, Reading, growth, readings, slope

GROWTH = 0.05
"""The share by which a flat quantity may differ: the allocator's, and the children that a moment catches."""
FLAT = ("memory_mb", "handles", "threads")
TITLES = {"memory_mb": "memory (MB)", "handles": "file handles", "threads": "threads", "written_mb": "recorded (MB)"}


def main(words: Sequence[str] | None = None) -> int:
    """Runs the session and judges it."""
    parser = argparse.ArgumentParser(prog="python -m tests.soak", description=__doc__)
    parser.add_argument("--samples", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--split", type=int, default=1000, metavar="MB")
    parser.add_argument("--every", type=float, default=5.0, metavar="S", help="seconds between two readings")
    parser.add_argument("--out", type=Path, default=Path("soak"), help="folder of recording, readings and plot")
    parser.add_argument("--rig", help="a live session on that rig, whose processes run, in place of a simulated one")
    options = parser.parse_args(words)
    options.out.mkdir(parents=True, exist_ok=True)
    recorded = options.out / "soak.mcap"
    how = ["--rig", options.rig] if options.rig else ["--lockstep"]
    said = ["--samples", str(options.samples), "--seed", str(options.seed), "--split", str(options.split)]
    words = [sys.executable, "-m", "station", "run", *how, *said, "--out", str(recorded), "--overwrite"]
    with (options.out / "session.log").open("wb") as log:
        program = psutil.Popen(words, stdout=log, stderr=log)
        found = list(readings(program, recorded, every_s=options.every))
    keep(found, options.out / "readings.csv")
    draw(found, options.out / "soak.png")
    print(f"The session ended with {program.wait()}; {len(found)} readings in {found[-1].at_s:.0f} s")
    return judged(found, recorded, options.samples)


def judged(found: Sequence[Reading], recorded: Path, samples: int) -> int:
    """Prints what was seen and what the parts hold; 1 if something grew or is missing."""
    wrong = grown(found)
    reader = open_recording(recorded)
    held = len(reader.samples())
    rise, half = slope(found, "memory_mb")
    gigabytes = found[-1].written_mb / max(held, 1)
    print(f"memory grew by {rise * gigabytes:.2f} +- {half * gigabytes:.2f} MB in 1000 samples of {gigabytes:.2f} GB")
    return 1 if wrong + incomplete(reader, samples) else 0


def grown(found: Sequence[Reading]) -> int:
    """Prints how the quantities changed; how many of those that should be flat are not."""
    wrong = 0
    for name in QUANTITIES:
        before, after = growth(found, name)
        print(f"{TITLES[name]}: {before:.1f} in the second quarter, {after:.1f} in the last one")
        wrong += name in FLAT and after > (1 + GROWTH) * before
    return wrong


def incomplete(reader: RecordingReader, samples: int) -> int:
    """Prints what the parts hold together, but for the truth; 1 if something is missing."""
    told = {name: info.count for name, info in reader.topics.items() if info.message is not None}
    counts = {name: count for name, count in told.items() if not name.startswith(TRUTH)}
    held, known = len(reader.samples()), sum(counts.values())
    count = sum(len(batch.channel) for _, batch in reader.batches(counts))
    print(f"{len(files_of(reader.path))} files, read as one: {held} of {samples} samples, {count} of {known} messages")
    for sentence in reader.parts_missing:
        print(sentence)
    return int(held != samples or count != known or bool(reader.parts_missing))


def keep(found: Sequence[Reading], path: Path) -> None:
    """Writes the readings as a table."""
    with path.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(["at_s", *QUANTITIES])
        rows.writerows(astuple(one) for one in found)


def draw(found: Sequence[Reading], path: Path) -> None:
    """Draws each quantity over the time."""
    import matplotlib as mpl  # noqa: PLC0415  # slow to load

    mpl.use("Agg")
    from matplotlib import pyplot as plt  # noqa: PLC0415

    figure, axes = plt.subplots(len(QUANTITIES), 1, sharex=True, figsize=(8, 8), constrained_layout=True)
    for axis, name in zip(axes, QUANTITIES, strict=True):
        axis.plot([one.at_s / 60 for one in found], [getattr(one, name) for one in found], color="#1f4e79")
        axis.set_ylabel(TITLES[name])
        axis.set_ylim(bottom=0)
        axis.grid(alpha=0.3)
    axes[-1].set_xlabel("time (min)")
    figure.savefig(path, dpi=120)
    plt.close(figure)


if __name__ == "__main__":
    sys.exit(main())
