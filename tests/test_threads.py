"""One core, where Mitsuba waits for ever for a worker that reads or writes an EXR file; and threads of one's own."""

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


def test_threads_that_take_turns():
    """Under one lock; without, Dr.Jit crashes, whoever wrote the BSDF: 2 runs of 6 with Mitsuba's `principled`."""
    code = """
import asperity, mitsuba as mi, threading
mi.set_variant("llvm_ad_rgb")
SCENE = {"type": "scene", "integrator": {"type": "path"}, "light": {"type": "constant"},
         "sensor": {"type": "perspective", "film": {"type": "hdrfilm", "width": 8, "height": 8}},
         "ball": {"type": "sphere", "center": [0, 0, 4], "bsdf": {"type": "micrograin", "specular": False}}}
lock, means = threading.Lock(), []
def render():
    for _ in range(2):
        with lock:
            means.append(sum(mi.render(mi.load_dict(SCENE, parallel=False), spp=4).array))
threads = [threading.Thread(target=render) for _ in range(4)]
[thread.start() for thread in threads]
[thread.join() for thread in threads]
assert len(means) == 8 and max(means) - min(means) < 1e-3 * means[0], means
"""
    child = subprocess.run([sys.executable, "-c", code], timeout=120, capture_output=True)
    assert child.returncode == 0, child.stderr
