"""How the terms of the closed form are numbered."""

import asperity  # noqa: F401  isort: skip
import drjit as dr
import drjit.llvm.ad as llvm
import numpy as np
import pytest

from asperity.models.vgroove.symmetric import numbered

KINDS = ((True, 1), (True, -1), (False, 1), (False, -1))


@pytest.mark.parametrize("first_even", [2, 4])
@pytest.mark.parametrize("limits", [(9.5, 3.0, 2.0, 40.0), (1.0, 2.0, 0.5, 1.5), (3.1, 5.0, 4.1, 6.0)], ids=str)
def test_terms_are_numbered_without_gaps(limits, first_even):
    """Every k of its kind below the limit, up to the most, once."""
    most = 12
    count, term = numbered([llvm.Float(limit) for limit in limits], llvm.UInt(most), first_even)
    found = zip(*(np.array(part) for part in term(dr.arange(llvm.UInt, 40))))
    expected = [
        (k, odd, tau)
        for (odd, tau), limit in zip(KINDS, limits)
        for k in range(3 if odd else first_even, most + 1, 2)
        if k < limit
    ]
    assert list(found)[: count[0]] == expected
