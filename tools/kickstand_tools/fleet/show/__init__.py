"""The results of a fleet to look at: index.html, and a picture of each vehicle."""
