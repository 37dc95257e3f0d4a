"""Shows the results of a fleet: index.html, and a picture of each vehicle."""
