"""A fleet that is made up, with its manifest and its truth, to try `kickstand fleet` on."""
