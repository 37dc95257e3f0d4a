"""What is broken in a recording, and what becomes of it: a cut end, rounded times, readings that froze."""
