"""What all parts of the tools use: messages, files written whole or not at all, progress, and markup."""
