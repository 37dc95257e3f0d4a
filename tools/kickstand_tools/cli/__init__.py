"""The command `kickstand`. Each subcommand parses its arguments, calls a function of these tools, and prints."""
