"""The firmware onto a board by mpremote, and questions to a board."""
