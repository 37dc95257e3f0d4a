"""The pictures of the READMEs, made from the real firmware, settings and commands."""
