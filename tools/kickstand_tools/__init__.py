"""Kickstand on the host: the command `kickstand` (cli) and its functions for other programs (api)."""
