"""Counts the values that the columns of a Parquet table hold: `python -m station.recording.parquet_values FILE`.

A list's items are counted by the file's own account of its columns alone. Where that is damaged pyarrow throws and its
binding does not catch, which ends the process. So another process looks, and where it ends the file is refused.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path


def values_of(path: Path) -> list[int]:
    """Returns the values of each column that holds no others, items of lists among them, in the order of the schema.

    Raises:
        OSError: if the file's account of its columns is damaged, or nobody can look.
    """
    # -P: the folder of this file is no place to look for modules.
    done = subprocess.run([sys.executable, "-P", __file__, str(path)], capture_output=True, check=False)
    if done.returncode != 0:
        *_, why = ["", *done.stderr.decode(errors="replace").split("\n  what():  ")[-1].splitlines()]
        raise OSError(f"the values of its columns cannot be counted: {why}")
    return json.loads(done.stdout)


def main(path: str) -> None:
    """Prints the counts as a list."""
    import pyarrow.parquet as pq  # noqa: PLC0415  # slow to load, and not wanted where `values_of` is

    with pq.ParquetFile(path) as file:
        metadata = file.metadata
    groups = [metadata.row_group(number) for number in range(metadata.num_row_groups)]
    columns = range(metadata.num_columns)
    print(json.dumps([sum(group.column(number).num_values for group in groups) for number in columns]))


if __name__ == "__main__":
    main(sys.argv[1])
