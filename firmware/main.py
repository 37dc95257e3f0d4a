"""Starts Kickstand when the board gets power."""

from kickstand.start import main

main()
