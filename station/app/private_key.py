"""Private keys in files: what is not its owner's alone, or no key of ours, is refused in words."""

from __future__ import annotations

from pathlib import Path

from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric import ec

from shared.errors import UserError
from shared.own_files import require_secret


def private_key(path: Path) -> ec.EllipticCurvePrivateKey:
    """Returns the private key in a file.

    Raises:
        UserError: if it cannot be read, others than its owner may read it, or it is of another kind.
    """
    try:
        require_secret(path, what="a private key")
        key = serialization.load_pem_private_key(path.read_bytes(), password=None)
    except OSError as error:
        raise UserError(f"Expected a private key at {path}, but it cannot be read: {error.strerror}") from error
    except (ValueError, TypeError) as error:
        raise UserError(f"Expected a private key without a password (PEM) in {path}, got something else") from error
    if not isinstance(key, ec.EllipticCurvePrivateKey):
        raise UserError(f"Expected an elliptic-curve key in {path}, got another kind")
    return key
