"""The discriminator in process: scoring with D_k, replay, and training of D_k+1."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from discriminator import loss, normaliser
from discriminator.config import StyleConfig
from discriminator.errors import StyleError, TurnError
from discriminator.masking import hide
from discriminator.network import StyleNetwork
from discriminator.pairing import check_rollout, next_states
from discriminator.protocols import Holding, MocapSampler, StyleScores
from discriminator.replay import Replay
from discriminator.state import LOSS, Form, check
from discriminator.windows import Windows
from world.device import CPU, block_rows, moved, put
from world.graphs import forget, replayed
from world.precision import Precision, decide

BLOCK = 512  # rows per forward pass, so that activations stay in the cache
TRAINING = 2  # separates the random stream of training from that of insertions
MAX_ROLLOUT_STATE_BYTES = 1 << 30  # most bytes of the last rollout and the scores in a state
REMEMBERED = 8  # number of batch ids whose scores are kept for a retry


class Discriminator:
    """Style rewards for rollouts; deterministic from (seed, batch ids, versions).

    Version k is the number of trainings so far. `score` uses D_k, `train(k)` makes D_k+1.
    Not thread-safe: one caller at a time.
    """

    def __init__(
        self,
        config: StyleConfig,
        mocap: MocapSampler,
        seed: int,
        object_mask: Tensor | None = None,
        replay_path: Path | None = None,
        precision: Precision | None = None,
        device: torch.device = CPU,
        record: bool = True,
        holding: Holding | None = None,
        coarse: Tensor | None = None,
    ) -> None:
        """Fix the normaliser from the mocap and draw the network from `seed`.

        object_mask: [F] bool, the features that describe the object; they are left out of the input
        where `config.object_features` is off, which without a mask raises StyleError.
        replay_path: see Replay.
        precision: of the network; default: by `world.precision.decide` for the device.
        device: of network, replay and mocap; rollouts may come from any.
        record: record the kernels of a gradient step and replay them, on a GPU (world.graphs).
        holding: what `config.mask_holding` hides; without it that setting raises StyleError.
        coarse: [F] bool, features that the clips show coarsely; see normaliser.COARSE_FLOOR.
        """
        self.device = device
        self.precision = precision or decide(device.type)
        self.config, self.mocap, self.seed = config, moved(mocap, device), seed
        mocap = self.mocap
        states, *rest = mocap.sample(config.normaliser_samples, normaliser.FIRST_COUNTER)
        if len(rest) + 1 != config.window:
            raise StyleError(f"window {config.window}: the mocap has windows of {len(rest) + 1}")
        self.width = states.shape[-1]
        self._kept = _kept_features(config, self.width, object_mask)
        if self._kept is not None:
            self._kept = put(self._kept, device)
        self.mean, self.deviation = normaliser.fit(
            put(states, device), None if coarse is None else put(coarse, device)
        )
        #: By which one discriminator's mocap is told from another's: clips, mixture and seed.
        self.mocap_mean: list[float] = self.mean.tolist()
        self._holding = _holding(config, holding, device)
        each = self.width if self._kept is None else len(self._kept)
        self._windows = Windows(config.window, each, device)
        inputs = config.window * each
        self.network = StyleNetwork(inputs, config.hidden, torch.Generator().manual_seed(seed))
        self.network.to(device)
        self.optimiser = torch.optim.Adam(
            self.network.parameters(),
            lr=config.learning_rate,
            fused=True,
            capturable=device.type == "cuda",
        )
        self._gradient_step = replayed(self._take_step, device, record)
        capacity = max(1, 2 * config.replay // config.window)
        self.replay = Replay(capacity, inputs, seed, replay_path, device)
        self.version = 0
        self.batches = 0
        self.last_batch = -1
        self._last_dropped = -1
        self.transitions = 0
        self._new = torch.empty(0, inputs, device=device)
        self._scores: dict[int, StyleScores] = {}
        self._trained: dict[str, float] = {}

    def score(
        self,
        batch: int,
        rollout_states: Tensor,
        end_index: Tensor,
        end_states: Tensor,
        valid: Tensor,
    ) -> StyleScores:
        """Style rewards of a rollout under D_k; its transitions enter the replay once.

        batch: id of the rollout; the same id again returns the same scores and inserts nothing.
        rollout_states: [T+1, N, F] float32. end_index: [K, 2] int64 (t, n). end_states: [K, F].
        valid: [T, N] bool, False where a transition is ignored.
        Raises StyleError for another layout, or numbers that are not finite in a valid transition.
        """
        if batch in self._scores:
            return self._scores[batch]
        if batch <= self._last_dropped:
            raise StyleError(
                f"batch {batch}: its scores are forgotten, ids must be above {self._last_dropped}"
            )
        place, valid = valid.device, put(valid, self.device)
        states, end_index, end_states = (
            put(tensor, self.device) for tensor in (rollout_states, end_index, end_states)
        )
        check_rollout(states, end_index, end_states, valid, self.width)
        if not (states.isfinite().all() and end_states.isfinite().all()):
            _refuse_non_finite(states, end_index, end_states, valid)
        rows, whole = self._windows.rows(
            self._features(states), end_index, self._features(end_states), valid
        )
        logits = self.logits(rows)
        reward = loss.style_reward(logits, self.config.clamp, self.config.reward_scale)
        keep = None if valid.all() else valid.flatten()
        if not whole.all():
            # the first transitions of an episode: the mean of the others neither helps nor hurts
            known = whole if keep is None else whole & keep
            mean = reward[known].mean() if known.any() else reward.new_zeros(())
            reward = torch.where(whole, reward, mean)
        if keep is not None:
            reward = torch.where(keep, reward, 0.0)
        taught = whole if keep is None else whole & keep
        if not taught.all():
            logits, rows = logits[taught], rows[taught]
        self.replay.insert(rows, batch, self.config.insert_probability)
        self._new = rows
        self.batches += 1
        self.transitions += len(rows)
        count = max(len(rows), 1)
        scores = StyleScores(
            reward.view(valid.shape).to(place),
            self.version,
            {
                "style/accuracy_policy": float((logits < 0).sum()) / count,
                "style/logit_policy": float(logits.sum()) / count,
                "reward/style": float(reward.sum()) / max(int(valid.sum()), 1),
                "style/reward_spread": _spread(
                    reward.flatten()[keep] if keep is not None else reward
                ),
            },
        )
        self._scores[batch] = scores
        self.last_batch = batch
        if len(self._scores) > REMEMBERED:
            self._last_dropped = min(self._scores)
            del self._scores[self._last_dropped]
        return scores

    def has_scores(self, batch: int) -> bool:
        """Whether the scores of a batch id are kept, so that scoring it again changes nothing."""
        return batch in self._scores

    def train(self, version: int) -> dict[str, float]:
        """Train D_version+1 from D_version; a repeated call returns the same metrics.

        Raises TurnError for any other version, and before the first rollout is scored.
        """
        if version + 1 == self.version and self._trained:
            return dict(self._trained)
        if version != self.version:
            raise TurnError(
                f"train: version {version}, must be {self.version} (the discriminator's own)"
            )
        if self.replay.size == 0:
            raise TurnError("train: no policy transitions yet, score a rollout first")
        held_out = self.logits(
            self._mocap_rows(self.mocap.held_out(self.config.held_out_batch, version))
        )
        health = {"style/accuracy_mocap": float((held_out > 0).double().mean())}
        latest = self._scores.get(self.last_batch)
        right = 0.0
        if latest is not None:
            on_policy = latest.metrics
            health["style/logit_gap"] = float(held_out.mean()) - on_policy["style/logit_policy"]
            right = min(health["style/accuracy_mocap"], on_policy["style/accuracy_policy"])
        bound = self.config.throttle
        if bound is not None and right > bound:
            health["style/skipped"] = 1.0
        else:
            health |= {"style/skipped": 0.0} | self._steps(version)
        self.version = version + 1
        self._trained = health
        return dict(self._trained)

    def _steps(self, version: int) -> dict[str, float]:
        """Take the gradient steps of a training; return their mean figures, none without steps."""
        steps = [self._step(version, i) for i in range(self.config.steps_per_iteration)]
        if not steps:
            return {}
        total, penalty, logit, slope = torch.stack(steps).double().mean(0).tolist()
        return {
            LOSS: total,
            "style/penalty": penalty,
            "style/logit_mocap": logit,
            "style/gradient": slope,
        }

    def _step(self, version: int, step: int) -> Tensor:
        """Take one gradient step; returns classification loss, weighted penalty, mean mocap logit,
        root mean square of the norm of the logit's gradient on mocap [4]."""
        config = self.config
        draw = np.random.default_rng((TRAINING, self.seed, version, step))
        half = config.batch // 2 if len(self._new) else 0
        policy = [self.replay.sample(config.batch - half, draw)]
        if half:
            rows = torch.from_numpy(draw.integers(len(self._new), size=half))
            policy.append(self._new[put(rows, self.device)])
        counter = version * config.steps_per_iteration + step
        mocap = self._mocap_rows(self.mocap.sample(config.batch, counter))
        return self._gradient_step(mocap, torch.cat(policy))

    def _take_step(self, mocap: Tensor, policy: Tensor) -> Tensor:
        """As `_step`, on rows of network input [m, inputs] of mocap and policy."""
        config = self.config
        # Mocap comes first, because the penalty is computed on the leading rows.
        with self.precision.context():
            logits, hidden = self.network.with_activations(torch.cat([mocap, policy]))
            gradient = self.network.input_gradient([h[: config.penalty_batch] for h in hidden])
        on_mocap, on_policy = logits[: len(mocap)], logits[len(mocap) :]
        classified = loss.classification(on_policy, on_mocap)
        penalty = config.gradient_penalty * loss.gradient_penalty(gradient)
        regular = loss.regularisation(self.network, config.logit_regulariser, config.weight_decay)
        self.optimiser.zero_grad(set_to_none=True)
        (classified + penalty + regular).backward()
        self.optimiser.step()
        slope = gradient.detach().float().square().sum(-1).mean().sqrt()
        return torch.stack([classified, penalty, on_mocap.mean(), slope]).detach()

    def logits(self, rows: Tensor) -> Tensor:
        """Logits [n] of rows of network input [n, inputs], without gradient."""
        with torch.no_grad(), self.precision.context():
            return torch.cat(
                [self.network(block) for block in rows.split(block_rows(BLOCK, self.device))]
            )

    def _features(self, states: Tensor) -> Tensor:
        """Normalised input features of states [..., F]."""
        normalised = normaliser.normalise(states, self.mean, self.deviation)
        if self._holding is not None:
            normalised = hide(normalised, states, self._holding)
        return normalised if self._kept is None else normalised[..., self._kept]

    def _mocap_rows(self, window: Sequence[Tensor]) -> Tensor:
        return torch.cat([self._features(put(states, self.device)) for states in window], -1)

    def state_dict(self, replay: bool = True) -> dict[str, Tensor]:
        """Everything that an exact restart needs, as copies of flat tensors.

        replay: False leaves the replay's rows out, for a process whose replay is a file.
        """
        state = {f"network/{k}": v.clone() for k, v in self.network.state_dict().items()}
        moments = self.optimiser.state_dict()["state"]
        for index, moment in moments.items():
            state |= {f"adam/{index}/{k}": v.clone() for k, v in moment.items()}
        state["normaliser/mean"] = self.mean.clone()
        state["normaliser/deviation"] = self.deviation.clone()
        state["new"] = self._new.clone()
        for name, value in self._counters().items():
            state[f"counters/{name}"] = torch.tensor(value)
        state |= self._windows.state_dict()
        if replay:
            state["replay"] = self.replay.rows[: self.replay.size].clone()
        for name, value in self._trained.items():
            state[f"trained/{name}"] = torch.tensor(value, dtype=torch.float64)
        for order, (batch, scores) in enumerate(self._scores.items()):
            state[f"scores/{order}/id"] = torch.tensor([batch, scores.version])
            state[f"scores/{order}/reward"] = scores.reward.clone()
            for name, value in scores.metrics.items():
                state[f"scores/{order}/{name}"] = torch.tensor(value, dtype=torch.float64)
        return state

    def load_state_dict(self, state: Mapping[str, Tensor]) -> None:
        """Restore a state, bit for bit.

        A state without `replay` keeps the present rows. Raises LayoutError, and changes nothing, if
        the state does not fit this discriminator (see state.check).
        """
        self.check_state(state)
        self.network.load_state_dict(_under(state, "network/"))
        parameters = len(list(self.network.parameters()))
        moments = {i: _copied(_under(state, f"adam/{i}/")) for i in range(parameters)}
        groups = self.optimiser.state_dict()["param_groups"]
        self.optimiser.load_state_dict(
            {"state": {i: m for i, m in moments.items() if m}, "param_groups": groups}
        )
        forget(self._gradient_step)
        self.mean, self.deviation, self._new = (
            state[name].to(self.device, copy=True)
            for name in ("normaliser/mean", "normaliser/deviation", "new")
        )
        counters = {k: int(v) for k, v in _under(state, "counters/").items()}
        self.seed = self.replay.seed = counters["seed"]
        self.version, self.batches = counters["version"], counters["batches"]
        self.transitions, size = counters["transitions"], counters["replay"]
        self.last_batch, self._last_dropped = counters["last_batch"], counters["forgotten"]
        if "replay" in state:
            self.replay.rows[:size] = state["replay"]
        self.replay.size = size
        self._windows.load_state_dict(state)
        self._trained = {k: float(v) for k, v in _under(state, "trained/").items()}
        self._scores = {}
        for order in range(REMEMBERED + 1):
            entry = _under(state, f"scores/{order}/")
            if entry:
                batch, version = entry.pop("id").tolist()
                reward = entry.pop("reward").clone()
                metrics = {k: float(v) for k, v in entry.items()}
                self._scores[batch] = StyleScores(reward, version, metrics)

    def _counters(self) -> dict[str, int]:
        return {
            "seed": self.seed,
            "version": self.version,
            "batches": self.batches,
            "transitions": self.transitions,
            "replay": self.replay.size,
            "last_batch": self.last_batch,
            "forgotten": self._last_dropped,
        }

    def close(self) -> None:
        """Nothing to release in process."""

    def check_state(self, state: Mapping[str, Tensor]) -> None:
        """Raise LayoutError unless `load_state_dict` can load the state."""
        own = self.state_dict(replay=False)
        tensors = {k: v for k, v in own.items() if k.startswith(("network/", "normaliser/"))}
        check(
            state,
            Form(
                tensors=tensors,
                parameters=tuple(p.shape for p in self.network.parameters()),
                inputs=self.replay.rows.shape[1],
                window=self.config.window,
                capacity=self.replay.capacity,
                remembered=REMEMBERED,
            ),
        )

    @property
    def state_bytes(self) -> int:
        """Upper bound on the bytes of a state: replay, last rollout and scores."""
        own = sum(v.numel() * v.element_size() for v in self.state_dict(replay=False).values())
        rows = self.replay.rows
        return 2 * (own + rows.numel() * rows.element_size()) + MAX_ROLLOUT_STATE_BYTES


def _spread(reward: Tensor) -> float:
    """Return the standard deviation of rewards [..]; 0 for fewer than two."""
    return float(reward.double().std()) if reward.numel() > 1 else 0.0


def _under(state: Mapping[str, Tensor], prefix: str) -> dict[str, Tensor]:
    return {k.removeprefix(prefix): v for k, v in state.items() if k.startswith(prefix)}


def _copied(state: dict[str, Tensor]) -> dict[str, Tensor]:
    return {k: v.clone() for k, v in state.items()}


def _kept_features(config: StyleConfig, width: int, object_mask: Tensor | None) -> Tensor | None:
    """Indices of the input features; None for all."""
    if config.object_features:
        return None
    if object_mask is None or tuple(object_mask.shape) != (width,):
        raise StyleError(f"object_features off: needs object_mask, bool [{width}]")
    return torch.nonzero(~object_mask).flatten()


def _holding(config: StyleConfig, holding: Holding | None, device: torch.device) -> Holding | None:
    if not config.mask_holding:
        return None
    if holding is None:
        raise StyleError("mask_holding: the task has no box to hold")
    return moved(holding, device)


def _refuse_non_finite(
    states: Tensor, end_index: Tensor, end_states: Tensor, valid: Tensor
) -> None:
    """Raise StyleError unless every valid transition is finite."""
    before = states[:-1].isfinite().all(-1)
    after = next_states(states, end_index, end_states).isfinite().all(-1)
    bad = torch.nonzero(valid & ~(before & after))
    if len(bad):
        step, scene = bad[0].tolist()
        raise StyleError(
            f"states: {len(bad)} valid transitions are not finite (the first at step {step}, "
            f"scene {scene}), must be finite or marked invalid"
        )
