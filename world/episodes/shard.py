"""The shard: a range of scenes that step together, their episodes, rewards and resets.

Everything is torch over index sets; the only loops run over the few scenes whose furniture changes.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor

from world import random_streams, tasks
from world.character import features
from world.character import model as character
from world.character.features import Body
from world.config import WorldConfig
from world.episodes.stall import Patience
from world.errors import ConfigError
from world.initial import make as starters
from world.initial.track import TrackStarter
from world.motions.library import MotionLibrary
from world.objects import grasp
from world.objects.box_bank import BoxBank
from world.objects.furniture_bank import Bank
from world.objects.track_bank import TrackBank
from world.scene.batch import Scenes
from world.tasks import HELD, Place
from world.teachers.carry import Porter, lifted

#: Index sets are padded to whole multiples of this: vectorised and scalar tails of torch's
#: functions may round differently, and a scene's numbers must not depend on how many others reset
#: with it.
_LANES = 32
#: A porter teaches in two of five control steps, the scenes in turn: all would cost more than they
#: teach; a period that is no part of a step's, of 12.
_TURN, _TURNS = 2, 5


@dataclass(frozen=True)
class Step:
    """What one control step gave; see Rollout for how it is used."""

    reward: Tensor
    """[n]: weighted sum of the task's terms."""
    terms: Tensor
    """[n, n_terms]: the unweighted terms."""
    fell: Tensor
    """[n] bool: the character or its box fell, or patience with it ended."""
    timed_out: Tensor
    """[n] bool: the clock ran out, or success was held long enough."""
    finite: Tensor
    """[n] bool: False where the simulation blew up; the sample is void."""
    end_ids: Tensor
    """[K] int64: scenes whose episode ended in this step, ascending."""
    end_states: Tensor
    """[K, 114]: their last states."""
    end_goals: Tensor
    """[K, G]."""
    episodes: dict[str, Tensor]
    """Of the K: return, length (steps), success, fall, stalled (patience with it ended), start
    (index into KINDS), and stage_NAME of each stage of the task: whether the episode reached it;
    float32."""
    broken: Tensor
    """[B, 43 + 34] float64: qpos and qvel of scenes that blew up, as they were before the step."""
    taught: Tensor | None = None
    """[n, 28]: what a lesson says that the action should have been, NaN where it says nothing."""
    led: Tensor | None = None
    """[n] bool: where that was done, whatever the action."""


class Shard:
    """The scenes `scenes` (a range of global ids) of one task."""

    def __init__(
        self,
        config: WorldConfig,
        library: MotionLibrary,
        bank: Bank | BoxBank | TrackBank,
        scenes: range,
        seed: int,
    ) -> None:
        self.config = config
        self.task = tasks.make(config.task)
        self.n = len(scenes)
        self.clock = 0
        self._seed = seed
        self._ids = torch.arange(scenes.start, scenes.stop, dtype=torch.int64)
        self._bank = bank
        self._starter = starters.make(config, library, bank, seed)
        self._scenes = Scenes([bank.models[0]] * self.n, config.action_scale, config.action_clip)
        self._weights = torch.tensor(list(self.task.terms.values()), dtype=torch.float32)
        self._length = round((config.episode_s or self.task.episode_s) * character.CONTROL_HZ)
        self._hold = round(config.hold_s * character.CONTROL_HZ)
        self._episode = torch.zeros(self.n, dtype=torch.int64)
        self._steps = torch.zeros(self.n, dtype=torch.int64)
        self._held = torch.zeros(self.n, dtype=torch.int64)
        self._return = torch.zeros(self.n)
        self._kind = torch.zeros(self.n, dtype=torch.int64)
        self._variant = torch.zeros(self.n, dtype=torch.int64)
        self._stages = torch.zeros(self.n, len(self.task.stages) + 1, dtype=torch.bool)
        self._state = torch.zeros(self.n, features.STATE.width)
        self._goal = torch.zeros(self.n, self.task.goal.width)
        self._places: Place | None = None
        if config.carry.porter and not isinstance(bank, BoxBank):
            raise ConfigError("carry.porter is for the task carry")
        self._porter = Porter(self.n) if config.carry.porter else None
        self._patience = Patience(self.n, config.patience_s)
        self._reset(torch.arange(self.n))
        # clocks start apart, so that not all scenes time out in the same step
        apart = random_streams.uniform(seed, random_streams.EPISODE, self._ids, 0, 16)[:, 15]
        self._steps[:] = (apart * self._length).long()

    def observe(self) -> tuple[Tensor, Tensor]:
        """The current states [n, 114] and goals [n, G]; overwritten by the next step."""
        return self._state, self._goal

    def heed(self, told: Mapping[str, Tensor]) -> None:
        """Take what the learner publishes for the worlds: failures [S] by segment of what episodes
        follow, for those initial states that depend on them."""
        if isinstance(self._starter, TrackStarter):
            self._starter.heed(told["failures"])

    def step(self, action: Tensor) -> Step:
        """One control step with actions [n, 28]; episodes that end start anew at once."""
        before = torch.cat((self._scenes.qpos, self._scenes.qvel), dim=1)
        targets, taught, led = self._lesson(self._scenes.targets(action, self._place().setpoints()))
        self._scenes.drive(targets)
        self.clock += 1
        finite = self._scenes.finite()
        body = self._scenes.body()
        place = self._place()
        place.advance(body)
        terms = self.task.reward_terms(body, place)
        # a fixed order of additions: one matrix product would round by its number of rows
        reward = (terms * self._weights).sum(dim=1)
        error = self.task.error_m(body, place)
        # down where there is nothing to do down there: saves a third of early samples
        collapsed = ~self.task.low(body, place) & (body.root[:, 2] < self.config.early_pelvis_m)
        fell = self.task.fell(body, place) | collapsed
        stalled = self._patience.ends(body, place, error <= self.task.success_m) & ~fell
        fell = fell | stalled
        self._steps += 1
        self._held = torch.where(error <= self.task.success_m, self._held + 1, 0)
        over = place.over()
        held = self._held >= self._hold if over is None else over
        self._stages |= torch.cat((self.task.stage(body, place), held[:, None]), dim=1)
        timed_out = ((self._steps >= self._length) | held) & ~fell & finite
        fell = fell & finite
        reward = torch.where(finite, reward, 0.0)
        terms = torch.where(finite[:, None], terms, 0.0)
        self._return += reward
        self._look(body, place, None)

        ends = torch.nonzero(fell | timed_out).flatten()
        broken = torch.nonzero(~finite).flatten()
        step = Step(
            reward=reward,
            terms=terms,
            fell=fell,
            timed_out=timed_out,
            finite=finite,
            end_ids=ends,
            end_states=self._state[ends],
            end_goals=self._goal[ends],
            episodes={
                "return": self._return[ends],
                "length": self._steps[ends].float(),
                "success": ((error <= self.task.success_m) & ~fell)[ends].float(),
                "fall": (fell & ~stalled)[ends].float(),
                "stalled": stalled[ends].float(),
                "start": self._kind[ends].float(),
                **{
                    name if name.startswith("end_") else f"stage_{name}": self._stages[
                        ends, k
                    ].float()
                    for k, name in enumerate((*self.task.stages, HELD))
                },
                **{name: value[ends].float() for name, value in place.told().items()},
            },
            broken=before[broken],
            taught=taught,
            led=led,
        )
        again = torch.cat((ends, broken))
        if len(again):
            self._reset(again)
        return step

    def _lesson(self, targets: Tensor) -> tuple[Tensor, Tensor | None, Tensor | None]:
        """The servo targets [n, 28] rad to be driven to, and what the lesson, if there is one, says
        of the actions; see Step."""
        carry = self.config.carry
        if self._porter is not None:
            return targets, self._portered(self._porter), torch.zeros(self.n, dtype=torch.bool)
        if not ((carry.lesson or carry.led) and isinstance(self._bank, BoxBank)):
            return targets, None, None
        mass, qpos = self._bank.mass[self._variant], self._scenes.qpos.float()
        wanted, said = grasp.lead(qpos, self._place(), mass)
        u = random_streams.uniform(
            self._seed, random_streams.EPISODE, self._ids, self._episode, 16
        )[:, 14]
        led = u < carry.led
        taught = torch.where(said, self._scenes.actions(wanted.double()).float(), torch.nan)
        return torch.where(said & led[:, None], wanted.double(), targets), taught, led

    def _portered(self, porter: Porter) -> Tensor:
        """[n, 28]: the actions of the porter in two of five steps of each scene, from the last
        metres before the box on; NaN elsewhere."""
        assert isinstance(self._bank, BoxBank)
        mass, place = self._bank.mass[self._variant], self._place()
        intent = porter.intend(self._scenes.qpos, self._scenes.qvel, place, mass)
        said = porter.teaches(place, self._scenes.qpos[:, :3].float())
        turn = (_TURN * self.clock + self._ids) % _TURNS < _TURN
        rows = torch.nonzero(said & turn).flatten()
        taught = torch.full((self.n, character.NU), torch.nan)
        taught[rows] = self._scenes.actions(intent.rows(rows).targets()).float()
        return taught

    def _place(self) -> Place:
        """Where every scene's object is at this moment."""
        assert self._places is not None
        return self._scenes.now(self._places)

    def _look(self, body: Body, place: Place, ids: Tensor | None) -> None:
        """Write states and goals of all scenes, or of `ids`."""
        state = tasks.state(body, place)
        goal = self.task.goal_features(body, place)
        if ids is None:
            self._state, self._goal = state, goal
        else:
            self._state[ids], self._goal[ids] = state, goal

    def _reset(self, ids: Tensor) -> None:
        """Start the next episode in the scenes `ids` [K] (local)."""
        self._episode[ids] += 1
        padding = -len(ids) % _LANES
        rows = torch.cat((ids, ids[:1].expand(padding)))
        starts = self._starter.draw(self._ids[rows], self._episode[rows])
        models = [self._bank.models[v] for v in starts.variant[: len(ids)].tolist()]
        self._scenes.set_models(ids.tolist(), models)
        self._starter.put(self._scenes, rows, starts)
        place = self._starter.place(starts)
        if self._places is None:
            self._places = place.rows(ids)
        self._places.write(rows, place)
        self._variant[rows] = starts.variant
        self._kind[rows] = starts.kind
        self._steps[ids] = 0
        self._held[ids] = 0
        self._return[ids] = 0.0
        self._stages[ids] = False
        now, body = self._scenes.now(self._places.rows(rows), rows), self._scenes.body(rows)
        self._look(body, now, rows)
        self._patience.reset(rows, body, now)
        if self._porter is not None and now.box is not None:
            self._porter.reset(rows, lifted(now.box))

    def state_dict(self) -> dict[str, Tensor]:
        """Everything that an exact continuation needs."""
        own = {name: getattr(self, f"_{name}").clone() for name in (*_EPISODES, "state", "goal")}
        assert self._places is not None
        own |= {name: value.clone() for name, value in self._places.tensors().items()}
        own |= {f"patience_{k}": v.clone() for k, v in self._patience.memory().items()}
        physics = {f"physics_{k}": v for k, v in self._scenes.physics().items()}
        if self._porter is not None:
            own |= {f"porter_{k}": v.clone() for k, v in self._porter.memory().items()}
        return own | physics | {"clock": torch.tensor(self.clock)}

    def load_state_dict(self, state: dict[str, Tensor]) -> None:
        """Restore what `state_dict` gave; from here on the same numbers follow."""
        for name in (*_EPISODES, "state", "goal"):
            # runs begun before there were stages lack these
            if name in state or name != "stages":
                setattr(self, f"_{name}", state[name].clone())
        assert self._places is not None
        for name, value in self._places.tensors().items():
            if name in state or name != "head":
                value.copy_(state[name])
        # nor did those know patience
        if "patience_still" in state:
            self._patience.remember({k: state[f"patience_{k}"] for k in self._patience.memory()})
        if self._porter is not None:
            self._porter.remember({k: state[f"porter_{k}"] for k in self._porter.memory()})
        self.clock = int(state["clock"])
        models = [self._bank.models[v] for v in self._variant.tolist()]
        self._scenes.set_models(range(self.n), models)
        prefix = "physics_"
        self._scenes.load_physics(
            {k.removeprefix(prefix): v for k, v in state.items() if k.startswith(prefix)}
        )


_EPISODES = ("episode", "steps", "held", "return", "kind", "variant", "stages")
