"""An authority and a certificate of it, made for a test."""

import datetime
from pathlib import Path

import pytest


def certificates(directory: Path) -> dict[str, str]:
    """An authority, and a certificate of it for localhost; file names by role."""
    x509 = pytest.importorskip("cryptography.x509")
    from cryptography.hazmat.primitives import hashes, serialization
    from cryptography.hazmat.primitives.asymmetric import ec

    now = datetime.datetime.now(datetime.UTC)

    def write(role: str, issuer: tuple | None) -> tuple:
        key = ec.generate_private_key(ec.SECP256R1())
        name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, role)])
        signer, signer_name = issuer or (key, name)
        builder = (
            x509.CertificateBuilder()
            .subject_name(name)
            .issuer_name(signer_name)
            .public_key(key.public_key())
            .serial_number(x509.random_serial_number())
            .not_valid_before(now - datetime.timedelta(days=1))
            .not_valid_after(now + datetime.timedelta(days=1))
            .add_extension(x509.BasicConstraints(issuer is None, None), critical=True)
            .add_extension(x509.SubjectAlternativeName([x509.DNSName("localhost")]), critical=False)
        )
        cert = builder.sign(signer, hashes.SHA256())
        pem = serialization.Encoding.PEM
        (directory / f"{role}.crt").write_bytes(cert.public_bytes(pem))
        (directory / f"{role}.key").write_bytes(
            key.private_bytes(pem, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
        )
        return key, name

    authority = write("ca", None)
    for role in ("server", "client"):
        write(role, authority)
    return {p.name: str(p) for p in directory.iterdir()}
