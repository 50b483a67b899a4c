"""Time profiles: minimum-jerk moves, quintic bridges, smoothing, and the walking pendulum."""

import itertools

import numpy as np

from world.motions.synthetic.rotations import Array

GRAVITY_M_S2 = 9.81


def minimum_jerk(fraction: Array) -> Array:
    """Position 0..1 of a minimum-jerk move at a fraction of its time (Flash & Hogan 1985)."""
    s = np.clip(fraction, 0.0, 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


def through(times_s: Array, knots: list[tuple[float, float]]) -> Array:
    """Values [T] that rest at each knot (time, value), with minimum-jerk moves between them."""
    value = np.full(len(times_s), float(knots[0][1]))
    for (start, before), (end, after) in itertools.pairwise(knots):
        value += (after - before) * minimum_jerk((times_s - start) / max(end - start, 1e-9))
    return value


End = tuple[Array | float, Array | float]
"""Position and velocity at an end of a bridge."""


def quintic(s: Array, span_s: float, start: End, end: End) -> Array:
    """Quintic bridge between two (position, velocity) ends with zero accelerations there.

    Args:
        s: fraction of the span, [n].
        span_s: duration of the bridge.
        start: position and velocity, each [d] (or scalar arrays), at s = 0.
        end: the same at s = 1.

    Returns:
        positions [n, d].
    """
    (p0, v0), (p1, v1) = (
        (np.atleast_1d(position), np.atleast_1d(velocity) * span_s)
        for position, velocity in (start, end)
    )
    s = np.clip(s, 0.0, 1.0)[:, None]
    blend = minimum_jerk(s)
    leave = s - 6 * s**3 + 8 * s**4 - 3 * s**5
    arrive = -4 * s**3 + 7 * s**4 - 3 * s**5
    return p0 * (1 - blend) + p1 * blend + v0 * leave + v1 * arrive


def smooth(values: Array, sigma_s: float, rate_hz: float) -> Array:
    """Gaussian smoothing along the first axis, ends held."""
    half = max(1, round(4 * sigma_s * rate_hz))
    kernel = np.exp(-0.5 * (np.arange(-half, half + 1) / (sigma_s * rate_hz)) ** 2)
    return convolve(values, kernel / kernel.sum())


def convolve(values: Array, kernel: Array) -> Array:
    """Centred convolution along the first axis with an odd kernel, ends held."""
    half = len(kernel) // 2
    flat = values.reshape(len(values), -1)
    padded = np.pad(flat, ((half, half), (0, 0)), mode="edge")
    columns = [np.convolve(column, kernel, mode="valid") for column in padded.T]
    return np.stack(columns, -1).reshape(values.shape)


def lower_envelope(values: Array, reach_s: float, rate_hz: float) -> Array:
    """A smooth curve [T] under `values` [T]: the least within `reach_s`, then smoothed."""
    half = max(1, round(reach_s * rate_hz))
    padded = np.pad(values, half, mode="edge")
    least = np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1).min(-1)
    return smooth(least, 0.7 * reach_s, rate_hz)


def pendulum(pressure_m: Array, height_m: float, rate_hz: float) -> Array:
    """The centre of mass [T, 2] whose centre of pressure follows `pressure_m` [T, 2].

    The linear inverted pendulum x - (h/g) x'' = p (Kajita et al. 2003) has one bounded solution:
    p convolved with exp(-|t| / c) / 2c, c = sqrt(h/g). It leans ahead of a step without further
    terms.
    """
    constant_s = np.sqrt(height_m / GRAVITY_M_S2)
    half = round(8 * constant_s * rate_hz)
    kernel = np.exp(-np.abs(np.arange(-half, half + 1)) / (constant_s * rate_hz))
    return convolve(pressure_m, kernel / kernel.sum())


def wander(generator: np.random.Generator, frames: int, sigma_s: float, rate_hz: float) -> Array:
    """Slow random drift [T] of unit standard deviation."""
    half = round(4 * sigma_s * rate_hz)
    kernel = np.exp(-0.5 * (np.arange(-half, half + 1) / (sigma_s * rate_hz)) ** 2)
    noise = generator.standard_normal(frames + 2 * half)
    weights = kernel / np.sqrt(np.sum(kernel**2))
    return np.asarray(np.convolve(noise, weights, mode="valid"), np.float64)
