"""Draws the pictures of the READMEs from the real firmware, settings and commands."""
