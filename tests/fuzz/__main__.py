"""`python -m tests.fuzz --inputs 200000 --seed S`: what every reader makes of inputs that nobody should send.

Prints a table of targets and every finding once with its number; exit status 1 if there is one. `--only NUMBER` reads
one input again, with its traceback. Each process reads its share of the numbers, and begins anew when it dies.
"""

from __future__ import annotations

import argparse
import bisect
import itertools
import json
import logging
import os
import subprocess
import sys
import tempfile
from collections import Counter, defaultdict
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from random import Random

from tests.fuzz.target import Target, all_targets
from tests.fuzz.trial import Outcome, peak_bytes, try_input

MEMORY = Path("/dev/shm")
AGAIN = 3
"""Exit status of a worker whose memory is spoilt: another one goes on."""


def main(words: Sequence[str] | None = None) -> int:
    """Runs the inputs; 1 if one of them was neither answered nor refused in words."""
    options = _parser().parse_args(words)
    chosen = [target for target in all_targets() if options.target in target.name]
    if options.worker:
        return _work(options, chosen)
    if options.only is not None:
        return _one(options, chosen)
    return _report(_of_all(options), chosen)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--inputs", type=int, default=1000, help="how many")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--target", default="", metavar="NAME", help="targets whose names contain this")
    parser.add_argument("--only", type=int, metavar="NUMBER", help="one input again, saved as ./fuzzed.*")
    parser.add_argument("--worker", metavar="FROM:STEP", default="", help=argparse.SUPPRESS)
    return parser


def target_of(number: int, seed: int, targets: Sequence[Target]) -> Target:
    """The target of an input, by the targets' shares."""
    sums = [*itertools.accumulate(target.share for target in targets)]
    return targets[bisect.bisect(sums, Random(f"{seed} {number} whose").random() * sums[-1])]


def _work(options: argparse.Namespace, targets: Sequence[Target]) -> int:
    """Reads a share of the numbers; a line of JSON before and after each."""
    logging.disable(logging.CRITICAL)
    begin, step = map(int, options.worker.split(":"))
    with tempfile.TemporaryDirectory(dir=MEMORY if MEMORY.is_dir() else None) as name:
        for number in range(begin, options.inputs, step):
            print(json.dumps({"begins": number}), flush=True)
            outcome = try_input(target_of(number, options.seed, targets), number, seed=options.seed, folder=Path(name))
            told = {"number": number, "refused": outcome.refused, "s": outcome.seconds, "peak": peak_bytes()}
            print(json.dumps({**told, "finding": outcome.finding, "target": outcome.target}), flush=True)
            if outcome.finding.startswith("memory"):  # a fresh process for the others, whose peaks would not be seen
                return AGAIN
    return 0


def _of_all(options: argparse.Namespace) -> list[Outcome]:
    with ThreadPoolExecutor(options.jobs) as pool:
        told = pool.map(partial(_told_by_job, options), range(options.jobs))
        return sorted(itertools.chain.from_iterable(told), key=lambda outcome: outcome.number)


def _told_by_job(options: argparse.Namespace, begin: int) -> list[Outcome]:
    return [*_of_job(options, begin)]


def _of_job(options: argparse.Namespace, begin: int) -> Iterator[Outcome]:
    """The outcomes of one share of the numbers; where its process dies, another one goes on after that input."""
    while begin < options.inputs:
        begin = yield from _of_process(options, begin)


def _of_process(options: argparse.Namespace, begin: int) -> Generator[Outcome, None, int]:
    """The outcomes that one process tells, and the number to go on with; the input at which it died is a finding."""
    open_number = None
    with _start(options, begin) as process:
        assert process.stdout is not None
        for line in process.stdout:
            told = json.loads(line)
            if "begins" in told:
                open_number = told["begins"]
                continue
            open_number, begin = None, told["number"] + options.jobs
            peak = f" (peak {told['peak'] / 1e9:.2f} GB)" if told["finding"] else ""
            yield Outcome(told["target"], told["number"], told["refused"], told["s"], told["finding"] + peak)
    status = process.returncode
    if open_number is not None:
        yield Outcome("?", open_number, False, 0.0, f"the process died (status {status})")
        return open_number + options.jobs
    if status not in (0, AGAIN):
        raise SystemExit(f"a worker failed with status {status} before its first input")
    return begin if status == AGAIN else options.inputs


def _start(options: argparse.Namespace, begin: int) -> subprocess.Popen[str]:
    words = ["--inputs", str(options.inputs), "--seed", str(options.seed), "--target", options.target]
    return subprocess.Popen(
        [sys.executable, "-m", "tests.fuzz", *words, "--worker", f"{begin}:{options.jobs}"],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "PYTHONWARNINGS": "ignore"},
    )


def _one(options: argparse.Namespace, targets: Sequence[Target]) -> int:
    logging.disable(logging.CRITICAL)
    target = target_of(options.only, options.seed, targets)
    path = Path(f"fuzzed{target.suffix}")
    path.write_bytes(target.make(Random(f"{options.seed} {options.only}")))
    with tempfile.TemporaryDirectory() as name:
        outcome = try_input(target, options.only, seed=options.seed, folder=Path(name))
    print(f"{target.name}: {path}, {outcome.seconds:.2f} s, {'refused' if outcome.refused else 'answered'}")
    print(outcome.finding)
    return 1 if outcome.finding else 0


def _report(outcomes: Sequence[Outcome], targets: Sequence[Target]) -> int:
    by_target = defaultdict[str, list[Outcome]](list)
    for outcome in outcomes:
        by_target[outcome.target].append(outcome)
    print(f"{'target':<28}{'inputs':>8}{'answered':>10}{'refused':>9}{'findings':>10}{'longest s':>11}")
    for name in [target.name for target in targets] + (["?"] if "?" in by_target else []):
        of_it = by_target[name]
        refused = sum(outcome.refused for outcome in of_it)
        findings = sum(bool(outcome.finding) for outcome in of_it)
        longest = max((outcome.seconds for outcome in of_it), default=0.0)
        answered = sum(not (outcome.refused or outcome.finding) for outcome in of_it)
        print(f"{name:<28}{len(of_it):>8}{answered:>10}{refused:>9}{findings:>10}{longest:>11.2f}")
    found = [outcome for outcome in outcomes if outcome.finding]
    kinds = Counter((outcome.target, _kind(outcome.finding)) for outcome in found)
    for (name, kind), count in kinds.most_common():
        first = next(one for one in found if (one.target, _kind(one.finding)) == (name, kind))
        print(f"\n{count} × {name}, the first is input {first.number}:\n{first.finding.strip()}")
    print(f"\n{len(outcomes)} inputs, {len(found)} findings of {len(kinds)} kinds")
    return 1 if found else 0


def _kind(finding: str) -> str:
    """Returns what similar findings have in common: where and what of a traceback, without values."""
    lines = [line.strip() for line in finding.strip().splitlines()]
    places = [line for line in lines if line.startswith("File ")]
    return f"{places[-1] if places else ''} {lines[-1].partition(':')[0][:80]}"


if __name__ == "__main__":
    sys.exit(main())
