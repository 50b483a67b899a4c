"""Checks of `inhabit doctor` beyond this process: a Ray cluster and services."""

import importlib.metadata
import json
import os
import subprocess
import sys
from pathlib import Path

from console.doctor.finding import Finding
from rpc.channel import ChannelConfig
from rpc.probe import check_health
from world.surroundings import home

JOIN_S = 120.0
#: Joins the cluster in a process of its own, because Ray fixes its authentication at import.
_JOIN = """
import json, sys
import ray
ray.init(address=sys.argv[1], log_to_driver=False, logging_level="ERROR")
nodes = [n for n in ray.nodes() if n["Alive"]]
found = ray.cluster_resources()
print(json.dumps({"nodes": len(nodes), "cpus": int(found.get("CPU", 0)),
                  "gpus": int(found.get("GPU", 0))}))
"""


def find_ray(address: str | None = None) -> Finding:
    """Check the local Ray and, with an address, the cluster and its authentication."""
    version = f"{importlib.metadata.version('ray')}, {token()}"
    inherited = None if address else os.environ.get("RAY_ADDRESS")
    address = address or inherited
    if not address:
        return Finding("ray", "ok", f"{version}; no --address: a training starts its own")
    from actors.cluster import require_listener

    require_listener(address, inherited is not None)
    found, why = cluster_size(address, {})
    if found is None:
        return Finding("ray", "bad", f"{version}; {address}: {why}")
    size = f"{found['nodes']} nodes, {found['cpus']} CPU slots, {found['gpus']} GPUs"
    detail = f"{version}; {address}: {size}"
    open_size, _ = cluster_size(address, {"RAY_AUTH_MODE": "disabled"})
    if open_size is not None:
        return Finding(
            "ray", "mind", f"{detail}; without authentication: start it with RAY_AUTH_MODE=token",
            slots=found["cpus"],
        )  # fmt: skip
    return Finding("ray", "ok", f"{detail}; accepts our token, needs one", slots=found["cpus"])


def token() -> str:
    """Return the source of Ray's token as text, without the token."""
    mode = os.environ.get("RAY_AUTH_MODE", "")
    if mode.lower() == "disabled":
        return "RAY_AUTH_MODE=disabled: no token is sent"
    if os.environ.get("RAY_AUTH_TOKEN"):
        return "token from RAY_AUTH_TOKEN"
    named = os.environ.get("RAY_AUTH_TOKEN_PATH")
    own = home()
    file = Path(named) if named else None if own is None else own / ".ray" / "auth_token"
    if file is not None and file.exists():
        return f"token from {file}"
    return "no token (`ray get-auth-token --generate` makes one)"


def cluster_size(address: str, environment: dict[str, str]) -> tuple[dict[str, int] | None, str]:
    """Return the size of the cluster at an address, or None and why it cannot be joined."""
    try:
        done = subprocess.run(
            [sys.executable, "-c", _JOIN, address],
            env=os.environ | {"RAY_USAGE_STATS_ENABLED": "0"} | environment,
            capture_output=True,
            text=True,
            timeout=JOIN_S,
        )
    except subprocess.TimeoutExpired:
        return None, f"no answer within {JOIN_S:g} s (another token, or another version of Ray?)"
    if done.returncode:
        lines = done.stderr.strip().splitlines()
        return None, lines[-1] if lines else f"ended with {done.returncode}"
    return json.loads(done.stdout.strip().splitlines()[-1]), ""


def find_service(
    name: str, address: str, ca: Path | None, cert: Path | None, key: Path | None
) -> Finding:
    """Check a service's health; RpcError for an unhealthy or unreachable one."""
    config = ChannelConfig(
        address=address, tls_ca=str(ca or ""), tls_cert=str(cert or ""), tls_key=str(key or "")
    )
    spent = check_health(config, f"rpc.v1.{name.capitalize()}")
    return Finding(name, "ok", f"{address} serves, reply after {1e3 * spent:.0f} ms")
