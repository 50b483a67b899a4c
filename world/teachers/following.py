"""A tracker that is watched as it follows clips: the states from which it went on are physical."""

from collections.abc import Callable, Mapping

import torch
from torch import Tensor

from world import tasks
from world.scene.batch import Scenes
from world.scene.target import Target
from world.tasks.track import Track
from world.tracking import rollouts
from world.tracking.rollouts import Rollouts
from world.tracking.target import tracked

#: A state is good if the tracker went on from it for so many control steps, or to the clip's end.
GOES_ON = 30
#: So many control steps after the start nothing is left of the reference state.
_SIMULATED = 10


class WatchedTracker:
    """Labels scenes that follow clips as its tracker does, and keeps what came of it; a
    world.teachers.teacher.Teacher."""

    def __init__(self, act: Callable[[Tensor, Tensor], Tensor], scenes: int, each: int) -> None:
        """act: actions [n, 28] of states and goals of the task track; each: boxes of a clip."""
        self._act, self._task, self._each = act, Track(), each
        self._episode = torch.zeros(scenes, dtype=torch.int64)
        self._age = torch.zeros(scenes, dtype=torch.int64)
        self._seen: list[dict[str, Tensor]] = []

    def reset(self, rows: Tensor, target: Target) -> None:
        """New episodes begin in these scenes."""
        self._episode[rows] += 1
        self._age[rows] = 0

    def label(self, scenes: Scenes, target: Target, variant: Tensor, clock: int) -> Tensor:
        """The tracker's own actions [n, 28]."""
        body, there = scenes.body(), tracked(target)
        action = self._act(tasks.state(body, there), self._task.goal_features(body, there))
        qpos, box, speed = scenes.qpos.float(), scenes.free_qpos.float(), scenes.free_qvel.float()
        qpos[:, :3] -= there.origin
        if box.shape[1] == 0:
            box, speed = torch.zeros(len(qpos), 7), torch.zeros(len(qpos), 6)
        else:
            box, speed = box[:, :7].clone(), speed[:, :6]
            box[:, :3] -= there.origin
        self._seen.append(
            {
                "episode": self._episode.clone(),
                "age": self._age.clone(),
                "frame": there.frame.clone(),
                "ends": there.reference.stop[there.clip()] - 1 <= there.frame + 1,
                "key": rollouts.keys(there.frame, variant, self._each),
                "qpos": qpos,
                "qvel": scenes.qvel.float(),
                "box": box,
                "box_velocity": speed,
            }
        )
        self._age += 1
        return action

    def rollouts(self, seed: int) -> Rollouts:
        """Return the states that were good, some for each frame and box, chosen by the seed."""
        seen = {name: torch.stack([row[name] for row in self._seen]) for name in self._seen[0]}
        good = went_on(seen["episode"], seen["ends"]) & (seen["age"] >= _SIMULATED)
        late = torch.nonzero(good.flatten()).flatten()
        key = seen["key"].flatten()
        order = late[rollouts.kept(key[late], torch.Generator().manual_seed(seed))]
        names = ("qpos", "qvel", "box", "box_velocity")
        states = {name: seen[name].flatten(0, 1)[order] for name in names}
        return Rollouts(key=key[order], **states)

    def state_dict(self) -> dict[str, Tensor]:
        """Nothing: it is not continued."""
        return {}

    def load_state_dict(self, state: Mapping[str, Tensor]) -> None:
        """Nothing."""


def went_on(episode: Tensor, ends: Tensor) -> Tensor:
    """Return [T, n] bool: after this step the episode went on for GOES_ON steps, or ended before
    with its clip; false where the watch was over before that was known.

    episode [T, n]: its number; ends [T, n]: the clip's last frame comes next.
    """
    good, steps = torch.zeros_like(ends), len(episode)
    for ahead in range(min(GOES_ON, steps - 1)):
        here, there, after = (
            episode[: steps - 1 - ahead],
            episode[ahead : steps - 1],
            episode[ahead + 1 :],
        )
        good[: steps - 1 - ahead] |= (here == there) & ends[ahead : steps - 1] & (after != there)
    if steps > GOES_ON:
        good[:-GOES_ON] |= episode[GOES_ON:] == episode[:-GOES_ON]
    return good
