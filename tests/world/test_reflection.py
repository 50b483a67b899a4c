"""The mirror image of features and actions."""

import torch

from world.character import features
from world.character import model as character
from world.motions.clip import Clip, mirrored


def test_mirrored_features_are_the_features_mirrored(imported: Clip) -> None:
    own_features = features.body(
        torch.from_numpy(imported.qpos()), torch.from_numpy(imported.qvel())
    ).features
    other = mirrored(imported)
    theirs = features.body(torch.from_numpy(other.qpos()), torch.from_numpy(other.qvel())).features
    table, expected = features.STATE, torch.empty_like(own_features)
    vector, axial = torch.tensor([1.0, -1, 1]), torch.tensor([-1.0, 1, -1])
    # columns x and z of M R M, with M the reflection of y
    columns = torch.tensor([1.0, -1, 1, 1, -1, 1])
    swap = {"right": "left", "left": "right"}
    for feature in table:
        if feature.name.startswith("object") or feature.name == "joint_velocity":
            continue
        name = feature.name
        for side in swap:
            if f"_{side}_" in feature.name:
                name = feature.name.replace(side, swap[side])
        value = own_features[:, table.slice(name)]
        sign: torch.Tensor | float = 1.0
        if "rotation" in name:
            sign = columns
        elif name == "root_angular_velocity":
            sign = axial
        elif name == "root_linear_velocity" or name.startswith("position"):
            sign = vector
        expected[:, table.slice(feature.name)] = value * sign
    speed = own_features[:, table.slice("joint_velocity")]
    rows: dict[str, torch.Tensor] = {}
    column = 0
    for joint in character.JOINTS:
        width = len(joint.range_deg)
        rows[joint.name] = speed[:, column : column + width] * (axial if joint.is_ball else 1.0)
        column += width
    swapped = [
        rows[j.name.replace(s, swap[s])] if (s := j.name.split("_")[0]) in swap else rows[j.name]
        for j in character.JOINTS
    ]
    expected[:, table.slice("joint_velocity")] = torch.cat(swapped, dim=1)
    width = features.BODY_WIDTH
    torch.testing.assert_close(theirs[:, :width], expected[:, :width], atol=2e-4, rtol=0)
