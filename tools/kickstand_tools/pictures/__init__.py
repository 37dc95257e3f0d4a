"""Draws the display and the wiring as SVG for the web page and the READMEs, from settings and character ROM."""
