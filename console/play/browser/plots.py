"""Plots of the last seconds: reward terms, style reward, distance and success."""

import colorsys

import numpy as np
import viser
from numpy.typing import NDArray

from console.play.page import success
from console.play.source import HZ, Curves

#: Time range of the plots, s.
_SECONDS = 20
_COLOURS = ("#2f6fb3", "#c8553d", "#3a8f5c", "#8a5bb0", "#b98a1d", "#46888f")
#: Step of the hue of further colours: the golden ratio keeps any number of them apart.
_GOLDEN = 0.6180339887
_HEIGHT = 170
_SUCCESS = "success"
_Y: dict[str, viser.uplot.Scale] = {_SUCCESS: {"range": (-0.05, 1.05)}}


def series_of(curves: Curves, weights: dict[str, float]) -> dict[str, dict[str, NDArray]]:
    """Return the plots: title -> name of a line -> its values [T]."""
    plots: dict[str, dict[str, NDArray]] = {}
    if curves.terms:
        plots["reward terms (weight)"] = {
            f"{name} ({weights[name]:g})" if name in weights else name: values
            for name, values in curves.terms.items()
        }
    if curves.style is not None:
        plots["style reward"] = {"style": curves.style}
    if curves.error_m is not None and curves.fell is not None:
        limit = np.full(len(curves.error_m), curves.success_m)
        plots["distance from the goal, m"] = {"distance": curves.error_m, "success below": limit}
        plots[_SUCCESS] = {"success": success(curves), "fallen": curves.fell.astype(np.float64)}
    return plots


def colour_of(number: int) -> str:
    """Return the colour of the line `number`, from 0; lines of one plot have different ones."""
    if number < len(_COLOURS):
        return _COLOURS[number]
    hue = (number * _GOLDEN) % 1.0
    rgb = colorsys.hls_to_rgb(hue, 0.35 + 0.1 * (number % 3), 0.55)
    return "#" + "".join(f"{round(255 * part):02x}" for part in rgb)


def window(frame: int) -> slice:
    """Return the frames of the plots at `frame`: the last ones up to it."""
    return slice(max(0, frame + 1 - _SECONDS * HZ), frame + 1)


def points(lines: dict[str, NDArray], frames: slice) -> tuple[NDArray, ...]:
    """Return times (s) and values of the frames in which all lines are finite: uPlot draws no line
    with NaN."""
    values = [line[frames] for line in lines.values()]
    finite = np.isfinite(values).all(axis=0)
    seconds = np.arange(frames.start, frames.stop) / HZ
    return (seconds[finite], *(line[finite] for line in values))


class Plots:
    """The plots of one source, created in the current folder of the page."""

    def __init__(
        self, server: viser.ViserServer, curves: Curves, weights: dict[str, float]
    ) -> None:
        self._weights = weights
        self._parts: list[viser.GuiUplotHandle | viser.GuiMarkdownHandle] = []
        if curves.missing:
            self._parts.append(server.gui.add_markdown(f"*{curves.missing}*"))
        self._plots: dict[str, viser.GuiUplotHandle] = {}
        for title, lines in series_of(curves, weights).items():
            self._plots[title] = server.gui.add_uplot(
                data=(np.zeros(1), *(np.zeros(1) for _ in lines)),
                series=(
                    {"label": "s"},
                    *(
                        {"label": name, "stroke": colour_of(number), "width": 1.5}
                        for number, name in enumerate(lines)
                    ),
                ),
                title=title,
                scales={"x": {"time": False}, "y": _Y.get(title, {"auto": True})},
                height=_HEIGHT,
            )
        self._parts += self._plots.values()

    def draw(self, curves: Curves, frame: int) -> None:
        """Draw the values up to a frame."""
        here = window(frame)
        for title, lines in series_of(curves, self._weights).items():
            data = points(lines, here)
            if len(data[0]):
                self._plots[title].data = data

    def show(self, visible: bool) -> None:
        """Show or hide the plots."""
        for part in self._parts:
            part.visible = visible


def kind_of(curves: Curves, weights: dict[str, float]) -> tuple:
    """Return what two sources have in common that can be drawn in the same plots."""
    lines = {title: tuple(lines) for title, lines in series_of(curves, weights).items()}
    return curves.missing, tuple(lines.items())
