"""The table [notify] stays with its owner: no recording, no other machine and no error message has the address."""

from __future__ import annotations

from pathlib import Path

import pytest

from shared.config import load_table
from shared.errors import UserError
from shared.rig import load_rig, rig_of_table

SECRET = "https://hooks.example.org/T0/s3cret"
RIG = f"""\
id = "lab"  # the name
[notify]
url = "{SECRET}"
# url = "{SECRET}-of-before"
command = [
  "logger",
  "{{text}}",
]

[block]  # of the shelf
mass_kg = 0.009
"""


def rig_file(folder: Path, text: str) -> Path:
    path = folder / "rig.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_the_table_is_read_and_everything_else_is_handed_on(tmp_path: Path):
    rig = load_rig(rig_file(tmp_path, RIG))
    assert (rig.notify.url, rig.notify.command) == (SECRET, ("logger", "{text}"))
    assert rig.text.splitlines()[0] == 'id = "lab"  # the name'
    assert rig.text.splitlines()[-2:] == ["[block]  # of the shelf", "mass_kg = 0.009"]
    assert "s3cret" not in rig.text
    assert "logger" not in rig.text
    assert "s3cret" not in repr(rig)


def test_the_table_inside_a_recording_names_nobody(tmp_path: Path):
    """Its text is a stranger's and stays as it is; who reads it gets a rig that tells nobody, whatever stands there."""
    rig = rig_of_table(load_table(rig_file(tmp_path, RIG)))
    assert not rig.notify.anybody
    assert not rig_of_table(load_table(rig_file(tmp_path, 'id = "lab"\nnotify = 3\n'))).notify.anybody


@pytest.mark.parametrize(
    "text",
    [
        f'id = "lab"\nnotify = {{url = "{SECRET}"}}\n',
        f'notify.url = "{SECRET}"\nid = "lab"\n',
        RIG + f"# the address is {SECRET}\n",
        RIG.replace("[block]", '[plate]\nmaterial = """\n[notify]\n"""\n[block]'),
    ],
    ids=["inline", "dotted", "elsewhere too", "a text that looks like it"],
)
def test_a_table_that_cannot_be_cut_out_is_refused_without_its_address(text: str, tmp_path: Path):
    with pytest.raises(UserError, match=r"expected all of \[notify\] once and under a header of its own") as refused:
        load_rig(rig_file(tmp_path, text))
    assert "s3cret" not in str(refused.value)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        (f'url = ["{SECRET}"]', "something else, which is not shown"),
        (f'url = "ftp{SECRET}"', "begins with https:// or http://"),
        ('url = "https://s3cret:port"', "names a host"),
        (f'command = "curl {SECRET}"', "something else, which is not shown"),
        ('command = [""]', "a program and its arguments"),
        ('on = ["fire"]', "'fault', 'disk', 'mark', 'outage', 'end'"),
        ("timeout_s = 0", "a positive number of seconds as timeout_s"),
        ("quiet_s = -1", "quiet_s"),
    ],
)
def test_a_mistake_is_named_and_no_address_shown(line: str, said: str, tmp_path: Path):
    with pytest.raises(UserError) as refused:
        load_rig(rig_file(tmp_path, f'id = "lab"\n[notify]\n{line}\n'))
    assert said in str(refused.value)
    assert "s3cret" not in str(refused.value)
