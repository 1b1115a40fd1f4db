"""Prints what an installation takes, for each extra: `python deploy/sizes.py [EXTRA…]`. It needs uv and the network.

Each is installed with the versions of requirements.lock into a fresh environment, without compiled files, and measured.
`dev` is all of the lock: what `make setup` installs. An extra beside `station` is measured together with it.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LOCK = ROOT / "requirements.lock"
OUT_OF = re.compile(r" \\$|^ +--hash=.*$", re.MULTILINE)


def main(wanted: list[str]) -> None:
    """Prints a table in Markdown: what is installed, MB on disk (2^20 bytes), packages."""
    if shutil.which("uv") is None:
        sys.exit("Expected uv, which installs each extra, and found none: pip install uv")
    unknown = sorted({*wanted} - {"", *known(), "dev"})
    if unknown:
        sys.exit(f"Expected extras among {', '.join(known())} or dev, got {', '.join(unknown)}")
    print("| installed | MB | packages |\n| --- | ---: | ---: |")
    for extra in wanted or ["", *known(), "dev"]:
        with tempfile.TemporaryDirectory() as folder:
            words = words_for(extra, Path(folder))
            count, size_mb = installed(words, Path(folder) / "venv")
        title = ROOT.joinpath(words[-1]).name.removeprefix(ROOT.name) or "no extra: the camera agent"
        print(f"| {title} | {size_mb:.0f} | {count} |", flush=True)


def known() -> list[str]:
    """Returns the extras that bring something."""
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    return [name for name, wanted in extras.items() if wanted]


def words_for(extra: str, folder: Path) -> list[str]:
    """Gives the arguments of pip's install."""
    if extra == "dev":
        return ["--requirements", str(LOCK)]
    pins = folder / "pins.txt"
    pins.write_text(OUT_OF.sub("", LOCK.read_text(encoding="utf-8")), encoding="utf-8")
    together = ["station", extra] if extra not in ("", "station", "all") else [extra]
    return ["--constraints", str(pins), f"{ROOT}[{','.join(together)}]" if extra else str(ROOT)]


def installed(words: list[str], venv: Path) -> tuple[int, float]:
    """Counts the packages that a fresh environment then holds, and gives its size in MB."""
    subprocess.run(["uv", "venv", "--quiet", "--python", sys.executable, str(venv)], check=True)
    install = ["uv", "pip", "install", "--quiet", "--link-mode", "copy", "--python", str(venv), *words]
    subprocess.run(install, check=True, env={**os.environ, "VIRTUAL_ENV": str(venv)})
    files = [path for path in venv.rglob("*") if path.is_file() and not path.is_symlink()]
    return sum(path.name == "METADATA" for path in files), sum(path.stat().st_size for path in files) / 2**20


if __name__ == "__main__":
    main(sys.argv[1:])
