"""The page "Features and goals" is enough to build the inputs: a reader with numpy gets ours."""

import re
from typing import Any

import numpy as np
import pytest
import torch

from docs.generate import features as page
from world import rotations
from world.character import features
from world.character import model as character
from world.scene.target import BoxState
from world.tasks import REGISTRY, Target, state

STATES = 10
ROW = re.compile(r"^\| (.+) \|$")


def sections(text: str) -> dict[str, list[list[str]]]:
    """The rows of the page's tables, cells as text, by heading."""
    found: dict[str, list[list[str]]] = {}
    title = ""
    for line in text.splitlines():
        if line.startswith("## "):
            title = line[3:].split(",")[0]
        elif (row := ROW.match(line)) and not line.startswith("| ---"):
            cells = [c.strip().strip("`") for c in row[1].replace("\\|", "¦").split(" | ")]
            found.setdefault(title, []).append([c.replace("¦", "|") for c in cells])
    return {name: rows[1:] for name, rows in found.items()}


PAGE = sections(page.page())


def unit(q: np.ndarray) -> np.ndarray:
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


@pytest.fixture(scope="module")
def poses() -> tuple[np.ndarray, np.ndarray]:
    """Ten states: qpos [10, 43] and qvel [10, 34]."""
    random = np.random.default_rng(7)
    qpos = np.tile(character.standing_qpos(), (STATES, 1))
    qpos[:, :3] += random.normal(0.0, 1.0, (STATES, 3))
    qpos[:, 3:7] = unit(np.array([1.0, 0.0, 0.0, 0.0]) + random.normal(0.0, 0.5, (STATES, 4)))
    for address in character.BALL_QPOS:
        turned = np.array([1.0, 0.0, 0.0, 0.0]) + random.normal(0.0, 0.4, (STATES, 4))
        qpos[:, address : address + 4] = unit(turned)
    qpos[:, list(character.HINGE_QPOS)] = random.uniform(0.0, 2.5, (STATES, 4))
    return qpos, random.normal(0.0, 2.0, (STATES, 34))


def scenes(with_box: bool) -> tuple[Target, list[dict[str, Any]]]:
    """Ten objects as the tasks have them, and as the page names their quantities."""
    random = np.random.default_rng(8)
    yaw = random.uniform(-np.pi, np.pi, STATES)
    facing = np.stack((np.cos(yaw), np.sin(yaw)), axis=1)
    upright = np.stack((np.cos(yaw / 2), 0 * yaw, 0 * yaw, np.sin(yaw / 2)), axis=1)
    far = np.linspace(0.3, 9.0, STATES)[:, None]
    point = far * np.array([[0.6, 0.8, 0.05]]) + random.normal(0.0, 0.1, (STATES, 3))
    head, target = (point + random.normal(0.0, 1.0, (STATES, 3)) for _ in range(2))
    rotation = unit(upright + random.normal(0.0, 0.3, (STATES, 4))) if with_box else upright
    centre, velocity = point, random.normal(0.0, 1.0, (STATES, 3))
    half = random.uniform(0.1, 0.3, (STATES, 3))
    box = BoxState(*(tensor(x) for x in (centre, rotation, velocity, half, centre, target)))
    corners = box.corners()
    place = Target(tensor(point), tensor(facing), corners, tensor(head), box if with_box else None)
    floor = point * np.array([1.0, 1.0, 0.0])
    named = [
        {
            "o": centre[i] if with_box else floor[i],
            "Q_o": rotation[i],
            "c": corners[i].numpy().astype(float),
            "u": point[i],
            "h": head[i],
            "b_v": velocity[i],
            "t": target[i],
        }
        for i in range(STATES)
    ]
    return place, named


def tensor(x: np.ndarray) -> torch.Tensor:
    return torch.from_numpy(x).float()


def inputs(qpos: np.ndarray, qvel: np.ndarray) -> dict[str, Any]:
    """One state by the names of the page."""
    found: dict[str, Any] = {"p": qpos[:3], "q": qpos[3:7], "v": qvel[:3], "w": qvel[3:6]}
    q, v = 7, 6
    for joint in character.JOINTS:
        if joint.is_ball:
            found |= {f"Q_{joint.name}": qpos[q : q + 4], f"w_{joint.name}": qvel[v : v + 3]}
            q, v = q + 4, v + 3
        else:
            found |= {f"a_{joint.name}": qpos[q], f"w_{joint.name}": qvel[v]}
            q, v = q + 1, v + 1
    return found


def evaluated(named: dict[str, Any], table: str) -> np.ndarray:
    """The numbers of one table, by the page's own definitions and numpy alone."""
    known = {"np": np, **named}
    for name, _, _, _, expression in PAGE["Definitions"]:
        known[name] = eval(expression, known)
    rows = PAGE[table]
    numbers = []
    for place, name, _, _, formula in rows:
        assert formula, f"feature {name} of {table} has no formula"
        part = np.atleast_1d(eval(formula, known))
        first, _, last = place.partition("-")
        assert len(numbers) == int(first), name
        numbers += part.tolist()
        assert len(numbers) == int(last or first) + 1, name
    return np.array(numbers)


def with_meanings() -> set[str]:
    """Tasks whose goals need a reference motion: the page describes their features in words."""
    return {n for n, task in REGISTRY.items() if all(f.meaning for f in task.goal)}


def test_each_goal_has_formulas_or_meanings() -> None:
    assert with_meanings() == {"track"}
    for task in REGISTRY.values():
        assert all(bool(f.formula) != bool(f.meaning) for f in task.goal)


@pytest.mark.parametrize("task", sorted(set(REGISTRY) - with_meanings()))
def test_the_page_gives_the_inputs_of_ten_states(
    task: str, poses: tuple[np.ndarray, np.ndarray]
) -> None:
    qpos, qvel = poses
    rows = PAGE[f"Goal of {task}"]
    place, objects = scenes(with_box=any("b_v" in row[-1] for row in rows))
    body = features.body(tensor(qpos), tensor(qvel))
    ours = torch.cat((state(body, place), REGISTRY[task]().goal_features(body, place)), dim=1)
    for i in range(STATES):
        named = inputs(qpos[i], qvel[i]) | objects[i]
        theirs = np.concatenate((evaluated(named, "State"), evaluated(named, f"Goal of {task}")))
        np.testing.assert_allclose(theirs, ours[i].numpy(), atol=1e-5, rtol=1e-5)


def test_sit_takes_143_numbers() -> None:
    goal = PAGE["Goal of sit"]
    assert PAGE["State"][-1][0].endswith("-113") and goal[-1][0].endswith("-28")


def test_names_of_the_scene_are_all_on_the_page(poses: tuple[np.ndarray, np.ndarray]) -> None:
    named = {row[0] for row in PAGE["Inputs of the character"] + PAGE["Inputs of the scene"]}
    assert named == set(inputs(poses[0][0], poses[1][0])) | set(scenes(False)[1][0])


def test_the_heading_of_the_page_is_ours(poses: tuple[np.ndarray, np.ndarray]) -> None:
    q = poses[0][:, 3:7]
    yaw = 2 * np.arctan2(q[:, 3], q[:, 0])
    ours = rotations.heading(tensor(q)).numpy()
    np.testing.assert_allclose(np.stack((np.cos(yaw), np.sin(yaw)), axis=1), ours, atol=1e-5)
