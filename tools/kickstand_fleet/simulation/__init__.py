"""A simulated fleet with its manifest and its truth, to try `kickstand fleet` on."""
