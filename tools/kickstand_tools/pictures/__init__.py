"""Display and wiring as SVG, drawn from the settings and the character ROM: for the web page and the READMEs."""
