"""``python -m asperity`` is the ``asperity`` command."""

from asperity.cli import app

app(prog_name="asperity")
