"""The discriminator of a checkpoint for scoring motions, without mocap, replay or training."""

from pathlib import Path

import torch
from torch import Tensor

from console.run import assembly
from console.run.experiment import Experiment
from discriminator import loss, normaliser
from discriminator.masking import hide
from discriminator.network import StyleNetwork
from policy.checkpoints.format import read
from policy.errors import CheckpointError

_NETWORK = "network/"


class StyleJudge:
    """Scores transitions by the discriminator of a checkpoint."""

    def __init__(self, path: Path, experiment: Experiment) -> None:
        """Read the `style` section of a checkpoint; CheckpointError where it has none."""
        kept = read(path, ("style",)).state["style"]
        # keys of the first version's checkpoints have colons
        state = {key.replace(":", "/"): value for key, value in kept.items()}
        self._config = experiment.style
        #: Number of states that a reward is of.
        self.window = experiment.style.window
        self._holding = assembly.holding() if experiment.style.mask_holding else None
        mask = assembly.object_mask()
        self._kept = torch.arange(len(mask))
        if not experiment.style.object_features:
            self._kept = torch.nonzero(~mask).flatten()
        self.network = StyleNetwork(
            self.window * len(self._kept), experiment.style.hidden, torch.Generator().manual_seed(0)
        )
        own = {k.removeprefix(_NETWORK): v for k, v in state.items() if k.startswith(_NETWORK)}
        try:
            self.network.load_state_dict(own)
            self._mean, self._deviation = state["normaliser/mean"], state["normaliser/deviation"]
        except (RuntimeError, KeyError) as error:
            raise CheckpointError(f"{path}: unknown form of its discriminator ({error})") from error

    @torch.no_grad()
    def reward(self, *states: Tensor) -> Tensor:
        """Return the style rewards [n] of windows of states, oldest first, [n, 114] each."""
        rows = torch.cat([self._features(each) for each in states], dim=1)
        logits = torch.cat([self.network(block) for block in rows.split(4096)])
        return loss.style_reward(logits, self._config.clamp, self._config.reward_scale)

    def _features(self, states: Tensor) -> Tensor:
        found = normaliser.normalise(states, self._mean, self._deviation)
        if self._holding is not None:
            found = hide(found, states, self._holding)
        return found[:, self._kept]


def judge_of(found: assembly.Trained) -> StyleJudge | None:
    """Return the judge of a trained policy; None for a checkpoint without discriminator, such as a
    published one."""
    try:
        return StyleJudge(found.path, found.experiment)
    except CheckpointError:
        return None
