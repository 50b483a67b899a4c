"""The HTML of a report, self-contained."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from importlib import resources
from typing import Any

from console.evaluation.presets import published
from console.evaluation.tables import number, quality_rows
from console.report.charts import Line, chart

Figures = dict[str, Any]


@dataclass(frozen=True)
class Shown:
    """One trial to replay."""

    name: str
    """best, median or worst."""
    about: str
    data: Figures
    """Data of the viewer (of scene3d.drawable, with additions of the page)."""
    strip: str | None
    """Filmstrip as a data URI; None without offscreen rendering."""


@dataclass(frozen=True)
class Report:
    """Content of the page."""

    title: str
    subtitle: str
    """One sentence below the title."""
    main: Figures
    """Evaluation of the headline and of the tables by object."""
    evaluations: tuple[tuple[str, Figures], ...]
    """Name and JSON of each evaluation."""
    metrics: tuple[Figures, ...]
    """Lines of metrics.jsonl."""
    quality: Figures | None
    trials: tuple[Shown, ...]
    pictures: dict[str, str]
    """Piece -> data URI."""
    settings: Figures


def page(report: Report) -> str:
    """Return the HTML of a report."""
    sections = (
        _headline(report),
        _replay(report.trials),
        _evaluations(report),
        _by_object(report),
        _quality(report.quality),
        curves(report.metrics),
        settings(report.settings),
    )
    return document(report.title, sections, [shown.data for shown in report.trials])


def document(
    title: str, sections: Iterable[str], takes: Sequence[Figures], linked: bool = False
) -> str:
    """Return an HTML document of sections, with the takes of its player (`player`).

    linked: the document is embedded in a page, and style and viewer are the files page.css and
    viewer.js beside it, which many documents share; else it contains them.
    """
    embedded = ' class="embedded"' if linked else ""
    # "</" ends a script element
    packed = json.dumps(takes, separators=(",", ":")).replace("</", "<\\/")
    style = (
        '<link rel="stylesheet" href="page.css">'
        if linked
        else f"<style>{shared('page.css')}</style>"
    )
    script = (
        '<script src="viewer.js"></script>' if linked else f"<script>{shared('viewer.js')}</script>"
    )
    return (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8">'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">'
        f'<meta name="generator" content="inhabit">'
        f"<title>{escape(title)}</title>{style}</head>"
        f"<body{embedded}>"
        f"{''.join(sections)}"
        f'<script type="application/json" id="takes">{packed}</script>'
        f"{script}</body></html>\n"
    )


def shared(name: str) -> str:
    """Return the text of a file that documents contain or share: page.css or viewer.js."""
    return resources.files("console.report").joinpath("data", name).read_text()


def table(
    head: Sequence[str],
    rows: Iterable[Sequence[str]],
    marked: Sequence[str] = (),
    words: bool = False,
) -> str:
    """Return a table; rows with a first cell in `marked` are styled as published results. words:
    cells hold words, which wrap, instead of numbers."""
    cells = "".join(f"<th>{escape(cell)}</th>" for cell in head)
    body = []
    for row in rows:
        kind = ' class="published"' if row[0] in marked else ""
        body.append(f"<tr{kind}>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>")
    style = ' class="words"' if words else ""
    return f'<div class="wide"><table{style}><tr>{cells}</tr>{"".join(body)}</table></div>'


def percent(rate: dict[str, Any]) -> str:
    """Return a rate with its interval, as `73.1 % (71.7-74.4)`."""
    low, high = rate["ci95"]
    return f"{100 * rate['rate']:.1f} % ({100 * low:.1f}-{100 * high:.1f})"


def _headline(report: Report) -> str:
    main = report.main
    low, high = main["success"]["ci95"]
    figures = (
        (
            "success",
            number(main["success"]["rate"], 100) + " %",
            f"{100 * low:.1f}-{100 * high:.1f}",
        ),
        ("sustained", number(main["sustained"]["rate"], 100) + " %", "held 1 s, no fall after"),
        ("time", number(main["time_s"]) + " s", "over successes"),
        ("precision", number(main["precision_m"], 100) + " cm", "over successes"),
        ("falls", number(main["falls"], 100) + " %", "within the limit"),
    )
    return (
        f"<h1>{escape(report.title)}</h1><p class='soft'>{escape(report.subtitle)}</p>"
        f"{cards(figures)}"
    )


def cards(figures: Iterable[tuple[str, str, str]]) -> str:
    """Return figures of a headline: names, values and notes."""
    boxes = "".join(
        f'<div>{escape(name)}<b>{escape(value)}</b><span class="soft">{escape(note)}</span></div>'
        for name, value, note in figures
    )
    return f'<div class="headline">{boxes}</div>'


def _replay(trials: Sequence[Shown]) -> str:
    if not trials:
        return ""
    strips = "".join(
        f'<figure class="strip"><img src="{t.strip}" alt="filmstrip of the {escape(t.name)} trial">'
        f"<figcaption>{escape(t.name)}: {escape(t.about)}</figcaption></figure>"
        for t in trials
        if t.strip
    )
    if not strips:
        strips = '<p class="soft">No filmstrips: no offscreen rendering on this machine.</p>'
    return f"<h2>Best, median and worst trial</h2>{player([t.name for t in trials])}{strips}"


def player(names: Sequence[str], follows: bool = False) -> str:
    """Return the 3-D player of the document's takes, with one button per name. follows: the takes
    show a reference as a ghost, and the curve is the distance from it."""
    buttons = "".join(
        f'<button data-take="{i}" aria-pressed="{str(i == 0).lower()}">{escape(name)}</button>'
        for i, name in enumerate(names)
    )
    return (
        f'<div id="replay"><div class="row">{buttons}<span class="soft" data-part="about"></span>'
        '</div><canvas data-part="canvas"></canvas>'
        '<div class="row"><button data-part="play">pause</button>'
        '<select data-part="speed" aria-label="speed"><option value="0.25">¼×</option>'
        '<option value="1" selected>1×</option><option value="3">3×</option></select>'
        f'{_GHOST if follows else ""}<span class="soft" data-part="status"></span></div>'
        '<div class="row">'
        '<input type="range" min="0" value="0" data-part="slider" aria-label="moment"></div>'
        '<svg viewBox="0 0 1000 60" preserveAspectRatio="none" data-part="curve"></svg>'
        f'<p class="soft">Drag to turn, scroll to zoom. {_FOLLOWED if follows else _AIMED}</p>'
        "</div>"
    )


_GHOST = '<label><input type="checkbox" data-part="ghost" checked> reference</label>'
_AIMED = "The curve is the distance from the target; the dashed line is the limit of success."
_FOLLOWED = (
    "The translucent character is the reference. The curve is the distance of the roots on the"
    " floor; the trial ends above the dashed line."
)


def _evaluations(report: Report) -> str:
    rows: list[tuple[str, ...]] = []
    marked: list[str] = []
    for name, figures in report.evaluations:
        start = figures["start_m"]
        rows.append(
            (
                name,
                str(figures["trials"]),
                f"{figures['objects']}, {start[0]:g}-{start[1]:g} m, {figures['perturbation']}",
                percent(figures["success"]),
                number(figures["sustained"]["rate"], 100),
                number(figures["time_s"]),
                number(figures["precision_m"], 100),
                number(figures["falls"], 100),
            )
        )
    main = report.main
    task, preset = main["task"], main.get("preset", "table1")
    for row in published(task, preset, "none"):
        marked.append(row.name)
        given = (row.success, row.time_s, row.precision_cm)
        success, seconds, precision = ("" if value is None else f"{value}" for value in given)
        rows.append((row.name, "", "", success, "", seconds, precision, ""))
    for row in published(task, preset, "projectiles"):
        marked.append(f"{row.name}, perturbed")
        rows.append((f"{row.name}, perturbed", "", "", f"{row.success}", "", "", "", ""))
    head = ("", "trials", "protocol", "success (95 %)", "sustained %", "time s", "precision cm",
            "falls %")  # fmt: skip
    stages = table(
        ("stage", "trials that reached it (95 %)"),
        [(part["stage"], percent(part)) for part in main.get("by_stage", ())],
    )
    distances = table(
        ("initial distance", "trials", "success %"),
        [
            (
                f"{part['from_m']:g}-{part['to_m']:g} m",
                str(part["trials"]),
                number(part["success"], 100),
            )
            for part in main["by_distance"]
        ],
    )
    by_stage = f"<h2>By stage</h2>{stages}" if main.get("by_stage") else ""
    return (
        f"<h2>Evaluations</h2>{table(head, rows, marked)}{by_stage}<h2>By distance</h2>{distances}"
    )


def _by_object(report: Report) -> str:
    figures = []
    for part in report.main["by_object"]:
        name, success = part["object"], part["success"]
        picture = report.pictures.get(name)
        image = f'<img src="{picture}" alt="{escape(name)}">' if picture else ""
        figures.append(
            f"<figure>{image}<figcaption>{escape(name)}<br>"
            f"{100 * success:.1f} % of {part['trials']}"
            f'<div class="bar"><i style="width:{100 * success:.1f}%"></i></div>'
            "</figcaption></figure>"
        )
    return f'<h2>By object</h2><div class="pieces">{"".join(figures)}</div>'


def _quality(quality: Figures | None) -> str:
    if quality is None:
        return ""
    rows = table(("motion quality", "policy", "mocap"), quality_rows(quality))
    spectrum = quality["spectrum"]
    lines = [
        Line(name, tuple(zip(spectrum["hz"][1:], spectrum[key][1:], strict=True)))
        for name, key in (("policy", "policy"), ("mocap", "mocap"))
        if spectrum[key]
    ]
    drawn = chart("joint velocities, (rad/s)²/Hz", lines, "Hz", logarithmic=True)
    return (
        f"<h2>Motion quality</h2><p class='soft'>{quality['trials']} trials before any fall, and "
        "the same figures of the motion capture. The distance is in standard deviations of each "
        "feature; the mocap's is that of each clip to the other clips. Furniture of the mocap was "
        f"not recorded: it is placed as in reference states.</p>{rows}"
        f'<div class="grid-of">{drawn}</div>'
    )


#: Title, metrics by name (the part after the last slash is the line's name), logarithmic or not.
_CHARTS = (
    ("episode success and falls", ("episode/success", "episode/fall"), False),
    ("episode return", ("episode/return",), False),
    ("episode length, steps", ("episode/length",), False),
    ("reward: task and style", ("reward/task", "reward/style"), False),
    ("discriminator accuracy", ("style/accuracy_mocap", "style/accuracy_policy"), False),
    ("discriminator loss and penalty", ("style/loss", "style/penalty"), True),
    ("KL of the update", ("ppo/kl",), True),
    ("clip fraction, explained variance", ("ppo/clip_fraction", "ppo/value_explained"), False),
    ("action noise σ", ("ppo/sigma",), False),
    ("samples a second", ("rate/samples_per_s",), False),
)


def curves(metrics: Sequence[Figures]) -> str:
    """Return the curves of a training, of the lines of its metrics.jsonl."""
    if len(metrics) < 2:
        return ""
    keys = {key for line in (metrics[0], metrics[-1]) for key in line}
    rewards = tuple(
        sorted(key for key in keys if key.startswith("reward/") and key[7:] not in _TOTALS)
    )
    stages = tuple(sorted(key for key in keys if key.startswith("episode/stage_")))
    wanted = (*_CHARTS[:4], ("reward terms", rewards, False), ("stages", stages, False))
    drawn = []
    for title, names, logarithmic in (*wanted, *_CHARTS[4:]):
        lines = [
            Line(name.rpartition("/")[2].removeprefix("stage_"), _series(metrics, name))
            for name in names
        ]
        drawn.append(chart(title, lines, "M samples", logarithmic))
    return f'<h2>Training</h2><div class="grid-of">{"".join(drawn)}</div>'


_TOTALS = ("task", "style")


def _series(metrics: Sequence[Figures], name: str) -> tuple[tuple[float, float], ...]:
    return tuple(
        (line["samples"] / 1e6, float(line[name]))
        for line in metrics
        if line.get(name) is not None and "samples" in line
    )


def settings(resolved: Figures) -> str:
    """Return all settings, folded."""
    text = escape(json.dumps(resolved, indent=1))
    return (
        "<h2>Settings</h2><details><summary>all resolved settings</summary>"
        f"<pre>{text}</pre></details>"
    )
