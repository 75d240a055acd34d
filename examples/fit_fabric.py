"""Fits a fabric's stretch stiffness to a hanging strip's height by gradients: fit_fabric.py."""

import numpy as np
import torch

from drake_dress import cloth

TRUE, GUESS = 60.0, 150.0  # N/m
STRETCH, SOLVER = cloth.MATERIAL.index("stretch_stiffness"), cloth.ExplicitSettings(iterations=5)


def make_strip() -> tuple[cloth.ExplicitBiasCloth, torch.Tensor]:
    """Returns a strip of 8 by 40 cm, held at its top, and its nodes (n,3), m."""
    u, z = np.meshgrid(np.arange(5) * 0.02, np.arange(21) * -0.02)
    rest = np.stack([u.ravel(), np.zeros(u.size), z.ravel()], axis=1)
    k = np.arange(u.size).reshape(u.shape)[:-1, :-1].reshape(-1, 1)
    e = cloth.make_elements(rest, np.concatenate([k + [0, 5, 1], k + [1, 5, 6]]))
    strip = cloth.ExplicitBiasCloth(e, cloth.Material(), 0.05, np.arange(5), settings=SOLVER)
    return strip, torch.from_numpy(rest)


def hang(strip: cloth.ExplicitBiasCloth, x: torch.Tensor, fabric: torch.Tensor) -> torch.Tensor:
    """Returns the height of a corner after 1.5 s, m."""
    v, still = torch.zeros_like(x), torch.zeros((len(strip.held), 3), dtype=torch.float64)
    for _ in range(30):
        x, v, _ = cloth.cloth_step(strip, x, v, still, cloth.Obstacles.none(), material=fabric)
    return x[-1, 2]


strip, rest = make_strip()
fabric = cloth.material_tensor(strip.material)
fabric[STRETCH] = TRUE
measured = hang(strip, rest, fabric).item()
stiffness = GUESS
for _ in range(6):  # Newton's method in the compliance, in which the height is almost linear
    fabric = fabric.detach().index_fill(0, torch.tensor(STRETCH), stiffness).requires_grad_()
    height = hang(strip, rest, fabric)
    (slope,) = torch.autograd.grad(height, fabric)
    stiffness /= 1.0 - (measured - height.item()) / (slope[STRETCH].item() * stiffness)
    print(f"stretch stiffness {stiffness:.3f} N/m")
