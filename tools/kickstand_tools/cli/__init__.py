"""The command `kickstand`: each command parses its arguments, calls a function of these tools, and prints the
result."""
