"""A smooth force of unknown shape, seen through the residuals: evidence and posterior."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.special

from unmodeled.core.arrays import Array
from unmodeled.pipeline.comparison.force_inputs import ForceInputs
from unmodeled.pipeline.comparison.force_nodes import force_grids, nodal_responses
from unmodeled.pipeline.comparison.known_basis import known_basis
from unmodeled.pipeline.comparison.marginal import Compressed, Ridge, compress, ridge
from unmodeled.pipeline.linearisation import Linearisation
from unmodeled.pipeline.transition import Indices

__all__ = ["ForceData", "Smooth", "gradient_root", "smooth_root", "wave_root"]

#: Nodes: wished for in a revolution, in an arc at least, at most, of all arcs together.
_EACH, _ENOUGH, _MOST, _ALL = 24, 160, 160, 200
#: Directions that the data see less than the best by this factor show nothing while the best one
#: shows less than 3000 sigmas.
_SEEN = 3e-4
#: Eigenvalues of a kernel below this share of the largest carry nothing.
_RANK = 1e-8


@dataclass(frozen=True)
class Smooth:
    """A force under a Gaussian-process prior and its posterior.

    Parameters
    ----------
    root : ndarray (3 h, q)
        Root of the prior covariance of the values at the nodes, node after node.
    found : Ridge
        Size, noise and posterior of the q coefficients.
    """

    root: Array
    found: Ridge

    def mean(self) -> Array:
        """Posterior mean at the nodes (h, 3), m/s2, in the set's own axes."""
        mean: Array = (self.root @ self.found.mean()).reshape(-1, 3)
        return mean

    def sigma(self) -> Array:
        """Posterior standard deviation at the nodes (h, 3), m/s2."""
        spread = np.sqrt(self.found.variance) * self.found.size
        seen = self.root @ self.found.right.T * np.sqrt(1.0 - self.found.shrinkage())
        variance = np.sum(self.root**2, axis=1) - np.sum(seen**2, axis=1)
        sigma: Array = spread * np.sqrt(np.maximum(variance, 0.0)).reshape(-1, 3)
        return sigma


class ForceData:
    """Residuals and how they answer to a force at nodes along all arcs.

    Parameters
    ----------
    lin : Linearisation
        At the fit; what states and free parameters absorb is projected out.
    period : float
        Of a revolution, s.

    Attributes
    ----------
    residual : ndarray (n,)
        Projected.
    columns : ndarray (n, h, 3)
        Projected; inertial components.
    known : ndarray (n, k)
        Of `known_basis`.
    states, times : ndarray (h, 6), (h,)
        At the nodes.
    """

    def __init__(self, lin: Linearisation, period: float) -> None:
        self.lin = lin
        self.grids: list[Indices] = force_grids(
            lin, period, each=_EACH, enough=_ENOUGH, most=_MOST, total=_ALL
        )
        raw = nodal_responses(lin, self.grids)
        n, h, _ = raw.shape
        flat = lin.project(raw.reshape(n, -1))
        self.residual = lin.project(lin.residuals)
        self.columns = flat.reshape(n, h, 3)
        self.known = known_basis(lin)
        pairs = list(zip(lin.arcs, self.grids, strict=True))
        self.states = np.concatenate([a.partials.node_states[g] for a, g in pairs])
        self.times = np.concatenate([a.partials.nodes[g] for a, g in pairs])
        whole = compress(flat, self.residual)
        left, size, right = scipy.linalg.svd(whole.triangle, full_matrices=False)
        kept = size > _SEEN * size[0]
        self._triangle = (size[kept, None] * right[kept]).reshape(-1, h, 3)
        self._seen, self._square = left[:, kept].T @ whole.seen, whole.square

    def inputs(self, inputs: ForceInputs) -> Array:
        """Return a set's inputs at the nodes, (h, 3)."""
        return inputs.values(self.lin.model, self.lin.case.body, self.states, self.times)

    def turn(self, inputs: ForceInputs) -> Array:
        """Return a set's own_from_inertial at the nodes, (h, 3, 3)."""
        return inputs.turn(self.lin.model, self.lin.case.body, self.states, self.times)

    def turned(self, turn: Array) -> Array:
        """Return what the data see of components in own axes, (r, 3 h); turn: own_from_inertial."""
        own = np.einsum("rhi,hji->rhj", self._triangle, turn)
        flat: Array = own.reshape(len(own), -1)
        return flat

    def weigh(self, own: Array, root: Array) -> Smooth:
        """Return evidence and posterior of a prior over values at the nodes.

        Parameters
        ----------
        own : ndarray (r, 3 h)
            Of `turned`.
        root : ndarray (h, q) or (3 h, q)
            Of one component, the same for all three; or of all.
        """
        whole = root
        if 3 * len(root) == own.shape[1]:
            whole = np.asarray(np.kron(root, np.eye(3)), dtype=np.float64)
        data = Compressed(own @ whole, self._seen, self._square)
        return Smooth(whole, ridge(data, self.lin.freedom))

    def rows(self, turn: Array, values: Array) -> Array:
        """Return whitened, projected columns (n, p) of values (3 h, p) in a set's axes."""
        h = len(turn)
        inertial = np.einsum("hji,hjp->hip", turn, values.reshape(h, 3, -1))
        made: Array = self.columns.reshape(len(self.columns), -1) @ inertial.reshape(3 * h, -1)
        return made


def smooth_root(inputs: Array, length: float) -> Array:
    """Return a root (h, q) of the kernel exp(-d^2 / 2 l^2), [Rasmussen2006] Eq. 4.9."""
    size, axes = scipy.linalg.eigh(np.exp(-0.5 * _squares(inputs) / length**2))
    kept = size > _RANK * size[-1]
    root: Array = axes[:, kept] * np.sqrt(size[kept])
    return root


def gradient_root(inputs: Array, length: float) -> Array:
    r"""Return a root (3 h, q) for fields without curl: gradients of such a process.

    .. math:: K_{ij} = \left(\delta_{ij} - \frac{d_i d_j}{l^2}\right) e^{-d^2 / 2 l^2}

    ([Alvarez2012], curl-free kernels); of unit variance on each axis.
    """
    h = len(inputs)
    apart = inputs[:, None, :] - inputs[None, :, :]
    kernel = np.exp(-0.5 * np.sum(apart**2, axis=2) / length**2)
    blocks = np.eye(3) - apart[:, :, :, None] * apart[:, :, None, :] / length**2
    full = np.swapaxes(blocks * kernel[:, :, None, None], 1, 2).reshape(3 * h, 3 * h)
    size, axes = scipy.linalg.eigh(full)
    kept = size > _RANK * size[-1]
    root: Array = axes[:, kept] * np.sqrt(size[kept])
    return root


def wave_root(angle: Array, length: float, harmonics: int) -> Array:
    """Return the root (h, 2 k + 1) of the same kernel on the unit circle, in cosines and sines.

    On the circle d^2 = 2 - 2 cos(angle), and exp(cos(x) / l^2) is a series of Bessel functions,
    [AbramowitzStegun1964] 9.6.34: a period can be searched without a decomposition for each.
    """
    k = np.arange(1, harmonics + 1)
    weights = scipy.special.ive(np.arange(harmonics + 1), 1.0 / length**2)
    waves = angle[:, None] * k
    part = np.sqrt(2.0 * weights[1:])
    return np.concatenate(
        [np.full((len(angle), 1), np.sqrt(weights[0])), np.cos(waves) * part, np.sin(waves) * part],
        axis=1,
    )


def _squares(inputs: Array) -> Array:
    apart = inputs[:, None, :] - inputs[None, :, :]
    squares: Array = np.sum(apart**2, axis=2)
    return squares
