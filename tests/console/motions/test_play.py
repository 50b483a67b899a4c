"""The clip player: what its page holds, what its script computes, how it is served and refused."""

import json
import threading
import urllib.error
import urllib.request
from pathlib import Path

import pytest

from console.app import main
from console.motions import play
from tests.support.console.clip_pages import data_of
from world.errors import ClipError, ConfigError
from world.motions import load
from world.motions.objects import Seat


def test_raw_clips_get_what_they_use(folder: Path) -> None:
    found = {clip.name: clip for clip in play.clips([str(folder)], None)}
    assert [name for name, clip in found.items() if isinstance(clip.seat, Seat)] == [
        name for name in found if name.startswith("sit")
    ]
    with pytest.raises(ClipError, match="no clip's name holds 'zebra'; there are sit"):
        play.clips([str(folder)], "zebra")


def test_the_page_is_served_and_nothing_else() -> None:
    with play.server("127.0.0.1:0", "<p>é") as running:
        threading.Thread(target=running.serve_forever, daemon=True).start()
        address = f"http://127.0.0.1:{running.server_address[1]}"
        with urllib.request.urlopen(f"{address}/", timeout=10) as answer:
            assert answer.read().decode() == "<p>é"
        with pytest.raises(urllib.error.HTTPError, match="404"):
            urllib.request.urlopen(f"{address}/etc/passwd", timeout=10)
        running.shutdown()
        with pytest.raises(ConfigError, match="cannot listen on"):
            play.server(f"127.0.0.1:{running.server_address[1]}", "")
    for wrong in ("nowhere", "127.0.0.1:x", "127.0.0.1:99999"):
        with pytest.raises(ConfigError, match="HOST:PORT"):
            play.server(wrong, "")


def test_the_page_is_served_by_ipv6() -> None:
    with play.server("[::1]:0", "page") as running:
        threading.Thread(target=running.serve_forever, daemon=True).start()
        address = f"http://[::1]:{running.server_address[1]}/"
        direct = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        with direct.open(address, timeout=10) as answer:
            assert answer.read() == b"page"
        running.shutdown()
    with pytest.raises(ConfigError, match=r"write IPv6 in brackets, as \[::1\]:8080"):
        play.server("::1:8080", "")


def test_the_commands_by_hand(
    tmp_path: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "sub" / "clips.html"
    assert main(["motions", "play", str(folder), "--html", str(out)]) == 0
    assert "2 clips" in capsys.readouterr().out
    assert len(data_of(out.read_text())["clips"]) == 2
    assert [p.name for p in out.parent.iterdir()] == ["clips.html"]
    assert main(["motions", "list", str(folder), "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert {row["uses"] for row in rows} == {"seat", None}
    assert main(["motions", "play", str(tmp_path / "none")]) == 2
    error = capsys.readouterr().err
    assert "no such file or folder" in error and error.count("\n") == 1


def test_own_clips_are_all_playable() -> None:
    every = load.own_clips()
    kinds = {
        kind: sum(clip.seconds for clip in every if getattr(clip, kind) is not None)
        for kind in ("seat", "bed", "box")
    }
    assert min(kinds.values()) > 240
    assert sum(kinds.values()) > 600
