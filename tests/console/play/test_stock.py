"""What the player can choose from."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from console.kinds.box import BOX
from console.play.stock import load
from tests.support.console.players import stock
from tests.support.paths import ROOT
from world.errors import ChoiceError, ConfigError
from world.scene.box import BOX_SIZE_M

SIT = str(ROOT / "pretrained/sit")


def test_each_policy_has_its_pieces() -> None:
    found = stock()
    assert list(found.pieces("carry")) == [BOX]
    assert all(piece.sit for piece in found.pieces("sit").values())
    assert all(piece.lie for piece in found.pieces("lie").values())
    assert found.piece("carry", BOX, 1.2).size_m == pytest.approx([1.2 * e for e in BOX_SIZE_M])
    name = next(iter(found.pieces("sit")))
    plain, small = found.piece("sit", name, 1.0), found.piece("sit", name, 0.8)
    assert small.size_m[2] == pytest.approx(0.8 * plain.size_m[2])
    assert found.first().policy == "sit" and found.first().piece == name
    with pytest.raises(ChoiceError, match="unknown policy 'fly'"):
        found.pieces("fly")


def test_runs_are_named_by_task_or_flag(monkeypatch: pytest.MonkeyPatch) -> None:
    served = SimpleNamespace(check=lambda: None)
    monkeypatch.setattr("console.play.stock.loading.served", lambda name, path: served)
    assert list(load([SIT, f"other={SIT}"], "best", "test").policies) == ["sit", "other"]
    with pytest.raises(ConfigError, match=r"two policies have the name 'sit': .* sit2="):
        load([SIT, SIT], "best", "test")
    with pytest.raises(ConfigError, match="must be RUN or NAME=RUN"):
        load([f"={SIT}"], "best", "test")


def test_what_is_no_run_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(Exception, match=str(tmp_path)) as caught:
        load([str(tmp_path)], "best", "test")
    assert "\n" not in str(caught.value)
