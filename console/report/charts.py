"""Line charts as inline SVG, without script or library, for light and dark colour schemes."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from itertools import pairwise

Point = tuple[float, float]

WIDTH, HEIGHT = 360, 210
_LEFT, _RIGHT, _TOP, _BOTTOM = 46, 10, 36, 30
#: Number of points that a line is thinned to.
_POINTS = 240


@dataclass(frozen=True)
class Line:
    """One named line of a chart."""

    name: str
    points: tuple[Point, ...]
    """(x, y) in ascending x."""


def chart(title: str, lines: Sequence[Line], x_name: str, logarithmic: bool = False) -> str:
    """Return a chart as an `<svg>` element; "" if no line has two points.

    logarithmic: of the y axis; values of 0 or less are then left out.
    """
    thin = [Line(line.name, thinned(line.points)) for line in lines]
    if logarithmic:
        thin = [Line(line.name, tuple(p for p in line.points if p[1] > 0)) for line in thin]
    thin = [line for line in thin if len(line.points) > 1]
    if not thin:
        return ""
    xs = [x for line in thin for x, _ in line.points]
    ys = [y for line in thin for _, y in line.points]
    x_ticks = ticks(min(xs), max(xs))
    y_ticks = decades(min(ys), max(ys)) if logarithmic else ticks(min(ys), max(ys))
    left, right = min(xs), max(xs)
    low, high = min(y_ticks[0], min(ys)), max(y_ticks[-1], max(ys))

    def scaled(y: float) -> float:
        if logarithmic:
            return math.log(y / low) / math.log(high / low)
        return (y - low) / (high - low)

    def at(point: Point) -> Point:
        across = (point[0] - left) / (right - left or 1.0)
        return (
            _LEFT + across * (WIDTH - _LEFT - _RIGHT),
            HEIGHT - _BOTTOM - scaled(point[1]) * (HEIGHT - _TOP - _BOTTOM),
        )

    parts = [
        f'<svg class="chart" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" '
        f'aria-label="{escape(title)}">',
        f'<text class="title" x="{_LEFT}" y="15">{escape(title)}</text>',
    ]
    for y in y_ticks:
        _, height = at((left, y))
        parts.append(
            f'<line class="grid" x1="{_LEFT}" x2="{WIDTH - _RIGHT}" '
            f'y1="{height:.1f}" y2="{height:.1f}"/>'
            f'<text class="tick" x="{_LEFT - 5}" y="{height + 3.5:.1f}" '
            f'text-anchor="end">{shown(y)}</text>'
        )
    for x in x_ticks:
        if left <= x <= right:
            across, _ = at((x, y_ticks[0]))
            parts.append(
                f'<text class="tick" x="{across:.1f}" y="{HEIGHT - _BOTTOM + 14}" '
                f'text-anchor="middle">{shown(x)}</text>'
            )
    parts.append(
        f'<text class="tick" x="{WIDTH - _RIGHT}" y="{HEIGHT - 4}" '
        f'text-anchor="end">{escape(x_name)}</text>'
    )
    for index, line in enumerate(thin):
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in map(at, line.points))
        last = shown(line.points[-1][1])
        parts.append(
            f'<polyline class="line c{index % 6}" points="{path}">'
            f"<title>{escape(line.name)}: {last} at the end</title></polyline>"
        )
    if len(thin) > 1:
        parts += _legend([line.name for line in thin])
    return "".join([*parts, "</svg>"])


def _legend(names: Sequence[str]) -> list[str]:
    parts, x = [], float(_LEFT)
    for index, name in enumerate(names):
        parts.append(f'<text class="key c{index % 6}" x="{x:.0f}" y="26">● {escape(name)}</text>')
        x += 20 + 5.6 * len(name)
    return parts


def thinned(points: Sequence[Point], count: int = _POINTS) -> tuple[Point, ...]:
    """Return the finite points, or the means of `count` equal parts of them."""
    finite = [(x, y) for x, y in points if math.isfinite(x) and math.isfinite(y)]
    if len(finite) <= count:
        return tuple(finite)
    edges = [round(i * len(finite) / count) for i in range(count + 1)]
    means = []
    for first, last in pairwise(edges):
        part = finite[first:last]
        means.append((sum(x for x, _ in part) / len(part), sum(y for _, y in part) / len(part)))
    return tuple(means)


def ticks(low: float, high: float, about: int = 4) -> list[float]:
    """Return round numbers, 1, 2 or 5 times a power of ten apart, that enclose low and high."""
    if high <= low:
        low, high = low - 0.5, high + 0.5
    rough = (high - low) / about
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(f * power for f in (1, 2, 5, 10) if f * power >= rough * 0.999)
    first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    return [round(i * step, 12) for i in range(first, last + 1)]


def decades(low: float, high: float) -> list[float]:
    """Return powers of ten that enclose low and high, both above 0."""
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    return [10.0**i for i in range(first, max(last, first + 1) + 1)]


def shown(value: float) -> str:
    """Return a number as text of an axis."""
    if value == 0:
        return "0"
    if 1e-3 <= abs(value) < 1e4:
        return f"{value:.4g}"
    return f"{value:.0e}".replace("e+0", "e").replace("e-0", "e-")
