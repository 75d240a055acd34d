"""Every test that takes `device` runs on the CPU, and on CUDA where there is some."""

import pytest

from drake_dress.models.cloth.batch.device import cuda_is_available


@pytest.fixture(params=["cpu", "cuda"])
def device(request: pytest.FixtureRequest) -> str:
    if request.param == "cuda" and not cuda_is_available():
        pytest.skip("no CUDA device")
    return str(request.param)
