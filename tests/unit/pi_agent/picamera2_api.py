"""The signatures of picamera2, read from its source: the package itself cannot be imported away from a Pi.

`python -m tests.unit.pi_agent.picamera2_api FOLDER` prints them for an unpacked package (`pip download --no-deps
picamera2`, then `unzip`); picamera2_api.json holds those of the version that it names.
"""

from __future__ import annotations

import ast
import json
import sys
from pathlib import Path
from typing import Any

SNAPSHOT = Path(__file__).with_name("picamera2_api.json")
SOURCES = {
    "Picamera2": "picamera2.py",
    "CompletedRequest": "request.py",
    "MappedArray": "request.py",
}
Signature = dict[str, Any]


def signatures(package: Path) -> dict[str, dict[str, Signature]]:
    """Every public method of the classes that the driver uses: its kind and its parameters with their defaults."""
    return {name: _methods(package / file, name) for name, file in SOURCES.items()}


def _methods(file: Path, name: str) -> dict[str, Signature]:
    tree = ast.parse(file.read_text(encoding="utf-8"))
    found = next(node for node in tree.body if isinstance(node, ast.ClassDef) and node.name == name)
    methods = [node for node in found.body if isinstance(node, ast.FunctionDef)]
    # Overloads come before the implementation, which has the last word.
    return {
        node.name: _signature(node) for node in methods if not node.name.startswith("_") or node.name.startswith("__")
    }


def _signature(node: ast.FunctionDef) -> Signature:
    arguments = node.args
    names = [argument.arg for argument in (*arguments.posonlyargs, *arguments.args)]
    defaults = [ast.unparse(default) for default in arguments.defaults]
    marks = {ast.unparse(mark).split(".")[-1] for mark in node.decorator_list}
    kind = next((mark for mark in ("staticmethod", "classmethod", "property") if mark in marks), "method")
    return {"kind": kind, "parameters": names, "defaults": defaults}


def snapshot() -> dict[str, Any]:
    """Returns what picamera2_api.json holds."""
    return json.loads(SNAPSHOT.read_text(encoding="utf-8"))


if __name__ == "__main__":
    print(json.dumps({"version": sys.argv[2], "signatures": signatures(Path(sys.argv[1]))}, indent=1))
