"""Keys for encrypted endpoints: `tls/ADDRESS:PORT` in `[bus]` means mutual TLS, and both ends must show a certificate.

The folder that the environment variable REPOSE_KEYS names holds ca.pem (who signs the rig's certificates), cert.pem and
key.pem (this machine's own; the certificate's alternative names hold the address or name that others connect to).
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from shared.errors import UserError

VARIABLE = "REPOSE_KEYS"


def tls_settings(endpoints: Sequence[str], environment: Mapping[str, str] = os.environ) -> dict[str, Any]:
    """Zenoh's settings for these endpoints; empty when none of them is encrypted.

    Raises:
        UserError: if one is and the keys are missing.
    """
    if not any(endpoint.startswith(("tls/", "quic/")) for endpoint in endpoints):
        return {}
    folder = Path(environment.get(VARIABLE, "") or "keys").resolve()
    files = {name: folder / f"{name}.pem" for name in ("ca", "cert", "key")}
    for file in files.values():
        if not os.access(file, os.R_OK):
            raise UserError(
                f"Expected the key file {file} for the encrypted endpoints in [bus], but it cannot be read: "
                f"set {VARIABLE} to the folder of ca.pem, cert.pem and key.pem"
            )
    own = {
        f"{end}_{kind}": str(files[name])
        for end in ("listen", "connect")
        for kind, name in (("certificate", "cert"), ("private_key", "key"))
    }
    return {
        "transport/link/tls": {
            "root_ca_certificate": str(files["ca"]),
            "enable_mtls": True,
            "verify_name_on_connect": True,
            **own,
        }
    }
