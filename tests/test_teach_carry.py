"""The example that teaches networks to carry: they learn what they are told, and are a checkpoint
like any other."""

from pathlib import Path

import torch

from console import assembly
from console.__main__ import main
from examples.teach_carry import Settings, teach
from policy.networks import Actor


def test_networks_taught_by_the_porter_are_a_checkpoint(tmp_path: Path, capsys) -> None:
    torch.set_num_threads(1)
    out = tmp_path / "taught"
    teach(Settings(out, rounds=3, steps=40, scenes=8, batches=150, batch=128, alone=0.5))
    lines = capsys.readouterr().out.splitlines()
    errors = [float(line.split("error ")[1].split(";")[0]) for line in lines]
    assert len(errors) == 3 and errors[-1] < 0.7 * errors[0]
    found = assembly.trained(out)
    assert found.task == "carry"
    assert found.manifest.samples > 3 * 40 * 8 * 0.8
    untaught = Actor(found.manifest.layout.observation, 28).state_dict()
    taught = next(value for name, value in found.weights.items() if name.endswith("4.weight"))
    assert taught.abs().mean() > untaught["layers.4.weight"].abs().mean()
    # what `inhabit evaluate` makes of it
    assert main(["evaluate", str(out), "--trials", "4", "--quality", "0", "--threads", "1"]) == 0
