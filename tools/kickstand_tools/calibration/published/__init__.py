"""The alignment by driving as the article published it, for comparison with the firmware's own."""
