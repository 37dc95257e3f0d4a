"""The alignment by driving as the article published it, to compare the firmware's own with."""
