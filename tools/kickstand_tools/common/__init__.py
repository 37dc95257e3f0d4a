"""What all parts of the tools use: errors, files written whole, progress, templates, SVG, places of files."""
