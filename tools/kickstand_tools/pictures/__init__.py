"""Draws display and wiring as SVG, from the settings and the character ROM, for the web page and the READMEs."""
