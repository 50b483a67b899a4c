"""A contact sheet of furniture: each piece from the front and above, with its use points."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from PIL.PngImagePlugin import PngInfo

from console import existing, lettering
from world.errors import PieceError
from world.furniture.piece import Piece
from world.furniture.surface import polygons
from world.partial_files import replacing

CELL = 220
"""Width and height of a piece's picture, pixels."""
CAPTION = 34
_YAW_DEG, _PITCH_DEG = 35.0, 28.0
_SEAT, _LIE, _INK, _PAPER = (214, 69, 42), (36, 94, 178), (40, 40, 40), (250, 249, 246)
_LIGHT = np.array([0.45, 0.25, 0.86])

Array = NDArray[np.float64]


def view(yaw_deg: float = _YAW_DEG, pitch_deg: float = _PITCH_DEG) -> Array:
    """Return the rotation [3, 3] to the viewer's axes: right, up, towards the viewer."""
    yaw, pitch = math.radians(yaw_deg), math.radians(pitch_deg)
    towards = np.array(
        [
            math.cos(pitch) * math.cos(yaw),
            math.cos(pitch) * math.sin(yaw),
            math.sin(pitch),
        ]
    )
    right = np.array([-math.sin(yaw), math.cos(yaw), 0.0])
    return np.stack((right, np.cross(towards, right), towards))


def picture(piece: Piece, cell: int = CELL) -> Image.Image:
    """Return the picture of a piece, drawn at twice its size for smooth edges."""
    image = Image.new("RGB", (2 * cell, 2 * cell), _PAPER)
    draw = ImageDraw.Draw(image)
    turn = view()
    low, high = piece.bounds()
    centre = (low + high) / 2
    corners = (piece.corners() - centre) @ turn.T
    scale = 1.7 * cell / max(0.9, float(np.ptp(corners[:, :2], axis=0).max()))

    def flat(points: Array) -> list[tuple[float, float]]:
        local = (points - centre) @ turn.T
        return [(cell + scale * x, cell - scale * y) for x, y, _ in local]

    shown = []
    for face in polygons(piece):
        normal = np.cross(face[1] - face[0], face[2] - face[0])
        normal = normal / max(float(np.linalg.norm(normal)), 1e-12)
        if float(normal @ turn[2]) > 0.0:
            shown.append((float((face @ turn[2]).mean()), face, normal))
    for _, face, normal in sorted(shown, key=lambda item: item[0]):
        shade = 0.55 + 0.45 * max(0.0, float(normal @ _LIGHT))
        colour = tuple(round(c * shade) for c in (205, 176, 138))
        draw.polygon(flat(face), fill=colour)
    for place in piece.sit:
        point = np.array(place.point_m)
        ahead = point + 0.35 * np.array(
            [math.cos(place.facing_rad), math.sin(place.facing_rad), 0.0]
        )
        _arrow(draw, flat(np.stack((point, ahead))), _SEAT)
    if piece.lie is not None:
        _arrow(draw, flat(np.array([piece.lie.hip_m, piece.lie.head_m])), _LIE)
    return image.resize((cell, cell), Image.Resampling.LANCZOS)


def _arrow(
    draw: ImageDraw.ImageDraw, ends: list[tuple[float, float]], colour: tuple[int, int, int]
) -> None:
    """Draw an arrow with a dot at its start."""
    (x0, y0), (x1, y1) = ends
    draw.line((x0, y0, x1, y1), fill=colour, width=6)
    draw.ellipse((x0 - 9, y0 - 9, x0 + 9, y0 + 9), fill=colour)
    angle = math.atan2(y1 - y0, x1 - x0)
    tips = [
        (x1 + 20 * math.cos(angle + turn), y1 + 20 * math.sin(angle + turn))
        for turn in (0.0, 2.5, -2.5)
    ]
    draw.polygon(tips, fill=colour)


def caption(piece: Piece) -> str:
    """Return two lines: the name, and size and use points."""
    found = [f"seat {piece.sit[0].point_m[2]:.2f} m"] if piece.sit else []
    found += ["lie"] if piece.lie is not None else []
    size = "x".join(f"{x:.2f}" for x in piece.size_m)
    name = piece.name if len(piece.name) < 34 else piece.name[:32] + ".."
    return f"{name}\n{size}  {', '.join(found)}"


def sheet(pieces: Sequence[Piece], columns: int = 8, cell: int = CELL) -> Image.Image:
    """Return the pictures of all pieces on one image, row by row."""
    columns = min(columns, len(pieces))
    rows = math.ceil(len(pieces) / columns)
    image = Image.new("RGB", (columns * cell, rows * (cell + CAPTION)), _PAPER)
    draw = ImageDraw.Draw(image)
    for index, piece in enumerate(pieces):
        row, column = divmod(index, columns)
        x, y = column * cell, row * (cell + CAPTION)
        image.paste(picture(piece, cell), (x, y))
        words, font = lettering.legible(caption(piece)), lettering.font()
        draw.multiline_text((x + 6, y + cell), words, fill=_INK, font=font, spacing=2)
    return image


def write(path: Path, pieces: Sequence[Piece]) -> None:
    """Write the sheet as PNG, atomically. Raises PieceError."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as partial:
            texts = PngInfo()
            texts.add_itxt(existing.PNG_DESCRIPTION, existing.MARK)
            sheet(pieces).save(partial, "PNG", optimize=True, pnginfo=texts)
    except OSError as error:
        raise PieceError(f"cannot write {path}: {error.strerror or error}") from error
