"""Starts Kickstand when the board gets power. Without a whole firmware this ends at the prompt."""

from kickstand.start import main

if __name__ == "__main__":
    main()
