"""Signs recordings with a rig's key, and says who signed one.

The signature stands beside the recording, in `FILE.mcap.sig`: the recording itself is not touched, so every reader
reads it as before. It is a JSON object with the SHA-256 of the file, the time of signing, the certificate and an ECDSA
signature of the three. Whoever has the authority's certificate (`ca.pem`) and rights.toml can tell whose it is.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from cryptography import x509
from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID

from shared.bus_keys import RIGHTS, own_keys, require_own
from shared.config import load_table
from shared.errors import UserError
from station.app.private_key import private_key
from station.app.signature import Signature, file_sha256, signature_path

SIGNER = "station"
"""The process that records, and so the one whose keys count: those of the Pi, which lies in the open, do not."""
_FORMAT = "repose-signature-1"
_SIGNED = ("format", "sha256", "signed_ns", "certificate")
_MOST_BYTES = 100_000
"""A signature has some 1 500 bytes; a larger file is something else."""


def sign(recording: Path, keys: Path, *, now_ns: int) -> Path:
    """Signs a recording with the station's key; gives the signature's path.

    Raises:
        UserError: if the key is missing, readable by others, or not the one of the certificate.
    """
    folder = own_keys(keys, SIGNER)
    certificate, key = _certificate_in(folder / "cert.pem"), private_key(folder / "key.pem")
    if _public_key(certificate) != key.public_key():
        raise UserError(f"Expected the key of cert.pem in {folder}, got the key of another certificate")
    signed: dict[str, str | int] = {
        "format": _FORMAT,
        "sha256": file_sha256(recording),
        "signed_ns": now_ns,
        "certificate": certificate.public_bytes(serialization.Encoding.PEM).decode(),
    }
    signature = key.sign(_bytes(signed), ec.ECDSA(hashes.SHA256()))
    target = signature_path(recording)
    text = json.dumps({**signed, "signature": base64.b64encode(signature).decode()}, indent=1) + "\n"
    try:
        target.write_text(text, encoding="utf-8")
    except OSError as error:
        raise UserError(f"Expected to write {target}, but that failed: {error.strerror}") from error
    return target


def signature_of(recording: Path, *, sha256: str, keys: Path | None) -> Signature:
    """Returns the signer of a recording whose file has that SHA-256, and whether the signature holds.

    `keys` is the folder of the rig's keys, whose authority and rights decide who counts; without it a signature is
    known to hold, but not whose it is.

    Raises:
        UserError: if the file beside the recording is no signature, or the keys cannot be read, or others than their
            owner may write to them.
    """
    signed, certificate, signature = _parsed(signature_path(recording))
    name = _common_name(certificate)
    found = Signature(name, certificate.fingerprint(hashes.SHA256()).hex(), int(signed["signed_ns"]), keys is not None)
    fault = _broken(signed, certificate, signature, sha256=sha256)
    if not fault and keys is not None:
        fault = _stranger(certificate, name, keys, signed_ns=found.signed_ns)
    return replace(found, fault=fault)


def _broken(signed: dict[str, str | int], certificate: x509.Certificate, signature: bytes, *, sha256: str) -> str:
    key = _public_key(certificate)
    if key is None:
        return "its certificate has another kind of key than the rig's"
    try:
        key.verify(signature, _bytes(signed), ec.ECDSA(hashes.SHA256()))
    except InvalidSignature:
        return "the signature is not of this certificate"
    return "" if signed["sha256"] == sha256 else "the file was changed after it was signed"


def _stranger(certificate: x509.Certificate, name: str, keys: Path, *, signed_ns: int) -> str:
    """Returns the reason why a certificate does not count by the authority and rights in a folder of keys.

    It is empty if the certificate counts.
    """
    folder = own_keys(keys, SIGNER)
    authority = _certificate_in(folder / "ca.pem")
    require_own(keys, folder, folder / "ca.pem")
    try:
        certificate.verify_directly_issued_by(authority)
    except (ValueError, TypeError, InvalidSignature, UnsupportedAlgorithm):
        return f"its certificate is not of the authority in {folder}"
    at = _time(signed_ns)
    if at is None or not certificate.not_valid_before_utc <= at <= certificate.not_valid_after_utc:
        return "its certificate was not valid when it was signed"
    if not (folder / RIGHTS).exists():
        return ""
    require_own(folder / RIGHTS)
    members = load_table(folder / RIGHTS).values.get("members")
    named = members.get(SIGNER, ()) if isinstance(members, dict) else ()
    return "" if isinstance(named, list) and name in named else f"{name} is not, or no longer, the {SIGNER} of the rig"


def _time(stamp_ns: int) -> datetime | None:
    try:
        return datetime.fromtimestamp(stamp_ns / 1e9, UTC)
    except (OverflowError, ValueError, OSError):
        return None


def _parsed(path: Path) -> tuple[dict[str, str | int], x509.Certificate, bytes]:
    try:
        with path.open("rb") as file:
            values = json.loads(file.read(_MOST_BYTES))
        signed = {name: values[name] for name in _SIGNED}
        good = (
            signed["format"] == _FORMAT and isinstance(signed["signed_ns"], int) and isinstance(signed["sha256"], str)
        )
        certificate = _certificate_of(signed["certificate"].encode())
        signature = base64.b64decode(values["signature"], validate=True)
    except OSError as error:
        raise UserError(f"Expected a signature at {path}, but it cannot be read: {error.strerror}") from error
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise UserError(f"{path}: expected a signature as `station keys sign` writes it, got something else") from error
    if not good:
        raise UserError(f"{path}: expected a signature of the format {_FORMAT}, got another one")
    return signed, certificate, signature


def _certificate_of(pem: bytes) -> x509.Certificate:
    """Returns a certificate whose names and times can be read: the library looks at them only when they are asked for.

    Raises:
        ValueError: if it is none.
    """
    try:
        found = x509.load_pem_x509_certificate(pem)
    except x509.InvalidVersion as error:  # no ValueError
        raise ValueError(str(error)) from error
    _ = (found.subject, found.issuer, found.not_valid_before_utc, found.not_valid_after_utc)
    return found


def _certificate_in(path: Path) -> x509.Certificate:
    try:
        return _certificate_of(path.read_bytes())
    except OSError as error:
        raise UserError(f"Expected a certificate at {path}, but it cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise UserError(f"Expected a certificate (PEM) in {path}, got something else") from error


def _public_key(certificate: x509.Certificate) -> ec.EllipticCurvePublicKey | None:
    """Returns a certificate's key; None if it is of another kind, or none at all."""
    try:
        key = certificate.public_key()
    except (ValueError, UnsupportedAlgorithm):
        return None
    return key if isinstance(key, ec.EllipticCurvePublicKey) else None


def _common_name(certificate: x509.Certificate) -> str:
    names = certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    return str(names[0].value) if names else "a certificate without a name"


def _bytes(signed: Mapping[str, str | int]) -> bytes:
    return json.dumps(signed, sort_keys=True).encode()
