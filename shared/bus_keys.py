"""Keys for encrypted endpoints: `tls/ADDRESS:PORT` in `[bus]` means mutual TLS, and both ends must show a certificate.

The environment variable REPOSE_KEYS names the folder of keys: as `station keys new` writes it, with a folder for each
process, or one process's own. That holds ca.pem (who signs the rig's certificates), cert.pem and key.pem, and
rights.toml, which says whose certificates count as which process's. Without it all who have a certificate are equal.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from shared import own_files
from shared.bus_rights import ROLES, access_control
from shared.config import load_table
from shared.errors import UserError

VARIABLE = "REPOSE_KEYS"
FILES = ("ca", "cert", "key")
RIGHTS = "rights.toml"


def tls_settings(
    endpoints: Sequence[str], *, rig_id: str = "", process: str = "", environment: Mapping[str, str] = os.environ
) -> dict[str, Any]:
    """Returns Zenoh's settings for these endpoints and this process of the rig; empty when none of them is encrypted.

    Raises:
        UserError: if one is and the keys are missing, or others than their owner may read the private one, or write
            to any of them.
    """
    folder = keys_in_use(endpoints, process=process, environment=environment)
    if folder is None:
        return {}
    files = {name: _readable(folder / f"{name}.pem") for name in FILES}
    own_files.require_secret(files["key"], what="a private key")
    require_own(given_keys(environment), folder, *files.values())
    own = {
        f"{end}_{kind}": str(files[name])
        for end in ("listen", "connect")
        for kind, name in (("certificate", "cert"), ("private_key", "key"))
    }
    tls = {"root_ca_certificate": str(files["ca"]), "enable_mtls": True, "verify_name_on_connect": True, **own}
    return {"transport/link/tls": tls} | _rights(folder / RIGHTS, rig_id, process)


def keys_in_use(
    endpoints: Sequence[str], *, process: str = "", environment: Mapping[str, str] = os.environ
) -> Path | None:
    """Returns the folder of the keys with which a process speaks on these endpoints; None if none is encrypted."""
    if not any(endpoint.startswith(("tls/", "quic/")) for endpoint in endpoints):
        return None
    return own_keys(given_keys(environment), process)


def given_keys(environment: Mapping[str, str] = os.environ) -> Path:
    """Returns the folder of keys that REPOSE_KEYS names."""
    return Path(environment.get(VARIABLE, "") or "keys").resolve()


def own_keys(folder: Path, process: str) -> Path:
    """Returns the process's own folder among the keys of a rig.

    It is `folder` itself where that holds the keys of one process.
    """
    return folder / process if process and (folder / process).is_dir() else folder


def require_own(*paths: Path) -> None:
    """Refuses keys, or folders of keys, that others may write to: who changes rights.toml has any role of the rig.

    Raises:
        UserError: if others than its owner may write to one of them.
    """
    own_files.require_own(*paths, what="keys")


def _readable(file: Path) -> Path:
    if not os.access(file, os.R_OK):
        raise UserError(
            f"Expected the key file {file} for the encrypted endpoints in [bus], but it cannot be read: "
            f"set {VARIABLE} to the folder that `station keys new` made, or to that of ca.pem, cert.pem and key.pem"
        )
    return file


def _rights(file: Path, rig_id: str, process: str) -> dict[str, Any]:
    if not file.exists():
        return {}
    return {"access_control": access_control(rig_id, members_in(file, rig_id), process=process)}


def members_in(file: Path, rig_id: str) -> dict[str, list[str]]:
    """Returns whose certificates count as which process's, by role, from rights.toml.

    Raises:
        UserError: if the file is of another rig, says something else, or others than its owner may write to it.
    """
    require_own(file.parent, file)
    table = load_table(file).values
    members = table.get("members")
    lists = isinstance(members, dict) and all(isinstance(names, list) for names in members.values())
    if not isinstance(members, dict) or not lists or not set(members) <= set(ROLES):
        raise UserError(f"Expected [members] with lists for {', '.join(ROLES)} in {file}, got {sorted(table)}")
    if table.get("rig") != rig_id:
        raise UserError(f"Expected keys of rig '{rig_id}', but {file} is of rig '{table.get('rig')}'")
    return {role: [str(name) for name in names] for role, names in members.items()}
