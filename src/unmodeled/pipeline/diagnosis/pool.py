"""All candidates side by side: what each would explain, alone and beside others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy.special

from unmodeled.core.arrays import Array
from unmodeled.models.physics import Effect
from unmodeled.pipeline.cases.candidate import Candidate
from unmodeled.pipeline.linearisation import Linearisation

__all__ = ["Member", "Pool", "SetScore"]

#: A candidate of which less than this share of the signal (in variance) is left by the others is
#: the same thing as they are: nothing can be said about it beside them.
_PARALLEL = 1e-8


@dataclass(frozen=True)
class Member:
    """A candidate at one of the places that are searched.

    Parameters
    ----------
    candidate : Candidate
        The effect.
    values : mapping of str to float
        Its parameters, the place included.
    columns : ndarray of int (k,)
        Where its columns are in the pool.
    """

    candidate: Candidate
    values: Mapping[str, float]
    columns: Array = field(repr=False)

    @property
    def size(self) -> int:
        """Number of estimated parameters."""
        return len(self.columns)


@dataclass(frozen=True)
class SetScore:
    """What a set of members explains.

    Parameters
    ----------
    members : tuple of int
        Indices in the pool.
    drop : float
        By how much chi-square falls, in the stated sigmas.
    noise : float
        Standard deviation of what is left, in stated sigmas.
    evidence : float
        Natural logarithm of the posterior odds against nothing missing: Bayes factor with the
        candidates' priors and the noise as estimated, times prior odds of 1 to the number of
        candidates (and of places searched) for each member.
    estimate : ndarray (k,)
        In units of the priors, the members' parameters one after another.
    covariance : ndarray (k, k)
        Of ``estimate``, with the noise as estimated.
    wrong_sign : float
        ln of the chance that parameters that cannot be negative are positive, doubled (the prior is
        half as wide), at most 0; it is part of ``evidence``.
    """

    members: tuple[int, ...]
    drop: float
    noise: float
    evidence: float
    estimate: Array
    covariance: Array
    wrong_sign: float = 0.0

    @property
    def reach(self) -> float:
        """Largest estimate over its expected size."""
        return float(np.max(np.abs(self.estimate), initial=0.0))

    @property
    def worth(self) -> float:
        """Twice the logarithm of the likelihood, each parameter at the price of 2, [Akaike1974]."""
        return self.drop / self.noise**2 - 2.0 * len(self.estimate) + 2.0 * self.wrong_sign


class Pool:
    """Gram matrix of all candidates' projected columns and their products with the residuals.

    Parameters
    ----------
    lin : Linearisation
        Of the model fitted so far.
    candidates : sequence of Candidate
        All of them, those already in the model included.
    accepted : mapping of str to mapping
        Parameters of the candidates that are in the model: their effect is added back to the
        residuals, so that sets with and without them can be compared.

    Attributes
    ----------
    members : list of Member
    gram : ndarray (p, p)
        Of columns in units of the priors.
    """

    def __init__(
        self,
        lin: Linearisation,
        candidates: Sequence[Candidate],
        accepted: Mapping[str, Mapping[str, float]] | None = None,
    ) -> None:
        self.lin, self.accepted = lin, dict(accepted or {})
        self.members: list[Member] = []
        blocks, first = [], 0
        residual = lin.residuals.copy()
        for candidate in candidates:
            for values, columns in _columns(lin, candidate, self.accepted.get(candidate.name)):
                k = columns.shape[1]
                self.members.append(Member(candidate, values, np.arange(first, first + k)))
                first += k
                blocks.append(columns * np.array(candidate.priors))
                if candidate.name in self.accepted:
                    null = np.array([candidate.values[n] for n in candidate.estimate])
                    now = np.array([values[n] for n in candidate.estimate])
                    residual += columns @ (now - null)
        self._clashes = {c.name: _clashing(c, candidates) for c in candidates}
        raw = np.concatenate(blocks, axis=1) if blocks else np.zeros((len(residual), 0))
        self._raw, self._raw_residual = raw, residual
        self.columns = lin.project(raw)
        self.residual = lin.project(residual)
        self.gram = self.columns.T @ self.columns
        self.product = self.columns.T @ self.residual
        self.square = float(self.residual @ self.residual)
        self.freedom = lin.freedom
        # Against the whole column: what the known columns absorb does not count as parallel.
        self._scale = np.sqrt(np.maximum(np.diag(self.gram), 1e-300))
        self._sizes = np.array([m.size for m in self.members], dtype=int)
        self._alike = [
            (who, np.array([self.members[k].columns for k in who]))
            for who in (np.flatnonzero(self._sizes == n) for n in np.unique(self._sizes))
        ]

    def score(self, chosen: Sequence[int]) -> SetScore:
        """Score a set of members together."""
        index = self.index(chosen)
        G, c = self.gram[np.ix_(index, index)], self.product[index]
        inverse = _inverse(G)
        estimate = inverse @ c
        drop = float(c @ estimate)
        left = max(self.square - drop, 1e-12 * self.square)
        variance = left / max(self.freedom - len(index), 1)
        covariance = inverse * variance
        sign = self._wrong_sign(chosen, estimate, covariance)
        return SetScore(
            tuple(chosen),
            drop,
            float(np.sqrt(variance)),
            self._evidence(chosen, G / variance, c / variance, variance, estimate) + sign,
            estimate,
            covariance,
            sign,
        )

    def beside(self, chosen: Sequence[int]) -> tuple[Array, Array]:
        """Return Gram matrix and products with the columns of a set projected out."""
        index = self.index(chosen)
        if not len(index):
            return self.gram, self.product
        inverse = _inverse(self.gram[np.ix_(index, index)])
        cross = self.gram[:, index] @ inverse
        G = self.gram - cross @ self.gram[index]
        return G, self.product - cross @ self.product[index]

    def gains(self, chosen: Sequence[int]) -> tuple[Array, Array]:
        """Return what each member would explain beside a set, and its raw p-value.

        Returns
        -------
        drop : ndarray (m,)
            Fall of chi-square in stated sigmas; 0 for members that are the same as the set.
        log_p : ndarray (m,)
            Natural logarithm of the F-test's p-value with the noise as estimated.
        """
        G, c = self.beside(chosen)
        base = self.score(chosen).drop if len(chosen) else 0.0
        drops, sizes = self.drops(G, c), self._sizes
        taken = len(self.index(chosen))
        return drops, log_p(drops, sizes, self.square - base, self.freedom - taken)

    def names(self, s: SetScore) -> frozenset[str]:
        """Return the names of the candidates of a set."""
        return frozenset(self.members[m].candidate.name for m in s.members)

    def excluded(self, chosen: Sequence[int]) -> frozenset[str]:
        """Return the candidates that cannot join a set: its own, and those with a term of its own.

        A single harmonic cannot stand beside a published field that contains it.
        """
        return frozenset().union(*(self._clashes[self.members[m].candidate.name] for m in chosen))

    def left(self, s: SetScore) -> Array:
        """Return what a set leaves of the projected residuals, (n,)."""
        remaining: Array = self.residual - self.columns[:, self.index(s.members)] @ s.estimate
        return remaining

    def state_steps(self, s: SetScore) -> Array:
        """Return how the initial states (a, 6) move when a set is put in."""
        left = self._raw_residual - self._raw[:, self.index(s.members)] @ s.estimate
        return self.lin.state_steps(left)

    def shares(self, member: int, chosen: Sequence[int]) -> Array:
        """Return, for each member, the cosine between its span and a member's fitted signal.

        Both beside the rest of the set: 1 says that the other explains all of the signal.
        """
        rest = [m for m in chosen if m != member]
        G, c = self.beside(rest)
        own = self.members[member].columns
        theta = _inverse(G[np.ix_(own, own)]) @ c[own]
        size = float(theta @ G[np.ix_(own, own)] @ theta)
        out = np.zeros(len(self.members))
        if size <= 0:
            return out
        out = np.sqrt(np.maximum(self.drops(G, G[:, own] @ theta), 0.0) / size)
        return np.minimum(out, 1.0)

    def drops(self, G: Array, c: Array) -> Array:
        """Return what each member explains alone, (m,), given what `beside` returns."""
        # In units of the whole columns: a direction of which next to nothing is left is not used.
        c = c / self._scale
        drops = np.zeros(len(self.members))
        for who, index in self._alike:
            scale = self._scale[index]
            blocks = G[index[:, :, None], index[:, None, :]] / scale[:, :, None] / scale[:, None, :]
            size, axes = np.linalg.eigh(blocks)
            b = np.einsum("kij,ki->kj", axes, c[index])
            drops[who] = np.sum(
                np.divide(b * b, size, out=np.zeros_like(b), where=size > _PARALLEL), axis=1
            )
        return drops

    def _evidence(
        self, chosen: Sequence[int], G: Array, c: Array, variance: float, estimate: Array
    ) -> float:
        """Log Bayes factor: Gaussian priors; a mixture where a value is known; unknown noise.

        With a known value the prior is half "as accepted, within 5 %", half "any of this size".
        Expected sizes are guesses: a prior is widened to the estimate if that is larger, which
        costs twice the logarithm of the factor (a tail that falls as the third power).
        The noise is integrated over (Jeffreys' prior): sets are compared by the logarithm of what
        they leave, and two that explain the same are equal however strong the signal.
        """
        size = 0.5 * max(self.freedom - len(c), 1)
        options: list[list[tuple[float, float]]] = []
        widened, first = 0.0, 0
        for k in chosen:
            candidate = self.members[k].candidate
            part = estimate[first : first + self.members[k].size]
            first += self.members[k].size
            wide = float(max(1.0, np.sqrt(np.mean(part * part))))
            widened += 2.0 * np.log(wide)
            for name, prior in zip(candidate.estimate, candidate.priors, strict=True):
                broad = (0.0, wide)
                if name in candidate.known:
                    value, sigma = candidate.known[name]
                    centre = (value - candidate.values[name]) / prior
                    spread = float(np.hypot(sigma / prior, 0.05 * abs(centre)))
                    options.append([broad, (centre, spread)])
                else:
                    options.append([broad])
        total = -np.inf
        mixtures = _product(options)
        for prior_set in mixtures:
            mean = np.array([p[0] for p in prior_set])
            width: Array = np.array([p[1] for p in prior_set])
            d = (c - G @ mean) * width
            A = G * width[:, None] * width + np.eye(len(mean))
            factor = np.linalg.cholesky(A)
            half = np.linalg.solve(factor, d)
            gain = float(c @ mean - 0.5 * mean @ G @ mean + 0.5 * half @ half)
            left = max(1.0 - 2.0 * gain * variance / self.square, 1e-300)
            value = -size * np.log(left) - float(np.sum(np.log(np.diag(factor))))
            total = float(np.logaddexp(total, value))
        names = len({m.candidate.name for m in self.members})
        chances = sum(np.log(names * max(len(self.members[k].candidate.places), 1)) for k in chosen)
        return total - float(np.log(len(mixtures))) - float(chances) - widened

    def _wrong_sign(self, chosen: Sequence[int], estimate: Array, covariance: Array) -> float:
        one_sign = [
            name in self.members[k].candidate.positive
            for k in chosen
            for name in self.members[k].candidate.estimate
        ]
        if not any(one_sign):
            return 0.0
        z = estimate / np.sqrt(np.maximum(np.diag(covariance), 1e-300))
        ln_chance = scipy.special.log_ndtr(z[np.array(one_sign)]) + np.log(2.0)
        return float(np.sum(np.minimum(ln_chance, 0.0)))

    def index(self, chosen: Sequence[int]) -> Array:
        """Return the columns of members, one member after another."""
        if not len(chosen):
            return np.zeros(0, dtype=int)
        return np.concatenate([self.members[k].columns for k in chosen])


def log_p(drops: Array, sizes: Array, square: float, freedom: int) -> Array:
    """Return ln of the F-test's p-value for falls of chi-square out of ``square``."""
    drops = np.minimum(np.asarray(drops, dtype=float), square * (1.0 - 1e-12))
    rest = np.maximum(freedom - sizes, 1)
    ratio = (drops / sizes) / ((square - drops) / rest)
    # Beta form: its logarithm stays finite where that of the F distribution underflows.
    with np.errstate(divide="ignore"):
        tail = np.log(scipy.special.betaincc(0.5 * sizes, 0.5 * rest, drops / square))
    far = -0.5 * rest * np.log1p(sizes * ratio / rest)
    value: Array = np.where(np.isfinite(tail), tail, far)
    return value


def _columns(
    lin: Linearisation, candidate: Candidate, accepted: Mapping[str, float] | None
) -> list[tuple[dict[str, float], Array]]:
    """Values and columns of a candidate at each place; at its own place if it is in the model."""
    if accepted is None:
        places = candidate.places or ({},)
        values = [{**candidate.values, **place} for place in places]
        at = values
    else:
        values = [{**candidate.values, **accepted}]
        # An instrument in the model already did its work on the measurements.
        at = values if candidate.is_force else [dict(candidate.values)]
    return [
        (v, lin.columns(candidate.effect, a, candidate.estimate))
        for v, a in zip(values, at, strict=True)
    ]


def _clashing(candidate: Candidate, candidates: Sequence[Candidate]) -> frozenset[str]:
    """Names of the candidates that no force model can have beside one, itself included."""
    own = candidate.effect
    found = {candidate.name}
    for other in candidates:
        theirs = other.effect
        if isinstance(own, Effect) and isinstance(theirs, Effect) and own != theirs:
            found |= {other.name} if own.terms & theirs.terms else set()
    return frozenset(found)


def _inverse(G: Array) -> Array:
    """Inverse of a Gram matrix; directions that are rounding are left out."""
    if not len(G):
        return G
    scale = np.sqrt(np.maximum(np.diag(G), 1e-300))
    size, axes = np.linalg.eigh(G / scale[:, None] / scale)
    kept = size > _PARALLEL
    inverse: Array = (axes[:, kept] / size[kept]) @ axes[:, kept].T / scale[:, None] / scale
    return inverse


def _product(options: list[list[tuple[float, float]]]) -> list[list[tuple[float, float]]]:
    sets: list[list[tuple[float, float]]] = [[]]
    for choices in options:
        sets = [[*s, choice] for s in sets for choice in choices]
    return sets
