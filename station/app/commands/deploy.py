"""Puts the camera agent onto a Pi over ssh, and prints the rate and latency of the corners that then arrive.

On the way it checks the Pi, copies code, dependencies, keys and rig file, and installs a hardened systemd unit and the
station as the clock's source.

It may be repeated: what is there is not copied again, and what fails is rolled back. See deploy/README.md.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from shared.errors import UserError
from shared.rig import RigConfig, load_rig
from station.app.deploy.remote import Remote
from station.app.deploy.steps import Deployment, Wishes
from station.app.deploy.systems import system_of
from station.app.deploy.wheels import fetch, wheel_folder

NAME = "deploy"
HELP = "put the camera agent onto a Pi over ssh, or take it off"
EXAMPLE = "station deploy pi@raspberrypi --rig rig.toml"
ONE = "with --status: no camera agent runs on the Pi"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the options."""
    parser.add_argument("target", nargs="?", metavar="USER@HOST", help="the Pi, as ssh knows it")
    parser.add_argument("--rig", default="rig.toml", help="the rig file that the Pi gets")
    parser.add_argument("--keys", help="folder with ca.pem, cert.pem and key.pem of the Pi, for tls/ endpoints")
    parser.add_argument("--station", default="", help="the station's address for chrony; by default ssh's other end")
    parser.add_argument("--no-clock", action="store_true", help="leave the Pi's clock alone")
    parser.add_argument("--offline", action="store_true", help="use no internet, neither here nor on the Pi")
    parser.add_argument("--wheels", help="folder of wheels; by default ~/.cache/repose/wheels/<system>")
    parser.add_argument("--force", action="store_true", help="keep the release although camera or corners are missing")
    parser.add_argument("--verify-seconds", type=float, default=5.0, help="how long to listen for corners; 0: not")
    parser.add_argument("--patience", type=float, default=20.0, help="how long to wait for the first corners, in s")
    what = parser.add_argument_group("instead of installing").add_mutually_exclusive_group()
    what.add_argument("--prepare", metavar="SYSTEM", help="only fetch the wheels for trixie or bookworm, for --offline")
    what.add_argument("--check", action="store_true", help="only look at the Pi")
    what.add_argument("--status", action="store_true", help="only say what is installed and whether it runs")
    what.add_argument("--rollback", action="store_true", help="go back to the release before")
    what.add_argument("--uninstall", action="store_true", help="remove all that was installed")
    parser.add_argument("--purge", action="store_true", help="with --uninstall: calibrations made on the Pi as well")
    ssh = parser.add_argument_group("ssh")
    ssh.add_argument("--port", type=int, help="ssh port")
    ssh.add_argument("--identity", help="private key file")
    ssh.add_argument("--ssh-option", action="append", default=[], metavar="KEY=VALUE", help="passed to ssh -o")
    rare = parser.add_argument_group("other targets than a Pi")
    rare.add_argument("--root", default="/", help="install below this folder, without privileges")
    rare.add_argument("--supervisor", choices=("auto", "systemd", "none"), default="auto", help="who runs the agent")
    rare.add_argument("--python", default="python3", help="the target's Python")
    rare.add_argument("--lock", help="lock file of wheels for another system")
    rare.add_argument("--code", help="folder with pi_agent and shared, in place of this checkout")


def run(options: argparse.Namespace) -> int:
    """Gives 0, or 1 when nothing is installed where something should be."""
    if options.prepare:
        return _prepare(options)
    if not options.target:
        raise UserError("Expected USER@HOST of the Pi, got nothing: for instance `station deploy pi@rig.local`")
    wishes = _wishes(options)
    installing = not (options.status or options.rollback or options.uninstall)
    rig = load_rig(wishes.rig_path) if installing else None
    with Remote(options.target, port=options.port, identity=options.identity, options=options.ssh_option) as remote:
        deployment = Deployment(remote, wishes)
        if options.status:
            return _status(deployment)
        if options.rollback:
            print(f"Done: {deployment.roll_back()}.")
            return 0
        if options.uninstall:
            left = deployment.uninstall(purge=options.purge)
            print("Uninstalled." + (f" Kept: {', '.join(left)} (--purge removes it too)." if left else ""))
            return 0
        assert rig is not None
        return _install(deployment, rig, options)


def _prepare(options: argparse.Namespace) -> int:
    system = system_of(options.prepare)
    folder = Path(options.wheels) if options.wheels else wheel_folder(system)
    for wheel in fetch(system.lock, folder, system):
        print(f"{wheel.stat().st_size / 1e6:6.1f} MB  {wheel.name}")
    print(f"Everything that {system.title} needs is in {folder}; `station deploy --offline` uses it.")
    return 0


def _wishes(options: argparse.Namespace) -> Wishes:
    if not options.root.startswith("/"):
        raise UserError(f"Expected an absolute path on the target for --root, got '{options.root}'")
    return Wishes(
        rig_path=Path(options.rig),
        root=options.root.rstrip("/") or "/",
        python=options.python,
        supervisor=options.supervisor,
        wheels=_path(options.wheels),
        lock=_path(options.lock),
        code=_path(options.code),
        keys=_path(options.keys),
        station=options.station,
        clock=not options.no_clock,
        offline=options.offline,
        verify_s=options.verify_seconds,
        patience_s=options.patience,
        force=options.force,
    )


def _path(text: str | None) -> Path | None:
    return Path(text) if text else None


def _status(deployment: Deployment) -> int:
    found = deployment.status()
    runs = f"runs (process {found['pid']})" if found["pid"] else "does not run"
    print(f"Release {found['current'] or 'none'}, the agent {runs}. Before it: {found['previous'] or 'none'}.")
    if found["clock"]:
        print(f"Chrony follows {found['clock']['source']}, {1e3 * float(found['clock']['offset_s']):+.3f} ms away.")
    if found["log"]:
        print(f"Its log ends:\n{found['log']}")
    return 0 if found["pid"] else 1


def _install(deployment: Deployment, rig: RigConfig, options: argparse.Namespace) -> int:
    if options.check:
        deployment.check(rig)
        print("Nothing speaks against a deployment.")
        return 0
    done = deployment.install(rig)
    unchanged = "" if done["changed"] else " Nothing had to change."
    print(f"Release {done['id']} runs (process {done['pid']}).{unchanged}")
    if options.verify_seconds <= 0:
        return 0
    arrival = deployment.verify(rig)
    print(f"Verified: {arrival}." if arrival.corners else f"No corners came: {arrival.heard}.")
    if arrival.corners or options.force:
        return 0
    what = f"; {deployment.roll_back()}" if done["switched"] else ""
    raise UserError(
        f"Expected corners over the bus, got none in {options.patience:g} s "
        f"({arrival.heard}){what} (--force keeps a release that sees nothing)"
    )
