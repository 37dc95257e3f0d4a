"""The pages in a browser: a user who clicks, ports and radios that lead to boards in the test's process."""
