"""Fits bending and stretch stiffness to the drape of a sheet, measured with 1 mm of noise."""

import numpy as np
import torch

from drake_dress import cloth

SIDE, SPACING, NOISE = 13, 0.025, 1e-3  # nodes a side, m, m
NAMES = ("bending_stiffness", "stretch_stiffness")
TRUE, GUESS = (2.0e-3, 80.0), (5e-4, 200.0)  # N·m, N/m


def make_sheet() -> tuple[cloth.ExplicitBiasCloth, torch.Tensor]:
    """Returns a sheet of 30 cm that lies on a rod across its middle, and its nodes (n,3), m."""
    u, v = np.meshgrid(np.arange(SIDE) * SPACING, np.arange(SIDE) * SPACING)
    rest = np.stack([u.ravel(), v.ravel(), np.zeros(u.size)], axis=1)
    corner = np.arange(u.size).reshape(u.shape)[:-1, :-1].reshape(-1, 1)
    faces = np.concatenate([corner + [0, 1, SIDE + 1], corner + [0, SIDE + 1, SIDE]])
    on_rod = np.flatnonzero(np.abs(rest[:, 0] - 0.15) < 0.06)
    elements = cloth.make_elements(rest, faces)
    sheet = cloth.ExplicitBiasCloth(
        elements, cloth.Material(), 0.05, on_rod, settings=cloth.ExplicitSettings(iterations=20)
    )
    return sheet, torch.from_numpy(rest)


def drape(sheet: cloth.ExplicitBiasCloth, x: torch.Tensor, log: torch.Tensor) -> torch.Tensor:
    """Returns the nodes (n,3) after 3 s, m; `log` are the logarithms of both stiffnesses."""
    values = dict(zip(NAMES, torch.exp(log), strict=True))
    plain = cloth.material_tensor(sheet.material)
    fabric = torch.stack([values.get(n, plain[i]) for i, n in enumerate(cloth.MATERIAL)])
    v, still = torch.zeros_like(x), torch.zeros((len(sheet.held), 3), dtype=torch.float64)
    for _ in range(60):
        x, v, _ = cloth.cloth_step(sheet, x, v, still, cloth.Obstacles.none(), material=fabric)
    return x


sheet, rest = make_sheet()
rng = np.random.default_rng(1)
with torch.no_grad():
    measured = drape(sheet, rest, torch.log(torch.tensor(TRUE, dtype=torch.float64)))
    measured += NOISE * torch.from_numpy(rng.standard_normal(rest.shape))
log = torch.log(torch.tensor(GUESS, dtype=torch.float64)).requires_grad_()
optimizer = torch.optim.LBFGS([log], max_iter=1, line_search_fn="strong_wolfe")


def loss() -> torch.Tensor:
    """Returns the mean square error in units of the noise, and its gradient in `log.grad`."""
    optimizer.zero_grad()
    error = ((drape(sheet, rest, log) - measured) / NOISE).square().mean()
    error.backward()
    return error


for k in range(7):
    error = optimizer.step(loss)
    bending, stretch = torch.exp(log).tolist()
    print(f"{k}: error {error:.3f}, bending {bending:.2e} N·m, stretch {stretch:.1f} N/m")
