"""A played source as one self-contained HTML file: 3-D replay, and curves over time."""

import math
from html import escape

import numpy as np
from numpy.typing import NDArray

from console.play.source import HZ, Curves, Source
from console.recording.format import AWAY_M
from console.report.charts import Line, chart
from console.report.page import document, player
from console.report.scene3d import drawn
from world.errors import ConfigError


def page(source: Source, title: str, about: str) -> str:
    """Return the HTML of a source; ConfigError for a source without a target."""
    curves = source.curves()
    if curves.error_m is None or curves.fell is None:
        raise ConfigError("only what has a goal can be exported; 'inhabit motions play --html' "
                          "writes clips")  # fmt: skip
    fallen = np.flatnonzero(curves.fell)
    end = int(fallen[0]) if len(fallen) else len(source)
    error = np.nan_to_num(curves.error_m, posinf=99.0)
    poses = np.stack([source.poses(frame) for frame in range(len(source))])
    # a ball out of the scene has no position
    data = drawn(source.model, np.nan_to_num(poses, nan=AWAY_M), error, end, source.piece) | {
        "about": about,
        "success_m": curves.success_m,
        "fell": bool(len(fallen)),
    }
    if curves.style is not None:
        # the viewer shows the style reward of a frame at the step that leaves it
        data["style"] = [None if math.isnan(x) else round(float(x), 3) for x in curves.style[1:]]
    charts = "".join(
        chart(name, lines, "s")
        for name, lines in (
            ("reward terms, unweighted", [_line(k, v) for k, v in curves.terms.items()]),
            ("distance from the goal, m", [_line("error", curves.error_m)]),
            ("style reward", [] if curves.style is None else [_line("style", curves.style)]),
            ("success", [_line("success", success(curves))]),
        )
    )
    note = f'<p class="soft">{escape(curves.missing)}</p>' if curves.missing else ""
    sections = (
        f"<h1>{escape(title)}</h1>",
        f"<p class='soft'>{escape(about)}</p>",
        player(["replay"]),
        f'<h2>Over time</h2><div class="grid-of">{charts}</div>{note}',
    )
    return document(title, sections, [data])


def success(curves: Curves) -> NDArray[np.float64]:
    """Return [T] 1 where the target is reached without a fall; requires errors and falls."""
    assert curves.error_m is not None and curves.fell is not None
    return ((curves.error_m <= curves.success_m) & ~curves.fell).astype(np.float64)


def _line(name: str, values: NDArray[np.float64]) -> Line:
    finite = np.flatnonzero(np.isfinite(values))
    return Line(name, tuple((int(i) / HZ, float(values[i])) for i in finite))
