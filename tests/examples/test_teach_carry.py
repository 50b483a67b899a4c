"""The example that teaches networks to carry: they learn what they are told, and are a checkpoint
like any other. The one that records the teacher: its clips have all stages of a carry."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from console.__main__ import main
from console.run import assembly
from examples.record_porter import Recording, record
from examples.school import School, Settings
from examples.teach_carry import teach
from policy.model.acting import Policy
from world.character import model as character
from world.character.features import STATE
from world.config import WorldConfig
from world.motions import load, segments
from world.motions.uses.box import BOX
from world.scene.box import BOX_SIZE_M
from world.teachers.carry import Phase


def test_networks_taught_by_the_porter_are_a_checkpoint(tmp_path: Path, capsys) -> None:
    torch.set_num_threads(1)
    out = tmp_path / "taught"
    teach(Settings(out, minutes=0.15, workers=1, steps=30, scenes=16, first=2000, batch=256))
    last = capsys.readouterr().out.splitlines()[-1]
    found = assembly.trained(out)
    assert found.task == "carry"
    assert found.manifest.samples == int(last.split(": ")[1].split(" samples")[0]) >= 2000
    told = [json.loads(line) for line in (out / "metrics.jsonl").read_text().splitlines()]
    assert 2000 <= told[-1]["samples"] <= found.manifest.samples and 0 < told[-1]["error"] < 1
    # of what the porter says in scenes that were not seen, two fifths at least are said likewise
    school = School(Settings(out, steps=60, scenes=16, seed=77), WorldConfig(task="carry"))
    seen, said, _ = school.lesson(None, 1.0)
    policy = Policy(found.weights)
    answer = policy(seen[:, : STATE.width], seen[:, STATE.width :])
    assert (answer - said).square().mean() < 0.6**2 * said.var(dim=0).mean()
    # what `inhabit evaluate` makes of it
    assert main(["evaluate", str(out), "--trials", "4", "--quality", "0", "--threads", "1"]) == 0
    # wider ones that begin with it know as much
    grown = Settings(tmp_path / "grown", init=out, hidden=(600, 300), rate=1e-6, minutes=0.02)
    teach(replace(grown, steps=30, scenes=16, first=1000, batch=64))
    wider = assembly.trained(tmp_path / "grown")
    assert wider.manifest.layout.hidden == (600, 300)
    other = Policy(wider.weights)(seen[:, : STATE.width], seen[:, STATE.width :])
    assert (other - answer).square().mean() < 0.1 * (answer - said).square().mean()


def test_lessons_go_on_where_a_box_was_lifted(tmp_path: Path) -> None:
    """The same states again, with the box in hand, and the porter knows what it is about."""
    torch.set_num_threads(1)
    n = 12
    settings = Settings(tmp_path, scenes=n, steps=10, in_hand=0.0, near=1.0, lifted=1.0, seed=3)
    school = School(settings, WorldConfig(task="carry"))
    once = torch.zeros(n, dtype=torch.bool)
    for _ in range(40):
        school.lesson(None, 1.0)
        once |= school.porter.phase == Phase.CARRY
        if once.sum() >= 8:
            break
    assert once.sum() >= 8
    school.again(torch.ones(n, dtype=torch.bool))
    again = school.porter.phase == Phase.CARRY
    assert torch.equal(again, again & once), "only where one was lifted"
    assert again.sum() >= 6
    rows = again.nonzero().flatten()
    box = school.scenes.now(school.place).box
    assert box is not None
    gone = (box.position - box.start)[rows]
    assert ((gone[:, 2] > 0.03) | (gone[:, :2].norm(dim=1) > 0.2)).all()
    bodies = school.scenes.body().position[rows]
    held_by = bodies[:, [character.BODIES.index(f"{side}_hand") for side in ("right", "left")]]
    assert ((held_by - box.position[rows, None]).norm(dim=2) < 0.6).all()
    fell = torch.zeros(n, dtype=torch.bool)
    for _ in range(30):
        fell |= school.drive()[0]
    assert fell[rows].float().mean() <= 0.35, "the porter goes on with it"


def test_more_of_the_boxes_may_be_large(tmp_path: Path) -> None:
    """At an exponent of 0.5, three of four are in the upper half of the sizes."""
    school = School(Settings(tmp_path, scenes=4, skew=0.5), WorldConfig(task="carry"))
    scale = school.bank.half[:, 0].float() / (0.5 * BOX_SIZE_M[0])
    wanted = 0.5 + torch.tensor([0.125, 0.375, 0.625, 0.875]).sqrt()
    torch.testing.assert_close(scale, wanted, atol=1e-4, rtol=0)
    assert (scale > 1.0).tolist() == [False, True, True, True]


def test_the_porters_clips_have_every_stage(tmp_path: Path) -> None:
    torch.set_num_threads(1)
    record(Recording(tmp_path, clips=6, scenes=24))
    clips = load.clips([str(tmp_path)], BOX)
    assert len(clips) >= 6
    stages = np.concatenate([segments.stages(clip) for clip in clips])
    counts = [
        (stages == s).sum() for s in (segments.APPROACH, segments.TRANSITION, segments.CONTACT)
    ]
    assert min(counts) > 30
    for clip in clips:
        assert clip.box is not None and clip.box.held.any()
        assert np.abs(clip.qvel()).max() < 40.0
