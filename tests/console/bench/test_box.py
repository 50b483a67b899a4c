"""The box's bench steps what it says: boxes in hand, the same motion with either kind of matrices,
another one with other cones."""

import torch

from console.bench import box as bench_box


def test_the_box_is_in_hand_and_only_cones_change_its_motion() -> None:
    torch.set_num_threads(1)  # as the command does: the policy is of four rows
    figures = bench_box.measure(4, seconds=0.0)
    assert figures["held_ratio"] > 0.8
    assert figures["to_dense_gap_rad_per_s"] < 1e-9 < 1e-4 < figures["to_pyramidal_gap_rad_per_s"]
    per_step = 1e6 / figures["control_steps_per_s"]
    assert abs(figures["us_per_step"] / per_step - 1.0) < 1e-9
