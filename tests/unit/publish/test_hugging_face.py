"""Hugging Face's `datasets` loads what `station publish` writes, with no network."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from station.__main__ import main
from station.recording.reader import open_recording
from tests.unit.diagnosis.recorded import GOLDEN

pytest.importorskip("pyarrow", reason="the extra `parquet` is not installed")
pytest.importorskip("datasets", reason="datasets is not installed (the dependency group tools)")

LOADED = """
import json, socket, sys

def no_network(*asked, **more):
    raise OSError("the test has no network")

socket.socket.connect = no_network
from datasets import get_dataset_config_names, load_dataset

folder, cache = sys.argv[1:]
tables = {name: load_dataset(folder, name, cache_dir=cache) for name in get_dataset_config_names(folder)}
samples, runs = tables["samples"]["train"], tables["runs"]["train"]
print(json.dumps({
    "tables": {name: list(table) for name, table in tables.items()},
    "default": load_dataset(folder, cache_dir=cache)["train"].column_names == samples.column_names,
    "onsets": list(samples["onset_angle_rad"]),
    "seed": list(samples["seed"]),
    "path": [len(path) for path in runs["x_m"]],
}))
"""


def test_both_tables_load_by_name_and_hold_the_recorded_samples(tmp_path: Path) -> None:
    out = tmp_path / "dataset"
    assert main(["publish", str(GOLDEN), "--out", str(out), "--license", "CC-BY-4.0", "--author", "Doe, Jo"]) == 0
    env = {**os.environ, "HF_HUB_OFFLINE": "1", "HF_DATASETS_OFFLINE": "1", "HF_HOME": str(tmp_path / "home")}
    command = [sys.executable, "-c", LOADED, str(out), str(tmp_path / "cache")]
    ended = subprocess.run(command, env=env, capture_output=True, text=True, check=False, timeout=200)
    assert ended.returncode == 0, ended.stderr
    found = json.loads(ended.stdout.splitlines()[-1])
    samples = open_recording(GOLDEN).samples()
    assert found["tables"] == {"samples": ["train"], "runs": ["train"]}
    assert found["default"] is True
    assert found["onsets"] == [sample.onset_angle_rad for sample in samples]
    assert len(found["path"]) == len(samples)
    assert min(found["path"]) > 10
