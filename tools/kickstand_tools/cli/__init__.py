"""The command `kickstand`: each command parses its words, calls a function of these tools, and prints."""
