"""A ride drawn: a picture by matplotlib, a page to zoom into by plotly."""
