"""The target over ssh: one connection for everything, with the user's own ssh and its configuration."""

from __future__ import annotations

import contextlib
import getpass
import shlex
import shutil
import socket
import subprocess
import tempfile
import time
from collections.abc import Generator, Sequence
from pathlib import Path
from typing import IO

from shared.errors import UserError
from shared.visible import visible

PATIENCE_S = 60.0


class Remote:
    """An open connection to USER@HOST. `root_words` stand before every command that needs privileges."""

    def __init__(self, target: str, *, port: int | None, identity: str | None, options: Sequence[str]) -> None:
        self.target = target
        self._folder = Path(tempfile.mkdtemp(prefix="repose-ssh-"))
        words = ["-o", f"ControlPath={self._folder}/c", *(["-p", str(port)] if port else [])]
        words += ["-i", identity] if identity else []
        self._words = [*words, *(word for option in options for word in ("-o", option))]
        self._master: subprocess.Popen[bytes] | None = None
        self._root_words: list[str] = []
        self._password = b""
        self._kept: list[str] = []

    def __enter__(self) -> Remote:
        """Connects; ssh asks on the terminal for what it needs.

        Raises:
            UserError: if there is no connection.
        """
        log = self._folder / "log"
        words = ["ssh", "-M", "-N", "-o", "ServerAliveInterval=10", "-E", str(log), *self._words, "--", self.target]
        try:
            self._master = subprocess.Popen(words)
        except FileNotFoundError as error:
            raise UserError("Expected the program ssh on this computer, got none: install openssh-client") from error
        end = time.monotonic() + PATIENCE_S
        while not (self._folder / "c").exists():
            if self._master.poll() is not None or time.monotonic() > end:
                reason = log.read_text(errors="replace").strip().splitlines() if log.exists() else []
                self.__exit__()
                raise UserError(f"Expected an ssh connection to {self.target}, got: {(reason or ['no answer'])[-1]}")
            time.sleep(0.02)
        return self

    def __exit__(self, *_: object) -> None:
        """Closes the connection, and removes what it kept on the target."""
        if self._kept:
            self.run("rm", "-f", *self._kept, check=False)
            self._kept.clear()
        if self._master is not None and self._master.poll() is None:
            self._master.terminate()
            self._master.wait()
        shutil.rmtree(self._folder, ignore_errors=True)

    def become_root(self, how: str) -> None:
        """Uses sudo from now on: `how` is "free" or "password", which is asked for once."""
        self._root_words = ["sudo", "-n"]
        if how == "password":
            self._root_words = ["sudo", "-k", "-S", "-p", ""]
            self._password = (getpass.getpass(f"sudo password on {self.target}: ") + "\n").encode()

    def run(self, *words: str, given: bytes = b"", check: bool = True, root: bool = False) -> str:
        """Runs a command on the target and gives what it printed, visible: this computer's terminal obeys none of it.

        Raises:
            UserError: if it fails and `check` is set.
        """
        line = [*(self._root_words if root else []), *words]
        stdin = self._password + given if root else given
        done = subprocess.run(self._ssh(line), input=stdin, capture_output=True, check=False)
        if check and done.returncode != 0:
            said = (done.stderr.decode(errors="replace").strip().splitlines() or [f"status {done.returncode}"])[-1]
            raise UserError(f"On {self.target}, `{shlex.join(words)[:120]}` failed: {said}")
        return visible(done.stdout.decode(errors="replace"))

    @contextlib.contextmanager
    def feed(self, *words: str) -> Generator[IO[bytes]]:
        """Runs a command with privileges whose standard input is written by the caller.

        Raises:
            UserError: if it fails.
        """
        pipe, line = subprocess.PIPE, self._ssh([*self._root_words, *words])
        broken = False
        with subprocess.Popen(line, stdin=pipe, stdout=subprocess.DEVNULL, stderr=pipe) as process:
            assert process.stdin is not None
            assert process.stderr is not None
            try:
                process.stdin.write(self._password)
                yield process.stdin
                process.stdin.close()
            except BrokenPipeError:
                broken = True
            said = process.stderr.read().decode(errors="replace").strip()
        if process.returncode != 0 or broken:
            raise UserError(f"On {self.target}, `{shlex.join(words)[:120]}` failed: {said or 'the connection broke'}")

    def tunnel(self, port: int) -> int:
        """Returns a port of this computer's loopback that leads to the target's own `port`.

        Raises:
            UserError: if the target's ssh server forbids it.
        """
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            own = int(probe.getsockname()[1])
        words = ["ssh", "-O", "forward", "-L", f"127.0.0.1:{own}:127.0.0.1:{port}", *self._words, "--", self.target]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise UserError(f"Expected a tunnel to port {port} of {self.target}, got: {done.stderr.strip()}")
        return own

    def ahead_s(self) -> tuple[float, float]:
        """Returns the target's clock less this computer's, by the quickest of five round trips, and its largest error.

        Raises:
            UserError: if the target does not tell the time.
        """
        best = (float("inf"), 0.0)
        line = self._ssh(["sh", "-c", "while read -r _; do date +%s.%N; done"])
        with subprocess.Popen(line, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
            assert process.stdin is not None
            assert process.stdout is not None
            for _ in range(5):
                sent = time.time()
                process.stdin.write(b"\n")
                process.stdin.flush()
                answer = process.stdout.readline().decode(errors="replace").strip()
                back = time.time()
                if not answer.replace(".", "", 1).isdigit():
                    raise UserError(f"Expected the time of {self.target}, got '{answer}'")
                best = min(best, (back - sent, float(answer) - (sent + back) / 2))
        return best[1], best[0] / 2

    def keep(self, content: bytes) -> str:
        """Puts a file onto the target for as long as the connection stands; gives its path."""
        path = self.run(
            "sh", "-c", "f=$(mktemp /tmp/repose-deploy.XXXXXX) && cat > $f && echo $f", given=content
        ).strip()
        self._kept.append(path)
        return path

    def _ssh(self, words: Sequence[str]) -> list[str]:
        return ["ssh", "-T", *self._words, "--", self.target, shlex.join(words)]
