"""The documents of the project as pages of the site, in the folder docs/."""
