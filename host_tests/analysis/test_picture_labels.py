"""The labels of the pictures do not stand on one another, however little the bike leaned."""

import itertools
import types
from typing import Any

import numpy as np
import pytest
from kickstand_tools.analysis.plot import picture


@pytest.mark.parametrize("most", [(1.0, 1.0), (0.0, 6.0), (6.0, 4.0), (12.0, 11.0), (25.0, 46.0), (60.0, 60.0)])
def test_labels_of_the_share_of_each_lean(most, monkeypatch):
    backend = pytest.importorskip("matplotlib.backends.backend_agg")
    from matplotlib.figure import Figure

    middle = np.arange(-70.0, 71.0)
    share = np.where(np.abs(middle) <= 5.0, 8.0, 0.1)
    peaks = [(types.SimpleNamespace(value=value), sign) for value, sign in zip(most, (-1, 1), strict=True)]
    monkeypatch.setattr(picture, "histogram", lambda seen: (middle, share))
    monkeypatch.setattr(picture, "maxima", lambda seen: peaks)
    monkeypatch.setattr(picture, "lean_limit", lambda seen: max(20.0, 1.2 * max(most)))
    figure = Figure(figsize=(11, 3), layout="constrained")
    canvas = backend.FigureCanvasAgg(figure)
    axes = figure.add_subplot(1, 3, 2)
    seen: Any = None  # what would be asked of it is given above
    picture._histogram(axes, seen)
    canvas.draw()
    boxes = [text.get_window_extent() for text in axes.texts]
    assert len(boxes) == 3
    assert not any(a.overlaps(b) for a, b in itertools.combinations(boxes, 2))
    assert max(box.x1 for box in boxes) < axes.get_window_extent().x1 + 15
