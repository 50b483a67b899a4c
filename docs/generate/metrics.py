"""The page of metrics."""

from console.run.metric_names import METRICS
from docs.generate.markdown import code, table

INTRODUCTION = """# Metrics

A training writes one line of JSON per iteration to `metrics.jsonl`, and the same numbers as
TensorBoard scalars over samples. A test trains for three iterations and compares the names with
this table. `TERM` and `STAGE` stand for the reward terms and stages of the task, which
[`inhabit train TASK --dry-run`](commands.md) lists, `START` for the kinds of initial states.
"""


def page() -> str:
    """Every metric with unit and meaning."""
    rows = ((code(m.name), m.unit, m.meaning, m.when) for m in METRICS)
    return INTRODUCTION + "\n" + table(("metric", "unit", "meaning", "written"), rows)
