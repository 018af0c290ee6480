"""On one core Mitsuba waits for ever for a worker thread, when it reads or writes an EXR file."""

import os
import subprocess
import sys

import pytest

ALONE = "import os; os.sched_setaffinity(0, {min(os.sched_getaffinity(0))}); "
WRITE = "; import numpy as np; mi.Bitmap(np.ones((8, 8, 3), np.float32)).write('out.exr'); mi.Bitmap('out.exr')"
CODES = {
    "scalar": "import asperity, mitsuba as mi; mi.set_variant('scalar_rgb')" + WRITE,
    "asperity comes last": "import mitsuba as mi; mi.set_variant('scalar_rgb'); import asperity" + WRITE,
    "asked for one": "import asperity, mitsuba as mi, drjit as dr; dr.set_thread_count(1); mi.set_variant('scalar_rgb')"
    + WRITE,
    "command": "from asperity.cli import app; app(['render', '--size', '8', '--spp', '1', '-o', 'out'])",
}


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="cannot leave a process one core here")
@pytest.mark.parametrize("code", CODES.values(), ids=CODES)
def test_one_core_suffices(tmp_path, code):
    child = subprocess.run([sys.executable, "-c", ALONE + code], cwd=tmp_path, timeout=60, capture_output=True)
    assert child.returncode == 0, child.stderr
    assert (tmp_path / "out.exr").stat().st_size > 0
