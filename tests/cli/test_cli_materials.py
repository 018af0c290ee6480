import pytest

from asperity.cli import materials

VALUES = {
    "0.4": 0.4, ".4": 0.4, "-.4": -0.4, "+4.": 4.0, "1.e-3": 0.001, "4": 4, "false": False, '"4"': "4",
    "Au": "Au", "4x": "4x", ".": ".", "1_0": "1_0", "[1, 0, .5]": "[1, 0, .5]",
    "[1, 0, 0.5]": {"type": "rgb", "value": [1, 0, 0.5]}, '{"type": "diffuse"}': {"type": "diffuse"},
}  # fmt: skip


@pytest.mark.parametrize("text", VALUES)
def test_what_is_typed_after_set(text):
    found = materials.value(text)
    assert found == VALUES[text] and type(found) is type(VALUES[text])
