"""A self-contained page of one motion: 3-D replay, rewards over time, and origin."""

from collections.abc import Sequence
from html import escape

from console.report.charts import Line, chart
from console.report.page import document, player, table
from console.report.scene3d import drawable
from console.synthesis.motion import Motion
from policy.checkpoints import lineage


def page(motion: Motion) -> str:
    """Return the HTML of a motion."""
    task = motion.served.task
    title = f"inhabit {task.name}: {motion.piece}"
    outcome = f"{motion.seconds:.1f} s: {motion.outcome()}."
    take = drawable(motion.track) | {
        "about": outcome,
        "success_m": task.success_m,
        "fell": motion.fell_at is not None,
    }
    if motion.frames[-1].HasField("style_score"):
        take["style"] = [round(frame.style_score, 3) for frame in motion.frames]
    sections = (
        f"<h1>{escape(title)}</h1><p class='soft'>{escape(outcome)}</p>",
        player([task.name]),
        f'<h2>Over time</h2><div class="grid-of">{"".join(_charts(motion))}</div>',
        f"<h2>Origin</h2>{table(('', ''), _facts(motion), words=True)}",
    )
    return document(title, sections, [take])


def _charts(motion: Motion) -> list[str]:
    times = [frame.time_s for frame in motion.frames]

    def line(name: str, values: Sequence[float]) -> Line:
        return Line(name, tuple(zip(times, values, strict=True)))

    frames, terms = motion.frames, tuple(motion.served.task.terms)
    rewards = [line(name, [f.reward_terms[i] for f in frames]) for i, name in enumerate(terms)]
    found = [
        chart("distance from the target, m", [line("distance", [f.error_m for f in frames])], "s"),
        chart("reward of the task", [line("reward", [f.reward for f in frames])], "s"),
        chart("reward terms, unweighted", rewards, "s"),
    ]
    # the first frame ends no transition and has no score
    scored = [f for f in frames if f.HasField("style_score")]
    style = Line("style", tuple((f.time_s, f.style_score) for f in scored))
    return [*found, chart("style score", [style], "s")]


def _facts(motion: Motion) -> list[tuple[str, str]]:
    served, summary = motion.served, motion.summary
    notes = served.manifest.notes
    facts = [
        ("policy", f"{served.task.name}, version {served.version}"),
        ("training samples", f"{served.manifest.samples / 1e6:.1f} M"),
        ("trained on", lineage.data(notes)),
        ("licence", motion.licence()),
        ("piece", motion.piece),
        ("frames", str(summary.frames)),
    ]
    if summary.balls_thrown:
        facts.append(("balls thrown", str(summary.balls_thrown)))
    if summary.displaced:
        facts.append(("furniture", "moved during the approach"))
    if not motion.frames[-1].HasField("style_score"):
        facts.append(("style score", "none: the checkpoint has no discriminator"))
    return facts
