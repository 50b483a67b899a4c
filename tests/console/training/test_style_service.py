"""A style service made a training's own: how it is reached, and settings that differ."""

import json
from dataclasses import asdict, replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from console.commands.training import StyleAddress
from console.run.experiment import PRESETS
from console.training import style_service
from discriminator.errors import StyleError


def test_flags_set_the_address() -> None:
    style = StyleAddress("host:1", tls_ca=Path("ca"), token_file=Path("token"))
    found = style_service.channel_config(style)
    assert (found.address, found.tls_ca, found.token_file) == ("host:1", "ca", "token")
    assert found.tls_cert == found.tls_key == ""


def test_other_settings_are_refused_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
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
        style_service.attached(StyleAddress("host:1"), experiment, print),
    ):
        pass
    assert closed
