"""The files of deploy/: valid, consistent with each other, the package and what it serves."""

import asyncio
import copy
import json
import re
import socket
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import grpc
import pytest
import yaml

from console.app import parse
from console.commands import Demo, Serve, Style, Train
from console.serving.loading import source
from discriminator.service import start
from discriminator.trainer import Discriminator
from policy.service.servicer import serving
from rpc.channel import ChannelConfig
from rpc.errors import RpcError
from rpc.probe import check_health
from rpc.server import ServerConfig
from rpc.v1 import style_pb2, style_pb2_grpc
from tests.support.paths import ROOT
from tests.support.style_cases import SMALL, Mocap

DEPLOY = ROOT / "deploy"
KUBERAY = DEPLOY / "kuberay"


def documents(path: Path) -> list[dict[str, Any]]:
    return [document for document in yaml.safe_load_all(path.read_text()) if document]


def of_kind(path: Path, kind: str) -> dict[str, dict[str, Any]]:
    return {d["metadata"]["name"]: d for d in documents(path) if d["kind"] == kind}


def rayjob() -> dict[str, Any]:
    return of_kind(KUBERAY / "rayjob.yaml", "RayJob")["inhabit-sit"]


def groups(job: dict[str, Any]) -> dict[str, dict[str, Any]]:
    cluster = job["spec"]["rayClusterSpec"]
    return {"head": cluster["headGroupSpec"]} | {
        group["groupName"]: group for group in cluster["workerGroupSpecs"]
    }


def pods() -> Iterator[tuple[str, dict[str, Any]]]:
    """Every pod template of the manifests."""
    for name, group in groups(rayjob()).items():
        yield name, group["template"]
    for name, deployment in of_kind(KUBERAY / "services.yaml", "Deployment").items():
        yield name, deployment["spec"]["template"]


def train_command(entrypoint: str) -> Train:
    words = entrypoint.split()
    assert words[:3] == ["python", "-m", "console"]
    return parse(words[3:])


def test_every_yaml_file_is_yaml() -> None:
    files = sorted(DEPLOY.rglob("*.yaml"))
    assert len(files) >= 6
    for file in files:
        assert documents(file), file


def test_the_job_trains_with_token_authentication() -> None:
    spec = rayjob()["spec"]
    assert rayjob()["apiVersion"] == "ray.io/v1"
    cluster = spec["rayClusterSpec"]
    assert cluster["authOptions"] == {"mode": "token"}
    pinned = re.search(r"^ray==(.+)$", (ROOT / "constraints.txt").read_text(), re.M)
    assert pinned and cluster["rayVersion"] == pinned[1]
    command = train_command(spec["entrypoint"])
    found = groups(rayjob())
    assert command.runner == "ray" and command.actors == 60 and str(command.run) == "/runs/sit"
    assert command.experiment.scenes == 64 * 60
    actors = found["actors"]
    slots = int(actors["rayStartParams"]["num-cpus"]) * actors["replicas"]
    learner = found["learner"]
    assert found["head"]["rayStartParams"]["num-cpus"] == "0"
    # The driver's slots are the learner's; actors fill the rest.
    free = int(learner["rayStartParams"]["num-cpus"]) - spec["entrypointNumCpus"]
    assert slots + free >= command.actors and free == 0
    wanted = json.loads(spec["entrypointResources"])
    assert (
        json.loads(json.loads(learner["rayStartParams"]["resources"])) == wanted == {"learner": 1}
    )


def test_pods_are_bounded_and_unprivileged() -> None:
    for name, template in pods():
        assert template["spec"]["securityContext"]["runAsNonRoot"] is True, name
        for container in template["spec"]["containers"]:
            resources = container["resources"]
            assert resources["requests"] == resources["limits"], name
            assert set(resources["limits"]) == {"cpu", "memory"}, name
            assert container["securityContext"]["allowPrivilegeEscalation"] is False, name
            mounted = {mount["name"] for mount in container.get("volumeMounts", ())}
            offered = {volume["name"] for volume in template["spec"].get("volumes", ())}
            assert mounted == offered, name
            assert len({port["containerPort"] for port in container["ports"]}) == len(
                container["ports"]
            )


def test_services_start_protected_and_are_probed_where_they_listen() -> None:
    deployments = of_kind(KUBERAY / "services.yaml", "Deployment")
    services = of_kind(KUBERAY / "services.yaml", "Service")
    for name, kind, full in [
        ("inhabit-style", Style, "rpc.v1.Style"),
        ("inhabit-policy", Serve, "rpc.v1.Policy"),
    ]:
        container = deployments[name]["spec"]["template"]["spec"]["containers"][0]
        assert container["command"] == ["inhabit"]
        command = parse(container["args"])
        assert isinstance(command, kind)
        assert command.tls_cert and command.tls_key and command.token_file
        assert not command.allow_insecure_remote
        ports = {port["name"]: port["containerPort"] for port in container["ports"]}
        listening = {"grpc": command.listen, "health": command.health, "metrics": command.metrics}
        assert ports == {key: int(str(at).rpartition(":")[2]) for key, at in listening.items()}
        for probe in ("startupProbe", "readinessProbe", "livenessProbe"):
            assert container[probe]["grpc"]["port"] == ports["health"]
        assert container["readinessProbe"]["grpc"]["service"] == full
        assert services[name]["spec"]["selector"] == {"app": name}
        labels = deployments[name]["spec"]["template"]["metadata"]["labels"]
        assert labels == deployments[name]["spec"]["selector"]["matchLabels"] == {"app": name}
        outward = {port["targetPort"] for port in services[name]["spec"]["ports"]}
        assert outward == {"grpc", "metrics"}
    style = deployments["inhabit-style"]["spec"]
    assert style["replicas"] == 1 and style["strategy"] == {"type": "Recreate"}


def test_kubernetes_takes_the_manifests() -> None:
    """Against the published schemas; Ray's own kinds are not among them, their pods are."""
    validate = pytest.importorskip("kubernetes_validate")
    version = "1.33"
    for file in (KUBERAY / "services.yaml", KUBERAY / "rayjob.yaml"):
        for document in documents(file):
            if not document["apiVersion"].startswith("ray.io/"):
                validate.validate(document, version, strict=True)
    for name, template in pods():
        pod = {"apiVersion": "v1", "kind": "Pod", "metadata": {"name": name}}
        validate.validate(pod | {"spec": template["spec"]}, version, strict=True)
    broken = copy.deepcopy(dict(pods())["actors"]["spec"])
    broken["containers"][0]["resources"]["requests"] = "much"
    with pytest.raises(validate.ValidationError):
        validate.validate(pod | {"spec": broken}, version, strict=True)


def test_the_gpu_variant_changes_the_learner_alone() -> None:
    overlay = documents(KUBERAY / "gpu" / "kustomization.yaml")[0]
    assert (KUBERAY / "gpu" / overlay["resources"][0] / "kustomization.yaml").exists()
    target = overlay["patches"][0]["target"]
    job = rayjob()
    assert target == {"kind": job["kind"], "name": job["metadata"]["name"]}
    for change in yaml.safe_load(overlay["patches"][0]["patch"]):
        *way, last = [part.replace("~1", "/") for part in change["path"].split("/")[1:]]
        place: Any = job
        for part in way:
            place = place[int(part)] if isinstance(place, list) else place[part]
        assert change["op"] == "add" and last not in place
        place[last] = change["value"]
    changed, before = groups(job), groups(rayjob())
    assert changed["actors"] == before["actors"] and changed["head"] == before["head"]
    learner = changed["learner"]
    limits = learner["template"]["spec"]["containers"][0]["resources"]["limits"]
    assert limits["nvidia.com/gpu"] == learner["rayStartParams"]["num-gpus"] == "1"
    assert job["spec"]["entrypointNumGpus"] == 1


def test_the_cluster_file_authenticates_and_keeps_the_dashboard_in() -> None:
    cluster = documents(DEPLOY / "cluster.yaml")[0]
    assert {"cluster_name", "provider", "auth", "file_mounts"} <= set(cluster)
    assert cluster["max_workers"] == len(cluster["provider"]["worker_ips"])
    assert "~/.ray/auth_token" in cluster["file_mounts"]
    head, worker = (
        next(line for line in cluster[f"{role}_start_ray_commands"] if "ray start" in line)
        for role in ("head", "worker")
    )
    for line in (head, worker):
        assert "RAY_AUTH_MODE=token" in line
    assert "--dashboard-host=127.0.0.1" in head and "--head" in head
    assert "--address=$RAY_HEAD_IP:6379" in worker and "--port=6379" in head


@pytest.mark.parametrize("name", ["actor", "demo", "learner"])
def test_images_install_what_was_tested(name: str) -> None:
    text = (DEPLOY / f"{name}.Dockerfile").read_text()
    lines = text.replace("\\\n", " ").splitlines()
    installs = [line for line in lines if line.startswith("RUN pip")]
    torch = re.search(r"^torch==\S+$", (ROOT / "constraints.txt").read_text(), re.M)
    assert torch and len(installs) == 1
    assert all("-c constraints.txt" in part for part in installs[0].split("&&"))
    assert torch[0] in installs[0] and "index-url" not in text
    copied = {word for line in lines if line.startswith("COPY ") for word in line.split()[1:-1]}
    assert {"pyproject.toml", "constraints.txt"} <= copied
    packages = re.search(r"packages = \[(.+?)\]", (ROOT / "pyproject.toml").read_text(), re.S)
    assert packages
    rooms = {found.partition(".")[0] for found in re.findall(r'"([\w.]+)"', packages[1])}
    assert rooms <= copied
    assert all((ROOT / path).exists() for path in copied)
    users = [line for line in lines if line.startswith("USER ")]
    assert users == ["USER 1000"] and "latest" not in text


def test_the_image_of_the_demo_runs_it() -> None:
    lines = (DEPLOY / "demo.Dockerfile").read_text().splitlines()
    (entry,) = [line for line in lines if line.startswith("ENTRYPOINT ")]
    words = json.loads(entry.removeprefix("ENTRYPOINT "))
    assert words[0] == "inhabit"
    found = parse(words[1:])
    assert isinstance(found, Demo) and not found.open and found.allow_insecure_remote
    port = found.listen.rpartition(":")[2]
    assert f"EXPOSE {port}" in lines
    ran = [line for line in lines if line.startswith("#   docker run")]
    assert len(ran) == 2 and all(f"-p 127.0.0.1:{port}:{port} " in line for line in ran)
    (more,) = (line.partition(" inhabit-demo ")[2] for line in ran if "/app/" in line)
    for folder in parse([*words[1:], *more.split()]).policies:
        assert (ROOT / Path(folder).relative_to("/app") / "policy.safetensors").exists()


def metrics_of_dashboard() -> set[str]:
    board = json.loads((DEPLOY / "grafana" / "services.json").read_text())
    queries = [target["expr"] for panel in board["panels"] for target in panel["targets"]]
    return {name for query in queries for name in re.findall(r"\b(?:rpc|style|policy)_\w+", query)}


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def scraped(address: str) -> set[str]:
    """The series of a live endpoint, by their names in queries."""
    with urllib.request.urlopen(f"http://{address}/metrics", timeout=60) as page:
        typed = dict(re.findall(r"^# TYPE (\S+) (\S+)$", page.read().decode(), re.M))
    series = set(typed)
    for name, kind in typed.items():
        if kind == "histogram":
            series |= {f"{name}_{part}" for part in ("bucket", "count", "sum")}
    return series


def healthy(address: str, service: str) -> bool:
    return check_health(ChannelConfig(address), service, timeout_s=60) > 0


def test_the_dashboard_asks_for_metrics_that_services_expose() -> None:
    style_at, policy_at = (f"127.0.0.1:{free_port()}" for _ in range(2))
    style = start(
        Discriminator(SMALL, Mocap(), 0), ServerConfig(metrics=style_at, health="127.0.0.1:0")
    )
    try:
        assert healthy(style.health_address, "rpc.v1.Style")
        series = scraped(style_at)
    finally:
        style.drain()

    async def policy() -> set[str]:
        sources = [source("sit", ROOT / "pretrained" / "sit", "best")]
        config = ServerConfig(metrics=policy_at, health="127.0.0.1:0", drain_s=1)
        async with serving(sources, config) as (server, _):
            at = server.health_address
            assert await asyncio.to_thread(healthy, at, "rpc.v1.Policy")
            with pytest.raises(RpcError, match=r"serves no rpc\.v1\.Style"):
                await asyncio.to_thread(healthy, at, "rpc.v1.Style")
            return await asyncio.to_thread(scraped, policy_at)

    series |= asyncio.run(policy())
    asked = metrics_of_dashboard()
    assert len(asked) >= 12
    assert asked <= series, sorted(asked - series)


def test_the_health_port_answers_nothing_but_health(tmp_path: Path) -> None:
    token = tmp_path / "token"
    token.write_text("s3cret")
    server = start(
        Discriminator(SMALL, Mocap(), 0), ServerConfig(token_file=str(token), health="127.0.0.1:0")
    )
    try:
        assert healthy(server.health_address, "")
        with grpc.insecure_channel(server.health_address) as channel:
            with pytest.raises(grpc.RpcError) as caught:
                style_pb2_grpc.StyleStub(channel).Status(style_pb2.StatusRequest(), timeout=60)
            assert isinstance(caught.value, grpc.Call)
            assert caught.value.code() is grpc.StatusCode.UNIMPLEMENTED
    finally:
        server.drain()
    with pytest.raises(RpcError, match="does not answer"):
        check_health(ChannelConfig(server.health_address), timeout_s=60)


def test_the_panels_have_places_and_names_of_their_own() -> None:
    board = json.loads((DEPLOY / "grafana" / "services.json").read_text())
    ids = [panel["id"] for panel in board["panels"]]
    places = [(panel["gridPos"]["x"], panel["gridPos"]["y"]) for panel in board["panels"]]
    assert len(set(ids)) == len(set(places)) == len(ids)
    assert all(
        panel["title"] and panel["fieldConfig"]["defaults"]["unit"] for panel in board["panels"]
    )


def test_prometheus_scrapes_where_the_services_listen() -> None:
    scrapes = documents(DEPLOY / "prometheus" / "prometheus.yaml")[0]["scrape_configs"]
    local = {
        s["job_name"]: s["static_configs"][0]["targets"][0]
        for s in scrapes
        if "static_configs" in s
    }
    deployments = of_kind(KUBERAY / "services.yaml", "Deployment")
    for job, target in local.items():
        args = deployments[f"inhabit-{job}"]["spec"]["template"]["spec"]["containers"][0]["args"]
        assert parse(args).metrics.rpartition(":")[2] == target.rpartition(":")[2]
    monitors = documents(KUBERAY / "monitors.yaml")
    assert [m["kind"] for m in monitors] == ["ServiceMonitor", "PodMonitor"]
    watched = monitors[0]["spec"]["selector"]["matchExpressions"][0]["values"]
    assert set(watched) == set(deployments)
    for group in groups(rayjob()).values():
        ports = group["template"]["spec"]["containers"][0]["ports"]
        assert {"containerPort": 8080, "name": "metrics"} in ports
