"""The dataset card (README.md), with the header by which Hugging Face finds the tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from urllib.parse import quote

from station.pages.markdown import inline, row
from station.publish.citation import Author, quoted
from station.publish.licence import Licence
from station.publish.source import Source

TABLES = {"samples": "a row for each run that came to its end", "runs": "a row for each run, with the block's path"}
"""The tables by name: each is `data/NAME.parquet`, and a configuration of the dataset."""

_COLUMNS = """\
Units end the names of columns (`_rad`, `_m`, `_s`, `_ns`). `onset_angle_rad` is the tilt at which the block begins
to slide on a plate at rest; of a `censored` run, which did not slide, the steepest tilt. `flags` say what speaks
against a sample; without any it is kept. The plate frame has its origin at the plate's centre and z along its normal.
In `runs`, `x_m`, `y_m` and `yaw_rad` are the block in that frame at the times `path_s`, and `tilt_rad` is the plate's
tilt at `tilt_s`, both since `started_ns`."""
_CHECKED = """\
The digest is the SHA-256 of every measured message (`station samples FILE --digest`; provenance.json has all of it);
`station verify FILE` derives the samples again. Each recording carries its rig file, its plan and its calibration."""


@dataclass(frozen=True, kw_only=True)
class Card:
    """A card's contents; `figures` are paths below the dataset's folder, `pairs` sentences of each surface pair."""

    title: str
    authors: Sequence[Author]
    licence: Licence
    sources: Sequence[Source]
    figures: Sequence[str]
    pairs: dict[str, Sequence[str]]
    version: str

    def text(self) -> str:
        """Returns the whole card."""
        parts = (self._header(), self._beginning(), self._found(), self._provenance(), self._end())
        return "\n\n".join(part for part in parts if part) + "\n"

    def _header(self) -> str:
        count = sum(len(source.samples) for source in self.sources)
        configs = [line for index, name in enumerate(TABLES) for line in _config(name, default=not index)]
        lines = [
            *self.licence.card_lines(),
            f"pretty_name: {quoted(self.title)}",
            "tags:\n- robotics\n- friction\n- tribology\n- mcap",
            f"size_categories:\n- {_size(count)}",
            "configs:",
            *configs,
        ]
        return "\n".join(["---", *lines, "---"])

    def _beginning(self) -> str:
        samples, kept = (sum(counts) for counts in zip(*map(_counts, self.sources), strict=True))
        made = " and ".join(sorted({"simulated" if source.simulated else "measured" for source in self.sources}))
        files = "1 recording" if len(self.sources) == 1 else f"{len(self.sources)} recordings"
        return (
            f"# {inline(self.title)}\n\n"
            f"By {', '.join(inline(one.name) for one in self.authors)}. "
            f"Licence: [{self.licence.id}]({self.licence.url}).\n\n"
            f"Static friction, {made} with Repose: a plate is tilted until a block slides. {files}, {samples} samples, "
            f"{kept} of them kept (they slid, and nothing disturbed them).\n\n"
            "```python\nfrom datasets import load_dataset\n\n"
            'samples = load_dataset("PATH OF THIS FOLDER", "samples", split="train")\n```\n\n'
            "| file | what |\n|---|---|\n"
            + "".join(f"| `data/{name}.parquet` | {what} |\n" for name, what in TABLES.items())
            + "| `recordings/` | everything as it was recorded (MCAP): Rerun and Foxglove open it |\n"
            "| `figures/` | the figures of each surface pair |\n"
            "| `provenance.json` | sums, rig, seed and versions of each recording |\n\n"
            f"{_COLUMNS}"
        )

    def _found(self) -> str:
        parts = ["## What was found"]
        for name, sentences in self.pairs.items():
            parts.append("\n".join([f"### {inline(name)}", "", *(f"- {inline(text)}" for text in sentences)]))
        parts += [f"![{inline(path)}]({quote(path)})" for path in self.figures]
        return "\n\n".join(parts)

    def _provenance(self) -> str:
        rows = "\n".join(_row(source) for source in self.sources)
        return (
            "## Provenance\n\n| recording | started (UTC) | rig | mode | seed | kept | Repose | digest |\n"
            f"|---|---|---|---|---|---|---|---|\n{rows}\n\n"
            f"{_CHECKED}"
        )

    def _end(self) -> str:
        return (
            f"## Citation\n\nSee [CITATION.cff](CITATION.cff). Written by `station publish` of Repose {self.version}."
        )


def _config(name: str, *, default: bool) -> list[str]:
    lines = [f"- config_name: {name}", "  data_files:", "  - split: train", f"    path: data/{name}.parquet"]
    return [*lines, "  default: true"] if default else lines


def _size(count: int) -> str:
    """Returns the name that Hugging Face has for a number of rows."""
    steps = ((1_000, "n<1K"), (10_000, "1K<n<10K"), (100_000, "10K<n<100K"), (1_000_000, "100K<n<1M"))
    return next((name for limit, name in steps if count < limit), "1M<n<10M")


def _counts(source: Source) -> tuple[int, int]:
    return len(source.samples), source.kept


def _row(source: Source) -> str:
    seed = "" if source.seed is None else str(source.seed)
    version = source.versions.get("repose", "")
    cells = (source.name, source.started[:19], source.rig, source.mode, seed, f"{source.kept} of {len(source.samples)}")
    return row((*cells, version, source.digest[:16]))
