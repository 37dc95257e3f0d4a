"""How plotly lays the charts of a ride out: beside each other below the lines over time, or all below each other."""

from typing import Any

_INK = "rgb(36,36,36)"
_GAP, _NARROW_GAP = 62, 96  # between rows, in a narrow window with the names of axes: pixels, as what follows
_MARGIN = {"l": 80, "r": 80, "t": 100, "b": 80}
_NARROW_MARGIN = {"l": 52, "r": 12, "t": 160, "b": 60}
_ACROSS = 3  # charts in the last row
_ASIDE = 0.2 / 3  # between these, of the width
AXIS = {
    "automargin": True,
    "linecolor": _INK,
    "showgrid": False,
    "showline": True,
    "ticks": "outside",
    "title": {"standoff": 15},
    "zeroline": False,
}
PAPER = {
    "autotypenumbers": "strict",
    "bargap": 0,
    "font": {"color": _INK},
    "paper_bgcolor": "white",
    "plot_bgcolor": "white",
    "showlegend": False,
}


def arranged(rows: list[int], titles: list[str], title: str, narrow: bool) -> dict[str, Any]:
    """What plotly's layout says of places: height, title, the title of each chart, and where its axes are.

    rows: heights of the rows in pixels, one chart in each but the last. titles: of all charts. title: of the whole, its
    parts parted by two blanks. narrow: for a phone, one chart in each row.
    """
    heights = rows[:-1] + rows[-1:] * (_ACROSS if narrow else 1)
    gap = _NARROW_GAP if narrow else _GAP
    inner = sum(heights) + gap * (len(heights) - 1)
    margin = _NARROW_MARGIN if narrow else _MARGIN
    made: dict[str, Any] = {"height": inner + margin["t"] + margin["b"], "margin": margin}
    made["title"] = {"text": title.replace("  ·  ", "<br>") if narrow else title, "x": 0.05}
    made["title"] |= {"font": {"size": 14}} if narrow else {}
    made["annotations"] = []
    wide = (1.0 - _ASIDE * (_ACROSS - 1)) / _ACROSS
    for k, text in enumerate(titles):
        column = k - len(rows) + 1
        row = k if narrow else min(k, len(rows) - 1)
        whole = narrow or column < 0
        left, right = (0.0, 1.0) if whole else (column * (wide + _ASIDE), column * (wide + _ASIDE) + wide)
        top = inner - sum(heights[:row]) - gap * row
        name = str(k + 1) if k else ""
        made[f"xaxis{name}"] = {"domain": [left, right], "anchor": f"y{name}"}
        made[f"yaxis{name}"] = {"domain": [(top - heights[row]) / inner, top / inner], "anchor": f"x{name}"}
        place = {"x": (left + right) / 2.0, "y": top / inner, "xref": "paper", "yref": "paper", "xanchor": "center"}
        said = {"text": text.replace("; ", ";<br>") if narrow else text, "font": {"size": 12}}
        made["annotations"].append(place | said | {"yanchor": "bottom", "showarrow": False})
    return made
