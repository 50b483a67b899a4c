"""A style service made a training's own: how it is reached, and settings that differ."""

import json
import stat
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from console.commands.training import StyleAddress
from console.run.directory import RunDirectory, RunError
from console.run.experiment import PRESETS
from console.training import style_service
from discriminator.client import MOCAP_MEAN
from discriminator.errors import StyleError
from world.errors import ConfigError


def test_flags_set_the_address() -> None:
    style = StyleAddress("host:1", tls_ca=Path("ca"), token_file=Path("token"))
    found = style_service.channel_config(style)
    assert (found.address, found.tls_ca, found.token_file) == ("host:1", "ca", "token")
    assert found.tls_cert == found.tls_key == ""


def test_other_settings_are_refused_by_name(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    experiment = PRESETS["fast"]
    theirs = replace(experiment.style, batch=7)
    closed = []
    client = SimpleNamespace(
        status=lambda: SimpleNamespace(config=json.dumps(asdict(theirs))),
        close=lambda: closed.append(True),
    )
    monkeypatch.setattr(style_service, "StyleClient", lambda config, say, training: client)
    with (
        pytest.raises(StyleError, match=r"other settings: style\.batch: 7 -> 1024 \(start it"),
        style_service.attached(StyleAddress("host:1"), experiment, print, RunDirectory(tmp_path)),
    ):
        pass
    assert closed


def test_a_service_with_other_mocap_is_refused(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A state of this training would load there, and train on the wrong demonstrations."""
    experiment = PRESETS["fast"]
    loaded = []

    def service(mean: list[float]) -> Callable[..., SimpleNamespace]:
        config = json.dumps(asdict(experiment.style) | {MOCAP_MEAN: mean})
        return lambda config_, say, training: SimpleNamespace(
            status=lambda: SimpleNamespace(config=config),
            load_state_dict=loaded.append,
            close=lambda: None,
        )

    own = SimpleNamespace(mocap_mean=[0.5, 1.5], state_dict=dict)
    monkeypatch.setattr(style_service.assembly, "discriminator", lambda experiment: own)
    run = RunDirectory(tmp_path)
    monkeypatch.setattr(style_service, "StyleClient", service([0.5, 1.6]))
    with (
        pytest.raises(StyleError, match="host:1 has other clips, or another seed"),
        style_service.attached(StyleAddress("host:1"), experiment, print, run),
    ):
        pass
    assert not loaded
    monkeypatch.setattr(style_service, "StyleClient", service([0.5, 1.5 + 1e-6]))
    with style_service.attached(StyleAddress("host:1"), experiment, print, run):
        assert loaded == [{}]


def test_a_run_keeps_its_secret_from_others_and_shows_it_again_when_it_resumes(
    tmp_path: Path,
) -> None:
    one, other = RunDirectory(tmp_path / "one"), RunDirectory(tmp_path / "other")
    secret = style_service.secret_of(one)
    assert len(secret) == 32 and style_service.secret_of(one) == secret
    assert style_service.secret_of(other) != secret
    (path,) = one.path.iterdir()
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    path.write_text("short")
    with pytest.raises(RunError, match="is damaged: remove it"):
        style_service.secret_of(one)


@pytest.mark.parametrize(
    ("address", "token", "said"),
    [
        ("nowhere", "", "--style-service: address 'nowhere': must be HOST:PORT"),
        ("127.0.0.1:1", "empty", "--style-service: token file .*: must hold one line"),
        ("10.0.0.1:1", "token", "--style-service: 10.0.0.1:1: a token is not shown to another"),
    ],
)
def test_what_cannot_be_reached_is_wrong_usage_before_a_run(
    address: str, token: str, said: str, tmp_path: Path
) -> None:
    (tmp_path / "empty").write_text("\n")
    (tmp_path / "token").write_text("s3cret\n")
    style = StyleAddress(address, token_file=tmp_path / token if token else None)
    with pytest.raises(ConfigError, match=said):
        style_service.require(style)
    style_service.require(StyleAddress("127.0.0.1:1", token_file=tmp_path / "token"))
    style_service.require(StyleAddress("10.0.0.1:1", Path("ca"), token_file=tmp_path / "token"))
