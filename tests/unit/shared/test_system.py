"""Every system gives these alike. tests/elsewhere runs this file again without what another system lacks."""

from __future__ import annotations

import io
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from shared.system import desktop, files, processes, terminal
from tests.patience import PATIENCE_S

Process = subprocess.Popen[bytes]
ROOT = Path(__file__).parents[3]


def opened(path: Path, mode: str) -> io.FileIO:
    return io.FileIO(path, mode)


def test_a_lock_is_seen_by_others_until_the_file_is_closed(tmp_path: Path) -> None:
    path = tmp_path / "growing"
    with opened(path, "w") as file:
        files.lock(file)
        file.write(b"some")
        with opened(path, "r") as other:
            assert files.locked(other)
            assert other.read() == b"some"  # whoever repairs or copies may read on
        file.write(b" more")
    with opened(path, "r") as other:
        assert not files.locked(other)
        assert not files.locked(other)  # asking leaves no lock behind
        assert other.read() == b"some more"


def test_a_second_writer_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "growing"
    with opened(path, "w") as file, opened(path, "a") as second:
        files.lock(file)
        with pytest.raises(OSError, match=r".*"):
            files.lock(second)


def test_a_locked_file_is_taken_away_and_its_name_is_free(tmp_path: Path) -> None:
    path = tmp_path / "claim"
    file = opened(path, "a")
    files.lock(file)
    files.remove_locked(file, path)
    assert file.closed
    with opened(path, "x") as another:
        files.lock(another)


@pytest.mark.parametrize("links", [True, False])
def test_a_name_that_somebody_has_is_given_to_no_other_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, links: bool
) -> None:
    def no_links(*_: object) -> None:
        raise PermissionError(1, "Operation not permitted")  # as a FAT disk says it

    if not links:
        monkeypatch.setattr(os, "link", no_links)
    growing, name = tmp_path / "growing", tmp_path / "name"
    growing.write_bytes(b"ours")
    name.write_bytes(b"theirs")
    with pytest.raises(FileExistsError):
        files.name_anew(growing, name)
    assert (growing.read_bytes(), name.read_bytes()) == (b"ours", b"theirs")
    files.name_anew(growing, tmp_path / "free")
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {"free": b"ours", "name": b"theirs"}


def test_a_file_that_is_gone_gets_no_name(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        files.name_anew(tmp_path / "gone", tmp_path / "name")
    assert list(tmp_path.iterdir()) == []


def test_occupied_room_is_on_the_disk(tmp_path: Path) -> None:
    path = tmp_path / "reserve"
    with opened(path, "w") as file:
        files.occupy(file, 1_000_000)
        status = os.fstat(file.fileno())
    assert status.st_size == 1_000_000
    if hasattr(status, "st_blocks"):
        assert status.st_blocks * 512 >= 1_000_000


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a disk that is always full")
def test_room_that_is_not_there_is_an_error() -> None:
    with opened(Path("/dev/full"), "w") as file, pytest.raises(OSError, match=r".*"):
        files.occupy(file, 1_000)


def test_there_is_a_processor() -> None:
    assert 1 <= processes.usable_processors() <= (os.cpu_count() or 1)


def test_an_emergency_is_signalled_by_nothing_that_asks_for_the_end() -> None:
    assert signal.SIGINT in processes.ENDING
    assert not set(processes.ENDING) & set(processes.EMERGENCY)


@pytest.mark.parametrize("end", [processes.interrupt, processes.ask_to_end])
def test_a_process_is_asked_to_end_by_a_signal_that_our_programs_hear(end: Callable[[Process], None]) -> None:
    program = (
        "import signal, sys, time\n"
        f"for number in {[int(number) for number in processes.ENDING]}: signal.signal(number, lambda *_: sys.exit(7))\n"
        "print('begun', flush=True)\n"
        "for _ in range(600): time.sleep(0.1)"
    )
    with subprocess.Popen(
        [sys.executable, "-c", program],
        stdout=subprocess.PIPE,
        start_new_session=processes.NEW_SESSION,
        creationflags=processes.NEW_GROUP,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline().strip() == b"begun"
        end(process)
        assert process.wait(timeout=PATIENCE_S) == 7


def test_a_started_program_prints_nothing_when_it_should_be_quiet(capfd: pytest.CaptureFixture[str]) -> None:
    assert processes.start([sys.executable, "-c", "print('loud')"]).wait(timeout=PATIENCE_S) == 0
    assert processes.start([sys.executable, "-c", "print('still')"], quiet=True).wait(timeout=PATIENCE_S) == 0
    assert capfd.readouterr().out.split() == ["loud"]


def test_nobody_sees_a_window_over_ssh_alone() -> None:
    assert not desktop.has_display({"SSH_CONNECTION": "192.0.2.1 50000 192.0.2.2 22"})


@pytest.mark.parametrize("here", [{}, {"DISPLAY": ":0"}, {"WAYLAND_DISPLAY": "wayland-0"}])
def test_a_window_can_be_opened_where_the_system_or_the_environment_has_a_display(here: dict[str, str]) -> None:
    on_linux = processes.CAN_SPLIT
    assert desktop.has_display(here) == (bool(here) or not on_linux)


def test_a_place_is_named_from_the_present_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert desktop.from_here(tmp_path / "a" / "b") == os.path.join("a", "b")


def test_a_place_on_another_drive_is_named_in_full(monkeypatch: pytest.MonkeyPatch) -> None:
    def other_drive(_path: Path) -> str:
        raise ValueError("path is on mount 'D:', start on mount 'C:'")

    monkeypatch.setattr(os.path, "relpath", other_drive)
    assert desktop.from_here(Path("far/away")) == str(Path("far/away"))


def test_a_stream_of_few_letters_is_given_all() -> None:
    pipe = io.BytesIO()
    stream = io.TextIOWrapper(pipe, encoding="cp1252")
    terminal.print_all_letters(stream, io.StringIO())
    print("µ → ✓", file=stream, flush=True)
    assert pipe.getvalue().decode("utf-8").split() == ["µ", "→", "✓"]


_PARENT = """
import sys, time
from shared.system import processes
child = processes.start([sys.executable, "-c", sys.argv[1]])
sys.stdout.write(f"{child.pid}\\n")
sys.stdout.flush()
time.sleep(600)
"""
_CHILD = """
import signal, sys, time
from shared.system import processes
asked = []
signal.signal(processes.ENDING[1], lambda *_: asked.append(1))
assert processes.follow_parent()
print("up", flush=True)
while not asked:
    time.sleep(0.02)
print("asked to end", flush=True)
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs an end that no process can hear of")
def test_a_child_is_asked_to_end_when_its_parent_is_killed() -> None:
    words = [sys.executable, "-c", _PARENT, _CHILD]
    where = Path(__file__).parents[3]
    parent = subprocess.Popen(words, stdout=subprocess.PIPE, encoding="utf-8", cwd=where)
    assert parent.stdout is not None
    with parent.stdout as printed:
        said = [printed.readline().strip(), printed.readline().strip()]
        parent.kill()
        parent.wait()
        rest = printed.read()  # until the child, too, has let go of it
    assert "up" in said
    assert rest.strip() == "asked to end"


def test_a_process_that_nobody_started_follows_nobody() -> None:
    assert not processes.follow_parent()


OUTLIVES = "import os, sys\nfrom shared.system.terminal import outlive_terminal\noutlive_terminal()\n"
PRINTS = (
    OUTLIVES + "for number in range({lines}): print(f'{{number:06d}}', 'x' * 90, flush={flush})\n"
    "print('last', file=sys.stderr)\nsys.exit(7)"
)


@pytest.mark.skipif(sys.platform == "win32", reason="a terminal of Unix")
def test_a_terminal_that_stands_still_keeps_nobody_waiting(tmp_path: Path) -> None:
    reading, writing = os.openpty()
    done = tmp_path / "done"
    script = PRINTS.format(lines=20_000, flush=True).replace("sys.exit", f"open({str(done)!r}, 'w').close(); sys.exit")
    process = subprocess.Popen([sys.executable, "-c", script], stdout=writing, stderr=writing, cwd=ROOT)
    os.close(writing)
    try:
        end = time.monotonic() + PATIENCE_S
        while not done.exists():  # nobody has read a word
            assert time.monotonic() < end
            time.sleep(0.05)
    finally:
        os.close(reading)
    assert process.wait(timeout=PATIENCE_S) == 7  # words that wait for a terminal that is gone are forgotten


def started(script: str, unbuffered: str) -> subprocess.Popen[str]:
    """A Python that runs the script, with its three streams in pipes; `unbuffered` is its PYTHONUNBUFFERED."""
    return subprocess.Popen(
        [sys.executable, "-c", script],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        cwd=ROOT,
        encoding="utf-8",
        env={**os.environ, "PYTHONUNBUFFERED": unbuffered},
    )


@pytest.mark.parametrize("unbuffered", ["", "1"])
@pytest.mark.parametrize("flush", [True, False])
def test_whoever_reads_slowly_gets_every_line_in_its_order(flush: bool, unbuffered: str) -> None:
    script = PRINTS.format(lines=20_000, flush=flush)
    with started(script, unbuffered) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        lines = list[str]()
        for line in process.stdout:
            lines.append(line.split()[0])
            if len(lines) % 1000 == 0:
                time.sleep(0.02)
        assert process.stderr.read() == "last\n"
        assert process.wait(timeout=PATIENCE_S) == 7
    assert lines == [f"{number:06d}" for number in range(20_000)]


@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_what_went_wrong_is_printed_at_once(unbuffered: str) -> None:
    script = OUTLIVES + "print('it goes wrong', file=sys.stderr)\nsys.exit(sys.stdin.readline() != 'read\\n')"
    with started(script, unbuffered) as process:
        assert process.stdin is not None
        assert process.stderr is not None
        assert process.stderr.readline() == "it goes wrong\n"  # while the process waits for an answer
        assert process.communicate("read\n", timeout=PATIENCE_S) == ("", "")
    assert process.returncode == 0


def test_what_is_printed_after_the_terminal_is_gone_is_forgotten() -> None:
    script = OUTLIVES + "sys.stdin.readline()\nprint('nobody reads this', flush=True)\nsys.exit(7)"
    process = subprocess.Popen(
        [sys.executable, "-c", script],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        cwd=Path(__file__).parents[3],
    )
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdout.close()
    with process.stdin as asked:
        asked.write(b"go on\n")
    assert process.wait(timeout=PATIENCE_S) == 7
