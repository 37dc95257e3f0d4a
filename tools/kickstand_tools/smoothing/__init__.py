"""The lean looked back over: found from the whole ride, after it, with a standard deviation for every sample."""
