"""A rig's own authority: certificates for its processes, and who counts as which process.

    keys/authority/ca.key, ca.pem    stays with the user
    keys/<process>/                  ca.pem, cert.pem, key.pem, rights.toml: goes to where the process runs

A certificate's common name is `<process>.<number>`; rights.toml lists those that count. To revoke one is to issue the
process another with the next number: the old one still opens a connection, and nothing that it says or asks arrives.
"""

from __future__ import annotations

import datetime
import ipaddress
import os
import re
import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path

import tomli_w
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID

from shared.bus_keys import RIGHTS, members_in
from shared.bus_rights import ROLES
from shared.errors import UserError
from shared.rig import RigConfig
from station.app.private_key import private_key

AUTHORITY = "authority"
VALID_DAYS = 3650
"""Ten years: a rig is revoked by hand, not by a date that passes in the middle of a session."""

_SECRET, _SHOWN = 0o600, 0o644
"""The modes of a private key, and of what others may read and nobody but the owner may write, whatever the umask is."""

Names = Mapping[str, list[str]]


def new_authority(rig: RigConfig, folder: Path) -> None:
    """Makes an authority and the keys of every process of the rig in a new folder.

    Raises:
        UserError: if the folder exists or cannot be written.
    """
    try:
        folder.mkdir(parents=True, mode=0o700)
    except FileExistsError:
        raise UserError(f"Expected a new folder for the keys, but {folder} exists; choose another --out") from None
    except OSError as error:
        raise UserError(f"Expected to write keys to {folder}, but that failed: {error.strerror}") from error
    (folder / AUTHORITY).mkdir(mode=0o700)
    key = ec.generate_private_key(ec.SECP256R1())
    name = _name(f"{rig.id} authority")
    certificate = (
        _certificate(name, name, key.public_key())
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .sign(key, hashes.SHA256())
    )
    _write(folder / AUTHORITY / "ca.key", _pem(key), mode=_SECRET)
    _write(folder / AUTHORITY / "ca.pem", certificate.public_bytes(serialization.Encoding.PEM))
    for role in ROLES:
        issue(rig, folder, role, f"{role}.1")
    _write_rights(rig, folder, {role: [f"{role}.1"] for role in ROLES})


def revoke(rig: RigConfig, folder: Path, role: str) -> str:
    """Gives a process new keys, and takes the rights of the old ones; the new certificate's name.

    Raises:
        UserError: if the folder is not one that `new_authority` made for this rig, or others may read its key.
    """
    members = members_in(folder / role / RIGHTS, rig.id) if (folder / role / RIGHTS).exists() else None
    if members is None or not (folder / AUTHORITY / "ca.key").exists():
        raise UserError(f"Expected the folder that `station keys new` made, with its authority, got {folder}")
    number = max(int(found[1]) for name in members[role] if (found := re.search(r"\.(\d+)$", name)))
    fresh = f"{role}.{number + 1}"
    private_key(folder / AUTHORITY / "ca.key")  # refused before anything is taken away
    shutil.rmtree(folder / role)
    issue(rig, folder, role, fresh)
    _write_rights(rig, folder, {**members, role: [fresh]})
    return fresh


def issue(rig: RigConfig, folder: Path, role: str, common_name: str) -> None:
    """Makes the keys of a process in a new folder, signed by the folder's authority.

    Raises:
        UserError: if the authority's key is of another kind, or others than its owner may read it.
    """
    ca_key = private_key(folder / AUTHORITY / "ca.key")
    ca = x509.load_pem_x509_certificate((folder / AUTHORITY / "ca.pem").read_bytes())
    key = ec.generate_private_key(ec.SECP256R1())
    certificate = (
        _certificate(_name(common_name), ca.subject, key.public_key())
        .add_extension(x509.SubjectAlternativeName(list(_hosts(rig.bus.endpoint(role)))), critical=False)
        .sign(ca_key, hashes.SHA256())
    )
    own = folder / role
    own.mkdir(mode=0o700)
    _write(own / "key.pem", _pem(key), mode=_SECRET)
    _write(own / "cert.pem", certificate.public_bytes(serialization.Encoding.PEM))
    _write(own / "ca.pem", ca.public_bytes(serialization.Encoding.PEM))


def _hosts(endpoints: Iterable[str]) -> Iterable[x509.GeneralName]:
    """Yields the addresses under which others connect to a process, and this machine's own."""
    named = {"127.0.0.1"} | {endpoint.partition("/")[2].rpartition(":")[0].strip("[]") for endpoint in endpoints}
    for host in sorted(named):
        try:
            yield x509.IPAddress(ipaddress.ip_address(host))
        except ValueError:
            yield x509.DNSName(host)


def _write_rights(rig: RigConfig, folder: Path, members: Names) -> None:
    text = tomli_w.dumps({"rig": rig.id, "members": {role: list(names) for role, names in members.items()}})
    for role in ROLES:
        (folder / role / RIGHTS).unlink(missing_ok=True)
        _write(folder / role / RIGHTS, text.encode())


def _name(common_name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, common_name)])


def _certificate(subject: x509.Name, issuer: x509.Name, key: ec.EllipticCurvePublicKey) -> x509.CertificateBuilder:
    now = datetime.datetime.now(datetime.UTC)
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key)
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - datetime.timedelta(days=1))  # a Pi without a clock's battery may be behind
        .not_valid_after(now + datetime.timedelta(days=VALID_DAYS))
    )


def _pem(key: ec.EllipticCurvePrivateKey) -> bytes:
    return key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )


def _write(path: Path, content: bytes, *, mode: int = _SHOWN) -> None:
    """Writes a new file that has its mode from its first byte on."""
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode), "wb") as file:
        file.write(content)
