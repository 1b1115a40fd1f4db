"""Tables of tracks become recordings with runs, onsets and what is known; a wrong table is one sentence."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from shared.errors import UserError
from station.app.commands import import_
from station.diagnosis.observations.build import evidence_of
from station.diagnosis.observations.setting import Setting
from station.friction.onset import estimate_onset
from station.physics.model import Model
from station.recording.arrays import load_signals
from station.recording.importers import tracks, write
from station.recording.importers.tracks.table import read_table
from station.recording.reader import open_recording

Columns = dict[str, list[float]]
RATE, MU = 0.15, 0.35


def run_of(number: int, *, azimuth: float = 0.5, begins_s: float = 0.5) -> Columns:
    """A block without noise that slides 40 mm from where a plate that tilts at 0.15 rad/s pulls as much as it holds."""
    columns: Columns = {name: [] for name in ("run", "t_s", "x_m", "y_m", "yaw_rad", "tilt_rad", "azimuth_rad")}
    slid = speed = step = 0.0
    while slid < 0.04:
        tilt = max(0.0, RATE * (1e-3 * step - begins_s))
        if step % 10 == 0:
            row = (number, 1e-3 * step, slid * math.sin(azimuth), -slid * math.cos(azimuth), 0.2, tilt, azimuth)
            for name, value in zip(columns, row, strict=True):
                columns[name].append(value)
        speed = max(0.0, speed + 9.81e-3 * (math.sin(tilt) - MU * math.cos(tilt)))
        slid, step = slid + 1e-3 * speed, step + 1
    return columns


def two_runs() -> Columns:
    parts = (run_of(3), run_of(7, azimuth=2.0))
    return {name: [*parts[0][name], *parts[1][name]] for name in parts[0]}


def saved(columns: Mapping[str, Sequence[object]], path: Path) -> Path:
    lines = [",".join(columns), *(",".join(map(str, row)) for row in zip(*columns.values(), strict=True))]
    path.write_text("\n".join(lines).replace("nan", ""), encoding="utf-8")
    return path


def imported(path: Path, out: Path) -> Path:
    write(tracks.read(path, onset=estimate_onset), out)
    return out


def test_a_run_gets_its_onset_where_the_plate_pulls_as_much_as_friction_holds(tmp_path: Path) -> None:
    reader = open_recording(imported(saved(two_runs(), tmp_path / "a.csv"), tmp_path / "a.mcap"))
    samples = reader.samples()
    assert [sample.run for sample in samples] == [3, 7]
    for sample, azimuth in zip(samples, (0.5, 2.0), strict=True):
        assert not sample.censored
        assert sample.onset_angle_rad == pytest.approx(math.atan(MU), abs=2e-3)
        assert sample.azimuth_rad == pytest.approx(azimuth, abs=1e-6)
    signals = load_signals(reader).run(3)
    assert len(signals.block) == len(run_of(3)["t_s"])
    assert signals.attitude.tilt_rad == pytest.approx(run_of(3)["tilt_rad"], abs=1e-9)
    assert signals.block.position_m[:, 0] == pytest.approx(run_of(3)["x_m"])


def test_units_a_parquet_file_and_a_quaternion_give_the_same(tmp_path: Path) -> None:
    known = two_runs()
    half, azimuth = 0.5 * np.array(known["tilt_rad"]), np.array(known["azimuth_rad"])
    other = {
        "run": pa.array([int(run) for run in known["run"]]),
        "t_ms": pa.array([1e3 * t for t in known["t_s"]]),
        "x_mm": pa.array([1e3 * x for x in known["x_m"]]),
        "y_mm": pa.array([1e3 * y for y in known["y_m"]]),
        "yaw_deg": pa.array(np.degrees(known["yaw_rad"])),
        "plate_qw": pa.array(np.cos(half)),
        "plate_qx": pa.array(np.sin(half) * np.cos(azimuth)),
        "plate_qy": pa.array(np.sin(half) * np.sin(azimuth)),
        "plate_qz": pa.array(np.zeros(len(half))),
    }
    pq.write_table(pa.table(other), tmp_path / "b.parquet")
    first = open_recording(imported(saved(known, tmp_path / "a.csv"), tmp_path / "a.mcap")).samples()
    second = open_recording(imported(tmp_path / "b.parquet", tmp_path / "b.mcap")).samples()
    for a, b in zip(first, second, strict=True):
        assert b.slip_ns == pytest.approx(a.slip_ns, abs=1e5)
        assert b.onset_angle_rad == pytest.approx(a.onset_angle_rad, abs=1e-5)
        assert b.start_yaw_rad == pytest.approx(a.start_yaw_rad)


def test_what_is_known_of_a_run_is_in_its_sample(tmp_path: Path) -> None:
    known = two_runs()
    light = [run == 3 for run in known["run"]]
    known |= {"mass_g": [5.0 if one else 9.0 for one in light], "dwell_s": [2.0] * len(light)}
    named = {**known, "group": ["A" if one else "B" for one in light]}
    first, second = open_recording(imported(saved(named, tmp_path / "a.csv"), tmp_path / "a.mcap")).samples()
    assert (first.block_mass_kg, second.block_mass_kg) == pytest.approx((0.005, 0.009))
    assert (first.object, second.object) == ("A", "B")
    assert math.isnan(first.temperature_c)
    assert first.slip_ns - first.rest_ns == pytest.approx((2.0 + math.atan(MU) / RATE) * 1e9, abs=3e7)


def test_a_block_that_holds_and_is_moved_on_the_level_plate_did_not_slip(tmp_path: Path) -> None:
    known = two_runs()
    count = known["run"].count(3)
    held = {**known, "x_m": [*[0.0] * count, *known["x_m"][count:]], "y_m": [*[0.0] * count, *known["y_m"][count:]]}
    for name, values in (("tilt_rad", [0.1, 0.0, 0.0]), ("x_m", [0.0, 0.0, 0.03]), ("y_m", [0.0] * 3)):
        held[name] = [*held[name][:count], *values, *held[name][count:]]
    last = known["t_s"][count - 1]
    held["t_s"] = [*known["t_s"][:count], *(last + 0.01 * step for step in (1, 2, 3)), *known["t_s"][count:]]
    for name, value in (("run", 3.0), ("yaw_rad", 0.2), ("azimuth_rad", 0.5)):
        held[name] = [*known[name][:count], *[value] * 3, *known[name][count:]]
    samples = open_recording(imported(saved(held, tmp_path / "a.csv"), tmp_path / "a.mcap")).samples()
    assert [sample.censored for sample in samples] == [True, False]
    assert samples[0].onset_angle_rad == pytest.approx(max(known["tilt_rad"][:count]))


def test_a_lost_block_is_said_to_be_lost_and_a_level_plate_has_no_onset(tmp_path: Path) -> None:
    known = two_runs()
    known["x_m"][5], known["tilt_rad"] = math.nan, [0.0] * len(known["run"])
    reader = open_recording(imported(saved(known, tmp_path / "a.csv"), tmp_path / "a.mcap"))
    assert (~load_signals(reader).block.found).sum() == 1
    assert all(sample.censored and sample.flags == ("no_tilt",) for sample in reader.samples())


def on_a_slope(number: int, *, mu: float, tilt: float = 0.4) -> Columns:
    """A block on a plate that does not turn, let go after 0.3 s; the plate's tilt is told once."""
    columns: Columns = {name: [] for name in ("run", "t_s", "x_m", "y_m", "yaw_rad", "tilt_rad", "azimuth_rad")}
    for step in range(120):
        slid = 0.5 * 9.81 * max(math.sin(tilt) - mu * math.cos(tilt), 0.0) * max(0.01 * step - 0.3, 0.0) ** 2
        once = (tilt, 0.5) if step == 0 else (math.nan, math.nan)
        row = (number, 0.01 * step, slid * math.sin(0.5), -slid * math.cos(0.5), 0.0, *once)
        for name, value in zip(columns, row, strict=True):
            columns[name].append(value)
    return columns


def test_a_slide_down_a_fixed_plate_has_no_onset_and_one_that_holds_is_a_limit(tmp_path: Path) -> None:
    parts = on_a_slope(1, mu=0.3), on_a_slope(2, mu=0.5)
    columns = {name: [*parts[0][name], *parts[1][name]] for name in parts[0]}
    source = saved(columns, tmp_path / "a.csv")
    reader = open_recording(imported(source, tmp_path / "a.mcap"))
    slid, held = reader.samples()
    assert (slid.censored, slid.flags) == (True, ("no_tilt",))
    assert (held.censored, held.flags, held.onset_angle_rad) == (True, (), pytest.approx(0.4))
    signals = load_signals(reader)
    assert signals.attitude.tilt_rad == pytest.approx(0.4)
    first = signals.run(1).block.position_m[0]
    assert 2e-3 < math.hypot(first[0], first[1]) < 4e-3, "the run begins where the block has visibly moved"
    assert any("does not turn in 2 of 2 runs" in line for line in tracks.read(source).lacking)


def test_a_slide_down_a_fixed_plate_is_evidence_of_sliding_friction_alone(tmp_path: Path) -> None:
    parts = [on_a_slope(number, mu=0.3) for number in range(3)]
    columns = {name: [value for part in parts for value in part[name]] for name in parts[0]}
    reader = open_recording(imported(saved(columns, tmp_path / "a.csv"), tmp_path / "a.mcap"))
    evidence = evidence_of(load_signals(reader), Setting(opening_radius_m=10.0))
    assert evidence.channel("onset") is None
    along = evidence.channel("along")
    assert along is not None
    assert along.residual(Model(mu_s=0.3)) == pytest.approx(0.0, abs=2e-3)


Change = Callable[[Columns], object]


def _set(name: str, row: int, value: float) -> Change:
    return lambda columns: columns[name].__setitem__(row, value)


BAD: dict[str, tuple[Change, str]] = {
    "time without a number": (_set("t_s", 3, math.nan), "row 4: expected a number for 't_s', got none"),
    "doubled time": (_set("t_s", 4, 0.03), "row 5: expected rising times in run 3, got 0.03 s twice; leave one"),
    "unsorted time": (_set("t_s", 4, 0.01), "row 5: expected rising times in run 3, got 0.01 s after 0.03 s; sort"),
    "attitude without a number": (_set("tilt_rad", 2, math.nan), "row 3: expected the plate's attitude in every row"),
    "no attitude": (lambda columns: columns.pop("tilt_rad"), "Expected the plate's attitude in .*found none"),
    "no azimuth": (lambda columns: columns.pop("azimuth_rad"), "Expected azimuth_rad beside tilt_rad"),
    "no place": (lambda columns: columns.pop("y_m"), "missing are y_m"),
    "no run": (lambda columns: columns.pop("run"), "Expected a column 'run'"),
    "one run": (lambda columns: columns.update(run_of(3)), "at least 2 runs in .*, got one"),
    "a name misspelt": (
        lambda columns: columns.update(yawrad=columns.pop("yaw_rad")),
        "got 'yawrad': rename it yaw_rad",
    ),
    "two names of others": (
        lambda columns: columns.update(time=columns.pop("t_s"), displacement=columns["x_m"]),
        "got 'time': rename it t_s or t_ms or t_us or t_ns$",
    ),
    "a table of friction": (
        lambda columns: columns.update(friction_force_n=columns.pop("x_m")),
        "a table of friction .'friction_force_n'.: station diagnose takes it as it is",
    ),
    "a unit unknown": (
        lambda columns: columns.update(x_inch=columns.pop("x_m")),
        "got 'x_inch': convert it and call it x_m",
    ),
    "degrees for radians": (
        lambda columns: columns.update(tilt_rad=np.degrees(columns["tilt_rad"]).tolist()),
        "at most 1.571 rad in 'tilt_rad', as no plate is tilted beyond the vertical, got .*; did you mean tilt_deg",
    ),
    "a yaw in degrees": (
        lambda columns: columns.update(yaw_rad=np.degrees(columns["yaw_rad"]).tolist()),
        "row 1: expected at most 6.283 rad in 'yaw_rad', .* did you mean yaw_deg",
    ),
    "millimetres for metres": (
        lambda columns: columns.update(x_m=[1e3 * x for x in columns["x_m"]]),
        "at most 3 m in 'x_m', as no plate is larger, got .* m; did you mean x_mm",
    ),
    "milliseconds for seconds": (
        lambda columns: columns.update(t_s=[1e3 * t for t in columns["t_s"]]),
        "rows at most 2 s apart, as blocks slide for seconds, got rows 10 s apart by 't_s'; did you mean t_ms",
    ),
    "microseconds for seconds": (
        lambda columns: columns.update(t_s=[1e6 * t for t in columns["t_s"]]),
        r"got rows 1e\+04 s apart by 't_s'; did you mean t_us",
    ),
    "milliseconds of a fast camera for seconds": (
        lambda columns: columns.update(
            {name: values[:1] * 4000 for name, values in columns.items()},
            run=[float(row // 2000) for row in range(4000)],
            t_s=[float(row % 2000) for row in range(4000)],
        ),
        "runs of 0.02 s to 1800 s, as no plate takes longer to tilt, got runs of .* s by 't_s'; did you mean t_ms",
    ),
    "seconds for milliseconds": (
        lambda columns: columns.update(t_ms=columns.pop("t_s")),
        "as no block slides in less, got runs of .* s by 't_ms'; did you mean t_s",
    ),
    "two masses in a run": (
        lambda columns: columns.update(mass_kg=[1.0 + t for t in columns["t_s"]]),
        "Expected one mass in each run",
    ),
    "a negative mass": (
        lambda columns: columns.update(mass_kg=[-0.008 for _ in columns["t_s"]]),
        "row 1: expected a number above 0 in 'mass_kg', or nothing where it is not known, got -0.008",
    ),
    "grams for kilograms": (
        lambda columns: columns.update(mass_kg=[8000.0 for _ in columns["t_s"]]),
        "row 1: expected at most 1000 kg in 'mass_kg', as no bench tilts more, got 8000 kg; did you mean mass_g",
    ),
    "no area": (
        lambda columns: columns.update(area_mm2=[0.0 for _ in columns["t_s"]]),
        "row 1: expected a number above 0 in 'area_mm2'",
    ),
    "a negative noise": (
        lambda columns: columns.update(sigma_m=[-1e-5 for _ in columns["t_s"]]),
        "row 1: expected 0 or more in 'sigma_m'",
    ),
    "a humidity in per cent": (
        lambda columns: columns.update(relative_humidity=[45.0 for _ in columns["t_s"]]),
        "expected at most 1 in 'relative_humidity', as it is a share of saturation and no per cent, got 45$",
    ),
    "two attitudes": (
        lambda columns: columns.update({f"plate_q{axis}": [0.5 for _ in columns["t_s"]] for axis in "wxyz"}),
        "Expected the plate's attitude once in .*, got it in tilt_rad and in plate_qw to plate_qz; leave one",
    ),
    "an azimuth of the slope for that of the axis": (
        lambda columns: columns.update(azimuth_rad=[azimuth - 0.5 * math.pi for azimuth in columns["azimuth_rad"]]),
        "got slides 90° off its steepest way down .the median of 2 runs.: downhill is .sin, -cos. of azimuth_rad",
    ),
    "slides uphill": (
        lambda columns: columns.update(azimuth_rad=[azimuth + math.pi for azimuth in columns["azimuth_rad"]]),
        "got slides 180° off its steepest way down",
    ),
}


def test_columns_that_nothing_reads_are_named_and_left_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    columns: dict[str, Sequence[object]] = {**two_runs()}
    columns |= {name: ["Kim"] * len(columns["run"]) for name in ("Operator", "x_target_m", "mass_lb", "")}
    source, out = saved(columns, tmp_path / "a.csv"), tmp_path / "a.mcap"
    parser = argparse.ArgumentParser()
    import_.add_arguments(parser)
    for words in (["--check"], ["--out", str(out)]):
        assert import_.run(parser.parse_args(["tracks", str(source), *words])) == 0
        assert capsys.readouterr().out.splitlines()[0] == (
            "Columns that nothing reads were left alone: Operator, x_target_m, mass_lb (convert it and call it mass_kg "
            "or mass_g), one without a name."
        )
    assert len(open_recording(out).samples()) == 2


@pytest.mark.parametrize(("between", "point"), [(";", ","), (";", "."), ("\t", ".")])
def test_semicolons_and_tabs_are_read_and_a_decimal_comma_between_semicolons(
    between: str, point: str, tmp_path: Path
) -> None:
    known = {**two_runs(), "group": ["A, B"] * len(two_runs()["run"])}
    lines = [between.join(known)]
    for row in zip(*known.values(), strict=True):
        lines.append(between.join(cell if isinstance(cell, str) else str(cell).replace(".", point) for cell in row))
    source = tmp_path / "a.csv"
    source.write_text("\n".join(lines), encoding="utf-8")
    read, expected = read_table(source), read_table(saved(two_runs(), tmp_path / "b.csv"))
    assert read.group == tuple(known["group"])
    for name, values in expected.numbers.items():
        assert read.numbers[name].tolist() == values.tolist()


def test_a_decimal_comma_between_commas_is_told(tmp_path: Path) -> None:
    source = tmp_path / "a.csv"
    source.write_text("run,t_s,x_m\n1,0,5,0,2\n", encoding="utf-8")
    with pytest.raises(
        UserError, match=r"3 cells between commas, .* got 5; numbers with a decimal comma need semicolons"
    ):
        read_table(source)


def test_an_azimuth_may_be_counted_on_and_one_in_degrees_is_told(tmp_path: Path) -> None:
    columns = two_runs()
    columns["azimuth_rad"] = [azimuth + 2.0 * math.pi for azimuth in columns["azimuth_rad"]]
    reader = open_recording(imported(saved(columns, tmp_path / "a.csv"), tmp_path / "a.mcap"))
    assert [sample.azimuth_rad for sample in reader.samples()] == pytest.approx([0.5, 2.0], abs=1e-6)
    columns["azimuth_rad"] = np.degrees(columns["azimuth_rad"]).tolist()
    with pytest.raises(UserError, match=r"as that is three turns, .* did you mean azimuth_deg"):
        imported(saved(columns, tmp_path / "a.csv"), tmp_path / "b.mcap")


def test_a_block_that_has_turned_often_is_no_slip_of_unit(tmp_path: Path) -> None:
    columns = two_runs()
    columns["yaw_rad"] = [0.2 + 30.0 * t for t in columns["t_s"]]
    assert imported(saved(columns, tmp_path / "a.csv"), tmp_path / "a.mcap").exists()


@pytest.mark.parametrize("name", BAD)
def test_a_wrong_table_is_one_sentence(name: str, tmp_path: Path) -> None:
    change, said = BAD[name]
    columns = two_runs()
    change(columns)
    with pytest.raises(UserError, match=said) as raised:
        imported(saved(columns, tmp_path / "a.csv"), tmp_path / "a.mcap")
    assert "\n" not in str(raised.value)


def test_check_says_what_is_missing_and_what_cannot_be_tested(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    parts = [run_of(number, azimuth=0.3 * number) for number in range(20)]
    columns = {name: [value for part in parts for value in part[name]] for name in parts[0]}
    parser = argparse.ArgumentParser()
    import_.add_arguments(parser)
    source = saved(columns, tmp_path / "a.csv")
    assert import_.run(parser.parse_args(["tracks", str(source), "--check"])) == 0
    said = capsys.readouterr().out.splitlines()
    assert "No mass_kg: every block has 8 g." in said
    assert any(line.startswith("It can be diagnosed: 20 of 20 runs") for line in said)
    assert any(line.startswith("Untestable: ") and "load_dependence" in line for line in said)
    assert list(tmp_path.glob("*.mcap")) == []
    few = saved(two_runs(), tmp_path / "b.csv")
    assert import_.run(parser.parse_args(["tracks", str(few), "--check"])) == 0
    assert "It cannot be diagnosed: expected at least 20 runs" in capsys.readouterr().out
    with pytest.raises(UserError, match="--check, got neither"):
        import_.run(parser.parse_args(["tracks", str(few)]))
