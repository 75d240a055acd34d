"""Which devices there are, and that Warp stays out of the way."""

import importlib
import subprocess
import sys
from pathlib import Path

import pytest
import warp as wp

from drake_dress.errors import UserError
from drake_dress.models.cloth.batch.cloth import BatchCloth
from drake_dress.models.cloth.batch.device import cuda_is_available, find_device
from drake_dress.models.cloth.material import Material
from tests.models.cloth.sheets import NO_NODES, sheet_elements


@pytest.mark.parametrize("name", ["gpu", "CPU", "cuda:", "cuda:x", "", "cpu:0"])
def test_unknown_device_is_told_with_what_is_expected(name: str) -> None:
    _, e = sheet_elements(3, 3, 0.03)
    with pytest.raises(UserError, match=rf"^device: is '{name}', expected cpu, cuda or cuda:N$"):
        BatchCloth(e, Material(), 0.01, NO_NODES, 1, name)


def test_device_that_is_not_there_is_told_with_what_is() -> None:
    _, e = sheet_elements(3, 3, 0.03)
    missing = "cuda:99" if cuda_is_available() else "cuda"
    with pytest.raises(UserError, match=rf"^device: is '{missing}', .* expected one of cpu"):
        BatchCloth(e, Material(), 0.01, NO_NODES, 1, missing)


def test_warp_is_imported_on_use_and_starts_in_silence() -> None:
    program = (
        "import sys\n"
        "import drake_dress, drake_dress.models.cloth.batch\n"
        "assert 'warp' not in sys.modules\n"
        "from drake_dress.models.cloth.batch.device import cuda_is_available, find_device\n"
        "cuda_is_available()\n"
        "sys.stderr.write(str(find_device('cpu')))\n"
    )
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (run.returncode, run.stdout, run.stderr) == (0, "", "cpu")


@pytest.mark.parametrize(
    "name",
    [
        "adjoint_kernels",
        "contact_kernels",
        "element_kernels",
        "friction_kernels",
        "inverse",
        "material_kernels",
        "oblique",
        "projected_cg",
        "reduction",
    ],
)
def test_kernels_compile_for_a_gpu_that_is_not_there(name: str, tmp_path: Path) -> None:
    find_device("cpu")
    module = importlib.import_module(f"drake_dress.models.cloth.batch.{name}")
    wp.compile_aot_module(module, arch=75, module_dir=tmp_path)
    assert list(tmp_path.glob("*.cu"))
    assert list(tmp_path.glob("*.sm75.*"))
