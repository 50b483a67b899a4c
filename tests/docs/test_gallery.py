"""The gallery: small, complete, of the policies that are committed, and honest in its choices."""

import json
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from docs.generate import gallery
from docs.generate.gallery import ENTRIES, FOLDER, FOLLOWED, MOST, MOST_OF_ALL, Run
from policy.checkpoints.format import read_manifest
from tests.support.console.recordings import take
from tests.support.paths import ROOT
from world.character import model as character
from world.errors import ConfigError
from world.scene.model import compile_scene

FACTS = json.loads((FOLDER / "entries.json").read_text())


def test_every_entry_is_there_and_small() -> None:
    every = (*ENTRIES, *FOLLOWED)
    sizes = {entry.name: (FOLDER / f"{entry.name}.html").stat().st_size for entry in every}
    assert list(FACTS) == [entry.name for entry in every]
    assert max(sizes.values()) <= MOST and sum(sizes.values()) <= MOST_OF_ALL
    assert {path.stem for path in FOLDER.glob("*.html")} == set(sizes)
    for entry in every:
        text = (FOLDER / f"{entry.name}.html").read_text()
        assert '<script src="viewer.js"></script>' in text and "class Viewer" not in text
        assert text.count("data-take=") == len(FACTS[entry.name]["shown"]) > 0


def test_it_shows_the_committed_policies() -> None:
    for name, fact in FACTS.items():
        manifest = read_manifest(ROOT / "pretrained" / fact["policy"])
        assert fact["iteration"] == manifest.iteration, (
            f"{name} shows another policy: run python -m docs.generate.gallery {name}"
        )


def test_worst_cases_of_every_task_are_shown() -> None:
    policies = {fact["policy"] for fact in FACTS.values()}
    assert policies == {"sit-free", "lie-free", "carry", "walk", "track", "track-sit"}
    for policy in policies:
        worst = FACTS[policy.removesuffix("-free")]["shown"]["worst"]
        assert "reached" not in worst and "to its end" not in worst, "it is a failure"


def test_an_unknown_entry_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"sit-free: no such entry; there are carry, lie, .*walk"):
        gallery.make(("walk", "sit-free"), ())


def run(success: list[bool], time_s: list[float], disturbed: list[int]) -> Run:
    """A run of trials by hand: those without success are 1 m, 2 m, ... away."""
    n = len(success)
    reached = np.array(success)
    outcomes: Any = SimpleNamespace(
        success=reached,
        sustained=reached,
        fell=~reached,
        time_s=np.where(reached, time_s, np.nan),
    )
    results: Any = SimpleNamespace(
        error_m=np.arange(1.0, n + 1)[:, None] * np.ones((n, 5)), disturbed=np.array(disturbed)
    )
    pieces = [SimpleNamespace(size_m=(0.5, 0.4 + i, 0.8), sit=[SimpleNamespace(
        point_m=(0.0, 0.0, 0.6 - 0.1 * i))]) for i in range(n)]  # fmt: skip
    chosen: Any = SimpleNamespace(pieces=pieces, scale=np.ones(n))
    return Run(chosen, results, outcomes)


def test_choices_by_hand() -> None:
    found = run([True, False, True, True, False], [5, 0, 3, 4, 0], [2, 9, 7, 3, 4])
    assert found.ranked() == [2, 3, 0, 1, 4]
    assert gallery.typical(found) == {"best": 2, "median": 0, "worst": 4}
    assert gallery.recoveries(found) == {"recovers": 2, "recovers, another": 3, "fails": 1}
    assert gallery.followed(found) == {"follows": 3, "worst": 4}
    assert gallery.spread(found) == {"lowest": 3, "highest": 0, "widest": 3}
    assert gallery.one(found) == {"sits": 3}
    none = run([False, False], [0, 0], [0, 0])
    assert gallery.one(none) == {} == gallery.spread(none)
    assert gallery.recoveries(none) == {"fails": 0}


@pytest.mark.parametrize(
    ("success", "fell", "frames"), [(10, None, 70), (None, None, 360), (None, 400, 431)]
)
def test_a_replay_ends_after_its_success_or_fall(
    success: int | None, fell: int | None, frames: int
) -> None:
    length = 431 if fell else 600
    take: Any = SimpleNamespace(
        qpos=np.tile(character.standing_qpos(), (length, 1)),
        mocap_pos=np.zeros((length, 3)),
        mocap_quat=np.tile([1.0, 0, 0, 0], (length, 1)),
        stand=np.zeros(0),
        balls=np.zeros((0, 0, 3)),
        piece="",
        meta={"success_at_step": success, "fell_at_step": fell},
    )

    class Take(SimpleNamespace):
        def __len__(self) -> int:
            return length

    track: Any = SimpleNamespace(
        take=Take(**vars(take)),
        model=compile_scene(None),
        error_m=np.linspace(3.0, 0.0, length),
        steps=length,
    )
    whole, half = (gallery.replay(track, "about", 0.2, every) for every in (1, 2))
    assert whole["frames"] == frames and whole["hz"] == 30 and len(whole["error"]) == frames
    assert half["frames"] == (frames + 1) // 2 and half["hz"] == 15
    assert whole["fell"] == (fell is not None)


def test_the_mesh_becomes_a_chair_with_a_seat_where_it_has_one() -> None:
    piece = gallery.imported()
    assert piece.hulls and piece.sit
    # the top of its seat is 0.42 + 0.03 m high
    assert piece.sit[0].point_m[2] == pytest.approx(0.45, abs=0.03)


def test_the_page_embeds_every_replay() -> None:
    text = gallery.page()
    for entry in ENTRIES:
        assert f'<iframe src="{entry.name}.html"' in text and f"(#{entry.name})" in text
        assert all(about in text for about in FACTS[entry.name]["shown"].values())


def test_clips_are_shown_by_their_longest_completed_trials() -> None:
    def trial(clip: str, steps: int, completed: bool) -> Any:
        found = take(steps)
        meta = {"clip": clip, "completed": completed, "body_cm": 1.0, "ends": []}
        found.meta.update(meta)
        return found

    takes = [trial("a", 5, True), trial("a", 9, True), trial("b", 7, True), trial("b", 40, False),
             trial("a", 3, False)]  # fmt: skip
    shown = {"longest": 1, "longest of another clip": 2, "worst": 4}
    assert gallery.longest(takes) == shown and list(gallery.longest(takes)) == list(shown)
    assert gallery.longest(takes[3:]) == {"worst": 1}
