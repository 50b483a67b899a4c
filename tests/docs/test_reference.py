"""Generated reference pages hold what the code has: settings, flags, metrics, keys of files."""

import dataclasses
import json
import typing
from pathlib import Path

import numpy as np
import pytest

from console.app import main
from console.commands import COMMANDS, MOTIONS, OBJECTS
from console.manual import fields
from console.recording import format as recording
from console.run.experiment import Experiment, to_json
from console.run.metric_names import ALWAYS, METRICS
from console.run.metrics import read_metrics
from docs.generate import commands, configuration, formats, hook, markdown, protocol
from rpc import codec
from rpc.v1 import policy_pb2, style_pb2
from tests.support import small_clips
from tests.support.paths import ROOT
from world.character import model as character
from world.meshes import store
from world.motions import clip_file
from world.motions.clip import Clip
from world.motions.objects import BoxTrack, Skeleton
from world.tasks import REGISTRY

SMALL = [
    "--scenes", "64", "--block", "32", "--world.pieces", "4", "--world.scales", "1",
    "--ppo.hidden", "32", "--style.hidden", "32", "--style.batch", "64", "--clone-passes", "1",
    "--clone-samples", "256", "--threads", "2", "--ppo.warmup-iterations", "1",
    "--style.normaliser-samples", "500", "--style.replay", "2000",
]  # fmt: skip


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of three iterations."""
    base = tmp_path_factory.mktemp("runs")
    folder, clips = base / "three", small_clips.write(base / "clips")
    words = ["--run", str(folder), "--motions", str(clips), "--iterations", "3"]
    assert main(["train", "sit", *words, *SMALL]) == 0
    return folder


def leaves(value: object, prefix: str = "") -> set[str]:
    if not isinstance(value, dict):
        return {prefix.rstrip(".")}
    return set().union(*(leaves(inner, f"{prefix}{key}.") for key, inner in value.items()))


def test_every_setting_is_on_the_page_with_a_meaning() -> None:
    found = {f.name: f for f in fields.walk(Experiment, Experiment())}
    assert set(found) == leaves(to_json(Experiment()))
    page = configuration.page()
    for name, field in found.items():
        assert f"`{name}`" in page and field.meaning, name
    assert found["world.initial.near_m"].unit == "m"
    assert found["world.initial.near_m"].default == "0.75 1.6"
    assert found["ppo.gamma"].default == f"{Experiment().ppo.gamma:g}"


def test_every_flag_is_on_the_page() -> None:
    page = commands.page()
    for entry in (*COMMANDS, *MOTIONS, *OBJECTS):
        hints = typing.get_type_hints(entry.flags)
        for field in dataclasses.fields(entry.flags):
            if field.name == "overrides":
                continue  # set by the program
            spelled = field.name.replace("_", "-")
            shown = (f"--{spelled}`", f"`{field.name}`")
            if dataclasses.is_dataclass(hints[field.name]):
                shown = (f"--{spelled}.", "every field of [the configuration]")
            assert any(text in page for text in shown), (entry.name, field.name)


def test_metrics_of_a_training_are_all_listed(run: Path) -> None:
    written = set().union(*map(set, read_metrics(run / "metrics.jsonl")))
    unlisted = {name for name in written if not any(m.matches(name) for m in METRICS)}
    assert not unlisted
    terms = REGISTRY["sit"]().terms
    expected = {m.name for m in METRICS if m.when == ALWAYS} - {"reward/TERM"}
    expected -= {"episode/stalled"}
    assert expected | {f"reward/{t}" for t in terms} <= written


@pytest.mark.parametrize("policy", ["sit", "lie"])
def test_metrics_of_policies_trained_by_ppo_are_all_listed(policy: str) -> None:
    written = read_metrics(ROOT / "pretrained" / policy / "metrics.jsonl")[-1]
    assert not {name for name in written if not any(m.matches(name) for m in METRICS)}


def test_metric_names_are_unambiguous() -> None:
    assert len({metric.name for metric in METRICS}) == len(METRICS)


@pytest.mark.parametrize(("name", "module"), [("policy", policy_pb2), ("style", style_pb2)])
def test_the_protocol_pages_have_every_message_and_field(name: str, module: object) -> None:
    _, blocks = protocol.read((ROOT / protocol.FILES[name]).read_text())
    by_name = {block.name: block for block in blocks}
    descriptor = module.DESCRIPTOR  # type: ignore[attr-defined]
    for message in descriptor.message_types_by_name.values():
        rows = {(int(row[0]), row[1]) for row in by_name[message.name].rows}
        assert rows == {(f.number, f.name) for f in message.fields}, message.name
    for service in descriptor.services_by_name.values():
        calls = {row[0] for row in by_name[service.name].rows}
        assert calls == {m.name for m in service.methods}


def keys(kind: formats.Format) -> set[str]:
    return {key for key, _, _ in kind.keys}


def test_a_clip_file_has_the_keys_of_the_page() -> None:
    frames = 3
    rotation = np.zeros((frames, 15, 4), np.float32)
    rotation[..., 0] = 1.0
    pose = np.zeros((frames, 7), np.float32)
    box = BoxTrack(pose, (0.3, 0.3, 0.3), np.zeros(frames, bool))
    ghost = Skeleton(("root",), (-1,), np.zeros((frames, 1, 3), np.float32))
    root = np.zeros((frames, 3), np.float32)
    clip = Clip("c", 30, root, rotation, "s", "l", box=box, ghost=ghost)
    assert set(clip_file.arrays(clip)) == keys(formats.CLIP)


def test_a_piece_file_has_the_keys_of_the_page() -> None:
    source = Path(store.__file__).read_text()
    start = source.index("return {\n")
    body = source[start : source.index("\n    }\n", start)]
    written = {
        line.strip().split('"')[1] for line in body.splitlines() if line.startswith('        "')
    }
    assert written == keys(formats.PIECE)


def test_a_recording_has_the_keys_of_the_page(tmp_path: Path) -> None:
    zero = np.zeros
    take = recording.Take(
        zero((2, 43)),
        zero((2, 34)),
        zero((2, 28)),
        zero((2, 3)),
        zero((2, 4)),
        zero((0, 10)),
        "",
        1.0,
    )
    recording.write(tmp_path / "r.msgpack", recording.Recording([take], {"task": "sit"}))
    held = codec.unpack((tmp_path / "r.msgpack").read_bytes())
    assert set(held) == {"format", "version", "meta", "takes"}
    assert set(held["takes"][0]) == keys(formats.RECORDING)


def test_a_checkpoint_and_a_run_have_the_keys_of_the_page(run: Path) -> None:
    manifest = json.loads((run / "checkpoints/latest/manifest.json").read_text())
    assert set(manifest) == keys(formats.CHECKPOINT)
    assert {p.name for p in run.iterdir() if not p.name.startswith(".")} <= keys(formats.RUN)


def test_the_page_of_features_lists_all_servos() -> None:
    page = hook.pages()["reference/features.md"]
    assert page.count("| `") >= character.NU and "`left_ankle_z`" in page


def test_cells_of_tables_show_angle_brackets() -> None:
    """A browser takes `<date>` for an unknown element, and shows nothing."""
    page = markdown.table(("a", "b"), [("runs/TASK-<date>", "`a<b`"), ("x | y", "2\nlines")])
    assert "| runs/TASK-&lt;date> | `a<b` |" in page and "| x \\| y | 2 lines |" in page
    assert "runs/TASK-&lt;date>-&lt;n>" in commands.page()
