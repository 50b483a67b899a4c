"""The metrics file: cut where a run goes on, and the same figures elsewhere."""

import json
import math

from console.run.metrics import JsonLines, TensorBoard, read_metrics, truncate_metrics


def test_metrics_are_cut_where_a_resumed_run_goes_on(tmp_path):
    path = tmp_path / "metrics.jsonl"
    lines = JsonLines(path)
    for iteration in range(1, 6):
        lines.write({"iteration": iteration, "ppo/kl": math.nan})
    lines.close()
    with path.open("a") as file:
        file.write('{"iteration": 6, "ppo')  # killed in the middle of a line
    assert [line["iteration"] for line in read_metrics(path)] == [1, 2, 3, 4, 5]
    assert truncate_metrics(path, 3) == 2
    text = path.read_text().splitlines()
    assert [json.loads(line)["iteration"] for line in text] == [1, 2, 3]
    assert json.loads(text[0])["ppo/kl"] is None


def test_tensorboard_reads_the_same_figures(tmp_path):
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    first = TensorBoard(tmp_path)
    for samples in (100, 200, 300):
        first.write({"iteration": 1, "samples": samples, "ppo/kl": samples / 8, "a/b": math.nan})
    first.close()
    again = TensorBoard(tmp_path, purge_step=201)  # resumed from 200 samples
    again.write({"samples": 300, "ppo/kl": 0.5})
    again.close()
    found = EventAccumulator(str(tmp_path)).Reload()
    assert found.Tags()["scalars"] == ["ppo/kl"]
    kept = [(event.step, event.value) for event in found.Scalars("ppo/kl")]
    assert kept == [(100, 12.5), (200, 25.0), (300, 0.5)]
