"""Comparisons of two sets of motion windows: Fréchet distance, classifier, coverage.

All take features [W, F] of `windows.windows`, scaled by the standard deviations of the reference,
so that all bodies count alike.
"""

from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

#: Principal components of the reference that the Fréchet distance and the coverage are taken in.
COMPONENTS = 24
#: Neighbours whose distance is a reference window's radius of coverage.
NEIGHBOURS = 5
#: Rows that enter coverage, and the classifier's training.
_ROWS = 4000
#: Hidden units, training steps, batch of each class, learning rate and weight decay of the
#: classifier.
_HIDDEN, _STEPS, _BATCH, _RATE, _DECAY = 48, 200, 128, 3e-3, 1e-2


@dataclass(frozen=True)
class Basis:
    """Scaled principal components of reference windows."""

    mean: Tensor
    """[F]."""
    scale: Tensor
    """[F]: standard deviations."""
    components: Tensor
    """[F, K]: orthonormal columns, in scaled features."""

    def scaled(self, rows: Tensor) -> Tensor:
        """Return the rows [W, F] less the mean, in standard deviations."""
        return (rows.double() - self.mean) / self.scale

    def project(self, rows: Tensor) -> Tensor:
        """Return the coordinates [W, K] of rows [W, F]."""
        return self.scaled(rows) @ self.components


def basis(reference: Tensor, least: Tensor, components: int = COMPONENTS) -> Basis:
    """Return the basis of reference windows [W, F]; ValueError for fewer than 2 windows.

    least: smallest scale of each feature [F].
    """
    if len(reference) < 2:
        raise ValueError("at least 2 windows of reference motion are needed")
    rows = reference.double()
    mean = rows.mean(0)
    scale = torch.maximum(rows.std(0), least.double())
    _, _, right = torch.linalg.svd((rows - mean) / scale, full_matrices=False)
    return Basis(mean, scale, right[:components].T.contiguous())


def frechet(first: Tensor, second: Tensor) -> float:
    """Return the Fréchet distance of Gaussians fitted to rows [n, K] and [m, K]: the root of
    |Δμ|² + tr(A + B − 2 (A B)^½), of which the FID of Heusel et al. (2017) is the square."""
    mean = (first.mean(0) - second.mean(0)).square().sum()
    a, b = torch.cov(first.T), torch.cov(second.T)
    values, vectors = torch.linalg.eigh(a)
    root = (vectors * values.clamp_min(0.0).sqrt()) @ vectors.T
    # (A B)^½ has the trace of (A^½ B A^½)^½, which is symmetric
    between = torch.linalg.eigvalsh(root @ b @ root).clamp_min(0.0).sqrt().sum()
    return float((mean + a.trace() + b.trace() - 2.0 * between).clamp_min(0.0).sqrt())


def coverage(rows: Tensor, reference: Tensor) -> float:
    """Return the share of reference rows [m, K] that have a row [n, K] within the distance of
    their NEIGHBOURS-th nearest reference row (Naeem et al. 2020)."""
    rows, reference = spread(rows, _ROWS), spread(reference, _ROWS)
    if not len(rows) or len(reference) <= NEIGHBOURS:
        return float("nan")
    radius = torch.cdist(reference, reference).kthvalue(NEIGHBOURS + 1, dim=1).values
    return float((torch.cdist(reference, rows).min(dim=1).values <= radius).double().mean())


def separability(train: tuple[Tensor, Tensor], test: tuple[Tensor, Tensor], seed: int = 0) -> float:
    """Return the area under the ROC curve of a classifier that separates two sets of rows.

    train, test: rows of the first and of the second set, [n, F] and [m, F], scaled. 0.5: the sets
    cannot be told apart; 1: always. The classifier is a network of one hidden layer, trained with
    balanced batches. Training rows and test rows must come from different motions, or it scores
    what it remembers.
    """
    generator = torch.Generator().manual_seed(seed)
    train = (spread(train[0], _ROWS).float(), spread(train[1], _ROWS).float())
    if min(len(rows) for rows in (*train, *test)) == 0:
        return float("nan")
    network = _network(train[0].shape[1], generator)
    optimiser = torch.optim.AdamW(network.parameters(), _RATE, weight_decay=_DECAY)
    sign = torch.cat((torch.ones(_BATCH), torch.zeros(_BATCH)))
    for _ in range(_STEPS):
        batch = [rows[torch.randint(len(rows), (_BATCH,), generator=generator)] for rows in train]
        loss = functional.binary_cross_entropy_with_logits(
            network(torch.cat(batch)).squeeze(1), sign
        )
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
    with torch.no_grad():
        scores = [network(rows.float()).squeeze(1) for rows in test]
    return area(scores[0], scores[1])


def _network(inputs: int, generator: torch.Generator) -> nn.Sequential:
    network = nn.Sequential(nn.Linear(inputs, _HIDDEN), nn.ReLU(), nn.Linear(_HIDDEN, 1))
    with torch.no_grad():
        for parameter in network.parameters():
            bound = parameter.shape[-1] ** -0.5
            parameter.uniform_(-bound, bound, generator=generator)
    return network


def area(positive: Tensor, negative: Tensor) -> float:
    """Return the probability that a score of `positive` [n] exceeds one of `negative` [m]; ties
    count half (Mann-Whitney)."""
    order = negative.sort().values
    below = torch.searchsorted(order, positive)
    through = torch.searchsorted(order, positive, right=True)
    return float((0.5 * (below + through)).double().mean() / len(negative))


def spread(rows: Tensor, count: int) -> Tensor:
    """Return at most `count` of the rows, evenly spaced."""
    if len(rows) <= count:
        return rows
    return rows[torch.linspace(0, len(rows) - 1, count).long()]
