"""Geometric conservation: the flux through each facet of a moving surface is the volume that it sweeps per time.

A facet sweeps m . A in a step, with the mean m of the displacements of its vertices and the mean A over the way of its
area vector. It gets the additional velocity c = a (Q - a . mean(g)) / |a|^2 with the new area vector a and

    Q = sum_k beta_k m_k . A_k

by the difference formula of the flow (docs/theory_coupling.md, Swept volumes).
Source: Lesoinne, Farhat, Comput. Methods Appl. Mech. Engrg. 134 (1996) 71-90 (geometric conservation laws).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from solvers.api import Array, State
from solvers.fluid.settings.time_scheme import Difference
from solvers.mesh.tessellation import area_vectors


class Sweep:
    """Positions of all vertices at earlier times, and what follows from them for the present step."""

    def __init__(self, times: int, those: NDArray[np.bool_] | None = None):
        """times: count of earlier positions in the difference formula; those: mask of the facets; None: all."""
        self._times, self._those = times, those
        self.past: tuple[Array, ...] = ()  #: positions [m] at earlier times, newest first; empty: nothing is swept

    def begin_step(self, x: Array) -> None:
        """Keep the positions x [m] at the start of a step."""
        self.past = (x, *self.past)[: self._times]

    def forget(self) -> None:
        """Nothing has been swept."""
        self.past = ()

    def velocity(self, facets: NDArray[np.int64], x: Array, v: Array, difference: Difference) -> Array | None:
        """The additional velocity c [m/s] of facets, (facets, dim), at x [m] with v [m/s]; None: it is zero.

        Facets that rest may have a velocity of their own.
        """
        pairs = self._pairs(x, difference)
        if pairs is None:
            return None
        a = area_vectors(x[facets])
        flux = -_dot(a, v[facets].mean(axis=1))
        for beta, past in pairs:
            flux += beta * swept(past[facets], x[facets])
        moves = np.any([(past != x).any(axis=1)[facets].any(axis=1) for _, past in pairs], axis=0)
        if self._those is not None:
            moves &= self._those
        return a * np.where(moves, flux * _inverse_square(a), 0.0)[:, None]

    def by_motion(self, facets: NDArray[np.int64], x: Array, v: Array, difference: Difference) -> Array | None:
        """Derivative of `velocity` by x where v changes by alpha dx, (facets, component of c, vertex, direction)."""
        pairs = self._pairs(x, difference)
        if pairs is None:
            return None
        dim, corners, g = x.shape[1], x[facets], v[facets].mean(axis=1)
        a, da, square = area_vectors(corners), _area_slope(_edges(corners)), _inverse_square(area_vectors(corners))
        flux, of_flux = -_dot(a, g), -np.einsum("fl,flcj->fcj", g, da)
        of_flux -= difference.alpha / dim * a[:, None]
        for beta, past in pairs:
            way, mean = (corners - past[facets]).mean(axis=1), _mean_area(past[facets], corners)
            flux += beta * _dot(way, mean)
            of_flux += beta * (mean[:, None] / dim + np.einsum("fl,flcj->fcj", way, _mean_slope(past[facets], corners)))
        along = da - 2.0 * square[:, None, None, None] * a[:, :, None, None] * np.einsum("fl,flcj->fcj", a, da)[:, None]
        found: Array = a[:, :, None, None] * of_flux[:, None] + flux[:, None, None, None] * along
        return square[:, None, None, None] * found

    def _pairs(self, x: Array, difference: Difference) -> list[tuple[float, Array]] | None:
        """(beta_k, x_k) of the formula; None if nothing is swept."""
        pairs = list(zip(difference.beta, self.past, strict=False))
        return pairs if any((x != past).any() for _, past in pairs) else None

    def save(self) -> State:
        return {"count": len(self.past), "past": np.array(self.past)}

    def restore(self, state: State) -> None:
        self.past = tuple(np.asarray(state["past"]).copy()) if state["count"] else ()


def swept(before: Array, now: Array) -> Array:
    """Volume [m^3] that facets sweep along the normal of `area_vectors`, between corners [m], (facets, dim, dim)."""
    return _dot((now - before).mean(axis=1), _mean_area(before, now))


def _mean_area(before: Array, now: Array) -> Array:
    """Mean of the area vectors of facets whose vertices move straight, (facets, dim)."""
    if now.shape[2] == 2:
        return 0.5 * (area_vectors(before) + area_vectors(now))
    middle: Array = area_vectors(0.5 * (before + now))
    return (area_vectors(before) + 4.0 * middle + area_vectors(now)) / 6.0


def _mean_slope(before: Array, now: Array) -> Array:
    """Derivative of `_mean_area` by the corners at the end, (facets, component, vertex, direction)."""
    if now.shape[2] == 2:
        return 0.5 * _area_slope(_edges(now))
    return _area_slope(_edges(before) / 6.0 + _edges(now) / 3.0)


def _edges(corners: Array) -> Array:
    return corners[:, 1:] - corners[:, :1]


def _area_slope(edges: Array) -> Array:
    """Derivative of `area_vectors` by corners of facets with these edges, (facets, component, vertex, direction)."""
    if edges.shape[2] == 2:
        turn = np.broadcast_to([[0.0, 1.0], [-1.0, 0.0]], (len(edges), 2, 2))
        return np.stack([-turn, turn], axis=2)
    axes = np.eye(3)
    first = 0.5 * np.swapaxes(np.cross(axes, edges[:, None, 1]), 1, 2)
    second = 0.5 * np.swapaxes(np.cross(edges[:, None, 0], axes), 1, 2)
    return np.stack([-first - second, first, second], axis=2)


def _inverse_square(a: Array) -> Array:
    """1 / |a|^2, zero for facets without extent."""
    square = _dot(a, a)
    return np.divide(1.0, square, out=np.zeros_like(square), where=square > 0.0)


def _dot(a: Array, b: Array) -> Array:
    found: Array = np.einsum("fk,fk->f", a, b)
    return found
