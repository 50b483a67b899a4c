"""Tables of an evaluation on the terminal, with the published results."""

from collections.abc import Iterator
from typing import Any

from rich.table import Table

from console.evaluation.presets import published

#: Figures of motion quality: key, name, factor and unit.
QUALITY = (
    ("foot_skate_m_s", "foot skating", 100.0, "cm/s"),
    ("furniture_overlap_m", "overlap with furniture in contact", 1000.0, "mm"),
    ("furniture_overlap_p99_m", "overlap with furniture, 99th percentile", 1000.0, "mm"),
    ("jerk_m_s3", "jerk", 1.0, "m/s³"),
    ("jerk_p95_m_s3", "jerk, 95th percentile", 1.0, "m/s³"),
    ("joint_speed_rad_s", "joint speed", 1.0, "rad/s"),
    ("tremor_share", "joint power above 5 Hz", 100.0, "%"),
)


def tables(figures: dict[str, Any]) -> Iterator[Table]:
    """Yield the tables of an evaluation JSON."""
    yield results_table(figures)
    if "quality" in figures:
        yield quality_table(figures["quality"])


def results_table(figures: dict[str, Any]) -> Table:
    """Return the figures in the form of the paper's Table 1, with the published rows below."""
    start = figures["start_m"]
    perturbed = "" if figures["perturbation"] == "none" else f", {figures['perturbation']}"
    shown = Table(
        "", "success %", "95 %", "sustained %", "time s", "precision cm", "falls %",
        title=f"{figures['task']}: {figures['trials']} trials, {_pieces(figures)}, "
        f"{start[0]:g}-{start[1]:g} m{perturbed}, {figures['wall_s']:.0f} s",
        title_justify="left",
    )  # fmt: skip
    low, high = figures["success"]["ci95"]
    shown.add_row(
        "all",
        number(figures["success"]["rate"], 100),
        f"{100 * low:.1f}-{100 * high:.1f}",
        number(figures["sustained"]["rate"], 100),
        number(figures["time_s"]),
        number(figures["precision_m"], 100),
        number(figures["falls"], 100),
    )
    for row in published(figures["task"], figures["preset"], figures["perturbation"]):
        given = (row.success, row.time_s, row.precision_cm)
        success, seconds, precision = ("" if value is None else f"{value}" for value in given)
        shown.add_row(row.name, success, "", "", seconds, precision, "")
    shown.add_section()
    for part in figures["by_stage"]:
        low, high = part["ci95"]
        shown.add_row(part["stage"], number(part["rate"], 100), f"{100 * low:.1f}-{100 * high:.1f}")
    shown.add_section()
    for part in figures["by_distance"]:
        name = f"{part['from_m']:g}-{part['to_m']:g} m ({part['trials']})"
        shown.add_row(name, number(part["success"], 100))
    shown.add_section()
    for part in figures["by_class"]:
        low, high = part.get("ci95", (None, None))  # older figures lack it
        interval = "" if low is None else f"{100 * low:.1f}-{100 * high:.1f}"
        name = f"{part['class']} ({part['trials']})"
        shown.add_row(name, number(part["success"], 100), interval)
    return shown


def quality_table(quality: dict[str, Any]) -> Table:
    """Return the table of motion quality, of policy and of the clips that it is compared with."""
    reference = reference_of(quality)
    title = f"{quality['trials']} trials before any fall"
    if reference is None:
        shown = Table("motion quality", "policy", title=title, title_justify="left")
    else:
        shown = Table("motion quality", "policy", "clips", title_justify="left",
                      title=f"{title}; compared with {reference}")  # fmt: skip
    for name, ours, theirs in quality_rows(quality):
        shown.add_row(name, ours, *([] if reference is None else [theirs]))
    return shown


def reference_of(quality: dict[str, Any]) -> str | None:
    """Return what a policy's motion quality is compared with; None for no clips."""
    if quality["mocap"] is None:
        return None
    return quality.get("compared_with") or "mocap"


def quality_rows(quality: dict[str, Any]) -> list[tuple[str, str, str]]:
    """Return rows of name and unit, the policy's figure, the mocap's figure."""
    ours, theirs = quality["policy"], quality["mocap"] or {}
    rows = [
        (f"{name}, {unit}", number(ours[key], factor, 2), number(theirs.get(key), factor, 2))
        for key, name, factor, unit in QUALITY
    ]
    near, nearest = ours["nearest_mocap"] or {}, theirs.get("nearest_mocap") or {}
    rows += [
        (
            f"distance to the nearest mocap transition, {name}, σ",
            number(near.get(key), 1, 3),
            number(nearest.get(key), 1, 3),
        )
        for key, name in (("median", "median"), ("p95", "95th percentile"))
    ]
    distance = number(quality["spectral_distance_db"])
    rows.append(("spectrum of joint velocities, distance in dB", distance, "0.0"))
    style = number(theirs.get("style_reward"), 1, 3)
    rows.append(("style reward, −log(1 − D)", number(ours["style_reward"], 1, 3), style))
    return rows


def _pieces(figures: dict[str, Any]) -> str:
    """Return the number and the set of an evaluation's pieces; older figures lack the number."""
    count = figures.get("pieces")
    held = "held-out " if figures.get("held_out") else ""
    return f"{count or ''} {held}{figures['objects']} pieces".lstrip()


def number(value: float | None, scale: float = 1.0, digits: int = 1) -> str:
    """Return a figure as text; a dash for None."""
    return "-" if value is None else f"{scale * value:.{digits}f}"
